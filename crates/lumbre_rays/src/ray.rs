//! Rays: an origin, a direction and a range of distances. The offset that keeps a ray off the surface that it
//! leaves is in `ray_offset`.

use glam::Vec3;

/// A half-line or a segment, in the space of the triangles.
///
/// Distances are measured in units of `direction`, which need not be of unit length.
/// A ray with a non-finite origin, a zero or non-finite direction, or an empty or NaN range hits nothing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Where the ray starts, in metres.
    pub origin: Vec3,
    /// Direction of the ray; its length is the unit of every distance.
    pub direction: Vec3,
    /// Smallest distance that counts, inclusive; negative values are treated as 0.
    pub t_min: f32,
    /// Largest distance that counts, inclusive; may be infinite.
    pub t_max: f32,
}

impl Ray {
    /// A ray without end: distances in [0, infinity].
    pub fn new(origin: Vec3, direction: Vec3) -> Self {
        Self { origin, direction, t_min: 0.0, t_max: f32::INFINITY }
    }

    /// The segment between two points: distance 0 is `from`, distance 1 is `to`, both included.
    ///
    /// Offset both ends with [`offset_ray_origin`](crate::offset_ray_origin) where they lie on surfaces.
    pub fn segment(from: Vec3, to: Vec3) -> Self {
        Self { origin: from, direction: to - from, t_min: 0.0, t_max: 1.0 }
    }

    /// The same ray with its distances restricted to [`t_min`, `t_max`].
    pub fn with_range(self, t_min: f32, t_max: f32) -> Self {
        Self { t_min, t_max, ..self }
    }

    /// Returns the point at a distance.
    pub fn at(&self, distance: f32) -> Vec3 {
        self.origin + self.direction * distance
    }
}

/// The intersection of a ray with a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Index of the triangle in the list that the hierarchy was built from.
    pub triangle: u32,
    /// Distance along the ray, in units of its direction.
    pub distance: f32,
    /// Weights (u, v) of the second and third vertex, each in [0, 1]; the first has 1 - u - v.
    pub barycentric: (f32, f32),
    /// Whether the ray came from the side on which the vertices run clockwise.
    pub back_face: bool,
}

impl Hit {
    /// Returns the point that was hit, interpolated from the vertices of the triangle that was hit.
    ///
    /// It is more accurate than `Ray::at`, as its error does not grow with the distance.
    pub fn position(&self, triangle: &[Vec3; 3]) -> Vec3 {
        let (u, v) = (f64::from(self.barycentric.0), f64::from(self.barycentric.1));
        let [a, b, c] = triangle.map(|vertex| vertex.as_dvec3());
        (a * (1.0 - u - v) + b * u + c * v).as_vec3()
    }
}
