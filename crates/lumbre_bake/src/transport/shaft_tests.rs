//! What a shaft leaves out stands in no segment's way.

use glam::{DVec3, Vec3};

use super::*;
use crate::sampling::Sequence;
use crate::scene::material::Side;

/// A square of the floor, one wide, about the origin.
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
    let shaft = Shaft::new(&floor(), &above()).unwrap();
    // The floor itself, the ceiling behind the lamp, a wall that touches the edge of both, and something beside.
    assert!(!meets(&shaft, [[-9.0, 0.0, -9.0], [9.0, 0.0, -9.0], [0.0, 0.0, 9.0]]));
    assert!(!meets(&shaft, [[-9.0, 2.0, -9.0], [9.0, 2.0, -9.0], [0.0, 2.0, 9.0]]));
    assert!(!meets(&shaft, [[0.5, -9.0, -9.0], [0.5, 9.0, -9.0], [0.5, 0.0, 9.0]]));
    assert!(!meets(&shaft, [[0.6, 1.0, 0.0], [2.0, 1.0, 1.0], [2.0, 1.0, 0.0]]));
    // What is in the middle, and a needle's point.
    assert!(meets(&shaft, [[-0.1, 1.0, -0.1], [0.1, 1.0, -0.1], [0.0, 1.0, 0.1]]));
    assert!(meets(&shaft, [[0.3, 0.5, 0.0], [2.0, 1.0, 1.0], [2.0, 1.0, 0.0]]));
}

#[test]
fn no_light_passes_between_backs() {
    let turned = lamp([[-0.5, 2.0, -0.5], [0.0, 2.0, 0.5], [0.5, 2.0, -0.5]]);
    assert!(turned.normal.y > 0.0 && Shaft::new(&floor(), &turned).is_none());
    let below = lamp([[-0.5, -2.0, -0.5], [0.5, -2.0, -0.5], [0.0, -2.0, 0.5]]);
    assert!(Shaft::new(&floor(), &below).is_none());
    let in_plane = lamp([[2.0, 0.0, -0.5], [3.0, 0.0, -0.5], [2.0, 0.0, 0.5]]);
    assert!(Shaft::new(&floor(), &in_plane).is_none());
}

/// Random triangles: whatever stands between a point of the area and one of the lamp is named.
#[test]
fn whatever_a_segment_meets_is_inside() {
    let (area, lamp) = (floor(), above());
    let shaft = Shaft::new(&area, &lamp).unwrap();
    let sequence = Sequence::new(5, 99, 0);
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
            let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
            let [p, q, r] = lamp.corners_f64;
            let along = p + (q - p) * u + (r - p) * v - from;
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
