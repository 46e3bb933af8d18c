//! Counts for form factors by cosine-distributed rays: they start at points spread over each patch, stratified within
//! it, and count the patch that they hit first. The counts become form factors in `form_factors`.

use super::patch_index::PatchIndex;
use super::patches::Patches;
use super::ray_counts::{PatchRayCounts, counted};
use crate::BakeError;
use crate::chunks::in_chunks;
use crate::monitor::BakeMonitor;
use crate::sampling::{Sequence, Stream, cosine_about};
use crate::scene::{BakeScene, SurfaceHit};

/// Fewest and most rays per patch. The sequence has 65,536 points.
pub(crate) const MIN_RAYS: u32 = 32;
const MAX_RAYS: u32 = 65_536;
/// Rays per patch once the time is up.
const LATE_RAYS: u32 = 16;

/// Casts about `rays` rays, in proportion to the patches' areas. Returns the counts per patch, and the number of rays.
pub(crate) fn cast(
    scene: &BakeScene,
    patches: &Patches,
    rays: usize,
    seed: u32,
    monitor: &mut BakeMonitor<'_>,
) -> Result<(Vec<PatchRayCounts>, u64), BakeError> {
    let total: f64 = patches.list.iter().map(|patch| f64::from(patch.area)).sum();
    let counts: Vec<u32> = patches
        .list
        .iter()
        .map(|patch| {
            (rays as f64 * f64::from(patch.area) / total)
                .round()
                .clamp(f64::from(MIN_RAYS), f64::from(MAX_RAYS)) as u32
        })
        .collect();
    let clock = monitor.clock();
    let cast = in_chunks(patches.list.len(), monitor, |index| {
        let count = if clock.is_over() { LATE_RAYS } else { counts[index] };
        cast_from_patch(scene, patches, PatchIndex::new(index), count, seed)
    })?;
    let rays = cast.iter().flat_map(|cast| cast.count).map(u64::from).sum();
    Ok((cast, rays))
}

/// Casts `count` rays from one patch; the even ones are one half, the odd ones the other.
pub(crate) fn cast_from_patch(
    scene: &BakeScene,
    patches: &Patches,
    index: PatchIndex,
    count: u32,
    seed: u32,
) -> PatchRayCounts {
    let patch = &patches.list[index.place()];
    let sequence = Sequence::new(seed, Stream::FormFactors, index.0);
    let mut hits = [Vec::with_capacity(count as usize / 2 + 1), Vec::with_capacity(count as usize / 2)];
    let (mut inside, mut missed) = ([0; 2], [0; 2]);
    for ray in 0..count {
        let half = ray as usize % 2;
        let [a, b, c, d] = sequence.point(ray, 0);
        let (face, (u, v)) = patches.point(patch, [a, b]);
        let triangle = &scene.triangles[face as usize];
        let origin = scene.off_surface(face, patch.side, triangle.position(u, v));
        match scene.first_hit(origin, cosine_about(triangle.side_normal(patch.side), c, d)) {
            SurfaceHit::Lit { triangle, side, at, .. } => {
                let is_other = |&hit: &PatchIndex| hit != index || patches.sees_itself(index);
                hits[half].extend(patches.at(triangle, side, at).filter(is_other));
            }
            SurfaceHit::Inside => inside[half] += 1,
            SurfaceHit::None => missed[half] += 1,
            SurfaceHit::Back => {}
        }
    }
    PatchRayCounts { hits: hits.map(counted), inside, missed, count: [count.div_ceil(2), count / 2] }
}
