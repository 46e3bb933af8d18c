//! The lit part against segments to the light, and in closed form.

use super::*;
use crate::sampling::{Sequence, Stream};

const FLOOR: [[f64; 3]; 4] = [[-0.5, 0.0, -0.5], [0.5, 0.0, -0.5], [0.6, 0.0, 0.5], [-0.4, 0.0, 0.5]];

fn floor() -> [DVec3; 4] {
    FLOOR.map(DVec3::from)
}

/// Share that is lit, and the mean place of what is, times that share.
fn lit(origin: Origin, shape: &ReceiverShape, blockers: &[[DVec3; 3]]) -> (f64, DVec3) {
    let shadows: Vec<Shadow> = blockers.iter().filter_map(|&corners| origin.shadow(corners)).collect();
    let (mut share, mut moment) = (0.0, DVec3::ZERO);
    origin.lit(shape, &shadows, &mut Pieces::new(), |place, own| {
        share += own;
        moment += place * own;
    });
    (share, moment)
}

fn square(half: f64, height: f64) -> [[DVec3; 3]; 2] {
    let at = |x: f64, z: f64| DVec3::new(x, height, z);
    let [a, b, c, d] = [at(-half, -half), at(half, -half), at(half, half), at(-half, half)];
    [[a, b, c], [a, c, d]]
}

#[test]
fn a_square_sheet_throws_a_square_shadow() {
    // Half as high as the light, twice as large; under a light in the sky as large as it is. The floor's area is 1.
    for (origin, side) in [
        (Origin::Point(DVec3::Y), 0.6),
        (Origin::Direction(DVec3::Y), 0.3),
        (Origin::Point(DVec3::NEG_Y), 0.0),
    ] {
        let (share, moment) = lit(origin, &ReceiverShape::Parallelogram(floor()), &square(0.15, 0.5));
        assert!((share - (1.0 - side * side)).abs() < 1e-12, "{origin:?} {share}");
        // The floor's middle is 0.05 beside the shadow's.
        assert!((moment - DVec3::X * 0.05).length() < 1e-12, "{origin:?} {moment}");
    }
    let all = Origin::Point(DVec3::Y);
    let shadows: Vec<Shadow> =
        square(0.4, 0.5).into_iter().filter_map(|corners| all.shadow(corners)).collect();
    assert!(all.hides_all(floor(), &shadows, &mut Pieces::new()));
    assert!(!all.hides_all(floor(), &shadows[..1], &mut Pieces::new()));
    assert_eq!(lit(all, &ReceiverShape::Parallelogram(floor()), &square(0.4, 0.5)).0, 0.0);
}

/// Random triangles: what is lit is what a fine grid of segments to the light finds lit, whether cut or by points.
#[test]
fn a_crowd_of_triangles_leaves_what_segments_find_lit() {
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
        // An edge right across meets 128 cells of 128², each wrong by a half at most and by chance: √128 / 128² / √12, here four edges and
        // 5 sigma, 2e-3. Sixty triangles make more pieces than are kept: a grid of 8 by 8 points, so 1/64 for each of some edges.
        let bound = if count == 4 { 2e-3 } else { 0.05 };
        assert!((whole - expected).abs() < bound, "{crowd}: {whole} {expected}");
        let (by_points, _) = lit(origin, &ReceiverShape::Points(points), &blockers);
        assert!((by_points - expected).abs() < 1e-9, "{crowd}: {by_points} {expected}");
        partly += u32::from(expected > 0.02 && expected < 0.98);
    }
    assert!(partly > 20, "{partly}");
}

#[test]
fn scales_do_not_matter() {
    let blockers = square(0.2, 0.4);
    let origin = DVec3::new(0.3, 1.0, 0.1);
    let (one, _) = lit(Origin::Point(origin), &ReceiverShape::Parallelogram(floor()), &blockers);
    let large = |corners: [DVec3; 3]| corners.map(|corner| corner * 1024.0);
    let shape = ReceiverShape::Parallelogram(floor().map(|corner| corner * 1024.0));
    let (other, _) = lit(Origin::Point(origin * 1024.0), &shape, &blockers.map(large));
    assert!(one > 0.1 && one < 0.9 && one.to_bits() == other.to_bits(), "{one} {other}");
}

#[test]
fn points_on_an_edge_that_triangles_share_are_hidden() {
    let along: Vec<DVec3> =
        (0..101).map(|i| DVec3::new(0.002, 0.0, 0.002) * f64::from(i) - DVec3::new(0.1, 0.0, 0.1)).collect();
    for origin in [Origin::Point(DVec3::Y), Origin::Direction(DVec3::Y)] {
        let (share, _) = lit(origin, &ReceiverShape::Points(along.clone()), &square(0.11, 0.5));
        assert_eq!(share, 0.0, "{origin:?}");
    }
}
