//! Clips a convex polygon to one side of a line or plane (Sutherland and Hodgman, "Reentrant Polygon Clipping", 1974),
//! and a segment to a polygon. `cut_out` keeps both sides of a cut, in reused memory.

use std::ops::{Div, Sub};

use glam::{DVec2, DVec3, Vec2};

/// A corner, in the plane or in space.
pub(crate) trait Corner: Copy {
    /// Distances from a line or plane.
    type Height: Copy + Default + PartialOrd + Sub<Output = Self::Height> + Div<Output = Self::Height>;

    /// The point at fraction `t` of the way to `other`.
    fn towards(self, other: Self, t: Self::Height) -> Self;
}

macro_rules! corners {
    ($($corner:ty: $height:ty),*) => {$(
        impl Corner for $corner {
            type Height = $height;

            fn towards(self, other: Self, t: $height) -> Self {
                self.lerp(other, t)
            }
        }
    )*};
}

corners!(Vec2: f32, DVec2: f64, DVec3: f64);

/// Clips a convex polygon to the points whose `height` is not below 0. Calls `keep` for each corner of the result, in
/// order.
pub(crate) fn clip<C: Corner>(corners: &[C], height: impl Fn(C) -> C::Height, mut keep: impl FnMut(C)) {
    let Some(&first) = corners.first() else { return };
    let zero = C::Height::default();
    let mut here = height(first);
    for (place, &corner) in corners.iter().enumerate() {
        let next = corners[(place + 1) % corners.len()];
        let there = height(next);
        if here >= zero {
            keep(corner);
        }
        if (here > zero && there < zero) || (here < zero && there > zero) {
            keep(corner.towards(next, here / (here - there)));
        }
        here = there;
    }
}

/// The part of a segment inside a counter-clockwise convex polygon.
pub(crate) fn clip_segment(polygon: &[DVec2], [p, q]: [DVec2; 2]) -> Option<[DVec2; 2]> {
    let (mut from, mut to) = (0.0f64, 1.0f64);
    for (place, &a) in polygon.iter().enumerate() {
        let b = polygon[(place + 1) % polygon.len()];
        let (hp, hq) = ((b - a).perp_dot(p - a), (b - a).perp_dot(q - a));
        match (hp >= 0.0, hq >= 0.0) {
            (true, true) => {}
            (false, false) => return None,
            (true, false) => to = to.min(hp / (hp - hq)),
            (false, true) => from = from.max(hp / (hp - hq)),
        }
    }
    (from < to).then(|| [p.lerp(q, from), p.lerp(q, to)])
}

#[cfg(test)]
mod tests {
    use super::*;

    const TRIANGLE: [DVec2; 3] = [DVec2::ZERO, DVec2::new(4.0, 0.0), DVec2::new(0.0, 4.0)];

    #[test]
    fn a_segment_ends_where_the_polygon_does() {
        let part = |a: [f64; 2], b: [f64; 2]| clip_segment(&TRIANGLE, [a.into(), b.into()]);
        let crossing = part([-1.0, 1.0], [9.0, 1.0]).expect("it crosses");
        assert!(crossing[0].distance(DVec2::new(0.0, 1.0)) < 1e-12, "{crossing:?}");
        assert!(crossing[1].distance(DVec2::new(3.0, 1.0)) < 1e-12, "{crossing:?}");
        assert_eq!(part([0.5, 0.5], [1.0, 2.0]), Some([DVec2::new(0.5, 0.5), DVec2::new(1.0, 2.0)]));
        // Beside an edge, past a corner, and along the prolonged edge.
        assert_eq!(part([1.0, -0.1], [2.0, -0.1]), None);
        assert_eq!(part([3.9, 2.0], [2.0, 3.9]), None);
        assert_eq!(part([5.0, 0.0], [6.0, 0.0]), None);
    }

    #[test]
    fn corners_on_the_plane_appear_once() {
        let part = |height: &dyn Fn(DVec2) -> f64| {
            let mut corners = Vec::new();
            clip(&TRIANGLE, height, |corner| corners.push(corner));
            corners
        };
        assert_eq!(part(&|p| p.x + 1.0), TRIANGLE);
        assert_eq!(part(&|p| p.x), TRIANGLE);
        assert!(part(&|p| -p.x - 1.0).is_empty());
        assert_eq!(part(&|p| p.x - 1.0), [[1.0, 0.0], [4.0, 0.0], [1.0, 3.0]].map(DVec2::from));
        // Through a corner and the middle of the edge before it.
        assert_eq!(part(&|p| p.y - p.x), [[0.0, 0.0], [2.0, 2.0], [0.0, 4.0]].map(DVec2::from));
    }
}
