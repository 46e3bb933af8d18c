//! The bounding volume hierarchy and its queries: closest hit and any hit. How the tree is built is in `build`.

use fearless_simd::{Level, Simd, dispatch};
use glam::Vec3;

use crate::build::build;
use crate::canonical_scale::CanonicalScale;
use crate::ray_setup::RaySetup;
use crate::wide_tree::WideTree;
use crate::{Hit, Ray};

/// A hierarchy over triangles. It is immutable once built and can be shared freely between threads.
///
/// Scaling triangles and rays by a power of two leaves every result bit-identical (with distances scaled exactly).
#[derive(Clone, Debug)]
pub struct Bvh {
    tree: WideTree,
    scale: CanonicalScale,
    /// Canonical corners of the bounding box of all triangles.
    bounds: [Vec3; 2],
    skipped: Vec<u32>,
    /// The instruction sets of this machine; the results are bit-identical on all of them.
    level: Level,
}

impl Bvh {
    /// Builds a hierarchy over triangles in metres, counter-clockwise on their front; a hit refers to a triangle by
    /// its index in this list.
    ///
    /// Triangles with a NaN or infinite coordinate or without area cannot be hit by any ray; they are left out and
    /// listed by [`skipped`](Self::skipped). An empty list gives a hierarchy that nothing hits. At most 2^29
    /// triangles are kept; those after are listed as skipped.
    pub fn build(triangles: &[[Vec3; 3]]) -> Self {
        const MAX_TRIANGLES: usize = 1 << 29;
        let (mut kept, mut skipped) = (Vec::with_capacity(triangles.len()), Vec::new());
        let mut largest = 0.0f32;
        for (index, triangle) in triangles.iter().enumerate() {
            let index = u32::try_from(index).unwrap_or(u32::MAX);
            if has_area(triangle) && kept.len() < MAX_TRIANGLES {
                kept.push((index, *triangle));
                largest = triangle.iter().fold(largest, |size, vertex| size.max(vertex.abs().max_element()));
            } else {
                skipped.push(index);
            }
        }
        let scale = CanonicalScale::for_largest(largest);
        let mut bounds = [Vec3::INFINITY, Vec3::NEG_INFINITY];
        for (_, triangle) in &mut kept {
            *triangle = triangle.map(|vertex| scale.canonical(vertex));
            for &vertex in triangle.iter() {
                bounds = [bounds[0].min(vertex), bounds[1].max(vertex)];
            }
        }
        if kept.is_empty() {
            bounds = [Vec3::ZERO; 2];
        }
        Self { tree: build(&kept), scale, bounds, skipped, level: Level::new() }
    }

    /// Indices of the triangles that were left out, in ascending order.
    pub fn skipped(&self) -> &[u32] {
        &self.skipped
    }

    /// The two corners of the bounding box of all triangles, in metres; both zero if there are none.
    pub fn bounds(&self) -> [Vec3; 2] {
        self.bounds.map(|corner| corner * self.scale.to_world)
    }

    /// Returns the nearest triangle within the ray's range; of several at the same distance, the one with the
    /// lowest index.
    pub fn closest_hit(&self, ray: &Ray) -> Option<Hit> {
        self.closest_hit_filtered(ray, |_, _, _| true)
    }

    /// Returns the nearest triangle for which `accept(triangle, u, v)` returns true, for alpha masks and one-sided
    /// surfaces.
    ///
    /// `accept` is called in no particular order, and also for hits that turn out not to be the nearest.
    pub fn closest_hit_filtered(&self, ray: &Ray, accept: impl Fn(u32, f32, f32) -> bool) -> Option<Hit> {
        self.trace::<false>(ray, accept)
    }

    /// Returns true if there is any triangle within the ray's range, for shadow rays.
    pub fn any_hit(&self, ray: &Ray) -> bool {
        self.any_hit_filtered(ray, |_, _, _| true)
    }

    /// Returns true if any triangle for which `accept(triangle, u, v)` returns true is within the ray's range.
    pub fn any_hit_filtered(&self, ray: &Ray, accept: impl Fn(u32, f32, f32) -> bool) -> bool {
        self.trace::<true>(ray, accept).is_some()
    }

    #[inline]
    fn trace<const ANY: bool>(&self, ray: &Ray, accept: impl Fn(u32, f32, f32) -> bool) -> Option<Hit> {
        #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
        if let Some(simd) = self.level.as_avx2() {
            return simd.vectorize(
                #[inline(always)]
                || self.trace_with::<ANY, _>(simd, ray, accept),
            );
        }
        dispatch!(Level::baseline(), simd => self.trace_with::<ANY, _>(simd, ray, accept))
    }

    #[inline(always)]
    fn trace_with<const ANY: bool, S: Simd>(
        &self,
        simd: S,
        ray: &Ray,
        accept: impl Fn(u32, f32, f32) -> bool,
    ) -> Option<Hit> {
        let setup = RaySetup::new(ray, self.scale.to_canonical, &self.bounds)?;
        let hit = self.tree.trace::<ANY, _, _>(simd, &setup, accept)?;
        Some(Hit { distance: hit.distance * self.scale.to_world, ..hit })
    }
}

/// Returns true if the triangle is finite and its normal is not exactly zero.
fn has_area(triangle: &[Vec3; 3]) -> bool {
    let [a, b, c] = triangle.map(|vertex| vertex.as_dvec3());
    // In f64 the differences are exact or nearly so, and products of numbers in the range of f32 neither overflow
    // nor underflow to zero.
    let normal = (b - a).cross(c - a);
    triangle.iter().all(|vertex| vertex.is_finite()) && normal.length_squared() > 0.0
}

#[cfg(test)]
mod tests {
    use super::*;

    /// SplitMix64, in [-1, 1).
    fn random(state: &mut u64) -> f32 {
        *state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = *state;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 40) as f32 / (1 << 23) as f32 - 1.0
    }

    fn point(state: &mut u64) -> Vec3 {
        Vec3::new(random(state), random(state), random(state))
    }

    fn soup(state: &mut u64) -> Vec<[Vec3; 3]> {
        (0..500)
            .map(|_| {
                let centre = point(state);
                [(); 3].map(|()| centre + 0.2 * point(state))
            })
            .collect()
    }

    /// Both hierarchies must give bit-identical results, and not only misses.
    fn assert_same(a: &Bvh, b: &Bvh, triangles: &[[Vec3; 3]]) {
        let (mut state, mut hits) = (7, 0);
        for i in 0..20_000 {
            let origin = point(&mut state);
            // Every other ray goes to a vertex or along an axis, where the exact edge functions decide.
            let direction = match i % 4 {
                0 => triangles[i % 500][i % 3] - origin,
                1 => Vec3::AXES[i % 3],
                _ => point(&mut state),
            };
            let ray = Ray::new(origin, direction);
            let hit = a.closest_hit(&ray);
            assert_eq!(hit, b.closest_hit(&ray));
            assert_eq!(a.any_hit(&ray), b.any_hit(&ray));
            hits += usize::from(hit.is_some());
        }
        assert!(hits > 5_000, "only {hits} of 20,000 rays hit");
    }

    #[test]
    fn every_set_of_instructions_computes_the_same_bits() {
        let triangles = soup(&mut 3);
        let best = Bvh::build(&triangles);
        let baseline = Bvh { level: Level::baseline(), ..best.clone() };
        assert_same(&best, &baseline, &triangles);
    }

    #[test]
    fn the_stack_of_a_deep_tree_answers_as_the_usual_one() {
        let triangles = soup(&mut 5);
        let usual = Bvh::build(&triangles);
        assert!(usual.tree.depth > 2);
        let mut deep = usual.clone();
        deep.tree.depth = 100;
        assert_same(&usual, &deep, &triangles);
    }
}
