//! Tests that a triangle outside of a shaft blocks no segment inside it.

use glam::{DVec3, Vec3};

use super::*;
use crate::sampling::{Sequence, Stream};
use crate::scene::Side;
use crate::sources::Emitter;

/// A unit square of the floor, centred at the origin.
fn floor() -> Area {
    let corners = [[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]].map(|[x, z]| DVec3::new(x, 0.0, z));
    Area { corners, normal: DVec3::Y }
}

fn lamp(corners: [[f32; 3]; 3]) -> Emitter {
    let corners = corners.map(Vec3::from);
    let [a, b, c] = corners;
    let normal = (b - a).cross(c - a);
    Emitter {
        corners,
        corners_f64: corners.map(|corner| corner.as_dvec3()),
        normal: normal.normalize(),
        area: 0.5 * normal.length(),
        radiance: Vec3::ONE,
        triangle: 0,
        side: Side::Front,
    }
}

/// The shaft from the floor to an emitter.
fn to_emitter(emitter: &Emitter) -> Option<Shaft> {
    Shaft::new(&floor(), emitter.corners_f64, emitter.normal)
}

fn above() -> Emitter {
    lamp([[-0.5, 2.0, -0.5], [0.5, 2.0, -0.5], [0.0, 2.0, 0.5]])
}

fn meets(shaft: &Shaft, corners: [[f64; 3]; 3]) -> bool {
    let corners = corners.map(DVec3::from);
    let extent = corners.iter().map(|corner| corner.abs().max_element()).fold(0.0, f64::max);
    shaft.may_meet(&corners, extent)
}

#[test]
fn walls_floors_and_ceilings_are_outside() {
    let shaft = to_emitter(&above()).unwrap();
    // The floor itself, the ceiling behind the lamp, a wall that touches the edges of both, and a triangle beside the
    // shaft.
    assert!(!meets(&shaft, [[-9.0, 0.0, -9.0], [9.0, 0.0, -9.0], [0.0, 0.0, 9.0]]));
    assert!(!meets(&shaft, [[-9.0, 2.0, -9.0], [9.0, 2.0, -9.0], [0.0, 2.0, 9.0]]));
    assert!(!meets(&shaft, [[0.5, -9.0, -9.0], [0.5, 9.0, -9.0], [0.5, 0.0, 9.0]]));
    assert!(!meets(&shaft, [[0.6, 1.0, 0.0], [2.0, 1.0, 1.0], [2.0, 1.0, 0.0]]));
    // A triangle in the middle, and one whose sharp corner reaches in.
    assert!(meets(&shaft, [[-0.1, 1.0, -0.1], [0.1, 1.0, -0.1], [0.0, 1.0, 0.1]]));
    assert!(meets(&shaft, [[0.3, 0.5, 0.0], [2.0, 1.0, 1.0], [2.0, 1.0, 0.0]]));
}

#[test]
fn no_light_passes_between_backs() {
    let turned = lamp([[-0.5, 2.0, -0.5], [0.0, 2.0, 0.5], [0.5, 2.0, -0.5]]);
    assert!(turned.normal.y > 0.0 && to_emitter(&turned).is_none());
    let below = lamp([[-0.5, -2.0, -0.5], [0.5, -2.0, -0.5], [0.0, -2.0, 0.5]]);
    assert!(to_emitter(&below).is_none());
    let in_plane = lamp([[2.0, 0.0, -0.5], [3.0, 0.0, -0.5], [2.0, 0.0, 0.5]]);
    assert!(to_emitter(&in_plane).is_none());
}

/// Checks with random triangles that all that block a segment inside the shaft are found. `end` maps a segment's start
/// and two random numbers to the segment's end.
fn finds_all_that_block_segments(shaft: &Shaft, purpose: u32, end: impl Fn(DVec3, f64, f64) -> DVec3) {
    let sequence = Sequence::new(5, Stream::Test(purpose), 0);
    let (mut met, mut out) = (0, 0);
    for index in 0..2000 {
        let corners = [0, 1, 2].map(|corner| {
            let [x, y, z, _] = sequence.point(index, corner);
            DVec3::new(4.0 * f64::from(x) - 2.0, 2.4 * f64::from(y) - 0.2, 4.0 * f64::from(z) - 2.0)
        });
        let inside = shaft.may_meet(&corners, 2.2);
        let [a, b, c] = corners;
        let normal = (b - a).cross(c - a);
        let blocks = (0..256).any(|ray| {
            let [x, z, u, v] = sequence.of(1).point(ray, 3).map(f64::from);
            let from = DVec3::new(x - 0.5, 0.0, z - 0.5);
            let along = end(from, u, v) - from;
            let t = normal.dot(a - from) / normal.dot(along);
            let at = from + along * t;
            let side = |from: DVec3, to: DVec3| (to - from).cross(at - from).dot(normal) > 0.0;
            t > 0.0 && t < 1.0 && side(a, b) && side(b, c) && side(c, a)
        });
        assert!(inside || !blocks, "{index}: {corners:?}");
        met += u32::from(blocks);
        out += u32::from(!inside);
    }
    assert!(met > 200 && out > 200, "{met} {out}");
}

#[test]
fn what_blocks_a_segment_to_a_lamp_is_inside() {
    let lamp = above();
    let [p, q, r] = lamp.corners_f64;
    finds_all_that_block_segments(&to_emitter(&lamp).unwrap(), 99, |_, u, v| {
        let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
        p + (q - p) * u + (r - p) * v
    });
}

#[test]
fn what_blocks_a_segment_to_a_light_is_inside() {
    let place = DVec3::new(0.4, 1.7, -0.3);
    finds_all_that_block_segments(&Shaft::to_point(&floor(), place).unwrap(), 100, |_, _, _| place);
    let direction = |u: f64, v: f64| {
        let (z, angle) = (2.0 * u - 1.0, std::f64::consts::TAU * v);
        let across = (1.0 - z * z).sqrt();
        DVec3::new(across * angle.cos(), z, across * angle.sin())
    };
    let ball = Shaft::to_ball(&floor(), place, 0.3).unwrap();
    finds_all_that_block_segments(&ball, 101, |_, u, v| place + direction(u, v) * 0.3);
    let towards = place.normalize();
    let parallel = Shaft::towards(&floor(), towards).unwrap();
    finds_all_that_block_segments(&parallel, 102, |from, _, _| from + towards * 5.0);
    let cone = Shaft::in_cone(&floor(), towards, 0.2).unwrap();
    let side = towards.any_orthonormal_vector();
    finds_all_that_block_segments(&cone, 103, |from, u, v| {
        let around = glam::DQuat::from_axis_angle(towards, std::f64::consts::TAU * v) * side;
        from + (towards + around * (0.2f64.tan() * u.sqrt())) * 5.0
    });
}

#[test]
fn triangles_beside_the_path_to_a_light_are_outside() {
    let above = [[-0.1, 1.0, -0.1], [0.1, 1.0, -0.1], [0.0, 1.0, 0.1]];
    // This triangle is outside of the narrow end of a pyramid, but inside the prism of a directional light.
    let beside = [[0.4, 1.9, -0.1], [0.4, 1.95, 0.1], [0.45, 1.9, 0.0]];
    let wall = [[0.5, -9.0, -9.0], [0.5, 9.0, -9.0], [0.5, 0.0, 9.0]];
    let beyond = [[-0.1, 2.1, -0.1], [0.1, 2.1, -0.1], [0.0, 2.1, 0.1]];
    let to_point = Shaft::to_point(&floor(), DVec3::Y * 2.0).unwrap();
    let to_ball = Shaft::to_ball(&floor(), DVec3::Y * 2.0, 0.05).unwrap();
    let towards = Shaft::towards(&floor(), DVec3::Y).unwrap();
    for (shaft, expected) in [
        (&to_point, [true, false, false, false]),
        (&to_ball, [true, false, false, false]),
        (&towards, [true, true, false, true]),
    ] {
        assert_eq!([above, beside, wall, beyond].map(|corners| meets(shaft, corners)), expected);
    }
    for below in [
        Shaft::to_point(&floor(), DVec3::NEG_Y),
        Shaft::to_point(&floor(), DVec3::X),
        Shaft::to_ball(&floor(), DVec3::NEG_Y, 0.5),
        Shaft::towards(&floor(), DVec3::NEG_Y),
        Shaft::in_cone(&floor(), DVec3::NEG_Y, 0.3),
    ] {
        assert!(below.is_none());
    }
}
