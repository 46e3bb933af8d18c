//! Counts for form factors by cosine rays: from points spread over each patch, in directions by the cosine, the patch that is hit first.
//! Stratified within each patch. Not what becomes of the counts: that is `form_factors`.

use super::patch_index::PatchIndex;
use super::patches::Patches;
use crate::BakeError;
use crate::chunks::in_chunks;
use crate::monitor::BakeMonitor;
use crate::radiosity::ray_counts::{PatchRayCounts, counted};
use crate::sampling::{Sequence, Stream, cosine_about, triangle_point};
use crate::scene::{BakeScene, SurfaceHit};

/// Least and most rays of a patch. The sequence has 65,536 points.
const RAYS: (f64, f64) = (MIN_RAYS as f64, 65_536.0);
pub(crate) const MIN_RAYS: u32 = 32;
/// Rays of a patch when the time is up.
const LATE_RAYS: u32 = 16;

/// About `rays` rays, in proportion to the patches' areas, and how many they were.
///
/// # Errors
/// [`BakeError::Cancelled`].
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
        .map(|patch| (rays as f64 * f64::from(patch.area) / total).round().clamp(RAYS.0, RAYS.1) as u32)
        .collect();
    let clock = monitor.clock();
    let cast = in_chunks(patches.list.len(), monitor, |index| {
        let count = if clock.is_over() { LATE_RAYS } else { counts[index] };
        of_patch(scene, patches, PatchIndex::new(index), count, seed)
    })?;
    let rays = cast.iter().flat_map(|cast| cast.count).map(u64::from).sum();
    Ok((cast, rays))
}

/// `count` rays of one patch; the even ones are one half, the odd ones the other.
pub(crate) fn of_patch(
    scene: &BakeScene,
    patches: &Patches,
    index: PatchIndex,
    count: u32,
    seed: u32,
) -> PatchRayCounts {
    let patch = &patches.list[index.place()];
    let triangle = &scene.triangles[patch.triangle as usize];
    let normal = triangle.side_normal(patch.side);
    let [p, q, r] = patches.corners(scene, patch);
    let sequence = Sequence::new(seed, Stream::FormFactors, index.0);
    let mut hits = [Vec::with_capacity(count as usize / 2 + 1), Vec::with_capacity(count as usize / 2)];
    let (mut inside, mut missed) = ([0; 2], [0; 2]);
    for ray in 0..count {
        let half = ray as usize % 2;
        let [a, b, c, d] = sequence.point(ray, 0);
        let (u, v) = triangle_point(a, b);
        let position = p + (q - p) * u + (r - p) * v;
        let origin = scene.off_surface(patch.triangle, patch.side, position);
        match scene.first_hit(origin, cosine_about(normal, c, d)) {
            SurfaceHit::Lit { triangle, side, at, .. } => {
                hits[half].extend(patches.at(triangle, side, at).filter(|&other| other != index));
            }
            SurfaceHit::Inside => inside[half] += 1,
            SurfaceHit::None => missed[half] += 1,
            SurfaceHit::Back => {}
        }
    }
    PatchRayCounts { hits: hits.map(counted), inside, missed, count: [count.div_ceil(2), count / 2] }
}
