//! Rays in f64, with the offsets that keep them off the surface that they leave and off the one that they end
//! on. Intersections are in `hierarchy`.

use glam::{DVec3, Vec3A};
use lumbre_rays::{Ray, offset_ray_origin};

/// A ray in the tracer's space. (What is called for every ray is inlined: a ray that is written to memory in pieces and
/// read back in others waits for the writes.)
#[derive(Clone, Copy, Debug)]
pub(crate) struct SpaceRay {
    /// Origin in metres, exactly on the surface that the ray leaves.
    pub origin: DVec3,
    /// Unit vector.
    pub direction: DVec3,
    /// The surface that it leaves, if it leaves one.
    departure: Option<Departure>,
}

/// The surface that a ray leaves.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Departure {
    /// Unit geometric normal, on the side that the ray goes to.
    side: DVec3,
    /// Largest coordinate of the surface that it leaves, to which rounding errors are relative.
    extent: f64,
    start: TriangleStart,
}

/// Where a ray starts for triangles, in f32. (`Vec3A` is copied and read in one piece.)
#[derive(Clone, Copy, Debug)]
struct TriangleStart {
    /// Offset from the surface that the ray leaves.
    origin: Vec3A,
    /// From there to the exact origin.
    back: Vec3A,
}

/// The origin of all rays that leave a point of a surface. What they have in common is computed once.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RayOrigin {
    position: DVec3,
    /// Of the rays to the side of the geometric normal.
    departure: Departure,
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
    #[inline]
    pub fn leaving(origin: DVec3, direction: DVec3, geometric: DVec3, extent: f64) -> Self {
        let side = if direction.dot(geometric) < 0.0 { -geometric } else { geometric };
        Self { origin, direction, departure: Some(Departure::new(origin, side, extent)) }
    }

    /// Returns the point at a distance.
    pub fn at(&self, distance: f64) -> DVec3 {
        self.origin + self.direction * distance
    }

    /// Returns the ray in f32 for triangles, whose corners are f32, with its origin offset from the surface
    /// that it leaves.
    #[inline]
    pub fn for_triangles(&self, farthest: f64) -> Ray {
        let (origin, direction) = (self.start().origin.into(), self.direction.as_vec3());
        Ray { origin, direction, t_min: 0.0, t_max: farthest as f32 }
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
        let TriangleStart { origin, back } = self.start();
        let distance = distance as f32;
        // Corrects the direction by the offset of the origin. It need not have unit length; after `distance`
        // the ray is at the point to within f32 rounding.
        let direction = self.direction.as_vec3a() + back / distance;
        let size = (origin + direction * distance).abs().max_element().max(distance);
        let t_max = (distance - ROUNDING as f32 * size).max(0.0);
        Ray { origin: origin.into(), direction: direction.into(), t_min: 0.0, t_max }
    }

    #[inline]
    fn start(&self) -> TriangleStart {
        self.departure.map_or_else(
            || TriangleStart::new(self.origin, self.origin.as_vec3a()),
            |departure| departure.start,
        )
    }

    /// Returns the origin for surfaces given by equations, offset by its own rounding error.
    pub fn exact_origin(&self) -> DVec3 {
        match self.departure {
            None => self.origin,
            Some(Departure { side, extent, .. }) => {
                let size = extent.max(self.origin.abs().max_element());
                self.origin + side * (EXACT_ERROR * size)
            }
        }
    }
}

impl Departure {
    #[inline]
    fn new(origin: DVec3, side: DVec3, extent: f64) -> Self {
        let offset = offset_ray_origin(origin.as_vec3(), side.as_vec3(), extent as f32);
        Self { side, extent, start: TriangleStart::new(origin, offset.into()) }
    }
}

impl TriangleStart {
    #[inline]
    fn new(exact: DVec3, origin: Vec3A) -> Self {
        Self { origin, back: (exact - origin.as_dvec3()).as_vec3a() }
    }
}

impl RayOrigin {
    /// Creates the origin at a point of a surface with this geometric normal and largest coordinate.
    #[inline]
    pub fn new(position: DVec3, geometric: DVec3, extent: f64) -> Self {
        Self { position, departure: Departure::new(position, geometric, extent) }
    }

    /// Returns the ray in a direction, to either side of the surface.
    #[inline]
    pub fn towards(&self, direction: DVec3) -> SpaceRay {
        let departure = match direction.dot(self.departure.side) < 0.0 {
            true => Departure::new(self.position, -self.departure.side, self.departure.extent),
            false => self.departure,
        };
        SpaceRay { origin: self.position, direction, departure: Some(departure) }
    }
}
