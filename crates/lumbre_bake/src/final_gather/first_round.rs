//! The first round of the gather: the same number of rays for every texel, or as many as there is time for. If there is
//! no time for one sample of each, one texel of each block of 2 x 2 stands for the others, and what has no time even for
//! that shows the light of its patch. Later rounds are planned in `rounds`.

use std::f32::consts::FRAC_1_SQRT_2;

use glam::{Vec2, Vec3};

use super::gather_sums::{GatherSums, UnguidedLight};
use super::patch_fallback::{from_patches, knows_nothing};
use super::radiance_cache::RadianceCache;
use crate::chunks::decide;
use crate::coverage::{CoveredTexels, Representatives};
use crate::denoise::replicates::{mean, variance};
use crate::monitor::BakeMonitor;
use crate::sample_allocation::SampleAllocation;
use crate::texel_index::CoveredTexel;
use crate::{BakeError, BakeOptions};

/// An evaluation takes about as much time as so many samples, per replicate, of every texel: 0.5 to 0.8 in the demo level,
/// at sixteen and at 64 texels per metre.
const SAMPLES_PER_EVALUATION: f64 = 0.8;
/// The sides of the blocks in which one texel may stand for the others, in texels.
const BLOCK_SIDE: u32 = 2;
/// Estimated fraction of the stage's progress from now on that a round makes up.
pub(crate) const ROUND_PROGRESS: f32 = 0.7;
/// The same for a first sample of one texel of each block, and for that of the others.
const BLOCKS_PROGRESS: f32 = 0.1;

/// Casts the `wanted` samples, which are the same number for each of their texels, or fewer if time is limited. Returns
/// false if the time was up before the texels had as many as there seemed to be time for.
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
    let representatives = monitor.run_interruptible(0.0, || Representatives::new(texels, BLOCK_SIDE))?;
    let begun = monitor.seconds();
    let one_each = wanted.iter().map(|allocation| SampleAllocation { samples: 1, ..*allocation });
    let (first, rest): (Vec<_>, Vec<_>) =
        one_each.partition(|allocation| representatives.represents_itself(allocation.texel));
    // How many samples of every wanted texel there is time for, besides the evaluation that follows, which is one of all
    // texels.
    let open = texels.open().count() as f64;
    let samples_of_evaluation = SAMPLES_PER_EVALUATION * open / wanted.len() as f64;
    let samples_left = |cast: usize, monitor: &BakeMonitor<'_>| {
        let seconds = (monitor.seconds() - begun).max(1e-6) * wanted.len() as f64 / cast.max(1) as f64;
        monitor.clock().seconds_left().map_or(f64::INFINITY, |left| left / seconds - samples_of_evaluation)
    };
    monitor.pass(BLOCKS_PROGRESS);
    if !cache.cast(list, &first, gathered, seed, monitor)? {
        // Single samples here and there would be dots among the light of patches.
        let is_replaced = |_, sums: &GatherSums| sums.samples == 0 || sums.rays > 0;
        from_patches(cache, texels, gathered, seed, is_replaced, monitor)?;
        return Ok(false);
    }
    let mut in_time = {
        let needed = rest.len() as f64 / wanted.len() as f64;
        let has_time = first.is_empty() || samples_left(first.len(), monitor) >= needed;
        let has_time = decide(monitor, has_time)?;
        monitor.pass(BLOCKS_PROGRESS);
        has_time && cache.cast(list, &rest, gathered, seed, monitor)?
    };
    if in_time {
        let affordable = (1.0 + samples_left(wanted.len(), monitor).max(0.0)).min(f64::from(most)) as u32;
        let affordable = decide(monitor, affordable)?;
        let more = |allocation: &SampleAllocation| SampleAllocation { samples: affordable, ..*allocation };
        let more: Vec<_> = wanted.iter().filter(|_| affordable > 1).map(more).collect();
        monitor.pass(ROUND_PROGRESS);
        in_time = cache.cast(list, &more, gathered, seed, monitor)?;
    }
    if !in_time {
        copy_representatives(representatives.list(), gathered);
        from_patches(cache, texels, gathered, seed, |_, sums| knows_nothing(sums), monitor)?;
    }
    Ok(in_time)
}

/// Gives every texel without samples those of its representative, if that has any. The error that is stated for it
/// includes the RMS difference between representatives two texels apart, beyond what is noise: no replicate shows by how
/// much the light differs from one texel to the next.
fn copy_representatives(representatives: &[CoveredTexel], gathered: &mut [GatherSums]) {
    let is_sampled = |place: CoveredTexel| gathered[place.place()].rays > 0;
    let own = CoveredTexel::all(gathered.len()).zip(representatives);
    let sampled = own.filter(|(place, representative)| place == *representative && is_sampled(*place));
    let estimates = sampled.map(|(place, _)| (place, gathered[place.place()].estimates()));
    let (mut squared_differences, mut squared_light) = (0.0, 0.0);
    let mut before: Option<(CoveredTexel, f64, f64)> = None;
    for (place, estimates) in estimates {
        let light = f64::from(mean(&estimates).element_sum()) / 3.0;
        let noise = f64::from(variance(&estimates).element_sum()) / 3.0;
        squared_light += light * light - noise;
        if let Some((_, other, other_noise)) = before.filter(|(other, ..)| other.0 + BLOCK_SIDE == place.0) {
            squared_differences += (light - other).powi(2) - noise - other_noise;
        }
        before = Some((place, light, noise));
    }
    let ratio = squared_differences.max(0.0) / squared_light;
    let relative_error = if ratio.is_finite() { ratio.min(1.0).sqrt() } else { 1.0 };
    for (place, representative) in CoveredTexel::all(gathered.len()).zip(representatives) {
        let sums = gathered[representative.place()];
        if gathered[place.place()].samples == 0 && sums.samples > 0 {
            let difference = (relative_error * f64::from(sums.total())) as f32;
            // Its rays, checks and discoveries are the representative's, and must not count twice.
            gathered[place.place()] = GatherSums {
                patch_errors: sums.patch_errors + Vec2::splat(FRAC_1_SQRT_2 * difference),
                rays: 0,
                checks: 0,
                differences: Vec3::ZERO,
                squared_differences: 0.0,
                unguided: UnguidedLight::default(),
                ..sums
            };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::denoise::REPLICATES;

    /// Of a texel whose four replicates have one sample each of this light.
    fn sums(light: f32) -> GatherSums {
        let unguided = UnguidedLight { light, ..UnguidedLight::default() };
        let sums = [Vec3::splat(light); REPLICATES];
        GatherSums { sums, samples: 1, rays: 4, checks: 1, unguided, ..GatherSums::default() }
    }

    #[test]
    fn a_texel_without_samples_shows_those_of_its_block() {
        let none = GatherSums::default();
        let mut gathered = vec![sums(3.0), none, sums(5.0), none, none];
        copy_representatives(&[0, 0, 2, 2, 4].map(CoveredTexel), &mut gathered);
        let shown: Vec<_> =
            gathered.iter().map(|sums| (sums.estimates()[0].x, sums.rays, sums.checks)).collect();
        assert_eq!(shown, [(3.0, 4, 1), (3.0, 0, 0), (5.0, 4, 1), (5.0, 0, 0), (0.0, 0, 0)]);
        assert_eq!(gathered[1].unguided.light, 0.0, "not found by this texel");
        // The two representatives differ by 2, where the root of the sum of squares is √34.
        let relative = f64::from(gathered[1].patch_error().length()) / 3.0;
        assert!((relative - 2.0 / 34f64.sqrt()).abs() < 1e-6, "{relative}");
        assert_eq!(gathered[0].patch_error(), Vec2::ZERO);
    }
}
