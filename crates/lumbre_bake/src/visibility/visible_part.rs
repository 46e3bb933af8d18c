//! The exact form factor of the part of an emitter that is visible from a point past some triangles: their shadows are
//! cut out of the emitter, and Lambert's formula is summed over the remaining pieces (Nishita and Nakamae, "Half-Tone
//! Representation of 3-D Objects Illuminated by Area Sources", 1983). `shaft` finds the triangles.

use glam::DVec3;

use super::cut_out::{GAP, PolygonClipper, Shadow};
use super::polygon::{lambert, point_to_triangle};
use super::shaft::Triangle;

/// The part of an emitter that is visible from a point.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Visible {
    /// Form factor of the visible part.
    pub factor: f64,
    /// Whether some of the emitter is hidden.
    pub hidden: bool,
}

/// The part of an emitter, a triangle that emits on its counter-clockwise side, that is visible past `blockers` from a
/// point with unit `normal`. `None` if the blockers cut it into too many pieces.
pub(crate) fn visible_part(
    point: DVec3,
    normal: DVec3,
    emitter: &Triangle,
    blockers: &[Triangle],
    pieces: &mut PolygonClipper,
) -> Option<Visible> {
    let [p, q, r] = emitter.map(|corner| corner - point);
    // The point is behind the triangle or in its plane.
    if (q - p).cross(r - p).dot(p) >= 0.0 {
        return Some(Visible::default());
    }
    pieces.begin(&[p, q, r])?;
    pieces.clip(|corner| corner.dot(normal))?;
    let mut hidden = false;
    for blocker in blockers {
        let Some(shadow) = Shadow::new(blocker.map(|corner| corner - point)) else { continue };
        hidden |= pieces.cut(&shadow)?;
        if pieces.list().is_empty() {
            break;
        }
    }
    let factor = pieces.list().iter().map(|piece| lambert(normal, piece.corners())).sum::<f64>();
    // The emitter's whole form factor is at most 1, so the first comparison saves most computations of it.
    let is_gap = hidden && factor < GAP && factor < GAP * point_to_triangle(point, normal, emitter);
    Some(Visible { factor: if is_gap { 0.0 } else { factor.clamp(0.0, 1.0) }, hidden })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::{Sequence, Stream, triangle_point};
    use crate::visibility::polygon::point_to_triangle;

    fn factor(point: DVec3, emitter: &Triangle, blockers: &[Triangle]) -> Visible {
        let mut pieces = PolygonClipper::new();
        visible_part(point, DVec3::Y, emitter, blockers, &mut pieces).unwrap()
    }

    /// A triangle that emits downwards from a height.
    fn lamp(height: f64) -> Triangle {
        [[-1.0, -1.0], [1.5, -0.5], [0.0, 1.5]].map(|[x, z]| DVec3::new(x, height, z))
    }

    #[test]
    fn without_blockers_it_is_lamberts_formula() {
        let emitter = lamp(2.0);
        let open = factor(DVec3::ZERO, &emitter, &[]);
        assert_eq!(
            open,
            Visible { factor: point_to_triangle(DVec3::ZERO, DVec3::Y, &emitter), hidden: false }
        );
        // Blockers beside the emitter, behind it, behind the point, and edge-on.
        let beside = [[5.0, 1.0, 0.0], [6.0, 1.0, 0.0], [5.0, 1.0, 1.0]].map(DVec3::from);
        let behind = lamp(3.0);
        let below = lamp(-1.0);
        let edge_on = [[0.0, 0.5, 0.0], [0.0, 1.0, 0.0], [0.0, 1.0, 1.0]].map(DVec3::from);
        assert_eq!(factor(DVec3::ZERO, &emitter, &[beside, behind, below, edge_on]), open);
    }

    #[test]
    fn a_sheet_with_straight_edges_hides_what_it_covers() {
        // The lamp scaled about the point to half the height hides all of it; at a third of that size, it hides as much
        // light as it would send itself.
        let emitter = lamp(2.0);
        let near = emitter.map(|corner| 0.5 * corner);
        let all = factor(DVec3::ZERO, &emitter, &[near.map(|corner| corner * 1.0)]);
        assert!(all.factor < 1e-12 && all.hidden, "{all:?}");
        let small = near.map(|corner| DVec3::new(corner.x / 3.0, corner.y, corner.z / 3.0));
        let remaining = factor(DVec3::ZERO, &emitter, &[small]);
        let expected = point_to_triangle(DVec3::ZERO, DVec3::Y, &emitter)
            - point_to_triangle(DVec3::ZERO, DVec3::Y, &small);
        assert!((remaining.factor - expected).abs() < 1e-14 && remaining.hidden, "{remaining:?} {expected}");
        // The same blocker a second time, turned over, hides no more.
        let [a, b, c] = small;
        let again = factor(DVec3::ZERO, &emitter, &[small, [a, c, b]]);
        assert!((again.factor - expected).abs() < 1e-14, "{again:?}");
    }

    /// Compares with area sampling by segments past the same triangles, within its error: 2^14 points of a (0,
    /// 2)-sequence.
    #[test]
    fn random_triangles_hide_the_part_that_segments_find_hidden() {
        let emitter = lamp(2.0);
        let sequence = Sequence::new(3, Stream::Test(77), 0);
        let mut some_hidden = 0;
        for crowd in 0..20 {
            let corner = |triangle: u32, corner: u32| {
                let [x, y, z, _] = sequence.of(crowd).point(3 * triangle + corner, 1);
                DVec3::new(3.0 * f64::from(x) - 1.5, 2.2 * f64::from(y) - 0.1, 3.0 * f64::from(z) - 1.5)
            };
            let blockers: Vec<Triangle> = (0..5).map(|t| [0, 1, 2].map(|c| corner(t, c))).collect();
            let point = DVec3::new(0.1, 0.0, -0.2);
            let visible = factor(point, &emitter, &blockers);
            let [p, q, r] = emitter;
            let area = 0.5 * (q - p).cross(r - p).length();
            let count = 1 << 14;
            let mut sum = 0.0;
            for index in 0..count {
                let [u, v, ..] = sequence.point(index, 2);
                let (u, v) = triangle_point(u, v);
                let towards = p + (q - p) * f64::from(u) + (r - p) * f64::from(v) - point;
                let crosses = |corners: &Triangle| {
                    let [a, b, c] = corners.map(|corner| corner - point);
                    let normal = (b - a).cross(c - a);
                    let t = normal.dot(a) / normal.dot(towards);
                    let at = towards * t;
                    let side = |from: DVec3, to: DVec3| (to - from).cross(at - from).dot(normal) > 0.0;
                    t > 0.0 && t < 1.0 && side(a, b) && side(b, c) && side(c, a)
                };
                if !blockers.iter().any(crosses) {
                    sum += towards.y * towards.y / towards.length_squared().powi(2);
                }
            }
            let expected = sum * area / std::f64::consts::PI / f64::from(count);
            // Edges cross √N of N strata, so the relative error is of the order of N^-3/4; the bound is a few times
            // that.
            let whole = point_to_triangle(point, DVec3::Y, &emitter);
            assert!((visible.factor - expected).abs() < 3e-3 * whole, "{crowd}: {visible:?} {expected}");
            some_hidden += u32::from(visible.factor > 0.0 && visible.factor < whole);
        }
        assert!(some_hidden > 10, "{some_hidden}");
    }

    #[test]
    fn adjacent_blockers_leave_no_gap() {
        // A screen in front of the whole lamp, of triangles whose f32 corners meet in T-junctions.
        let emitter = lamp(2.0);
        let sequence = Sequence::new(11, Stream::Test(78), 0);
        for index in 0..500 {
            let [x, y, z, angle] = sequence.point(index, 0).map(f64::from);
            let turn = DVec3::new((6.3 * angle).cos(), 0.1 * (y - 0.5), (6.3 * angle).sin()).normalize();
            let across = DVec3::Y.cross(turn);
            let at = |a: f64, b: f64| {
                (DVec3::new(x - 0.5, 0.7, z - 0.5) + turn * a + across * b).as_vec3().as_dvec3()
            };
            let square = |low: f64, high: f64, left: f64, right: f64| {
                let [a, b, c, d] = [at(low, left), at(high, left), at(high, right), at(low, right)];
                [[a, b, c], [a, c, d]]
            };
            let screen =
                [square(-9.0, 9.0, -9.0, 0.1), square(-9.0, 0.3, 0.1, 9.0), square(0.3, 9.0, 0.1, 9.0)];
            let seen = factor(DVec3::new(0.1 * x, 0.0, 0.2 * z), &emitter, &screen.concat());
            assert_eq!(seen, Visible { factor: 0.0, hidden: true }, "{index}");
        }
    }

    #[test]
    fn the_horizon_clips_and_scaling_by_a_power_of_two_changes_no_bit() {
        // Half of the lamp is below the horizon.
        let emitter = [[1.0, -1.0, -1.0], [1.0, -1.0, 1.0], [1.0, 2.0, 0.0]].map(DVec3::from);
        let blocker = [[0.5, 0.3, -0.5], [0.5, 0.3, 0.5], [0.5, 2.0, 0.1]].map(DVec3::from);
        let one = factor(DVec3::ZERO, &emitter, &[blocker]);
        assert!(one.hidden && one.factor > 0.0);
        let large = |corners: Triangle| corners.map(|corner| corner * 1024.0);
        assert_eq!(factor(DVec3::ZERO, &large(emitter), &[large(blocker)]), one);
    }
}
