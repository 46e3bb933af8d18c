//! The closest points of an upright capsule and a triangle. The response to a contact is in `collide`.

use glam::DVec3;

/// All points within `radius` of a vertical segment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Capsule {
    /// Lower end of the segment, metres.
    pub bottom: DVec3,
    /// Length of the segment in metres, at least 0; the capsule is taller by two radii.
    pub height: f64,
    /// Metres, greater than 0.
    pub radius: f64,
}

impl Capsule {
    /// Returns the upper end of the segment.
    pub fn top(&self) -> DVec3 {
        self.bottom + DVec3::Y * self.height
    }

    /// Returns the closest points of the segment and a triangle: the one on the segment and the one on the
    /// triangle. If they intersect, both are the intersection.
    pub fn closest(&self, triangle: &[DVec3; 3]) -> (DVec3, DVec3) {
        let (bottom, top) = (self.bottom, self.top());
        if let Some(crossing) = segment_crosses(bottom, top, triangle) {
            return (crossing, crossing);
        }
        let mut best = (bottom, closest_on_triangle(bottom, triangle));
        let mut consider = |pair: (DVec3, DVec3)| {
            if pair.0.distance_squared(pair.1) < best.0.distance_squared(best.1) {
                best = pair;
            }
        };
        consider((top, closest_on_triangle(top, triangle)));
        for corner in 0..3 {
            consider(closest_of_segments(bottom, top, triangle[corner], triangle[(corner + 1) % 3]));
        }
        best
    }
}

/// Returns the point where a segment passes through a triangle, if it does.
fn segment_crosses(from: DVec3, to: DVec3, &[a, b, c]: &[DVec3; 3]) -> Option<DVec3> {
    let normal = (b - a).cross(c - a);
    let (start, end) = (normal.dot(from - a), normal.dot(to - a));
    if start * end > 0.0 || start == end {
        return None;
    }
    let point = from.lerp(to, start / (start - end));
    let inside = |p: DVec3, q: DVec3| normal.dot((q - p).cross(point - p)) >= 0.0;
    (inside(a, b) && inside(b, c) && inside(c, a)).then_some(point)
}

/// Returns the point of a triangle that is closest to a point (Ericson, "Real-Time Collision Detection",
/// 5.1.5).
pub fn closest_on_triangle(point: DVec3, &[a, b, c]: &[DVec3; 3]) -> DVec3 {
    let (ab, ac) = (b - a, c - a);
    let (ap, bp, cp) = (point - a, point - b, point - c);
    let (d1, d2) = (ab.dot(ap), ac.dot(ap));
    let (d3, d4) = (ab.dot(bp), ac.dot(bp));
    let (d5, d6) = (ab.dot(cp), ac.dot(cp));
    if d1 <= 0.0 && d2 <= 0.0 {
        return a;
    }
    if d3 >= 0.0 && d4 <= d3 {
        return b;
    }
    if d6 >= 0.0 && d5 <= d6 {
        return c;
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return a + ab * ratio(d1, d1 - d3);
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return a + ac * ratio(d2, d2 - d6);
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 >= d3 && d5 >= d6 {
        return b + (c - b) * ratio(d4 - d3, (d4 - d3) + (d5 - d6));
    }
    let sum = va + vb + vc;
    a + ab * ratio(vb, sum) + ac * ratio(vc, sum)
}

/// Returns the closest points of two segments (Ericson, 5.1.9).
fn closest_of_segments(p: DVec3, p_end: DVec3, q: DVec3, q_end: DVec3) -> (DVec3, DVec3) {
    let (d, e, r) = (p_end - p, q_end - q, p - q);
    let (a, b, c) = (d.dot(d), d.dot(e), d.dot(r));
    let (ee, f) = (e.dot(e), e.dot(r));
    let parallel = a * ee - b * b;
    let mut s = ratio(b * f - c * ee, parallel).clamp(0.0, 1.0);
    let t = ratio(b * s + f, ee).clamp(0.0, 1.0);
    s = ratio(b * t - c, a).clamp(0.0, 1.0);
    (p + d * s, q + e * t)
}

/// Returns a quotient, or 0 if it is not finite.
fn ratio(numerator: f64, denominator: f64) -> f64 {
    let quotient = numerator / denominator;
    if quotient.is_finite() { quotient } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FLOOR: [DVec3; 3] = [DVec3::ZERO, DVec3::new(0.0, 0.0, 4.0), DVec3::new(4.0, 0.0, 0.0)];

    fn capsule(x: f64, y: f64, z: f64) -> Capsule {
        Capsule { bottom: DVec3::new(x, y, z), height: 1.0, radius: 0.25 }
    }

    #[test]
    fn face_edge_and_vertex() {
        let (on_segment, on_triangle) = capsule(1.0, 2.0, 1.0).closest(&FLOOR);
        assert_eq!((on_segment, on_triangle), (DVec3::new(1.0, 2.0, 1.0), DVec3::new(1.0, 0.0, 1.0)));
        let (_, at_edge) = capsule(-1.0, 0.5, 2.0).closest(&FLOOR);
        assert_eq!(at_edge, DVec3::new(0.0, 0.0, 2.0));
        let (_, at_vertex) = capsule(-1.0, 0.5, -1.0).closest(&FLOOR);
        assert_eq!(at_vertex, DVec3::ZERO);
        let (on_segment, _) = capsule(1.0, -3.0, 1.0).closest(&FLOOR);
        assert_eq!(on_segment, DVec3::new(1.0, -2.0, 1.0)); // from below it is the top that is near
    }

    #[test]
    fn the_middle_of_the_segment_meets_an_edge() {
        let beam = [DVec3::new(1.0, 0.5, -1.0), DVec3::new(1.0, 0.5, 1.0), DVec3::new(3.0, 0.5, 0.0)];
        let (on_segment, on_triangle) = capsule(0.0, 0.0, 0.0).closest(&beam);
        assert!((on_segment - DVec3::new(0.0, 0.5, 0.0)).length() < 1e-15);
        assert!((on_triangle - DVec3::new(1.0, 0.5, 0.0)).length() < 1e-15);
    }

    #[test]
    fn a_segment_through_a_triangle_is_at_distance_zero() {
        let (on_segment, on_triangle) = capsule(1.0, -0.5, 1.0).closest(&FLOOR);
        assert_eq!(on_segment, on_triangle);
        assert_eq!(on_segment.y, 0.0);
        let (p, q) = capsule(5.0, -0.5, 5.0).closest(&FLOOR);
        assert!(p.distance(q) > 1.0);
    }

    #[test]
    fn closest_agrees_with_a_dense_search() {
        // A search over 60 x 60 barycentric points and 60 heights finds no pair closer than `closest` does,
        // and one that is nearly as close (within a grid step, 4/60 m).
        let triangle = [DVec3::new(0.3, -0.2, 1.0), DVec3::new(2.0, 1.4, -0.5), DVec3::new(-1.0, 0.7, -2.0)];
        for place in
            [(0.0, 0.0, 0.0), (1.5, 0.3, 1.5), (-2.0, -1.0, -1.0), (0.4, 0.9, -0.6), (3.0, -2.0, 0.0)]
        {
            let capsule = capsule(place.0, place.1, place.2);
            let (p, q) = capsule.closest(&triangle);
            let mut least = f64::INFINITY;
            for i in 0..=60 {
                for j in 0..=60 - i {
                    let (u, v) = (f64::from(i) / 60.0, f64::from(j) / 60.0);
                    let point = triangle[0] * (1.0 - u - v) + triangle[1] * u + triangle[2] * v;
                    for k in 0..=60 {
                        let on_segment = capsule.bottom + DVec3::Y * (f64::from(k) / 60.0);
                        least = least.min(on_segment.distance(point));
                    }
                }
            }
            assert!(p.distance(q) <= least + 1e-12, "{place:?}: {} > {least}", p.distance(q));
            assert!(p.distance(q) >= least - 4.0 / 60.0, "{place:?}: {} < {least}", p.distance(q));
        }
    }
}
