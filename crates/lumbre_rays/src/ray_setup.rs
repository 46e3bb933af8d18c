//! What is computed once per ray: the shear of the triangle test and the widened slabs of the box test.
//! Not the tests themselves: those are `triangle_block` and `wide_node`.

use std::ops::RangeInclusive;

use glam::Vec3;

use crate::Ray;
use crate::visit_order::octant;

/// Units in the last place by which the box test is widened, times the ray's reach into the scene.
///
/// Woop, Benthin, Wald 2013, section 4, bound the error of the sheared vertices by 5 * 2^-24; 8 leaves room for
/// the rounding of the widening itself.
const SHEAR_ERROR: f32 = 8.0 / (1 << 24) as f32;

/// The dominant axis and a component are this far apart at most; a smaller component moves the ray across the
/// whole scene by less than `SHEAR_ERROR` and would make 1/0.
const LARGEST_RATIO: f32 = (1u64 << 26) as f32;

/// Sizes of the direction for which no reciprocal leaves the normal numbers; what is shorter counts as zero.
const DIRECTION_RANGE: RangeInclusive<f32> = 1e-30..=1e30;

/// A ray in canonical units, prepared for traversal.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RaySetup {
    pub origin: [f32; 3],
    /// x, y, z of the sheared space; z is the axis along which the ray runs most.
    pub axis: [usize; 3],
    /// Shear of x and y, scale of z.
    pub shear: [f32; 3],
    /// Bit per axis: the direction is negative.
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
    /// `None` where the ray can hit nothing. `bounds` are the scene's, canonical.
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
        // An infinite distance is no hit, so that a determinant which underflows is none either.
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
        // The winding is kept by swapping x and y where z is mirrored.
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
