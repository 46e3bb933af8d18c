//! Rounds of the final gather: every texel first, then those whose error is still too large, until the error asked for is
//! reached, the time is up or the quality's most rays are cast.

use crate::final_gather::map_error::MapError;
use glam::Vec3;
use rayon::prelude::*;

use super::error_estimate::{PatchBias, patch_bias};
use super::error_ledger::{ErrorLedger, GatherErrors, open_sum};
use super::patch_fallback::from_patches;
use super::reused_gather::ReusedGather;
use super::texel_radiance::GatheredLight;
use crate::chunks::in_chunks_until_deadline;
use crate::coverage::covered_texels::CoveredTexels;
use crate::coverage::footprint::Texel;
use crate::denoise::neighbourhoods::Neighbourhoods;
use crate::denoise::replicates::{Estimates, REPLICATES, mean, spread};
use crate::denoise::smooth::smooth;
use crate::direct_light::DirectLight;
use crate::direct_light::local_light::LocalLight;
use crate::final_gather::gather_sums::GatherSums;
use crate::final_gather::radiance_cache::RadianceCache;
use crate::monitor::BakeMonitor;
use crate::sample_allocation::{SampleAllocation, allocate_within};
use crate::sources::direct::Direct;
use crate::squared_errors::SquaredErrors;
use crate::texel_index::CoveredTexel;
use crate::{BakeError, BakeOptions, BakeReport, Ended, ErrorAtTime};

/// Share of the squared error below which the gather's own noise is not worth more rays.
const WORTH_RAYS: f64 = 0.1;
/// A round's usual share of the time that this one and those after it take.
const PASS: f32 = 0.7;
/// Of the squared error asked for, what a round aims at: a good deal less than what ends the rounds. Its estimates are rough, and another round would
/// smooth everything once more.
const AIM: f64 = 0.55;
/// The same, of what was reached, where the quality's rays are spent and a small step is missing: a round's estimates are the better the less it
/// lowers.
const NEAR_AIM: f64 = 0.9;
/// What was asked, over the squared error that is left, from which on the rest is a small step; and by how much its rays may be more than the
/// quality's most: a map that ends a hair beyond what was asked helps nobody.
const NEAR: f64 = 0.8;
const NEAR_RAYS: f64 = 1.25;
/// Order of the variance's fall with the samples: between random ones (1) and Sobol's of something smooth (3).
const ORDER: f64 = 1.25;
/// The most by which a round lowers the part that rays leave: the first estimates are rough.
const MAX_OF_A_ROUND: f64 = 8.0;
/// Share of the samples so far below which a round is not worth its smoothing.
const MIN_ROUND: f64 = 0.15;
/// A round that leaves more than this of the squared error that it was to lower was the last.
const STALLED: f64 = 0.95;
/// The same of a round that was a small step.
const SMALL_STEPS_END: f64 = 0.995;

/// What the rounds have found, for every covered texel.
#[derive(Default)]
pub(crate) struct IndirectLight {
    /// Irradiance by bounces.
    pub light: Vec<Vec3>,
    /// Of what the map then holds.
    pub variances: SquaredErrors,
    pub gathered: Vec<GatherSums>,
}

impl IndirectLight {
    /// Of a scene where nothing bounces.
    pub fn none(direct: &DirectLight) -> Self {
        Self { variances: ErrorLedger::of_direct_light(direct).total(), ..Self::default() }
    }

    /// The light of every covered texel, direct light included, W/m².
    pub fn with(&self, direct: &DirectLight) -> Vec<Vec3> {
        let bounced = self.light.iter().copied().chain(std::iter::repeat(Vec3::ZERO));
        direct.texels.iter().zip(bounced).map(|(direct, bounced)| direct.baked + bounced).collect()
    }
}

/// Gathers the light by bounces, beginning with what is `kept` of a former bake. The cache then holds what was gathered, too.
///
/// # Errors
/// [`BakeError::Cancelled`].
pub(crate) fn gather(
    cache: &mut RadianceCache<'_>,
    texels: &CoveredTexels<'_>,
    direct: &DirectLight,
    kept: Option<&ReusedGather>,
    options: &BakeOptions,
    monitor: &mut BakeMonitor<'_>,
    report: &mut BakeReport,
) -> Result<IndirectLight, BakeError> {
    let list = &texels.list;
    let leaked_before = cache.scene.leaks.count();
    let neighbourhoods = monitor.run_interruptible(0.0, || {
        Neighbourhoods::new(cache.scene, texels.layout, list, &texels.charts, &[])
    })?;
    let planner = RoundPlanner::new(&neighbourhoods, texels, direct, kept, options);
    let nothing = || vec![GatherSums::default(); list.len()];
    let mut gathered = kept.map_or_else(nothing, |kept| kept.gathered.clone());
    let mut wanted = planner.first_samples(&gathered);
    // With everything kept there is nothing that the former bake did not know when it ended.
    let settled = kept.is_some() && wanted.is_empty();
    let (mut reducible_before, mut was_small, mut is_first) = (f64::INFINITY, false, true);
    let found = loop {
        monitor.pass(PASS);
        if is_first && options.time.is_some() {
            wanted = affordable(cache, list, wanted, &mut gathered, options, monitor)?;
        }
        let in_time = cast(cache, list, &wanted, &mut gathered, options, monitor)?;
        if is_first && !in_time {
            from_patches(cache, list, &mut gathered);
        }
        is_first = false;
        let found = planner.found(&gathered, cache.patches.mean_reflectance(), monitor, report)?;
        let late = !in_time || monitor.clock().is_over();
        let next = planner.next(&gathered, &found);
        // A small step lowers little, and tells nothing of what a larger one would.
        let stalled = if was_small { SMALL_STEPS_END } else { STALLED };
        let is_ineffective = next.reducible_error <= WORTH_RAYS * found.sum
            || next.reducible_error > stalled * reducible_before;
        (reducible_before, was_small) = (next.reducible_error, next.is_small_step);
        report.ended = Ended::after(report.error_reached, late || monitor.is_late(), next.is_last);
        if report.error_reached || late || is_ineffective || settled || next.is_last {
            break found;
        }
        wanted = next.wanted;
        let variances = &found.unsettled.expected;
        cache.gathered = monitor.run_interruptible(1.0, || {
            GatheredLight::new(list, &gathered, &found.light, variances, &cache.direct)
        })?;
    };
    let RoundResult { light, variances, .. } = found;
    cache.gathered = monitor.run_interruptible(1.0, || {
        GatheredLight::new(list, &gathered, &light, &variances.expected, &cache.direct)
    })?;
    report.leaked_rays = cache.scene.leaks.count() - leaked_before;
    report.rays += gathered.iter().map(|own| own.rays).sum::<u64>();
    // Without rays: the patches' light, for want of time.
    let cast = gathered.iter().filter(|own| own.rays > 0);
    let cast: u64 = cast.map(|own| u64::from(own.samples) * REPLICATES as u64).sum();
    report.gather_rays = cast as f64 / planner.open.len().max(1) as f64;
    Ok(IndirectLight { light, variances, gathered })
}

/// Judges what a round has gathered, and says where the next one casts its rays.
struct RoundPlanner<'a> {
    neighbourhoods: &'a Neighbourhoods<'a>,
    texels: &'a [Texel],
    direct: &'a [Direct],
    local: &'a LocalLight,
    /// Of the covered texels, those that are not hidden.
    open: Vec<CoveredTexel>,
    /// Mean direct light of those, W/m², mean of the channels.
    mean_direct: f64,
    /// By how much light that is kept may have changed.
    reuse_error: &'a [f32],
    options: &'a BakeOptions,
}

/// What a round has found.
struct RoundResult {
    /// Irradiance by bounces, per covered texel.
    light: Vec<Vec3>,
    /// Of what the map then holds.
    variances: SquaredErrors,
    /// Of that, what more rays make smaller.
    unsettled: SquaredErrors,
    /// Over the open texels, the sum of their squared errors relative to the light around them.
    sum: f64,
}

/// What the next round is to do.
struct RoundPlan {
    wanted: Vec<SampleAllocation>,
    /// Of the sum of squared errors, the part that rays make smaller.
    reducible_error: f64,
    /// What is left of the quality's rays, or of the error, is not worth another round.
    is_last: bool,
    /// The quality's rays are spent, and it is but a small step to what was asked.
    is_small_step: bool,
}

impl<'a> RoundPlanner<'a> {
    fn new(
        neighbourhoods: &'a Neighbourhoods<'a>,
        texels: &'a CoveredTexels<'a>,
        direct: &'a DirectLight,
        kept: Option<&'a ReusedGather>,
        options: &'a BakeOptions,
    ) -> Self {
        let list = &texels.list;
        let open: Vec<CoveredTexel> =
            CoveredTexel::all(list.len()).filter(|texel| !list[texel.place()].is_hidden()).collect();
        let sum = direct.texels.iter().map(|direct| channel_mean(direct.baked)).sum::<f64>();
        Self {
            neighbourhoods,
            texels: list,
            direct: &direct.texels,
            local: &direct.local,
            mean_direct: sum / open.len().max(1) as f64,
            open,
            reuse_error: kept.map_or(&[], |kept| &kept.reuse_error),
            options,
        }
    }

    /// How many texels are judged; at least one, to be divided by.
    fn count(&self) -> f64 {
        self.open.len().max(1) as f64
    }

    /// The first round's, wherever nothing is kept.
    fn first_samples(&self, gathered: &[GatherSums]) -> Vec<SampleAllocation> {
        let samples = self.options.effort().gather[0] / REPLICATES as u32;
        let new = self.open.iter().copied().filter(|texel| gathered[texel.place()].samples == 0);
        new.map(|texel| SampleAllocation { texel, samples }).collect()
    }

    /// The light that the samples tell, smoothed, with its errors; the report states them.
    fn found(
        &self,
        gathered: &[GatherSums],
        reflectance: f64,
        monitor: &mut BakeMonitor<'_>,
        report: &mut BakeReport,
    ) -> Result<RoundResult, BakeError> {
        let (neighbourhoods, texels, local) = (self.neighbourhoods, self.texels, self.local);
        let raw: Vec<Estimates> = gathered.par_iter().map(GatherSums::estimates).collect();
        let (estimates, smoothing) = monitor.run_interruptible(1.0, || match self.options.denoise {
            true => {
                let near: Vec<f32> = gathered.par_iter().map(GatherSums::inverse_distance).collect();
                smooth(neighbourhoods, &raw, &near)
            }
            false => (raw.clone(), vec![0.0; texels.len()]),
        })?;
        let patches = monitor
            .run_interruptible(1.0, || patch_bias(neighbourhoods, texels, gathered, &raw, reflectance))?;
        let noise = monitor.run_interruptible(1.0, || spread(neighbourhoods, &estimates))?;
        let bounced = estimates.iter().map(|e| channel_mean(mean(e))).sum::<f64>();
        let total = self.mean_direct + bounced / self.count();
        let gather = GatherErrors {
            gathered,
            estimates: &estimates,
            noise: &noise,
            smoothing: &smoothing,
            patches: &patches,
            residual_bound: report.residual_bound,
            kept: self.reuse_error,
        };
        let ledger = ErrorLedger { direct: self.direct, gather: Some(gather), light: total as f32 };
        let variances = ledger.total();
        let stated = MapError::new(&ledger, &variances, texels, local, total);
        let parts = monitor.run_interruptible(1.0, || ledger.parts(texels, local))?;
        stated.write_report(self.options.error, parts, report);
        report.curve.push(ErrorAtTime { seconds: monitor.seconds(), error: report.estimated_error });
        monitor.note_error(report.estimated_error);
        monitor.advance(1.0)?;
        let light = corrected(&estimates, &patches);
        Ok(RoundResult { light, unsettled: ledger.by_rays(), variances, sum: stated.relative_squares })
    }

    /// Rays for the part of the error that they make smaller.
    fn next(&self, gathered: &[GatherSums], found: &RoundResult) -> RoundPlan {
        let [_, most] = self.options.effort().gather.map(|samples| samples / REPLICATES as u32);
        // They read texels and no patches, so that what patches left falls too; what is known of it by checks stays.
        let read: Vec<f32> = gathered.par_iter().map(GatherSums::squared_read_error).collect();
        let by_rays = self.local.relative_errors(&found.unsettled.with(&read));
        let reducible_error = open_sum(self.texels, &by_rays.expected);
        // What they may leave: what the rest leaves of the error asked for, or what would not be seen beside it.
        let rest = found.sum - reducible_error;
        let asked = self.count() * self.options.error.powi(2);
        let samples: Vec<u32> = gathered.iter().map(|own| own.samples).collect();
        let cast: u64 = samples.iter().map(|&samples| u64::from(samples)).sum();
        let most_of_all = self.options.effort().budget(self.count() as u64) / REPLICATES as u64;
        let budget = most_of_all.saturating_sub(cast);
        // What little is left of it is not worth another smoothing, unless that is all that is missing.
        let spent = (budget as f64) < MIN_ROUND * cast as f64;
        let reached = asked / found.sum.max(f64::MIN_POSITIVE);
        let is_small_step = spent && reached > NEAR;
        let (aim, budget) = match is_small_step {
            true => (NEAR_AIM * reached, ((most_of_all as f64 * NEAR_RAYS) as u64).saturating_sub(cast)),
            false => (AIM, budget),
        };
        let goal = (aim * asked - rest).max(WORTH_RAYS * rest).max(reducible_error / MAX_OF_A_ROUND);
        // Rays are given out by the cautious figures; the goal is one of expected ones.
        let goal = goal * open_sum(self.texels, &by_rays.cautious) / reducible_error.max(f64::MIN_POSITIVE);
        let open = self.open.iter().copied();
        let wanted = allocate_within(budget, open, &by_rays.cautious, &samples, most, ORDER, goal);
        RoundPlan {
            reducible_error,
            is_last: (spent && !is_small_step) || wanted.is_empty(),
            is_small_step,
            wanted,
        }
    }
}

/// Mean of the channels.
fn channel_mean(light: Vec3) -> f64 {
    f64::from(light.element_sum()) / 3.0
}

/// Casts the samples that are wanted; whether there was time for all of them.
fn cast(
    cache: &RadianceCache<'_>,
    texels: &[Texel],
    wanted: &[SampleAllocation],
    gathered: &mut [GatherSums],
    options: &BakeOptions,
    monitor: &mut BakeMonitor<'_>,
) -> Result<bool, BakeError> {
    let found = in_chunks_until_deadline(wanted.len(), monitor, |place| {
        let SampleAllocation { texel, samples } = wanted[place];
        let mut own = gathered[texel.place()];
        cache.gather(&texels[texel.place()], &mut own, samples, options.seed);
        own
    })?;
    let in_time = found.len() == wanted.len();
    for (allocated, own) in wanted.iter().zip(found) {
        gathered[allocated.texel.place()] = own;
    }
    Ok(in_time)
}

/// Casts one sample everywhere, and says how many of those that are wanted there is time for: a little everywhere is worth more than much in
/// the first maps and nothing in the last.
fn affordable(
    cache: &RadianceCache<'_>,
    texels: &[Texel],
    mut wanted: Vec<SampleAllocation>,
    gathered: &mut [GatherSums],
    options: &BakeOptions,
    monitor: &mut BakeMonitor<'_>,
) -> Result<Vec<SampleAllocation>, BakeError> {
    let once: Vec<SampleAllocation> =
        wanted.iter().map(|own| SampleAllocation { samples: 1, ..*own }).collect();
    let begun = monitor.seconds();
    if !cast(cache, texels, &once, gathered, options, monitor)? {
        // Where one was too much, those without any are the ones that are left.
        wanted.retain(|own| gathered[own.texel.place()].samples == 0);
        return Ok(wanted);
    }
    let (clock, seconds) = (monitor.clock(), monitor.seconds() - begun);
    wanted.iter_mut().for_each(|own| own.samples = clock.affordable(1, own.samples, seconds));
    wanted.retain(|own| own.samples > 1);
    Ok(wanted)
}

/// The estimates without what is known to be the patches' fault.
fn corrected(estimates: &[Estimates], bias: &[PatchBias]) -> Vec<Vec3> {
    let corrected = estimates.iter().zip(bias).map(|(e, bias)| (mean(e) - bias.correction).max(Vec3::ZERO));
    corrected.collect()
}
