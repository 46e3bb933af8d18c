//! The rounds of the final gather. The first casts a few rays for every texel, each later one more rays where the error
//! is still too large, until the requested error is reached, the time is up, or the quality's limit of rays is reached.
//! How a texel gathers light is in `gather`.

use glam::Vec3;
use rayon::prelude::*;

use super::error_estimate::{PatchBias, TexelReads, patch_bias};
use super::error_ledger::{ErrorLedger, GatherErrors};
use super::first_round::{ROUND_PROGRESS, cast_first_round};
use super::gather_sums::GatherSums;
use super::learned_guide::learn;
use super::map_error::MapError;
use super::patch_fallback::{are_much_better, from_patches};
use super::radiance_cache::RadianceCache;
use super::reused_gather::ReusedGather;
use super::round_goals::{CONVERGENCE_ORDER, ErrorLeft, TARGET};
use crate::chunks::decide;
use crate::color::wide_channel_mean;
use crate::coverage::CoveredTexels;
use crate::denoise::replicates::mean;
use crate::denoise::{Denoised, Estimates, Neighbourhoods, REPLICATES};
use crate::direct_light::DirectLight;
use crate::monitor::{BakeMonitor, Clock};
use crate::report::StageNotes;
use crate::sample_allocation::{SampleAllocation, SampleAllocator, WeightedGoal};
use crate::squared_errors::SquaredErrors;
use crate::texel_index::CoveredTexel;
use crate::{BakeError, BakeOptions, Ended, ErrorAtTime};

/// The rest of the way is a small step if the requested squared error is more than this fraction of the remaining one.
/// When the quality's rays are spent, a small step may still be taken: a map that just misses the requested error helps
/// nobody.
const SMALL_STEP: f64 = 0.8;
/// A small step towards the requested error of the whole level may raise the total number of rays to this multiple of
/// the quality's limit; one towards that of views stays within [`RAYS_FOR_VIEWS`].
const SMALL_STEP_RAYS: f64 = 1.25;
/// [`TARGET`] of a small step, per unit of the requested over the remaining squared error. It is closer to 1, as the
/// outcome is predicted better the less a round has to reduce the error.
const SMALL_STEP_TARGET: f64 = 0.9;
/// The quality's rays count as spent if those left are less than this fraction of those cast: so few are not worth
/// another smoothing.
const MIN_ROUND: f64 = 0.15;
/// Once the mean over the level reaches the requested error, the total number of rays may rise to this multiple of the
/// quality's limit for the sake of views that do not: a level's brightest place hides what its rooms still need.
const RAYS_FOR_VIEWS: f64 = 1.5;
/// Direct light and the gather together may take this multiple of the quality's limit: where direct light is simple, more
/// rays go to the bounces.
const WITH_DIRECT_LIGHT: f64 = 2.15;
/// A round that adds a smaller fraction of the rays cast, or fewer per texel than [`WORTHWHILE_PER_TEXEL`], is not worth
/// another smoothing either, which takes as long as three or four rays per texel: while a round needs fewer, it aims at
/// [`LOWER_TARGET`] of the squared error, down to [`LEAST_TARGET`] of what was requested.
const WORTHWHILE: f64 = 0.02;
const WORTHWHILE_PER_TEXEL: f64 = 1.0;
const LOWER_TARGET: f64 = 0.8;
const LEAST_TARGET: f64 = 0.1;
/// A round has stalled if it left more than this fraction of the squared error that it was to reduce.
const STALLED: f64 = 0.95;
/// The gather ends after so many stalled rounds in a row. One alone says little: where much of the light comes through
/// a gap that few rays find, the first rounds find out only how noisy it is.
const MAX_STALLED_ROUNDS: u32 = 2;
/// As [`STALLED`], for a small step, which is not expected to reduce the error by much.
const SMALL_STEP_STALLED: f64 = 0.995;

/// The result of the final gather, per covered texel.
#[derive(Default)]
pub(crate) struct IndirectLight {
    /// Irradiance by bounces.
    pub light: Vec<Vec3>,
    /// Squared errors of the map, direct light included.
    pub variances: SquaredErrors,
    pub gathered: Vec<GatherSums>,
}

impl IndirectLight {
    /// For a scene where nothing bounces: no light, and the errors of direct light alone.
    pub fn none(texels: &CoveredTexels<'_>, direct: &DirectLight) -> Self {
        Self { variances: ErrorLedger::of_direct_light(texels, direct).total(), ..Self::default() }
    }

    /// The sum of direct and indirect light of every covered texel, W/m².
    pub fn with(&self, direct: &DirectLight) -> Vec<Vec3> {
        let bounced = self.light.iter().copied().chain(std::iter::repeat(Vec3::ZERO));
        direct.texels.iter().zip(bounced).map(|(direct, bounced)| direct.baked + bounced).collect()
    }
}

/// The figures of the final gather, as in [`BakeReport`](crate::BakeReport).
pub(crate) struct GatherReport {
    pub error: MapError,
    pub curve: Vec<ErrorAtTime>,
    pub ended: Ended,
    pub leaked_rays: u64,
    pub gather_rays: f64,
}

/// Gathers bounced light in rounds, starting with the sums `reused` from a previous bake. Afterwards the cache also
/// holds the gathered light, for rays of later stages.
pub(crate) fn gather(
    cache: &mut RadianceCache<'_>,
    texels: &CoveredTexels<'_>,
    direct: &DirectLight,
    reused: Option<&ReusedGather>,
    options: &BakeOptions,
    monitor: &mut BakeMonitor<'_>,
) -> Result<((IndirectLight, GatherReport), StageNotes), BakeError> {
    let list = &texels.list;
    let leaked_before = cache.scene.leaks.count();
    let neighbourhoods = monitor.run_interruptible(0.0, || Neighbourhoods::new(texels, &[]))?;
    let planner = RoundPlanner::new(&neighbourhoods, texels, direct, reused, options);
    let mut curve = Vec::new();
    let no_sums = || vec![GatherSums::default(); list.len()];
    let mut gathered = reused.map_or_else(no_sums, |reused| reused.gathered.clone());
    let wanted = planner.first_samples(&gathered);
    // The previous bake decided that more rays were not needed. If all of it is reused, that still holds.
    let is_all_reused = reused.is_some() && wanted.is_empty();
    let mut speed = CastSpeed::default();
    let (begun, samples) = (monitor.seconds(), all_samples(&gathered));
    let mut in_time = cast_first_round(cache, texels, wanted, &mut gathered, options, monitor)?;
    speed.add(all_samples(&gathered) - samples, monitor.seconds() - begun);
    let mut plan: Option<RoundPlan> = None;
    let mut stalled_rounds = 0;
    let mut reads = TexelReads::new(cache.exchange.patches.mean_reflectance(), &gathered);
    let (result, ended, is_late) = loop {
        let begun = monitor.seconds();
        let result = planner.evaluate(&gathered, &reads, cache.exchange.residual_bound, monitor)?;
        let is_reached = result.error.reaches(options.error);
        curve.push(result.error_at_time());
        // A round needs time for its rays, and for another evaluation.
        let affordable = speed.affordable_samples(monitor.seconds() - begun, monitor.clock());
        if is_reached {
            break (result, Ended::Reached, false);
        }
        let left = planner.left(&gathered, &result);
        let next = planner.plan(&gathered, &result.error, &left, decide(monitor, affordable)?);
        let is_late = decide(monitor, !in_time || monitor.clock().is_over() || next.is_late)?;
        let is_hardly_reducible = left.is_hardly_reducible(options.error.powi(2), planner.count());
        let has_stalled = plan.as_ref().is_some_and(|plan| plan.has_stalled(&left));
        stalled_rounds = if has_stalled { stalled_rounds + 1 } else { 0 };
        let ended = Ended::after(false, is_late || monitor.is_late(), next.is_last);
        let rays_gain_nothing = is_hardly_reducible || stalled_rounds == MAX_STALLED_ROUNDS;
        if is_late || rays_gain_nothing || is_all_reused || next.is_last {
            break (result, ended, is_late);
        }
        let variances = &result.reducible.expected;
        monitor.run_interruptible(1.0, || {
            cache.texels.set_indirect(list, &gathered, &result.light, variances);
            learn(cache, list, &mut gathered);
        })?;
        monitor.pass(ROUND_PROGRESS);
        let rest = planner.open.iter().map(|texel| reads.rest_in(&gathered[texel.place()])).sum::<f64>();
        reads.add((next.added * REPLICATES as u64) as f64, rest / planner.count());
        let (begun, samples) = (monitor.seconds(), all_samples(&gathered));
        in_time = cache.cast(list, &next.wanted, &mut gathered, options.seed, monitor)?;
        speed.add(all_samples(&gathered) - samples, monitor.seconds() - begun);
        plan = Some(next);
    };
    // Texels for which there was no time have no rays: their sums are those of a neighbour, or the light of their patch.
    let cast = gathered.iter().filter(|sums| sums.rays > 0);
    let cast: u64 = cast.map(|sums| u64::from(sums.samples) * REPLICATES as u64).sum();
    let gather_rays = cast as f64 / planner.count();
    let is_kept =
        |texel: CoveredTexel| reused.is_some_and(|reused| reused.gathered[texel.place()].samples > 0);
    let by_patches = match is_late && plan.is_none() {
        true => planner.by_patches(cache, &mut gathered, &result, is_kept, &reads, monitor)?,
        false => None,
    };
    curve.extend(by_patches.as_ref().map(RoundResult::error_at_time));
    let is_reached = by_patches.as_ref().is_some_and(|result| result.error.reaches(options.error));
    let ended = if is_reached { Ended::Reached } else { ended };
    let result = by_patches.unwrap_or(result);
    let RoundResult { light, variances, error, .. } = result;
    monitor.run_interruptible(1.0, || {
        cache.texels.set_indirect(list, &gathered, &light, &variances.expected);
    })?;
    let leaked_rays = cache.scene.leaks.count() - leaked_before;
    let rays = cache.steep.rays + gathered.iter().map(|sums| sums.rays).sum::<u64>();
    let report = GatherReport { error, curve, ended, leaked_rays, gather_rays };
    Ok(((IndirectLight { light, variances, gathered }, report), StageNotes::of_rays(rays)))
}

/// Samples per replicate, of all texels together.
fn all_samples(gathered: &[GatherSums]) -> u64 {
    gathered.iter().map(|sums| u64::from(sums.samples)).sum()
}

/// How quickly samples are cast.
#[derive(Default)]
struct CastSpeed {
    /// Samples per replicate, of all texels together.
    samples: u64,
    seconds: f64,
}

impl CastSpeed {
    /// Adds the samples that were cast in so many seconds.
    fn add(&mut self, samples: u64, seconds: f64) {
        self.samples += samples;
        self.seconds += seconds;
    }

    /// For how many samples there is time if `reserved` seconds must be left afterwards.
    fn affordable_samples(&self, reserved: f64, clock: Clock) -> u64 {
        let Some(left) = clock.seconds_left() else { return u64::MAX };
        (self.samples as f64 * (left - reserved).max(0.0) / self.seconds.max(1e-6)) as u64
    }
}

/// Estimates light and errors after each round, and decides where the next one casts its rays.
struct RoundPlanner<'a> {
    neighbourhoods: &'a Neighbourhoods<'a>,
    texels: &'a CoveredTexels<'a>,
    direct: &'a DirectLight,
    /// The covered texels that are not hidden.
    open: Vec<CoveredTexel>,
    /// Mean direct light of the open texels, W/m², mean of the channels.
    mean_direct: f64,
    /// Per covered texel, by how much its reused light may have changed, W/m²; empty if nothing is reused.
    reuse_error: &'a [f32],
    /// The texels whose samples are reused, and those samples, per replicate.
    reused: [u64; 2],
    options: &'a BakeOptions,
}

/// The light and its errors after a round.
struct RoundResult {
    /// Irradiance by bounces, per covered texel.
    light: Vec<Vec3>,
    /// Squared errors of the map, direct light included.
    variances: SquaredErrors,
    /// The part of `variances` that more rays reduce.
    reducible: SquaredErrors,
    /// The error of the whole map, and the seconds that the bake had taken when it was known.
    error: MapError,
    seconds: f64,
}

impl RoundResult {
    fn error_at_time(&self) -> ErrorAtTime {
        ErrorAtTime { seconds: self.seconds, error: self.error.relative }
    }
}

/// What the next round should cast.
struct RoundPlan {
    wanted: Vec<SampleAllocation>,
    /// Samples of each replicate that it adds, of all texels together.
    added: u64,
    /// How much the error of each texel counts, and the sum of those that rays reduce.
    weights: Vec<f32>,
    reducible_sum: f64,
    /// The quality's rays are spent, or no texel would get more: there is no next round.
    is_last: bool,
    /// The quality's rays are spent, but the requested error is only a small step away.
    is_small_step: bool,
    /// The time left allows too few rays.
    is_late: bool,
}

impl RoundPlan {
    /// Returns true if the round that followed this plan hardly reduced the error: `left` is what there is afterwards.
    fn has_stalled(&self, left: &ErrorLeft<'_>) -> bool {
        let stalled = if self.is_small_step { SMALL_STEP_STALLED } else { STALLED };
        left.reducible_sum(&self.weights) > stalled * self.reducible_sum
    }
}

impl<'a> RoundPlanner<'a> {
    fn new(
        neighbourhoods: &'a Neighbourhoods<'a>,
        texels: &'a CoveredTexels<'a>,
        direct: &'a DirectLight,
        reused: Option<&'a ReusedGather>,
        options: &'a BakeOptions,
    ) -> Self {
        let list = &texels.list;
        let open: Vec<CoveredTexel> =
            CoveredTexel::all(list.len()).filter(|texel| !list[texel.place()].is_hidden()).collect();
        let sum = direct.texels.iter().map(|direct| wide_channel_mean(direct.baked)).sum::<f64>();
        Self {
            neighbourhoods,
            texels,
            direct,
            mean_direct: sum / open.len().max(1) as f64,
            open,
            reuse_error: reused.map_or(&[], |reused| &reused.reuse_error),
            reused: reused.map_or([0; 2], |reused| [reused.count() as u64, all_samples(&reused.gathered)]),
            options,
        }
    }

    /// Number of open texels; at least one, as it is divided by.
    fn count(&self) -> f64 {
        self.open.len().max(1) as f64
    }

    /// By how much the samples that are reused from a previous bake exceed the share of their texels in `limit`.
    fn reused_excess(&self, limit: u64) -> u64 {
        let [texels, samples] = self.reused;
        samples.saturating_sub((limit as f64 * texels as f64 / self.count()) as u64)
    }

    /// The samples of the first round: the same number for every open texel for which nothing is reused.
    fn first_samples(&self, gathered: &[GatherSums]) -> Vec<SampleAllocation> {
        let samples = self.options.effort().gather[0] / REPLICATES as u32;
        let without_samples = self.open.iter().copied().filter(|texel| gathered[texel.place()].samples == 0);
        without_samples.map(|texel| SampleAllocation { texel, samples }).collect()
    }

    /// Estimates the light from the samples, smooths it, and estimates its errors. `residual_bound` is the solver's.
    fn evaluate(
        &self,
        gathered: &[GatherSums],
        reads: &TexelReads,
        residual_bound: f64,
        monitor: &mut BakeMonitor<'_>,
    ) -> Result<RoundResult, BakeError> {
        let neighbourhoods = self.neighbourhoods;
        let raw: Vec<Estimates> = gathered.par_iter().map(GatherSums::estimates).collect();
        let nearness = |place: usize| gathered[place].mean_nearness();
        let denoised = Denoised::new(neighbourhoods, &raw, nearness, self.options.denoise, monitor)?;
        let patches = monitor.run_interruptible(1.0, || {
            patch_bias(neighbourhoods, &self.texels.list, gathered, &raw, reads)
        })?;
        let bounced = denoised.estimates.iter().map(|e| wide_channel_mean(mean(e))).sum::<f64>();
        let total = self.mean_direct + bounced / self.count();
        let gather = GatherErrors {
            gathered,
            denoised: &denoised,
            patches: &patches,
            residual_bound,
            kept: self.reuse_error,
        };
        let (texels, direct) = (self.texels, self.direct);
        let ledger = ErrorLedger { texels, direct, gather: Some(gather), light: total as f32 };
        let variances = ledger.total();
        let error = monitor.run_interruptible(1.0, || MapError::new(&ledger, &variances, total))?;
        let seconds = monitor.seconds();
        monitor.note_error(error.worst());
        monitor.advance(1.0)?;
        let light = without_patch_bias(&denoised.estimates, &patches);
        Ok(RoundResult { light, variances, reducible: denoised.errors(), error, seconds })
    }

    /// If the patches' light is much better than the few samples of the first round, the result with it in their place, but
    /// for texels that keep the light of a former bake.
    fn by_patches(
        &self,
        cache: &RadianceCache<'_>,
        gathered: &mut [GatherSums],
        result: &RoundResult,
        is_kept: impl Fn(CoveredTexel) -> bool,
        reads: &TexelReads,
        monitor: &mut BakeMonitor<'_>,
    ) -> Result<Option<RoundResult>, BakeError> {
        let (texels, seed) = (self.texels, self.options.seed);
        let gathered_anew: Vec<CoveredTexel> =
            self.open.iter().copied().filter(|texel| !is_kept(*texel)).collect();
        let sum =
            |of: &dyn Fn(usize) -> f64| gathered_anew.iter().map(|texel| of(texel.place())).sum::<f64>();
        let noise = sum(&|place| f64::from(result.reducible.expected[place]));
        let light = sum(&|place| wide_channel_mean(result.light[place]).powi(2));
        if gathered_anew.is_empty() || !are_much_better(cache, texels, noise / light, seed, monitor)? {
            return Ok(None);
        }
        from_patches(cache, texels, gathered, seed, |texel, _| !is_kept(texel), monitor)?;
        self.evaluate(gathered, reads, cache.exchange.residual_bound, monitor).map(Some)
    }

    /// The error that is left after a round, and the part of it that rays reduce.
    fn left(&self, gathered: &[GatherSums], result: &RoundResult) -> ErrorLeft<'_> {
        // From the second round on, rays read the light of texels instead of patches, and so also reduce the error that
        // was read from patches. The bias that is measured by checks against real bounces is not counted as reducible.
        let read: Vec<f32> = gathered.par_iter().map(GatherSums::squared_read_error).collect();
        ErrorLeft::new(&self.direct.local, &result.error, &result.reducible.with(&read))
    }

    /// Allocates the rays of the next round such that they reduce the reducible part of the error to what is needed to
    /// reach the requested one. At most `affordable` samples per replicate can be cast in the time that is left.
    fn plan(
        &self,
        gathered: &[GatherSums],
        error: &MapError,
        left: &ErrorLeft<'_>,
        affordable: u64,
    ) -> RoundPlan {
        let [_, max_samples] = self.options.effort().gather.map(|samples| samples / REPLICATES as u32);
        let samples: Vec<u32> = gathered.iter().map(|sums| sums.samples).collect();
        let cast = all_samples(gathered);
        let requested = self.options.error.powi(2);
        let is_whole_reached = error.relative <= self.options.error;
        let of_quality = self.options.effort().budget(self.count() as u64) / REPLICATES as u64;
        let of_direct_light = self.direct.samples() / REPLICATES as u64;
        // The limit of a previous bake may have been higher. What its samples have cost beyond this one does not count.
        let reused_excess = self.reused_excess(sample_limit(of_quality, of_direct_light, 0, false));
        let counted = cast - reused_excess;
        let limit = sample_limit(of_quality, of_direct_light, counted, is_whole_reached);
        let budget = limit.saturating_sub(counted);
        let is_spent = (budget as f64) < MIN_ROUND * cast as f64;
        let missed = if is_whole_reached { error.in_worst_view } else { error.relative };
        let requested_over_left = requested / missed.powi(2).max(f64::MIN_POSITIVE);
        let per_texel = WORTHWHILE_PER_TEXEL * self.count() / REPLICATES as f64;
        let worthwhile = ((WORTHWHILE * cast as f64).max(per_texel) as u64).min(affordable);
        let for_small_step = limit.max(times(of_quality, SMALL_STEP_RAYS)).saturating_sub(counted);
        let is_small_step = is_spent && requested_over_left > SMALL_STEP && for_small_step >= worthwhile;
        let (first_target, budget) = match is_small_step {
            true => (SMALL_STEP_TARGET * requested_over_left, for_small_step),
            false => (TARGET, budget),
        };
        let allocate = |goal: &WeightedGoal, most: u64| {
            let variances = &goal.variances;
            let (texels, samples, order) = (&self.open, &samples, CONVERGENCE_ORDER);
            let allocator = SampleAllocator { texels, variances, samples, most: max_samples, order };
            let wanted = allocator.within(most, goal.sum);
            (allocator.added(&wanted), wanted)
        };
        let mut target = first_target;
        let (goal, (mut added, mut wanted)) = loop {
            // The mean over the level comes first: the rays may not suffice for every room.
            let goal = match is_whole_reached {
                true => left.goal(target * requested, &self.open),
                false => left.goal_of_whole(target * requested, &self.open),
            };
            let allocated = allocate(&goal, budget);
            if allocated.0 >= worthwhile || budget < worthwhile || target < LEAST_TARGET {
                break (goal, allocated);
            }
            target *= LOWER_TARGET;
        };
        let is_short_of_time = added > affordable;
        let is_late = is_short_of_time && (affordable as f64) < MIN_ROUND * cast as f64;
        if is_late {
            (added, wanted) = (0, Vec::new());
        } else if is_short_of_time {
            (added, wanted) = allocate(&goal, affordable);
        }
        RoundPlan {
            reducible_sum: left.reducible_sum(&goal.weights),
            is_last: (is_spent && !is_small_step) || (wanted.is_empty() && !is_late),
            is_small_step,
            is_late,
            added,
            wanted,
            weights: goal.weights,
        }
    }
}

/// Most samples in all, given those of the quality, those that direct light has taken, and those that have been cast.
/// What direct light has left of [`WITH_DIRECT_LIGHT`] is the gather's, and more are allowed for views once the whole
/// level has reached the requested error. Samples beyond a small step can only have been cast for views: the whole
/// level had reached it then, and is near it still, so that the limit stays raised.
fn sample_limit(of_quality: u64, of_direct_light: u64, cast: u64, is_whole_reached: bool) -> u64 {
    let left = times(of_quality, WITH_DIRECT_LIGHT).saturating_sub(of_direct_light);
    let limit = of_quality.max(left);
    match is_whole_reached || cast > times(of_quality, SMALL_STEP_RAYS).max(limit) {
        true => times(of_quality, RAYS_FOR_VIEWS).max(limit),
        false => limit,
    }
}

/// A number of samples times a factor.
fn times(samples: u64, factor: f64) -> u64 {
    (samples as f64 * factor) as u64
}

/// The mean of each texel's replicates, minus the known bias of the patches that its rays read.
fn without_patch_bias(estimates: &[Estimates], bias: &[PatchBias]) -> Vec<Vec3> {
    let unbiased = estimates.iter().zip(bias).map(|(e, bias)| (mean(e) - bias.correction).max(Vec3::ZERO));
    unbiased.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn views_get_half_as_many_samples_again_once_the_whole_level_has_its_error() {
        assert_eq!([0, 990, 1250].map(|cast| sample_limit(1000, 1250, cast, false)), [1000; 3]);
        assert_eq!([0, 990, 1400].map(|cast| sample_limit(1000, 1250, cast, true)), [1500; 3]);
        for of_direct_light in [800, 1000, 1250] {
            let limit = sample_limit(1000, of_direct_light, 1490, false);
            assert_eq!(limit, 1500, "a limit that was raised stays so: {of_direct_light}");
        }
    }

    #[test]
    fn the_gather_gets_the_samples_that_direct_light_leaves() {
        let limit = |of_direct_light| sample_limit(1000, of_direct_light, 0, false);
        assert_eq!([0, 250, 1000, 1250, 9000].map(limit), [2150, 1900, 1150, 1000, 1000]);
        assert_eq!(sample_limit(1000, 250, 0, true), 1900, "already more than views would add");
    }
}
