//! Rounds of the final gather: every texel first, then those whose error is still too large, until the error asked for is
//! reached, the time is up or the quality's most rays are cast.

use glam::Vec3;
use rayon::prelude::*;

use super::allocation::{Allotment, allot_within};
use super::error_estimate::{GatherErrors, PatchBias, SquaredErrors, patch_bias, spread, variances};
use super::footprint::Texel;
use super::gather::{Gathered, REPLICATES, RadianceCache};
use super::kept::Kept;
use super::late::from_patches;
use super::local_light::LocalLight;
use super::smooth::{Estimates, mean, smooth};
use super::surroundings::Surroundings;
use super::texel_radiance::GatheredLight;
use crate::chunks::in_chunks_in_time;
use crate::progress::Watch;
use crate::transport::direct::Direct;
use crate::{BakeError, BakeOptions, BakeReport, Ended, ErrorAtTime};

/// Share of the squared error below which the gather's own noise is not worth more rays.
const WORTH_RAYS: f64 = 0.1;
/// A round's usual share of the time that this one and those after it take.
const PASS: f32 = 0.7;
/// Of the squared error asked for, what a round aims at: a good deal less than what ends the rounds. Its estimates are rough, and another round would
/// smooth everything once more.
const AIM: f64 = 0.55;
/// Order of the variance's fall with the samples: between random ones (1) and Sobol's of something smooth (3).
const ORDER: f64 = 1.25;
/// The most by which a round lowers the part that rays leave: the first estimates are rough.
const MOST_OF_A_ROUND: f64 = 8.0;
/// Share of the samples so far below which a round is not worth its smoothing.
const LEAST_ROUND: f64 = 0.15;
/// A round that leaves more than this of the squared error that it was to lower was the last.
const STALLED: f64 = 0.95;

/// What the rounds have found, for every covered texel.
#[derive(Default)]
pub(crate) struct Bounced {
    /// Irradiance by bounces.
    pub light: Vec<Vec3>,
    /// Of what the map then holds.
    pub variances: SquaredErrors,
    pub gathered: Vec<Gathered>,
}

/// The covered texels, as the gather needs them.
#[derive(Clone, Copy)]
pub(crate) struct Receivers<'a> {
    pub texels: &'a [Texel],
    pub charts: &'a [u32],
    pub direct: &'a [Direct],
    /// The light around them, beside which their errors count.
    pub local: &'a LocalLight,
    /// Of a former bake.
    pub kept: Option<&'a Kept>,
}

/// Gathers the light by bounces, beginning with what is kept of a former bake.
pub(crate) fn gather(
    cache: &RadianceCache<'_>,
    receivers: Receivers<'_>,
    options: &BakeOptions,
    watch: &mut Watch<'_>,
    report: &mut BakeReport,
) -> Result<Bounced, BakeError> {
    let Receivers { texels, charts, direct, local, kept } = receivers;
    let effort = options.effort();
    let [first, most] = effort.gather.map(|samples| samples / REPLICATES as u32);
    let nothing = || vec![Gathered::default(); texels.len()];
    let mut gathered = kept.map_or_else(nothing, |kept| kept.gathered.clone());
    let open_texels = (0..texels.len() as u32).filter(|&index| !texels[index as usize].is_hidden());
    let open = open_texels.clone().count().max(1) as f64;
    let channel_mean = |v: Vec3| f64::from(v.element_sum()) / 3.0;
    let mean_direct = direct.iter().map(|direct| channel_mean(direct.baked)).sum::<f64>() / open;
    let surroundings =
        watch.during(0.0, || Surroundings::new(cache.scene, cache.layout, texels, charts, &[]))?;
    let mut wanted: Vec<Allotment> = open_texels
        .clone()
        .filter(|&index| gathered[index as usize].samples == 0)
        .map(|index| Allotment { index, samples: first })
        .collect();
    // With everything kept there is nothing that the former bake did not know when it ended.
    let settled = kept.is_some() && wanted.is_empty();
    let mut helped_before = f64::INFINITY;
    let mut round = 0;
    let mut known = GatheredLight::default();
    let (light, variances) = loop {
        watch.pass(PASS);
        let cache = RadianceCache { gathered: &known, ..*cache };
        if round == 0 && options.time.is_some() {
            wanted = affordable(&cache, texels, wanted, &mut gathered, options, watch)?;
        }
        let in_time = cast(&cache, texels, &wanted, &mut gathered, options, watch)?;
        if !in_time && round == 0 {
            from_patches(&cache, texels, &mut gathered);
        }
        round += 1;
        let raw: Vec<Estimates> = gathered.par_iter().map(Gathered::estimates).collect();
        let (estimates, smoothing_bias) = watch.during(1.0, || match options.denoise {
            true => {
                let near: Vec<f32> = gathered.par_iter().map(Gathered::inverse_distance).collect();
                smooth(&surroundings, &raw, &near)
            }
            false => (raw.clone(), vec![0.0; texels.len()]),
        })?;
        let patch_bias = watch.during(1.0, || {
            patch_bias(&surroundings, texels, &gathered, &raw, cache.patches.mean_reflectance())
        })?;
        let spread = watch.during(1.0, || spread(&surroundings, &estimates))?;
        let errors = GatherErrors {
            gathered: &gathered,
            estimates: &estimates,
            spread: &spread,
            smoothing_bias: &smoothing_bias,
            patch_bias: &patch_bias,
            residual_bound: report.residual_bound,
            neglected: kept.map_or(&[], |kept| &kept.neglected),
        };
        let total = mean_direct + estimates.iter().map(|e| channel_mean(mean(e))).sum::<f64>() / open;
        let variances = variances(direct, Some(&errors), total as f32);
        let of_patches = |part: fn(&PatchBias) -> f32| -> f64 {
            let parts: Vec<f32> = patch_bias.iter().map(part).collect();
            open_sum(texels, &local.relative(&parts))
        };
        // What chance leaves in single texels falls out of their mean.
        let by_chance = of_patches(|bias| bias.rest) - of_patches(|bias| bias.expected).max(0.0);
        let sum = open_sum(texels, &local.relative(&variances.expected)) - by_chance;
        report.estimated_error = (sum / open).max(0.0).sqrt();
        report.error_of_mean = relative_to(total, open_sum(texels, &variances.expected) / open);
        report.error_reached = report.estimated_error <= options.error;
        report.curve.push(ErrorAtTime { seconds: watch.seconds(), error: report.estimated_error });
        watch.note_error(report.estimated_error);
        watch.advance(1.0)?;
        let late = !in_time || watch.clock().late();
        // Of the error, the part that more rays make smaller. They read texels and no patches, so that what patches left falls too; what is known of it
        // by checks stays.
        let unsettled = errors.by_rays();
        let read: Vec<f32> = gathered.par_iter().map(Gathered::squared_read_error).collect();
        let by_rays = unsettled.with(&read).relative(local);
        let helped = open_sum(texels, &by_rays.expected);
        let helpless = helped <= WORTH_RAYS * sum || helped > STALLED * helped_before;
        helped_before = helped;
        // The part that rays may leave: what the rest leaves of the error asked for, or what would not be seen beside it.
        let rest = sum - helped;
        let asked = open * options.error.powi(2);
        let goal = (AIM * asked - rest).max(WORTH_RAYS * rest).max(helped / MOST_OF_A_ROUND);
        // Rays are given out by the cautious figures; the goal is one of expected ones.
        let goal = goal * open_sum(texels, &by_rays.cautious) / helped.max(f64::MIN_POSITIVE);
        let samples: Vec<u32> = gathered.iter().map(|own| own.samples).collect();
        let cast: u64 = samples.iter().map(|&samples| u64::from(samples)).sum();
        let budget = (effort.budget(open as u64) / REPLICATES as u64).saturating_sub(cast);
        // What little is left of it is not worth another smoothing.
        let spent = (budget as f64) < LEAST_ROUND * cast as f64;
        wanted = allot_within(budget, open_texels.clone(), &by_rays.cautious, &samples, most, ORDER, goal);
        report.ended =
            Ended::after(report.error_reached, late || watch.is_late(), spent || wanted.is_empty());
        if report.error_reached || late || helpless || spent || settled || wanted.is_empty() {
            break (corrected(&estimates, &patch_bias), variances);
        }
        let light = corrected(&estimates, &patch_bias);
        known = watch.during(1.0, || {
            GatheredLight::new(texels, &gathered, &light, &unsettled.expected, cache.direct)
        })?;
    };
    report.rays += gathered.iter().map(|own| own.rays).sum::<u64>();
    // Without rays: the patches' light, for want of time.
    let cast = gathered.iter().filter(|own| own.rays > 0);
    let cast: u64 = cast.map(|own| u64::from(own.samples) * REPLICATES as u64).sum();
    report.gather_rays = cast as f64 / open;
    Ok(Bounced { light, variances, gathered })
}

/// Casts the samples that are wanted; whether there was time for all of them.
fn cast(
    cache: &RadianceCache<'_>,
    texels: &[Texel],
    wanted: &[Allotment],
    gathered: &mut [Gathered],
    options: &BakeOptions,
    watch: &mut Watch<'_>,
) -> Result<bool, BakeError> {
    let found = in_chunks_in_time(wanted.len(), watch, |place| {
        let Allotment { index, samples } = wanted[place];
        let mut own = gathered[index as usize];
        cache.gather(&texels[index as usize], &mut own, samples, options.seed);
        own
    })?;
    let in_time = found.len() == wanted.len();
    for (allotted, own) in wanted.iter().zip(found) {
        gathered[allotted.index as usize] = own;
    }
    Ok(in_time)
}

/// Casts one sample everywhere, and says how many of those that are wanted there is time for: a little everywhere is worth more than much in
/// the first maps and nothing in the last.
fn affordable(
    cache: &RadianceCache<'_>,
    texels: &[Texel],
    mut wanted: Vec<Allotment>,
    gathered: &mut [Gathered],
    options: &BakeOptions,
    watch: &mut Watch<'_>,
) -> Result<Vec<Allotment>, BakeError> {
    let once: Vec<Allotment> = wanted.iter().map(|own| Allotment { samples: 1, ..*own }).collect();
    let begun = watch.seconds();
    if !cast(cache, texels, &once, gathered, options, watch)? {
        // Where one was too much, those without any are the ones that are left.
        wanted.retain(|own| gathered[own.index as usize].samples == 0);
        return Ok(wanted);
    }
    let (clock, seconds) = (watch.clock(), watch.seconds() - begun);
    wanted.iter_mut().for_each(|own| own.samples = clock.affordable(1, own.samples, seconds));
    wanted.retain(|own| own.samples > 1);
    Ok(wanted)
}

/// The estimates without what is known to be the patches' fault.
fn corrected(estimates: &[Estimates], bias: &[PatchBias]) -> Vec<Vec3> {
    let corrected = estimates.iter().zip(bias).map(|(e, bias)| (mean(e) - bias.correction).max(Vec3::ZERO));
    corrected.collect()
}

/// The sum over texels that show a surface.
pub(crate) fn open_sum(texels: &[Texel], numbers: &[f32]) -> f64 {
    let open = texels.iter().zip(numbers).filter(|(texel, _)| !texel.is_hidden());
    open.map(|(_, number)| f64::from(*number)).sum()
}

/// The root of a squared error, relative to a mean; 0 where there is no light.
pub(crate) fn relative_to(mean: f64, squared: f64) -> f64 {
    if mean > 0.0 { squared.max(0.0).sqrt() / mean } else { 0.0 }
}
