//! Eight triangles side by side, and the watertight ray/triangle test over them.
//!
//! Woop, Benthin, Wald, "Watertight Ray/Triangle Intersection", JCGT 2(1), 2013. Two triangles that share an edge
//! compute the same edge function with opposite signs, so that no ray passes between them. Products are never fused
//! with sums, so that every machine computes the same bits.

use fearless_simd::{Simd, f32x8, prelude::*};
use glam::Vec3;

use crate::ray_setup::RaySetup;
use crate::wide_node::spread;

/// Up to eight triangles, `vertices[vertex][axis]`, one per lane. Lanes without a triangle are NaN, which fails
/// every comparison.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub(crate) struct TriangleBlock {
    vertices: [[[f32; 8]; 3]; 3],
    pub ids: [u32; 8],
}

impl TriangleBlock {
    /// Largest number of triangles in a block.
    pub const SIZE: usize = 8;
}

/// The lanes of a block that were hit, and the values of all lanes.
pub(crate) struct BlockHits {
    pub lanes: u32,
    pub distance: [f32; 8],
    pub u: [f32; 8],
    pub v: [f32; 8],
    /// One bit per lane, set if the triangle was hit from its back.
    pub back: u32,
}

/// The ray's constants, broadcast to all lanes.
#[derive(Clone, Copy)]
pub(crate) struct BlockRay<S: Simd> {
    origin: [f32x8<S>; 3],
    shear: [f32x8<S>; 3],
    axis: [usize; 3],
    t_min: f32x8<S>,
    simd: S,
}

impl<S: Simd> BlockRay<S> {
    #[inline(always)]
    pub fn new(simd: S, setup: &RaySetup) -> Self {
        let [x, y, z] = setup.axis;
        Self {
            origin: spread(simd, [setup.origin[x], setup.origin[y], setup.origin[z]]),
            shear: spread(simd, setup.shear),
            axis: setup.axis,
            t_min: simd.splat_f32x8(setup.t_min),
            simd,
        }
    }

    /// Transforms vertices to the ray's space, where the ray runs along z from the origin.
    #[inline(always)]
    fn shear(&self, vertex: &[[f32; 8]; 3]) -> [f32x8<S>; 3] {
        let [x, y, z] = self.axis;
        let depth = f32x8::simd_from(self.simd, vertex[z.min(2)]) - self.origin[2];
        [
            f32x8::simd_from(self.simd, vertex[x.min(2)]) - self.origin[0] - self.shear[0] * depth,
            f32x8::simd_from(self.simd, vertex[y.min(2)]) - self.origin[1] - self.shear[1] * depth,
            depth,
        ]
    }
}

impl TriangleBlock {
    /// Creates a block of up to eight (index, canonical triangle) pairs.
    pub fn new(triangles: &[(u32, [Vec3; 3])]) -> Self {
        let mut vertices = [[[f32::NAN; 8]; 3]; 3];
        let mut ids = [u32::MAX; 8];
        for (lane, (id, triangle)) in triangles.iter().take(Self::SIZE).enumerate() {
            ids[lane] = *id;
            for (vertex, position) in triangle.iter().enumerate() {
                for (axis, coordinate) in position.to_array().into_iter().enumerate() {
                    vertices[vertex][axis][lane] = coordinate;
                }
            }
        }
        Self { vertices, ids }
    }

    /// Tests all eight lanes. Distances in [t_min, `t_max`] count, inclusive at both ends. Returns `None` if no
    /// lane is hit.
    #[inline(always)]
    pub fn intersect<S: Simd>(&self, ray: &BlockRay<S>, t_max: f32) -> Option<BlockHits> {
        let simd = ray.simd;
        let [ax, ay, az] = ray.shear(&self.vertices[0]);
        let [bx, by, bz] = ray.shear(&self.vertices[1]);
        let [cx, cy, cz] = ray.shear(&self.vertices[2]);
        let mut u = cx * by - cy * bx;
        let mut v = ax * cy - ay * cx;
        let mut w = bx * ay - by * ax;
        let zero = simd.splat_f32x8(0.0);
        let vanish = simd.simd_eq_f32x8(u, zero) | simd.simd_eq_f32x8(v, zero) | simd.simd_eq_f32x8(w, zero);
        if simd.any_true_mask32x8(vanish) {
            u = f32x8::simd_from(simd, edge_function(&cx, &by, &cy, &bx));
            v = f32x8::simd_from(simd, edge_function(&ax, &cy, &ay, &cx));
            w = f32x8::simd_from(simd, edge_function(&bx, &ay, &by, &ax));
        }
        let smallest = simd.min_f32x8(simd.min_f32x8(u, v), w);
        let largest = simd.max_f32x8(simd.max_f32x8(u, v), w);
        let determinant = u + v + w;
        let inside = simd.simd_ge_f32x8(smallest, zero) | simd.simd_le_f32x8(largest, zero);
        // A NaN determinant passes this test, but its lane fails the comparisons with zero above.
        let inside = inside & !simd.simd_eq_f32x8(determinant, zero);
        if !simd.any_true_mask32x8(inside) {
            return None;
        }
        let reciprocal = simd.splat_f32x8(1.0) / determinant;
        let distance = (u * az + v * bz + w * cz) * ray.shear[2] * reciprocal;
        let in_range =
            simd.simd_ge_f32x8(distance, ray.t_min) & simd.simd_le_f32x8(distance, simd.splat_f32x8(t_max));
        let lanes = simd.to_bitmask_mask32x8(inside & in_range) as u32;
        if lanes == 0 {
            return None;
        }
        Some(BlockHits {
            lanes,
            distance: *distance,
            u: *(v * reciprocal),
            v: *(w * reciprocal),
            back: simd.to_bitmask_mask32x8(simd.simd_lt_f32x8(determinant, zero)) as u32,
        })
    }
}

/// Returns a * b - c * d with the exact sign: products of two f32 are exact in f64.
#[cold]
fn edge_function(a: &[f32; 8], b: &[f32; 8], c: &[f32; 8], d: &[f32; 8]) -> [f32; 8] {
    std::array::from_fn(|i| {
        let [a, b, c, d] = [a[i], b[i], c[i], d[i]].map(f64::from);
        (a * b - c * d) as f32
    })
}
