//! Nodes of eight children side by side, and the conservative slab test over them. The order in which children are
//! visited is in `visit_order`.
//!
//! Ize, "Robust BVH Ray Traversal", JCGT 2(2), 2013. The widening comes with the ray (`ray_setup`).

use fearless_simd::{Simd, f32x8, prelude::*};
use glam::Vec3;

use crate::ray_setup::RaySetup;

/// Child of a node's lane: another node or a block of triangles.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct ChildRef(pub u32);

impl ChildRef {
    const LEAF: u32 = 1 << 31;

    pub fn node(index: usize) -> Self {
        Self(index as u32)
    }

    pub fn block(index: usize) -> Self {
        Self(index as u32 | Self::LEAF)
    }

    /// Returns the block's index if this is a block.
    #[inline(always)]
    pub fn as_block(self) -> Option<usize> {
        (self.0 & Self::LEAF != 0).then_some((self.0 & !Self::LEAF) as usize)
    }
}

/// Relative widening of the distance at which a ray leaves a box. Entering and leaving distances each have two
/// roundings in the reciprocal and the product and one in the difference, 3 * 2^-24. With the rounding of the
/// widening itself that makes 7 * 2^-24; 8 are used (Ize 2013: 2 gamma(3)).
const SLAB_ERROR: f32 = 8.0 / (1 << 24) as f32;

/// Eight boxes, `planes[axis][side]` with side 0 the minimum, one box per lane.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub(crate) struct WideNode {
    planes: [[[f32; 8]; 2]; 3],
    pub children: [ChildRef; 8],
    /// One bit per lane, set if there is a child.
    taken: u32,
    /// One bit per lane, set if the child is a block.
    pub blocks: u32,
}

/// The ray's constants, broadcast to all lanes.
#[derive(Clone, Copy)]
pub(crate) struct NodeRay<S: Simd> {
    near_side: [usize; 3],
    near_origin: [f32x8<S>; 3],
    far_origin: [f32x8<S>; 3],
    reciprocal: [f32x8<S>; 3],
    t_min: f32x8<S>,
    simd: S,
}

impl<S: Simd> NodeRay<S> {
    #[inline(always)]
    pub fn new(simd: S, setup: &RaySetup) -> Self {
        Self {
            near_side: setup.near_side,
            near_origin: spread(simd, setup.near_origin),
            far_origin: spread(simd, setup.far_origin),
            reciprocal: spread(simd, setup.reciprocal),
            t_min: simd.splat_f32x8(setup.t_min),
            simd,
        }
    }

    /// Distances at which the ray meets the planes of an axis through which it enters.
    #[inline(always)]
    fn near(&self, planes: &[[f32; 8]; 2], axis: usize) -> f32x8<S> {
        let plane = f32x8::simd_from(self.simd, planes[self.near_side[axis] & 1]);
        (plane - self.near_origin[axis]) * self.reciprocal[axis]
    }

    /// Distances at which it meets those through which it leaves.
    #[inline(always)]
    fn far(&self, planes: &[[f32; 8]; 2], axis: usize) -> f32x8<S> {
        let plane = f32x8::simd_from(self.simd, planes[(self.near_side[axis] & 1) ^ 1]);
        (plane - self.far_origin[axis]) * self.reciprocal[axis]
    }
}

impl<S: Simd> NodeRay<S> {
    /// Returns those of the lanes entered at `enter` that are entered at or before `t_max`.
    #[inline(always)]
    pub fn reached(&self, enter: f32x8<S>, t_max: f32) -> u32 {
        let limit = self.simd.splat_f32x8(t_max * (1.0 + SLAB_ERROR));
        self.simd.to_bitmask_mask32x8(self.simd.simd_le_f32x8(enter, limit)) as u32
    }
}

/// Broadcasts each of three numbers to all lanes.
#[inline(always)]
pub(crate) fn spread<S: Simd>(simd: S, values: [f32; 3]) -> [f32x8<S>; 3] {
    [simd.splat_f32x8(values[0]), simd.splat_f32x8(values[1]), simd.splat_f32x8(values[2])]
}

impl WideNode {
    /// Creates a node from up to eight boxes and what they contain, by lane.
    pub fn new(lanes: &[Option<([Vec3; 2], ChildRef)>; 8]) -> Self {
        // The box of an empty lane is inverted: its near distance is +infinity, its far distance -infinity.
        let mut planes = [[[f32::INFINITY; 8], [f32::NEG_INFINITY; 8]]; 3];
        let (mut children, mut taken, mut blocks) = ([ChildRef::default(); 8], 0, 0);
        for (lane, content) in lanes.iter().enumerate() {
            let Some((bounds, child)) = content else { continue };
            children[lane] = *child;
            taken |= 1 << lane;
            blocks |= u32::from(child.as_block().is_some()) << lane;
            for (side, corner) in bounds.iter().enumerate() {
                for (axis, coordinate) in corner.to_array().into_iter().enumerate() {
                    planes[axis][side][lane] = coordinate;
                }
            }
        }
        Self { planes, children, taken, blocks }
    }

    /// Returns the lanes whose boxes the ray may enter within [t_min, `t_max`], and the distances at which it
    /// enters.
    #[inline(always)]
    pub fn intersect<S: Simd>(&self, ray: &NodeRay<S>, t_max: f32) -> (u32, f32x8<S>) {
        let simd = ray.simd;
        let [x, y, z] = &self.planes;
        let near = simd.max_f32x8(ray.near(x, 0), ray.near(y, 1));
        let enter = simd.max_f32x8(near, simd.max_f32x8(ray.near(z, 2), ray.t_min));
        let far = simd.min_f32x8(ray.far(x, 0), ray.far(y, 1));
        let leave = simd.min_f32x8(far, simd.min_f32x8(ray.far(z, 2), simd.splat_f32x8(t_max)));
        // Boxes behind the ray stay behind it: a negative distance becomes more negative.
        let leave = leave * simd.splat_f32x8(1.0 + SLAB_ERROR);
        let lanes = simd.to_bitmask_mask32x8(simd.simd_le_f32x8(enter, leave)) as u32;
        (lanes & self.taken, enter)
    }
}
