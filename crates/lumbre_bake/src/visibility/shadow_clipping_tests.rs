//! Tests of the lit part of a receiver, against segments to the light and against closed forms.

use super::*;
use crate::sampling::{Sequence, Stream};

const FLOOR: [[f64; 3]; 4] = [[-0.5, 0.0, -0.5], [0.5, 0.0, -0.5], [0.6, 0.0, 0.5], [-0.4, 0.0, 0.5]];

fn floor() -> [DVec3; 4] {
    FLOOR.map(DVec3::from)
}

/// The lit fraction, and the mean position of the lit part times that fraction.
fn lit(origin: Origin, shape: &ReceiverShape, blockers: &[[DVec3; 3]]) -> (f64, DVec3) {
    let shadows: Vec<Shadow> = blockers.iter().filter_map(|&corners| origin.shadow(corners)).collect();
    let (mut share, mut moment) = (0.0, DVec3::ZERO);
    origin.lit(shape, &shadows, &mut PolygonClipper::new(), |place, piece_share| {
        share += piece_share;
        moment += place * piece_share;
    });
    (share, moment)
}

fn square(half: f64, height: f64) -> [[DVec3; 3]; 2] {
    let at = |x: f64, z: f64| DVec3::new(x, height, z);
    let [a, b, c, d] = [at(-half, -half), at(half, -half), at(half, half), at(-half, half)];
    [[a, b, c], [a, c, d]]
}

#[test]
fn a_square_sheet_casts_a_square_shadow() {
    // The sheet is half as high as the point light, so its shadow is twice as large; under a directional light the
    // shadow is as large as the sheet. The floor's area is 1.
    for (origin, side) in [
        (Origin::Point(DVec3::Y), 0.6),
        (Origin::Direction(DVec3::Y), 0.3),
        (Origin::Point(DVec3::NEG_Y), 0.0),
    ] {
        let (share, moment) = lit(origin, &ReceiverShape::Parallelogram(floor()), &square(0.15, 0.5));
        assert!((share - (1.0 - side * side)).abs() < 1e-12, "{origin:?} {share}");
        // The floor's centre is 0.05 from the shadow's.
        assert!((moment - DVec3::X * 0.05).length() < 1e-12, "{origin:?} {moment}");
    }
    let all = Origin::Point(DVec3::Y);
    let shadows: Vec<Shadow> =
        square(0.4, 0.5).into_iter().filter_map(|corners| all.shadow(corners)).collect();
    assert!(all.hides_all(floor(), &shadows, &mut PolygonClipper::new()));
    assert!(!all.hides_all(floor(), &shadows[..1], &mut PolygonClipper::new()));
    assert_eq!(lit(all, &ReceiverShape::Parallelogram(floor()), &square(0.4, 0.5)).0, 0.0);
}

/// With random triangles, the lit fraction equals that of a fine grid of segments to the light, both by cutting and by
/// points.
#[test]
fn random_triangles_leave_the_part_lit_that_segments_find_lit() {
    let sequence = Sequence::new(3, Stream::Test(79), 0);
    let mut partly = 0;
    for crowd in 0..40 {
        let corner = |triangle: u32, corner: u32| {
            let [x, y, z, _] = sequence.of(crowd).point(3 * triangle + corner, 1).map(f64::from);
            DVec3::new(1.6 * x - 0.8, 1.6 * y - 0.1, 1.6 * z - 0.8)
        };
        let count = if crowd < 30 { 4 } else { 60 };
        let blockers: Vec<[DVec3; 3]> = (0..count).map(|t| [0, 1, 2].map(|c| corner(t, c))).collect();
        let light = DVec3::new(0.3, 1.4, -0.2);
        let origin = match crowd % 2 {
            0 => Origin::Point(light),
            _ => Origin::Direction(light.normalize()),
        };
        let is_lit = |from: DVec3| {
            let (along, end) = match origin {
                Origin::Point(point) => (point - from, 1.0),
                Origin::Direction(towards) => (towards, f64::INFINITY),
            };
            !blockers.iter().any(|&[a, b, c]| {
                let normal = (b - a).cross(c - a);
                let t = normal.dot(a - from) / normal.dot(along);
                let at = from + along * t;
                let side = |from: DVec3, to: DVec3| (to - from).cross(at - from).dot(normal) > 0.0;
                t > 0.0 && t < end && side(a, b) && side(b, c) && side(c, a)
            })
        };
        const SIDE: usize = 128;
        let [a, b, _, d] = floor();
        let at = |place: usize| (place as f64 + 0.5) / SIDE as f64;
        let points: Vec<DVec3> = (0..SIDE * SIDE)
            .map(|place| a + (b - a) * at(place % SIDE) + (d - a) * at(place / SIDE))
            .collect();
        let expected = points.iter().filter(|point| is_lit(**point)).count() as f64 / points.len() as f64;
        let (whole, _) = lit(origin, &ReceiverShape::Parallelogram(floor()), &blockers);
        // An edge across the grid passes through 128 of its 128² cells, each with a random error of at most a half:
        // standard deviation √128 / 128² / √12, which for four edges and 5 sigma is 2e-3. Sixty triangles exceed the
        // number of pieces, so a grid of 8 by 8 points is used, with an error of 1/64 for each of a few edges.
        let bound = if count == 4 { 2e-3 } else { 0.05 };
        assert!((whole - expected).abs() < bound, "{crowd}: {whole} {expected}");
        let (by_points, _) = lit(origin, &ReceiverShape::Points(points), &blockers);
        assert!((by_points - expected).abs() < 1e-9, "{crowd}: {by_points} {expected}");
        partly += u32::from(expected > 0.02 && expected < 0.98);
    }
    assert!(partly > 20, "{partly}");
}

#[test]
fn scaling_by_a_power_of_two_changes_no_bit() {
    let blockers = square(0.2, 0.4);
    let origin = DVec3::new(0.3, 1.0, 0.1);
    let (one, _) = lit(Origin::Point(origin), &ReceiverShape::Parallelogram(floor()), &blockers);
    let large = |corners: [DVec3; 3]| corners.map(|corner| corner * 1024.0);
    let shape = ReceiverShape::Parallelogram(floor().map(|corner| corner * 1024.0));
    let (other, _) = lit(Origin::Point(origin * 1024.0), &shape, &blockers.map(large));
    assert!(one > 0.1 && one < 0.9 && one.to_bits() == other.to_bits(), "{one} {other}");
}

#[test]
fn points_in_the_shadow_of_a_shared_edge_are_hidden() {
    let along: Vec<DVec3> =
        (0..101).map(|i| DVec3::new(0.002, 0.0, 0.002) * f64::from(i) - DVec3::new(0.1, 0.0, 0.1)).collect();
    for origin in [Origin::Point(DVec3::Y), Origin::Direction(DVec3::Y)] {
        let (share, _) = lit(origin, &ReceiverShape::Points(along.clone()), &square(0.11, 0.5));
        assert_eq!(share, 0.0, "{origin:?}");
    }
}
