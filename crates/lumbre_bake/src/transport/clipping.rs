//! The part of a convex polygon on one side of a line or plane (Sutherland and Hodgman, "Reentrant Polygon Clipping", 1974), and the part of a
//! segment in a polygon. Not both sides of a cut at once, in room that is reused: that is `cut_out`.

use glam::{DVec2, DVec3};

/// A corner, in the plane or in space.
pub(super) trait Corner: Copy {
    /// The point at a share of the way to another.
    fn towards(self, other: Self, share: f64) -> Self;
}

impl Corner for DVec2 {
    fn towards(self, other: Self, share: f64) -> Self {
        self.lerp(other, share)
    }
}

impl Corner for DVec3 {
    fn towards(self, other: Self, share: f64) -> Self {
        self.lerp(other, share)
    }
}

/// Calls `keep` for the corners, in their order, of the part of a convex polygon that is not below a height of 0.
pub(super) fn clip<C: Corner>(corners: &[C], height: impl Fn(C) -> f64, mut keep: impl FnMut(C)) {
    let Some(&first) = corners.first() else { return };
    let mut own = height(first);
    for (place, &corner) in corners.iter().enumerate() {
        let next = corners[(place + 1) % corners.len()];
        let beyond = height(next);
        if own >= 0.0 {
            keep(corner);
        }
        if (own > 0.0 && beyond < 0.0) || (own < 0.0 && beyond > 0.0) {
            keep(corner.towards(next, own / (own - beyond)));
        }
        own = beyond;
    }
}

/// The part of a segment in a counter-clockwise convex polygon.
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
