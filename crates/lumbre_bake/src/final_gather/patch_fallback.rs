//! Texels that had no time to gather, or too little: they show the patches' own solution, with an error that says how
//! rough that is. Not the gather.

use glam::{Vec2, Vec3};

use super::gather_sums::GatherSums;
use super::radiance_cache::RadianceCache;
use crate::BakeError;
use crate::chunks::in_chunks;
use crate::color::wide_channel_mean;
use crate::coverage::{CoveredTexels, Texel};
use crate::denoise::REPLICATES;
use crate::denoise::replicates::{mean, variance};
use crate::monitor::BakeMonitor;
use crate::sampling::hash;
use crate::scene::Side;
use crate::texel_index::CoveredTexel;

/// How many texels are compared with their patches, and the samples of each replicate that they gather for it.
const PROBED: usize = 2048;
const PROBE_SAMPLES: u32 = 2;
/// Fewer texels than this say nothing about the others.
const MIN_PROBED: usize = 256;
/// Estimated fraction of the stage's progress from now on.
const PROBE_PROGRESS: f32 = 0.1;

/// Where no more samples per replicate than this found only darkness, the patch says more than they do.
const FEW_SAMPLES: u32 = 3;

/// Whether a texel has gathered nothing, or nothing but darkness from few rays.
pub(crate) fn knows_nothing(sums: &GatherSums) -> bool {
    sums.samples <= FEW_SAMPLES && sums.sums.iter().all(|sum| *sum == Vec3::ZERO)
}

/// The gather's few samples give way to the patches where their noise exceeds the patches' error by this factor: noise is
/// smoothed, while the facets of patches catch the eye.
const MUCH_NOISIER: f64 = 2.0;

/// Whether the patches' light is much closer to the truth than what texels show that have gathered with so much noise (a
/// ratio of sums of squares: errors by light).
pub(crate) fn are_much_better(
    cache: &RadianceCache<'_>,
    texels: &CoveredTexels<'_>,
    squared_noise: f64,
    seed: u32,
    monitor: &mut BakeMonitor<'_>,
) -> Result<bool, BakeError> {
    Ok(squared_noise > (MUCH_NOISIER * error_of_patches(cache, texels, seed, monitor)?).powi(2))
}

/// Gives the irradiance of its patch to every open texel for whose sums `is_replaced` holds. The error stated for it is,
/// relative to the light, that of [`error_of_patches`].
pub(crate) fn from_patches(
    cache: &RadianceCache<'_>,
    texels: &CoveredTexels<'_>,
    gathered: &mut [GatherSums],
    seed: u32,
    is_replaced: impl Fn(CoveredTexel, &GatherSums) -> bool,
    monitor: &mut BakeMonitor<'_>,
) -> Result<(), BakeError> {
    let replaced: Vec<CoveredTexel> = texels
        .open()
        .map(|(texel, _)| texel)
        .filter(|&texel| is_replaced(texel, &gathered[texel.place()]))
        .collect();
    if replaced.is_empty() {
        return Ok(());
    }
    monitor.pass(PROBE_PROGRESS);
    let relative_error = error_of_patches(cache, texels, seed, monitor)?;
    for texel in replaced {
        let light = patch_light(cache, &texels.list[texel.place()]);
        let sums = &mut gathered[texel.place()];
        *sums = GatherSums {
            sums: [light; REPLICATES],
            samples: 1,
            rays: sums.rays,
            patch_errors: Vec2::X * REPLICATES as f32 * (relative_error * wide_channel_mean(light)) as f32,
            ..GatherSums::default()
        };
    }
    Ok(())
}

/// The irradiance of the patch that a texel lies on.
fn patch_light(cache: &RadianceCache<'_>, texel: &Texel) -> Vec3 {
    let Some(point) = texel.point(cache.scene, 0.5, 0.5) else { return Vec3::ZERO };
    let patch = cache.exchange.patches.at(point.triangle, Side::Front, point.at);
    patch.map_or(Vec3::ZERO, |patch| cache.exchange.indirect[patch.place()])
}

/// The RMS difference between patches and texels, plus one standard error of that, relative to the light: found by
/// gathering at a few texels all over the level, though the time is up. Where there are too few texels, it is all of the
/// light.
fn error_of_patches(
    cache: &RadianceCache<'_>,
    texels: &CoveredTexels<'_>,
    seed: u32,
    monitor: &mut BakeMonitor<'_>,
) -> Result<f64, BakeError> {
    let open = texels.open().count();
    if open < MIN_PROBED {
        return Ok(1.0);
    }
    // One of each run of texels, at a random place, as regular ones could keep in step with the rows of a map.
    let run = open.div_ceil(PROBED);
    let is_probed = |place: &usize| place % run == hash(seed ^ (place / run) as u32) as usize % run;
    let probed = texels.open().enumerate().filter(|(place, _)| is_probed(place));
    let probed: Vec<&Texel> = probed.map(|(_, (_, texel))| texel).collect();
    let gathered: Vec<GatherSums> = in_chunks(probed.len(), monitor, |place| {
        let mut sums = GatherSums::default();
        cache.gather(probed[place], &mut sums, PROBE_SAMPLES, seed);
        sums
    })?;
    let (mut squared_differences, mut scatter, mut squared_light) = (0.0f64, 0.0f64, 0.0);
    for (texel, sums) in probed.iter().zip(&gathered) {
        let estimates = sums.estimates();
        let mean = wide_channel_mean(mean(&estimates));
        // The part of the difference that is the texel's own noise is not the patch's error.
        let noise = f64::from(variance(&estimates).element_sum()) / 3.0;
        let squared_difference = (mean - wide_channel_mean(patch_light(cache, texel))).powi(2) - noise;
        squared_differences += squared_difference;
        scatter += squared_difference * squared_difference;
        squared_light += mean.powi(2) - noise;
    }
    // The noise of few rays may exceed the difference, which is then known only to within its standard error.
    let squared = (squared_differences.max(0.0) + scatter.sqrt()) / squared_light;
    Ok(if squared_light > 0.0 { squared.sqrt().min(1.0) } else { 1.0 })
}
