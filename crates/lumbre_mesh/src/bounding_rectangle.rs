//! The bounding rectangle of least area of points in the plane. One of its sides contains an edge of the
//! convex hull (Freeman and Shapira 1975).

use glam::DVec2;

/// Largest number of hull edges that are tried. A hull with more is nearly round, so trying every n-th edge
/// suffices.
const MAX_EDGES: usize = 256;

/// A rotated rectangle: the points lie between `min` and `max` along `axis` and its perpendicular.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct BoundingRectangle {
    /// Unit vector along the longer side.
    pub axis: DVec2,
    pub min: DVec2,
    pub max: DVec2,
}

impl BoundingRectangle {
    /// The rectangle around points, at least one of which must be finite.
    pub fn least_area(points: &[DVec2]) -> Self {
        let hull = convex_hull(points);
        let mut best = along(DVec2::X, &hull);
        let stride = hull.len().div_ceil(MAX_EDGES).max(1);
        for i in (0..hull.len()).step_by(stride) {
            let edge = hull[(i + 1) % hull.len()] - hull[i];
            let Some(axis) = edge.try_normalize() else { continue };
            let rectangle = along(axis, &hull);
            // Of nearly equal areas keep the first, so that rounding does not decide between the sides of a
            // square.
            if rectangle.area() < best.area() * (1.0 - 1e-9) || best.area() == 0.0 {
                best = rectangle;
            }
        }
        let size = best.max - best.min;
        if size.y > size.x * (1.0 + 1e-9) { along(best.axis.perp(), &hull) } else { best }
    }

    fn area(&self) -> f64 {
        let size = self.max - self.min;
        size.x * size.y
    }

    /// Coordinates of a point along the rectangle's sides.
    pub fn local(&self, point: DVec2) -> DVec2 {
        DVec2::new(point.dot(self.axis), point.dot(self.axis.perp()))
    }
}

fn along(axis: DVec2, points: &[DVec2]) -> BoundingRectangle {
    let mut rectangle = BoundingRectangle { axis, min: DVec2::INFINITY, max: DVec2::NEG_INFINITY };
    for &point in points {
        let local = rectangle.local(point);
        rectangle.min = rectangle.min.min(local);
        rectangle.max = rectangle.max.max(local);
    }
    rectangle
}

/// The convex hull in counter-clockwise order, by Andrew's monotone chain.
fn convex_hull(points: &[DVec2]) -> Vec<DVec2> {
    let mut sorted = points.to_vec();
    sorted.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    sorted.dedup();
    if sorted.len() < 3 {
        return sorted;
    }
    let mut hull: Vec<DVec2> = Vec::with_capacity(sorted.len());
    let mut half = |points: &mut dyn Iterator<Item = DVec2>| {
        let start = hull.len();
        for point in points {
            while hull.len() >= start + 2 {
                let (a, b) = (hull[hull.len() - 2], hull[hull.len() - 1]);
                if (b - a).perp_dot(point - b) > 0.0 {
                    break;
                }
                hull.pop();
            }
            hull.push(point);
        }
        // The last point of one half is the first of the other.
        hull.pop();
    };
    half(&mut sorted.iter().copied());
    half(&mut sorted.iter().rev().copied());
    hull
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_turned_rectangle_is_found() {
        for degrees in [0.0, 10.0, 45.0, 77.0, 90.0, 133.0] {
            let turn = DVec2::from_angle(f64::to_radians(degrees));
            let mut points = Vec::new();
            for i in 0..=10 {
                for j in 0..=10 {
                    points.push(turn.rotate(DVec2::new(f64::from(i) * 0.3, f64::from(j) * 0.1)));
                }
            }
            let found = BoundingRectangle::least_area(&points);
            let size = found.max - found.min;
            assert!((size - DVec2::new(3.0, 1.0)).abs().max_element() < 1e-12, "{size} at {degrees}");
            assert!(found.axis.perp_dot(turn).abs() < 1e-12 || found.axis.dot(turn).abs() < 1e-12);
        }
    }

    #[test]
    fn a_line_and_a_point() {
        let line = [DVec2::ZERO, DVec2::ONE, DVec2::splat(3.0)];
        let size = |r: BoundingRectangle| r.max - r.min;
        let found = size(BoundingRectangle::least_area(&line));
        assert!((found.x - 18f64.sqrt()).abs() < 1e-12 && found.y.abs() < 1e-12);
        assert_eq!(size(BoundingRectangle::least_area(&[DVec2::ONE; 3])), DVec2::ZERO);
    }

    #[test]
    fn a_disc_of_many_points_is_quick() {
        let disc: Vec<DVec2> = (0..100_000).map(|i| DVec2::from_angle(f64::from(i) * 6.2831853e-5)).collect();
        let found = BoundingRectangle::least_area(&disc);
        assert!(((found.max - found.min) - 2.0).abs().max_element() < 1e-6);
    }
}
