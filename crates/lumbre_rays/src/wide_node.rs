//! Nodes of four children side by side and the conservative slab test over them.
//!
//! Ize, "Robust BVH Ray Traversal", JCGT 2(2), 2013. The widening comes with the ray (`ray_setup`).
//! Not the order in which children are visited: that is `traversal`.

use glam::{Vec3, Vec4};

use crate::ray_setup::RaySetup;

/// What a lane of a node leads to: nothing, a node, or a block of triangles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct ChildRef(pub u32);

impl ChildRef {
    const LEAF: u32 = 1 << 31;
    pub const NONE: Self = Self(u32::MAX);

    pub fn node(index: usize) -> Self {
        Self(index as u32)
    }

    pub fn block(index: usize) -> Self {
        Self(index as u32 | Self::LEAF)
    }

    /// The block's index, if this is a block.
    #[inline(always)]
    pub fn as_block(self) -> Option<usize> {
        (self.0 & Self::LEAF != 0).then_some((self.0 & !Self::LEAF) as usize)
    }
}

/// Four boxes, `planes[axis][side]` with side 0 the minimum, one box per lane.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub(crate) struct WideNode {
    planes: [[Vec4; 2]; 3],
    pub children: [ChildRef; 4],
}

/// The ray's constants, spread over lanes.
pub(crate) struct NodeRay {
    near_side: [usize; 3],
    near_origin: [Vec4; 3],
    far_origin: [Vec4; 3],
    near_reciprocal: [Vec4; 3],
    far_reciprocal: [Vec4; 3],
    t_min: Vec4,
}

impl NodeRay {
    pub fn new(setup: &RaySetup) -> Self {
        Self {
            near_side: setup.near_side,
            near_origin: setup.near_origin.map(Vec4::splat),
            far_origin: setup.far_origin.map(Vec4::splat),
            near_reciprocal: setup.near_reciprocal.map(Vec4::splat),
            far_reciprocal: setup.far_reciprocal.map(Vec4::splat),
            t_min: Vec4::splat(setup.t_min),
        }
    }
}

impl WideNode {
    /// From up to four (box, child) pairs.
    pub fn new(children: &[([Vec3; 2], ChildRef)]) -> Self {
        // An empty lane's box is inside out: its near distance is +infinity, its far one -infinity.
        let mut planes = [[[f32::INFINITY; 4], [f32::NEG_INFINITY; 4]]; 3];
        let mut references = [ChildRef::NONE; 4];
        for (lane, (bounds, child)) in children.iter().take(4).enumerate() {
            references[lane] = *child;
            for (side, corner) in bounds.iter().enumerate() {
                for (axis, coordinate) in corner.to_array().into_iter().enumerate() {
                    planes[axis][side][lane] = coordinate;
                }
            }
        }
        Self { planes: planes.map(|axis| axis.map(Vec4::from_array)), children: references }
    }

    /// The lanes whose boxes the ray may enter in [t_min, `t_max`], and where it enters.
    #[inline(always)]
    pub fn intersect(&self, ray: &NodeRay, t_max: f32) -> (u32, [f32; 4]) {
        let near = |axis: usize| {
            (self.planes[axis][ray.near_side[axis] & 1] - ray.near_origin[axis]) * ray.near_reciprocal[axis]
        };
        let far = |axis: usize| {
            (self.planes[axis][(ray.near_side[axis] & 1) ^ 1] - ray.far_origin[axis])
                * ray.far_reciprocal[axis]
        };
        let enter = near(0).max(near(1)).max(near(2)).max(ray.t_min);
        let leave = far(0).min(far(1)).min(far(2)).min(Vec4::splat(t_max));
        (enter.cmple(leave).bitmask(), enter.to_array())
    }
}
