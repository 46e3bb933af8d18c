//! The triangles as shadow rays meet them: those that block every ray in one hierarchy, which is asked without a
//! question at each hit, and those that some rays pass, such as glass, masks and bulbs, in another.

use glam::Vec3;
use lumbre_rays::{Bvh, Ray};

/// The triangles of a scene that has some which rays may pass.
#[derive(Debug)]
pub(crate) struct Occluders {
    /// The triangles that block every ray.
    always: Bvh,
    /// The others.
    sometimes: Bvh,
    /// Index in the scene of each triangle of `sometimes`.
    scene_indices: Vec<u32>,
}

impl Occluders {
    /// Builds both hierarchies over the corners of all triangles of a scene; `None` if all of them always block, and
    /// one hierarchy is enough. `always_blocks` says which triangles do, by index.
    pub fn build(triangles: &[[Vec3; 3]], always_blocks: impl Fn(usize) -> bool) -> Option<Self> {
        let (always, sometimes): (Vec<usize>, Vec<usize>) =
            (0..triangles.len()).partition(|&index| always_blocks(index));
        let hierarchy = |indices: &[usize]| {
            let corners: Vec<[Vec3; 3]> = indices.iter().map(|&index| triangles[index]).collect();
            Bvh::build(&corners)
        };
        (!sometimes.is_empty()).then(|| Self {
            always: hierarchy(&always),
            sometimes: hierarchy(&sometimes),
            scene_indices: sometimes.iter().map(|&index| index as u32).collect(),
        })
    }

    /// Returns true if the ray hits a triangle that always blocks, or another that `blocks` takes by its index in
    /// the scene and the weights of its second and third corner.
    #[inline]
    pub fn block(&self, ray: &Ray, blocks: impl Fn(u32, f32, f32) -> bool) -> bool {
        let asked = |triangle: u32, u, v| blocks(self.scene_indices[triangle as usize], u, v);
        self.always.any_hit(ray) || self.sometimes.any_hit_filtered(ray, asked)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Numbers;

    fn point(numbers: &mut Numbers) -> Vec3 {
        Vec3::new(numbers.next() as f32, numbers.next() as f32, numbers.next() as f32)
    }

    /// Without `scene_indices`, or without either hierarchy, this fails.
    #[test]
    fn two_hierarchies_block_the_rays_that_one_blocks() {
        let mut numbers = Numbers::new(3, 0, 0);
        let mut triangle = || {
            let corner = point(&mut numbers);
            [corner, corner + 0.2 * point(&mut numbers), corner - 0.2 * point(&mut numbers)]
        };
        let triangles: Vec<[Vec3; 3]> = (0..60).map(|_| triangle()).collect();
        let always_blocks = |index: usize| index.is_multiple_of(3);
        // Of the others every second lets rays pass.
        let blocks = |triangle: u32| triangle.is_multiple_of(2);
        let one = Bvh::build(&triangles);
        let two = Occluders::build(&triangles, always_blocks).expect("some let rays pass");
        let (mut blocked, mut passed) = (0, 0);
        for _ in 0..4000 {
            let (from, to) = (point(&mut numbers), point(&mut numbers));
            let ray = Ray::segment(from, to);
            let expected = one.any_hit_filtered(&ray, |triangle, _, _| {
                always_blocks(triangle as usize) || blocks(triangle)
            });
            assert_eq!(two.block(&ray, |triangle, _, _| blocks(triangle)), expected);
            blocked += usize::from(expected);
            passed += usize::from(!expected && one.any_hit(&ray));
        }
        assert!(blocked > 300 && passed > 50, "{blocked} blocked, {passed} passed what may be passed");
        assert!(Occluders::build(&triangles, |_| true).is_none());
    }
}
