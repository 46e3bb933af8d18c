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
const EXACT_ERROR: f64 = 1e-12;

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
        let origin = match self.departure {
            None => self.origin.as_vec3(),
            Some(Departure { side, extent }) => {
                offset_ray_origin(self.origin.as_vec3(), side.as_vec3(), extent as f32)
            }
        };
        let direction: Vec3 = self.direction.as_vec3();
        Ray { origin, direction, t_min: 0.0, t_max: farthest as f32 }
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
