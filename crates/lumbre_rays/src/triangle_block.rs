//! Four triangles side by side and the watertight ray/triangle test over them.
//!
//! Woop, Benthin, Wald, "Watertight Ray/Triangle Intersection", JCGT 2(1), 2013. Two triangles that share an edge
//! compute the same edge function with opposite signs, so no ray passes between them. Not a shading lookup.

use glam::{Vec3, Vec4};

use crate::ray_setup::RaySetup;

/// Up to four triangles, `vertices[vertex][axis]`, one per lane. Lanes without a triangle hold NaN, which no
/// comparison accepts.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub(crate) struct TriangleBlock {
    vertices: [[Vec4; 3]; 3],
    pub ids: [u32; 4],
}

/// What the test found in a block: the lanes that hit, and their values.
pub(crate) struct BlockHits {
    pub lanes: u32,
    pub distance: [f32; 4],
    pub u: [f32; 4],
    pub v: [f32; 4],
    /// Bit per lane: seen from the back.
    pub back: u32,
}

/// The ray's constants, spread over lanes.
pub(crate) struct BlockRay {
    origin: [Vec4; 3],
    shear: [Vec4; 3],
    axis: [usize; 3],
    t_min: Vec4,
}

impl BlockRay {
    pub fn new(setup: &RaySetup) -> Self {
        Self {
            origin: setup.axis.map(|axis| Vec4::splat(setup.origin[axis])),
            shear: setup.shear.map(Vec4::splat),
            axis: setup.axis,
            t_min: Vec4::splat(setup.t_min),
        }
    }
}

impl TriangleBlock {
    /// From up to four (index, canonical triangle) pairs.
    pub fn new(triangles: &[(u32, [Vec3; 3])]) -> Self {
        let mut lanes = [[[f32::NAN; 4]; 3]; 3];
        let mut ids = [u32::MAX; 4];
        for (lane, (id, triangle)) in triangles.iter().take(4).enumerate() {
            ids[lane] = *id;
            for (vertex, position) in triangle.iter().enumerate() {
                for (axis, coordinate) in position.to_array().into_iter().enumerate() {
                    lanes[vertex][axis][lane] = coordinate;
                }
            }
        }
        Self { vertices: lanes.map(|vertex| vertex.map(Vec4::from_array)), ids }
    }

    /// Tests the four lanes; distances in [t_min, `t_max`] count, both included.
    #[inline(always)]
    pub fn intersect(&self, ray: &BlockRay, t_max: f32) -> BlockHits {
        let [x, y, z] = ray.axis;
        let sheared = |vertex: &[Vec4; 3]| {
            let depth = vertex[z] - ray.origin[2];
            (
                vertex[x] - ray.origin[0] - ray.shear[0] * depth,
                vertex[y] - ray.origin[1] - ray.shear[1] * depth,
                depth,
            )
        };
        let (ax, ay, az) = sheared(&self.vertices[0]);
        let (bx, by, bz) = sheared(&self.vertices[1]);
        let (cx, cy, cz) = sheared(&self.vertices[2]);
        let mut u = cx * by - cy * bx;
        let mut v = ax * cy - ay * cx;
        let mut w = bx * ay - by * ax;
        let zero = Vec4::ZERO;
        if (u.cmpeq(zero) | v.cmpeq(zero) | w.cmpeq(zero)).any() {
            u = edge_function(cx, by, cy, bx);
            v = edge_function(ax, cy, ay, cx);
            w = edge_function(bx, ay, by, ax);
        }
        let smallest = u.min(v).min(w);
        let largest = u.max(v).max(w);
        let determinant = u + v + w;
        let inside = smallest.cmpge(zero) | largest.cmple(zero);
        let mut lanes = (inside & determinant.cmpne(zero)).bitmask();
        if lanes == 0 {
            return BlockHits { lanes, distance: [0.0; 4], u: [0.0; 4], v: [0.0; 4], back: 0 };
        }
        let reciprocal = Vec4::ONE / determinant;
        let distance = (u * az + v * bz + w * cz) * ray.shear[2] * reciprocal;
        lanes &= (distance.cmpge(ray.t_min) & distance.cmple(Vec4::splat(t_max))).bitmask();
        BlockHits {
            lanes,
            distance: distance.to_array(),
            u: (v * reciprocal).to_array(),
            v: (w * reciprocal).to_array(),
            back: determinant.cmplt(zero).bitmask(),
        }
    }
}

/// a * b - c * d with the exact sign: products of two f32 are exact in f64.
#[cold]
fn edge_function(a: Vec4, b: Vec4, c: Vec4, d: Vec4) -> Vec4 {
    (a.as_dvec4() * b.as_dvec4() - c.as_dvec4() * d.as_dvec4()).as_vec4()
}
