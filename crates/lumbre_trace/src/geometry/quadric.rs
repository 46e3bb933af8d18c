//! Ray intersection with quadrics in f64: planes, spheres, cylinders, cones and all other surfaces of the
//! second degree. Triangles are in `lumbre_rays`.
//!
//! # Stability
//! The textbook's discriminant b² - 4ac loses all its digits where the ray starts far away: at 10⁶ radii both
//! terms are 10¹² times their difference. Here the ray's origin is moved to its closest point to the
//! surface's centre, and then to the vertex of the parabola Q(o + t d), where b all but vanishes and the
//! discriminant is -4ac, a product (after Haines, Günther, Akenine-Möller, "Precision Improvements for
//! Ray/Sphere Intersection", Ray Tracing Gems, chapter 7, who do it for spheres). The roots are q/a and c/q,
//! without cancellation, and the point is moved onto the surface by one Newton step along the gradient.

use glam::{DMat3, DVec3};
use lumbre_scene::{Quadric, QuadricShape};

/// A surface p·A p + b·p + c = 0, clipped by a box, with the discs that close it.
#[derive(Clone, Debug)]
pub(crate) struct QuadricSurface {
    second: DMat3,
    first: DVec3,
    constant: f64,
    bounds: [DVec3; 2],
    caps: Vec<Cap>,
}

/// A disc at a height on the y axis, facing away from the origin.
#[derive(Clone, Copy, Debug)]
struct Cap {
    height: f64,
    radius: f64,
}

/// The hit of a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct QuadricHit {
    /// In units of the direction.
    pub distance: f64,
    pub point: DVec3,
    /// Towards the front, of any length but 0.
    pub normal: DVec3,
}

/// Tolerance of the box for rounding, as a fraction of its size.
const BOX_ERROR: f64 = 1e-9;

impl QuadricSurface {
    /// Prepares a shape that was validated.
    pub fn new(quadric: &Quadric) -> Self {
        let (mut second, mut first, mut constant) = (DMat3::ZERO, DVec3::ZERO, 0.0);
        let mut caps = Vec::new();
        match quadric.shape {
            QuadricShape::Plane => first = DVec3::Y,
            // Divided by the radius, so that the gradient's length does not depend on it.
            QuadricShape::Sphere { radius } => {
                second = DMat3::from_diagonal(DVec3::splat(1.0 / radius));
                constant = -radius;
            }
            QuadricShape::Cylinder { radius, height, closed } => {
                second = DMat3::from_diagonal(DVec3::new(1.0, 0.0, 1.0) / radius);
                constant = -radius;
                if closed {
                    caps.extend([0.5, -0.5].map(|part| Cap { height: part * height, radius }));
                }
            }
            QuadricShape::Cone { radius, height, closed } => {
                // x² + z² = (k (h/2 - y))² with k = radius/height.
                let slope = radius / height;
                second = DMat3::from_diagonal(DVec3::new(1.0, -slope * slope, 1.0) / radius);
                first = DVec3::Y * (slope * slope * height / radius);
                constant = -(slope * slope * 0.25 * height * height) / radius;
                if closed {
                    caps.push(Cap { height: -0.5 * height, radius });
                }
            }
            QuadricShape::General { coefficients: [a, b, c, d, e, f, g, h, i, j] } => {
                let (d, e, f) = (0.5 * d, 0.5 * e, 0.5 * f);
                second = DMat3::from_cols(DVec3::new(a, d, f), DVec3::new(d, b, e), DVec3::new(f, e, c));
                (first, constant) = (DVec3::new(g, h, i), j);
            }
        }
        Self { second, first, constant, bounds: quadric.bounds(), caps }
    }

    /// Returns the nearest hit of a ray in the surface's own space at a distance in [0, `farthest`] that
    /// `accept` takes.
    pub fn closest(
        &self,
        origin: DVec3,
        direction: DVec3,
        farthest: f64,
        accept: &dyn Fn(&QuadricHit) -> bool,
    ) -> Option<QuadricHit> {
        if !self.may_meet(origin, direction, farthest) {
            return None;
        }
        let in_reach = |distance: f64| (0.0..=farthest).contains(&distance);
        let on_caps = self.caps.iter().filter_map(|cap| cap.meet(origin, direction, self.bounds));
        let on_caps = on_caps.filter(|hit| in_reach(hit.distance) && accept(hit));
        let nearest = on_caps.min_by(|a, b| a.distance.total_cmp(&b.distance));
        let ordered = match self.roots(origin, direction) {
            [Some(one), Some(other)] if other.0 < one.0 => [Some(other), Some(one)],
            roots => roots,
        };
        for (distance, point) in ordered.into_iter().flatten().filter(|(distance, _)| in_reach(*distance)) {
            if nearest.is_some_and(|nearest| nearest.distance <= distance) {
                break;
            }
            let point = self.onto_surface(point);
            let hit = QuadricHit { distance, point, normal: self.gradient(point) };
            if self.holds(point) && hit.normal != DVec3::ZERO && accept(&hit) {
                return Some(hit);
            }
        }
        nearest
    }

    fn value(&self, point: DVec3) -> f64 {
        point.dot(self.second * point + self.first) + self.constant
    }

    fn gradient(&self, point: DVec3) -> DVec3 {
        2.0 * (self.second * point) + self.first
    }

    /// Returns the distances along the ray of the two roots of the equation, in no order, each with its point
    /// to within rounding.
    fn roots(&self, origin: DVec3, direction: DVec3) -> [Option<(f64, DVec3)>; 2] {
        let squared = direction.length_squared();
        if !(squared > 0.0 && squared.is_finite() && origin.is_finite()) {
            return [None, None];
        }
        let a = direction.dot(self.second * direction);
        // First to the ray's closest point to the centre, then to the vertex of its parabola.
        let mut moved = -origin.dot(direction) / squared;
        let mut start = origin + direction * moved;
        let slope = |start: DVec3| direction.dot(self.gradient(start));
        let size = self.second.x_axis.abs().max(self.second.y_axis.abs()).max(self.second.z_axis.abs());
        if a.abs() > 1e-12 * size.max_element() * squared {
            let further = -0.5 * slope(start) / a;
            if further.is_finite() {
                (moved, start) = (moved + further, start + direction * further);
            }
        }
        let (b, c) = (slope(start), self.value(start));
        let discriminant = b * b - 4.0 * a * c;
        if discriminant < 0.0 {
            return [None, None];
        }
        let q = -0.5 * (b + discriminant.sqrt().copysign(b));
        let root = |step: f64| {
            let distance = moved + step;
            distance.is_finite().then(|| (distance, start + direction * step))
        };
        let near = if a != 0.0 { root(q / a) } else { None };
        // A double root is one point; q is 0 only there.
        let far = if q != 0.0 { root(c / q) } else { None };
        [near, far]
    }

    /// Takes one Newton step along the gradient.
    fn onto_surface(&self, point: DVec3) -> DVec3 {
        let gradient = self.gradient(point);
        let squared = gradient.length_squared();
        if squared > 0.0 { point - gradient * (self.value(point) / squared) } else { point }
    }

    fn holds(&self, point: DVec3) -> bool {
        let [low, high] = self.bounds;
        let span = (high - low).max(point.abs());
        let room = DVec3::select(span.is_finite_mask(), span * BOX_ERROR, DVec3::ZERO);
        point.cmpge(low - room).all() && point.cmple(high + room).all()
    }

    /// Returns true if the ray crosses the slightly enlarged box.
    fn may_meet(&self, origin: DVec3, direction: DVec3, farthest: f64) -> bool {
        let (mut enter, mut leave) = (0.0_f64, farthest);
        for axis in 0..3 {
            let (low, high) = (self.bounds[0][axis], self.bounds[1][axis]);
            if low == f64::NEG_INFINITY && high == f64::INFINITY {
                continue;
            }
            let room = BOX_ERROR * (high - low).min(1e300).max(low.abs().min(1e300)).max(origin[axis].abs());
            let (low, high) = (low - room, high + room);
            let (from, along) = (origin[axis], direction[axis]);
            if along == 0.0 {
                if from < low || from > high {
                    return false;
                }
                continue;
            }
            let (one, other) = ((low - from) / along, (high - from) / along);
            (enter, leave) = (enter.max(one.min(other)), leave.min(one.max(other)));
        }
        enter <= leave
    }
}

impl Cap {
    fn meet(&self, origin: DVec3, direction: DVec3, [low, high]: [DVec3; 2]) -> Option<QuadricHit> {
        let distance = (self.height - origin.y) / direction.y;
        let point = (origin + direction * distance).with_y(self.height);
        let inside = point.is_finite() && point.x * point.x + point.z * point.z <= self.radius * self.radius;
        let kept = point.cmpge(low).all() && point.cmple(high).all();
        (inside && kept).then(|| {
            let normal = DVec3::Y * if self.height < 0.0 { -1.0 } else { 1.0 };
            QuadricHit { distance, point, normal }
        })
    }
}
