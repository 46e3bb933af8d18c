//! What is computed once per ray: the shear of the triangle test and the widened slabs of the box test. The tests
//! are in `triangle_block` and `wide_node`.

use std::ops::RangeInclusive;

use glam::Vec3;

use crate::Ray;
use crate::visit_order::octant;

/// How far the box test is widened, relative to the ray's reach into the scene.
///
/// Woop, Benthin, Wald 2013, section 4, bound the error of the sheared vertices by 5 * 2^-24; 8 leaves room for the
/// rounding of the widening itself.
const SHEAR_ERROR: f32 = 8.0 / (1 << 24) as f32;

/// Largest ratio of the dominant component of a direction to another. A smaller component moves the ray by less
/// than `SHEAR_ERROR` across the whole scene, and its reciprocal could be infinite.
const LARGEST_RATIO: f32 = (1u64 << 26) as f32;

/// Range of the dominant component for which all reciprocals are normal numbers; a shorter direction counts as
/// zero.
const DIRECTION_RANGE: RangeInclusive<f32> = 1e-30..=1e30;

/// A ray in canonical units, prepared for traversal.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RaySetup {
    pub origin: [f32; 3],
    /// Axes that become x, y, z of the sheared space; z is the dominant axis of the ray.
    pub axis: [usize; 3],
    /// Shear of x and y, and scale of z.
    pub shear: [f32; 3],
    /// One bit per axis, set if the direction is negative.
    pub octant: u32,
    /// Index (0 = minimum, 1 = maximum) of the plane entered first, per axis.
    pub near_side: [usize; 3],
    pub near_origin: [f32; 3],
    pub far_origin: [f32; 3],
    pub reciprocal: [f32; 3],
    pub t_min: f32,
    pub t_max: f32,
}

impl RaySetup {
    /// Returns `None` if the ray cannot hit anything. `bounds` are the scene's, in canonical units.
    #[inline(always)]
    pub fn new(ray: &Ray, to_canonical: f32, bounds: &[Vec3; 2]) -> Option<Self> {
        let origin = ray.origin * to_canonical;
        let direction = ray.direction.to_array();
        let size = ray.direction.abs();
        let z = if size.x >= size.y {
            if size.x >= size.z { 0 } else { 2 }
        } else if size.y >= size.z {
            1
        } else {
            2
        };
        let dominant = direction[z];
        let reciprocal_z = 1.0 / dominant;
        let t_min = (ray.t_min * to_canonical).max(0.0);
        // An infinite distance is not a hit, which rules out those of a determinant that underflows.
        let t_max = ray.t_max * to_canonical;
        let accepted = origin.is_finite()
            && ray.direction.is_finite()
            && DIRECTION_RANGE.contains(&dominant.abs())
            && !ray.t_min.is_nan()
            && t_min <= t_max.min(f32::MAX)
            && !t_max.is_nan();
        if !accepted {
            return None;
        }
        // Where z is mirrored, x and y are swapped to keep the winding.
        let (x, y) = match (z, dominant < 0.0) {
            (0, false) => (1, 2),
            (0, true) => (2, 1),
            (1, false) => (2, 0),
            (1, true) => (0, 2),
            (_, false) => (0, 1),
            (_, true) => (1, 0),
        };
        let shear = [direction[x] * reciprocal_z, direction[y] * reciprocal_z, reciprocal_z];
        let reach = (origin - bounds[0]).abs().max((origin - bounds[1]).abs());
        let error = SHEAR_ERROR * (reach + reach[z]);
        let towards = error.copysign(ray.direction);
        let largest_reciprocal = reciprocal_z.abs() * LARGEST_RATIO;
        let reciprocal = size.recip().min(Vec3::splat(largest_reciprocal)).copysign(ray.direction);
        let octant = octant(ray.direction);
        Some(Self {
            origin: origin.to_array(),
            axis: [x, y, z],
            shear,
            octant,
            near_side: [0, 1, 2].map(|axis| (octant >> axis & 1) as usize),
            near_origin: (origin + towards).to_array(),
            far_origin: (origin - towards).to_array(),
            reciprocal: reciprocal.to_array(),
            t_min,
            t_max: t_max.min(f32::MAX),
        })
    }
}
