//! Rays in f64, with what keeps them off the surface that they leave. Not what they meet.

use glam::{DVec3, Vec3};
use lumbre_rays::{Ray, offset_ray_origin};

/// A half-line in the tracer's space.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SpaceRay {
    /// Where it starts, metres, exactly on the surface that it leaves.
    pub origin: DVec3,
    /// Unit.
    pub direction: DVec3,
    /// The surface that it leaves, if it leaves one.
    pub departure: Option<Departure>,
}

/// The surface that a ray leaves.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Departure {
    /// Unit geometric normal, on the side to which the ray goes.
    pub side: DVec3,
    /// Largest coordinate of what is left: its rounding is relative to that.
    pub extent: f64,
}

/// Relative rounding of a point that was found in f64 on a surface given by an equation, with room.
const EXACT_ERROR: f64 = 1e-13;

/// What keeps the end of a ray off the surface that it ends on, as a part of coordinates: as much as keeps its start off, and again for the
/// corners of triangles, which are f32.
const ROUNDING: f64 = 32.0 / (1 << 24) as f64;

impl SpaceRay {
    /// From a point in free space.
    pub fn new(origin: DVec3, direction: DVec3) -> Self {
        Self { origin, direction, departure: None }
    }

    /// From a point of a surface with this geometric normal, to whichever side the direction goes.
    pub fn leaving(origin: DVec3, direction: DVec3, geometric: DVec3, extent: f64) -> Self {
        let side = if direction.dot(geometric) < 0.0 { -geometric } else { geometric };
        Self { origin, direction, departure: Some(Departure { side, extent }) }
    }

    /// The point at a distance.
    pub fn at(&self, distance: f64) -> DVec3 {
        self.origin + self.direction * distance
    }

    /// For triangles, whose corners are f32.
    pub fn for_triangles(&self, farthest: f64) -> Ray {
        let direction: Vec3 = self.direction.as_vec3();
        Ray { origin: self.start_off_triangles(), direction, t_min: 0.0, t_max: farthest as f32 }
    }

    /// Metres that its start is off the surface at most where it meets triangles.
    pub fn set_off(&self) -> f64 {
        let size = |departure: Departure| departure.extent.max(self.origin.abs().max_element());
        self.departure.map_or(0.0, |departure| ROUNDING * size(departure))
    }

    /// The same up to a point at a distance, or short of it by the rounding of its coordinates: what lies in that point's own surface is not
    /// between. Seen from where the ray is set off to, the point lies in a slightly other direction.
    #[inline]
    pub fn between_triangles(&self, distance: f64) -> Ray {
        let origin = self.start_off_triangles();
        let distance = distance as f32;
        // By as much as the start is off. A direction need not be unit: at the distance it is at the point, to the rounding of f32.
        let aside = (self.origin - origin.as_dvec3()).as_vec3() / distance;
        let direction = self.direction.as_vec3() + aside;
        let size = (origin + direction * distance).abs().max_element().max(distance);
        Ray { origin, direction, t_min: 0.0, t_max: (distance - ROUNDING as f32 * size).max(0.0) }
    }

    #[inline]
    fn start_off_triangles(&self) -> Vec3 {
        let origin = self.origin.as_vec3();
        self.departure.map_or(origin, |Departure { side, extent }| {
            offset_ray_origin(origin, side.as_vec3(), extent as f32)
        })
    }

    /// For surfaces given by equations: the start, off the surface by its own rounding.
    pub fn exact_origin(&self) -> DVec3 {
        match self.departure {
            None => self.origin,
            Some(Departure { side, extent }) => {
                let size = extent.max(self.origin.abs().max_element());
                self.origin + side * (EXACT_ERROR * size)
            }
        }
    }
}
