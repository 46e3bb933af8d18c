//! The first round of the gather: the same number of rays for every texel, or as many as there is time for. If there is
//! no time for one sample of each, one texel of each block of 2 x 2 stands for the others, and what has no time even for
//! that shows the light of its patch. Later rounds are planned in `rounds`.

use super::gather_sums::{GatherSums, UnguidedLight};
use super::patch_fallback::from_patches;
use super::radiance_cache::RadianceCache;
use crate::chunks::decide;
use crate::coverage::covered_texels::CoveredTexels;
use crate::coverage::footprint::open_texels;
use crate::monitor::BakeMonitor;
use crate::sample_allocation::SampleAllocation;
use crate::texel_index::CoveredTexel;
use crate::{BakeError, BakeOptions};

/// An evaluation takes about as much time as so many samples, per replicate, of every texel: 0.5 to 0.8 in the demo level,
/// at sixteen and at 64 texels per metre.
const SAMPLES_PER_EVALUATION: f64 = 0.8;
/// The sides of the blocks in which one texel may stand for the others, in texels.
const BLOCK: u32 = 2;
/// Estimated fraction of the stage's progress from now on that a round makes up.
pub(crate) const ROUND_PROGRESS: f32 = 0.7;
/// Estimated fraction of the stage's progress from now on that a first sample makes up, of one texel of each block or of
/// the others.
const BLOCKS_PROGRESS: f32 = 0.1;

/// Casts the `wanted` samples, which are the same number for each of their texels, or fewer if there is not the time.
/// Returns true if there was time for at least one sample of each.
///
/// # Errors
/// [`BakeError::Cancelled`].
pub(crate) fn cast_first_round(
    cache: &RadianceCache<'_>,
    texels: &CoveredTexels<'_>,
    wanted: Vec<SampleAllocation>,
    gathered: &mut [GatherSums],
    options: &BakeOptions,
    monitor: &mut BakeMonitor<'_>,
) -> Result<bool, BakeError> {
    let (list, seed) = (&texels.list, options.seed);
    let Some(&SampleAllocation { samples: most, .. }) = wanted.first() else { return Ok(true) };
    if options.time.is_none() {
        monitor.pass(ROUND_PROGRESS);
        return cache.cast(list, &wanted, gathered, seed, monitor);
    }
    // A sample of every texel is better than all samples in the first maps and none in the last; and first of one texel
    // of each block, for the same reason.
    let begun = monitor.seconds();
    let representatives = representatives(texels);
    let one_each = wanted.iter().map(|allocation| SampleAllocation { samples: 1, ..*allocation });
    let (first, rest): (Vec<_>, Vec<_>) =
        one_each.partition(|allocation| representatives[allocation.texel.place()] == allocation.texel);
    // How many samples of every wanted texel there is time for, and the evaluation that follows.
    let samples_left = |cast: usize, monitor: &BakeMonitor<'_>| {
        let seconds = (monitor.seconds() - begun).max(1e-6) * wanted.len() as f64 / cast.max(1) as f64;
        monitor.clock().seconds_left().map_or(f64::INFINITY, |left| left / seconds - SAMPLES_PER_EVALUATION)
    };
    monitor.pass(BLOCKS_PROGRESS);
    let mut in_time = cache.cast(list, &first, gathered, seed, monitor)?;
    if in_time {
        let has_time = samples_left(first.len(), monitor) >= rest.len() as f64 / wanted.len() as f64;
        monitor.pass(BLOCKS_PROGRESS);
        in_time = decide(monitor, has_time)? && cache.cast(list, &rest, gathered, seed, monitor)?;
    }
    if !in_time {
        copy_representatives(&representatives, gathered);
        from_patches(cache, list, gathered);
        return Ok(false);
    }
    let affordable = most.min(1 + samples_left(wanted.len(), monitor).max(0.0) as u32);
    let affordable = decide(monitor, affordable)?;
    let more = |allocation: &SampleAllocation| SampleAllocation { samples: affordable, ..*allocation };
    let more: Vec<_> = wanted.iter().filter(|_| affordable > 1).map(more).collect();
    monitor.pass(ROUND_PROGRESS);
    cache.cast(list, &more, gathered, seed, monitor)
}

/// For each texel, the first one of its block if that is open, and of the same chart and group; otherwise the texel
/// itself.
fn representatives(texels: &CoveredTexels<'_>) -> Vec<CoveredTexel> {
    let mut places = vec![None; texels.layout.texels];
    for (place, texel) in open_texels(&texels.list) {
        places[texel.index.place()] = Some(place);
    }
    let chart = |place: CoveredTexel| texels.charts[texels.list[place.place()].triangle as usize];
    CoveredTexel::all(texels.list.len())
        .map(|place| {
            let texel = &texels.list[place.place()];
            let map = &texels.layout.maps[texel.object as usize];
            let corner = map.texel(texel.x / BLOCK * BLOCK, texel.y / BLOCK * BLOCK);
            places[corner.place()].filter(|&corner| chart(corner) == chart(place)).unwrap_or(place)
        })
        .collect()
}

/// Gives every texel without samples those of its representative, if that has any.
fn copy_representatives(representatives: &[CoveredTexel], gathered: &mut [GatherSums]) {
    for (place, representative) in CoveredTexel::all(gathered.len()).zip(representatives) {
        if gathered[place.place()].samples == 0 {
            let sums = gathered[representative.place()];
            // They are not cast a second time, and are not the texel's own finds.
            gathered[place.place()] = GatherSums { rays: 0, unguided: UnguidedLight::NONE, ..sums };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_texel_without_samples_shows_those_of_its_block() {
        let sums = |samples: u32, rays: u64| GatherSums { samples, rays, ..GatherSums::default() };
        let mut gathered = vec![sums(1, 4), sums(0, 0), sums(2, 9), sums(0, 0)];
        let representatives = [0, 0, 0, 3].map(CoveredTexel);
        copy_representatives(&representatives, &mut gathered);
        assert_eq!(
            gathered.iter().map(|sums| (sums.samples, sums.rays)).collect::<Vec<_>>(),
            [(1, 4), (1, 0), (2, 9), (0, 0)]
        );
    }
}
