//! Rays in f64, with the offsets that keep them off the surface that they leave and off the one that they end
//! on. Intersections are in `hierarchy`.

use glam::{DVec3, Vec3};
use lumbre_rays::{Ray, offset_ray_origin};

/// A ray in the tracer's space.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SpaceRay {
    /// Origin in metres, exactly on the surface that the ray leaves.
    pub origin: DVec3,
    /// Unit vector.
    pub direction: DVec3,
    /// The surface that it leaves, if it leaves one.
    pub departure: Option<Departure>,
}

/// The surface that a ray leaves.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Departure {
    /// Unit geometric normal, on the side that the ray goes to.
    pub side: DVec3,
    /// Largest coordinate of the surface that it leaves, to which rounding errors are relative.
    pub extent: f64,
}

/// Bound of the relative rounding error of a point that was computed in f64 on a surface given by an
/// equation, with a margin.
const EXACT_ERROR: f64 = 1e-13;

/// Distance that keeps a ray's end off the surface that it ends on, as a fraction of the coordinates: the
/// offset of its origin, and as much again for the rounding of the triangles' corners to f32.
const ROUNDING: f64 = 32.0 / (1 << 24) as f64;

impl SpaceRay {
    /// Creates a ray from a point in free space.
    pub fn new(origin: DVec3, direction: DVec3) -> Self {
        Self { origin, direction, departure: None }
    }

    /// Creates a ray from a point of a surface with this geometric normal, to either side of it.
    pub fn leaving(origin: DVec3, direction: DVec3, geometric: DVec3, extent: f64) -> Self {
        let side = if direction.dot(geometric) < 0.0 { -geometric } else { geometric };
        Self { origin, direction, departure: Some(Departure { side, extent }) }
    }

    /// Returns the point at a distance.
    pub fn at(&self, distance: f64) -> DVec3 {
        self.origin + self.direction * distance
    }

    /// Returns the ray in f32 for triangles, whose corners are f32, with its origin offset from the surface
    /// that it leaves.
    pub fn for_triangles(&self, farthest: f64) -> Ray {
        let direction: Vec3 = self.direction.as_vec3();
        Ray { origin: self.start_off_triangles(), direction, t_min: 0.0, t_max: farthest as f32 }
    }

    /// Returns an upper bound in metres of the offset of [`for_triangles`](Self::for_triangles).
    pub fn set_off(&self) -> f64 {
        let size = |departure: Departure| departure.extent.max(self.origin.abs().max_element());
        self.departure.map_or(0.0, |departure| ROUNDING * size(departure))
    }

    /// Returns the ray in f32 that ends at the point at a distance, or short of it by the rounding of its
    /// coordinates, so that the surface which contains that point does not count as in between. Seen from the
    /// offset origin the point lies in a slightly different direction.
    #[inline]
    pub fn between_triangles(&self, distance: f64) -> Ray {
        let origin = self.start_off_triangles();
        let distance = distance as f32;
        // Corrects the direction by the offset of the origin. It need not have unit length; after `distance`
        // the ray is at the point to within f32 rounding.
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

    /// Returns the origin for surfaces given by equations, offset by its own rounding error.
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
