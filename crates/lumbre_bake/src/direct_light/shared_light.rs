//! Direct light of the sources that share samples, for every covered texel: a few samples everywhere (where time is too
//! short for that, on a grid of texels from which the others are interpolated), smoothed over
//! neighbours that have the same light cut, then more where they are worth most, until direct light leaves no more than
//! its share of the requested error. Where many more would be needed, `control_variates` lower their noise. Single samples
//! are taken in `sources::shared_samples`; individually sampled sources are the parent module's.

use glam::Vec3;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::control_variates::{control_cost, mean_controlled_light, variance_left, visible_shares};
use super::error_goals::ErrorGoals;
use super::light_cuts::LightCuts;
use super::local_light::LocalLight;
use super::sparse_pass::{SparsePass, relative_difference, sparse_pass};
use super::views::ErrorsInViews;
use crate::chunks::{decide, in_chunks_until_deadline};
use crate::coverage::{Representatives, Texel, TileSequence, receiver};
use crate::denoise::replicates::{mean, variance};
use crate::denoise::{Denoised, Estimates, Nearness, Neighbourhoods, REPLICATES};
use crate::monitor::BakeMonitor;
use crate::sample_allocation::{
    MOST_DOUBLINGS_LEAVE, SampleAllocation, SampleAllocator, WeightedGoal, take_samples,
};
use crate::sampling::{Stream, hash};
use crate::sources::{Direct, Sources};
use crate::squared_errors::SquaredErrors;
use crate::texel_index::CoveredTexel;
use crate::{BakeError, BakeOptions};

/// The sums of a texel's samples.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub(crate) struct SampleSums {
    /// Baked light: the sum of the samples of each replicate.
    pub sums: [Vec3; REPLICATES],
    /// Light of mixed lights: the sum of all samples.
    pub mixed: Vec3,
    /// The control variate of `sums`: for each replicate the sum of what its samples would have brought without
    /// occluders, for the controlled sources only; mean of the channels.
    pub controls: [f32; REPLICATES],
    /// The part of each whose sources were visible.
    pub visible_controls: [f32; REPLICATES],
    /// The light of the controlled sources without occluders, if it has been computed.
    pub controlled_light: Option<Vec3>,
    /// Sum of 1 / distance to the sampled points of sources, canonical units.
    pub inverse_distances: f32,
    /// Samples of each replicate.
    pub samples: u32,
    /// Rays cast.
    pub rays: u32,
}

/// The power of the number of samples with which the variance falls: between random samples (1) and a Sobol sequence on
/// a smooth integrand (3).
const ORDER: f64 = 1.25;
/// The most by which a round aims to lower the sum of squared errors: the first estimates are rough, and a goal out of
/// reach would take all samples that can be had.
const MAX_REDUCTION: f64 = 8.0;
/// A round that leaves more than this share of the squared error is the last.
const STALLED: f64 = 0.9;
/// So is a round that leaves less than this multiple of the goal: smoothing everything once more would cost more than
/// the rest is worth.
const ENOUGH: f64 = 1.15;
/// The number of samples per texel that take about as long as smoothing all texels once.
const SMOOTHING: f64 = 5.0;
/// A round that adds fewer samples per texel is not worth another smoothing: while it needs fewer, it aims at
/// [`LOWER_AIM`] of the squared error, down to [`LEAST_AIM`] of the goal.
const WORTHWHILE: f64 = 1.0;
const LOWER_AIM: f64 = 0.8;
const LEAST_AIM: f64 = 0.2;
/// A control variate is to save so many times the samples that take as long as it does. More than one, as the rounds
/// rarely take all the samples that the first one foresees.
const WORTH_A_CONTROL: f32 = 2.0;
/// A round's usual share of the time that it and the rounds after it take.
const PASS: f32 = 0.6;

impl SampleSums {
    /// The mean of each replicate's samples.
    pub fn estimates(&self) -> Estimates {
        self.sums.map(|sum| sum / self.samples.max(1) as f32)
    }

    /// Of lights, whose shadows run in any direction.
    fn mean_nearness(&self) -> Nearness {
        Nearness::of_lamp(self.inverse_distances / (self.samples.max(1) * REPLICATES as u32) as f32)
    }
}

/// The squared light of sums, mean of the channels, without what is noise; may be negative.
fn squared_light(sums: &SampleSums) -> f64 {
    let estimates = sums.estimates();
    f64::from((mean(&estimates).length_squared() - variance(&estimates).element_sum()) / 3.0)
}

/// The sums of a texel that was not sampled, from texels around it; and, if these are several, the square of by how much
/// their light differs beyond what is noise, mean of the channels; may be negative.
fn interpolated(sums: &[SampleSums], around: &[(CoveredTexel, f32)]) -> (SampleSums, Option<f64>) {
    let mut sum = SampleSums::default();
    for (other, weight) in around {
        let other = &sums[other.place()];
        for replicate in 0..REPLICATES {
            sum.sums[replicate] += *weight * other.sums[replicate];
            sum.controls[replicate] += weight * other.controls[replicate];
            sum.visible_controls[replicate] += weight * other.visible_controls[replicate];
        }
        sum.mixed += *weight * other.mixed;
        sum.inverse_distances += weight * other.inverse_distances;
        sum.samples = other.samples;
    }
    let light = mean(&sum.estimates());
    let difference = |(other, weight): &(CoveredTexel, f32)| {
        let estimates = sums[other.place()].estimates();
        let noise = (1.0 - weight) * variance(&estimates).element_sum();
        f64::from(weight * ((mean(&estimates) - light).length_squared() - noise) / 3.0)
    };
    (sum, (around.len() > 1).then(|| around.iter().map(difference).sum()))
}

/// The sums of all texels, with what is needed to sample and smooth more.
pub(crate) struct SharedLight<'a> {
    sources: &'a Sources<'a>,
    texels: &'a [Texel],
    cuts: &'a LightCuts,
    neighbourhoods: Neighbourhoods<'a>,
    options: &'a BakeOptions,
    /// Samples of each replicate, in the first round and at most.
    first: u32,
    most: u32,
    /// Per covered texel.
    sums: Vec<SampleSums>,
    /// Per covered texel, the squared error, relative to the light, of its having been interpolated; empty if none was.
    interpolation_errors: Vec<f32>,
    /// The smoothed light of `sums`; updated after every round.
    smoothed: Denoised,
}

impl<'a> SharedLight<'a> {
    /// The first round: a few samples of every texel for whose index `is_wanted` holds.
    pub fn new(
        sources: &'a Sources<'a>,
        neighbourhoods: Neighbourhoods<'a>,
        cuts: &'a LightCuts,
        is_wanted: impl Fn(usize) -> bool + Sync,
        options: &'a BakeOptions,
        monitor: &mut BakeMonitor<'_>,
    ) -> Result<Self, BakeError> {
        let texels = &neighbourhoods.texels.list;
        let [first, most] = options.effort().shared.map(|samples| samples.div_ceil(REPLICATES as u32));
        let mut light = Self {
            sources,
            texels,
            cuts,
            neighbourhoods,
            options,
            first,
            most,
            sums: Vec::new(),
            interpolation_errors: Vec::new(),
            smoothed: Denoised::default(),
        };
        // A complete map comes first; if time is limited, with a single sample, and perhaps interpolated.
        let few = if options.time.is_some() { 1 } else { first };
        let is_sampled = |texel: &CoveredTexel| {
            is_wanted(texel.place())
                && !texels[texel.place()].is_hidden()
                && !cuts.of(*texel).shared.is_empty()
        };
        let wanted: Vec<CoveredTexel> = CoveredTexel::all(texels.len()).filter(is_sampled).collect();
        let SparsePass { sampled, seconds, blocks } =
            sparse_pass(light.neighbourhoods.texels, &wanted, PASS, monitor, |texel| {
                let mut sums = SampleSums::default();
                light.add(texel.place(), &mut sums, few);
                sums
            })?;
        light.sums = vec![SampleSums::default(); texels.len()];
        for (texel, sums) in sampled {
            light.sums[texel.place()] = sums;
        }
        let samples = monitor.clock().affordable(few, first, seconds);
        let samples = decide(monitor, samples)?;
        if let Some(blocks) = blocks {
            monitor.run_interruptible(1.0, || light.interpolate(&wanted, &blocks))?;
        } else if samples > few {
            let more = in_chunks_until_deadline(texels.len(), monitor, |place| {
                let mut sums = light.sums[place];
                if is_wanted(place) {
                    light.add(place, &mut sums, samples);
                }
                sums
            })?;
            light.sums.splice(..more.len(), more);
        }
        light.smoothed = light.smooth(monitor)?;
        Ok(light)
    }

    /// Interpolates the sums of those of the `wanted` texels that have none, and notes how uncertain that is.
    fn interpolate(&mut self, wanted: &[CoveredTexel], blocks: &Representatives<'_>) {
        let keys = self.cuts.keys();
        let missing: Vec<CoveredTexel> =
            wanted.iter().copied().filter(|texel| self.sums[texel.place()].samples == 0).collect();
        let interpolate = |texel: &CoveredTexel| {
            if self.sources.scene.stop.is_cancelled() {
                return (SampleSums::default(), None);
            }
            let fits = |other: CoveredTexel| {
                keys[other.place()] == keys[texel.place()] && self.sums[other.place()].samples > 0
            };
            interpolated(&self.sums, &blocks.around(*texel, fits))
        };
        let sums: Vec<(SampleSums, Option<f64>)> = missing.par_iter().map(interpolate).collect();
        let pairs = sums.iter().filter_map(|(sums, difference)| Some([(*difference)?, squared_light(sums)]));
        // Above 0, as it marks what is interpolated.
        let relative = relative_difference(pairs).max(f32::MIN_POSITIVE);
        self.interpolation_errors = vec![0.0; self.sums.len()];
        for (texel, (sums, _)) in missing.iter().zip(sums) {
            self.sums[texel.place()] = sums;
            self.interpolation_errors[texel.place()] = relative;
        }
    }

    /// Whether the sums of a texel are interpolated.
    fn is_interpolated(&self, place: usize) -> bool {
        self.interpolation_errors.get(place).is_some_and(|error| *error > 0.0)
    }

    /// The errors of the smoothed light.
    fn errors(&self) -> SquaredErrors {
        let errors = self.smoothed.errors();
        if self.interpolation_errors.is_empty() {
            return errors;
        }
        let squared_light = |estimates: &Estimates| mean(estimates).length_squared() / 3.0;
        let by_texel = self.interpolation_errors.par_iter().zip(&self.smoothed.estimates);
        let interpolation: Vec<f32> =
            by_texel.map(|(error, estimates)| error * squared_light(estimates)).collect();
        errors.with(&interpolation)
    }

    /// Adds samples to the sums of a texel until each replicate has `samples`.
    fn add(&self, place: usize, sums: &mut SampleSums, samples: u32) {
        let (texel, shared) = (&self.texels[place], &self.cuts.of(CoveredTexel::new(place)).shared);
        if texel.is_hidden() || shared.is_empty() {
            return;
        }
        let (scene, seed) = (self.sources.scene, hash(self.options.seed ^ Stream::SharedLight(0).number()));
        for (replicate, sum) in sums.sums.iter_mut().enumerate() {
            let sequence = TileSequence::new(seed, Stream::SharedLight(replicate as u32), texel, self.first);
            for sample in sums.samples..samples {
                let [x, y, ..] = sequence.first(sample);
                let Some(point) = texel.point(scene, x, y) else { continue };
                let [choice, u, v, _] = sequence.point(sample, 1);
                let light = self.sources.sample(shared, &receiver(scene, &point), [choice, u, v]);
                *sum += light.baked;
                sums.controls[replicate] += light.control;
                sums.visible_controls[replicate] +=
                    if light.has_ray && !light.hidden { light.control } else { 0.0 };
                sums.mixed += light.mixed;
                sums.inverse_distances += light.inverse_distance;
                sums.rays += u32::from(light.has_ray);
            }
        }
        sums.samples = sums.samples.max(samples);
    }

    /// The light of individually sampled sources plus that of shared ones, without smoothing, as far as it is known.
    pub fn with(&self, direct: &[Direct]) -> Vec<Direct> {
        let total = |(direct, sums): (&Direct, &SampleSums)| {
            let mut total = *direct;
            total.baked += mean(&sums.estimates());
            total
        };
        direct.par_iter().zip(&self.sums).map(total).collect()
    }

    /// Smooths the samples, and estimates the errors of the result.
    fn smooth(&self, monitor: &mut BakeMonitor<'_>) -> Result<Denoised, BakeError> {
        let raw: Vec<Estimates> = monitor.run_interruptible(0.0, || {
            if self.sums.iter().all(|sums| sums.controlled_light.is_none()) {
                return self.sums.par_iter().map(SampleSums::estimates).collect();
            }
            let shares = visible_shares(&self.neighbourhoods, &self.sums);
            let estimates = |(sums, shares): (&SampleSums, _)| sums.controlled_estimates(shares);
            self.sums.par_iter().zip(shares).map(estimates).collect()
        })?;
        let nearness = |place: usize| self.sums[place].mean_nearness();
        Denoised::new(&self.neighbourhoods, &raw, nearness, self.options.denoise, monitor)
    }

    /// Takes more rounds, until no more of the requested squared error is left than `goals` allow sources that share
    /// samples, of which the individually sampled ones leave `left_by_individual`.
    pub fn refine(
        &mut self,
        local: &LocalLight,
        goals: &ErrorGoals,
        left_by_individual: f64,
        monitor: &mut BakeMonitor<'_>,
    ) -> Result<(), BakeError> {
        let least_goal = goals.of_shared(goals.share_for(0.0), left_by_individual);
        let (mut before, mut chosen_goal, mut tried_controls) = ([f64::INFINITY; 2], None, false);
        loop {
            let relative = local.relative_errors(&self.errors());
            let is_sampled = |texel: &CoveredTexel| self.sums[texel.place()].samples > 0;
            let sampled: Vec<CoveredTexel> =
                CoveredTexel::all(self.texels.len()).filter(is_sampled).collect();
            let summed =
                |squares: &[f32]| sampled.iter().map(|texel| f64::from(squares[texel.place()])).sum::<f64>();
            let left = summed(&relative.expected);
            let errors = ErrorsInViews::new(&local.views, &relative.expected);
            let samples: Vec<u32> = self.sums.iter().map(|sums| sums.samples).collect();
            let taken: u64 = samples.iter().map(|&samples| u64::from(samples)).sum();
            let count = sampled.len() as u64;
            let budget =
                goals.budget_share() * self.options.effort().budget(count) as f64 / REPLICATES as f64;
            let budget = (budget as u64).saturating_sub(taken);
            // Samples are allocated by the cautious errors, but the goal is for the expected ones: scale it.
            let caution = summed(&relative.cautious) / left;
            // Before a round can reach the least share, a few uncertain texels dominate and the samples of the others
            // cannot be foreseen.
            if chosen_goal.is_none() && left <= MAX_REDUCTION * least_goal {
                let allocator = self.allocator(&sampled, &relative.cautious, &samples);
                let foreseen = taken + allocator.added(&allocator.within(budget, caution * least_goal));
                let per_texel = (foreseen * REPLICATES as u64) as f64 / count.max(1) as f64;
                chosen_goal = Some(goals.of_shared(goals.share_for(per_texel), left_by_individual));
            }
            let goal = chosen_goal.unwrap_or(least_goal);
            let sums = errors.sums();
            let is_open =
                |place: usize| sums[place] > goal * ENOUGH && sums[place] <= STALLED * before[place];
            if !is_open(0) && !is_open(1) {
                return Ok(());
            }
            if !tried_controls && budget > 0 {
                tried_controls = true;
                let plan = errors.shares(goal, MOST_DOUBLINGS_LEAVE);
                let plan = WeightedGoal::new(&relative.cautious, &plan, &sampled, ORDER);
                let plan = self.allocator(&sampled, &plan.variances, &samples).reach(plan.sum);
                if self.add_controls(&plan, monitor)? {
                    self.smoothed = self.smooth(monitor)?;
                    // It was chosen for the samples that would have been needed without control variates.
                    chosen_goal = None;
                    continue;
                }
            }
            before = sums;
            let worthwhile = (WORTHWHILE * self.texels.len() as f64) as u64 / REPLICATES as u64;
            let worthwhile = worthwhile.min(budget);
            let mut aim = goal;
            let allocated = loop {
                let shares = errors.shares(aim, MAX_REDUCTION.recip());
                let weighted = WeightedGoal::new(&relative.cautious, &shares, &sampled, ORDER);
                let allocator = self.allocator(&sampled, &weighted.variances, &samples);
                let allocated = allocator.within(budget, weighted.sum);
                if allocator.added(&allocated) >= worthwhile || aim < LEAST_AIM * goal {
                    break allocated;
                }
                aim *= LOWER_AIM;
            };
            monitor.pass(PASS);
            let mut sums = std::mem::take(&mut self.sums);
            let taken = take_samples(&allocated, &mut sums, monitor, |to, sums| {
                let place = to.texel.place();
                let mut sums = match self.is_interpolated(place) {
                    true => SampleSums { controlled_light: sums.controlled_light, ..SampleSums::default() },
                    false => sums,
                };
                self.add(place, &mut sums, to.samples);
                sums
            })?;
            self.sums = sums;
            if taken.is_empty() {
                return Ok(());
            }
            for to in taken {
                if let Some(error) = self.interpolation_errors.get_mut(to.texel.place()) {
                    *error = 0.0;
                }
            }
            self.smoothed = self.smooth(monitor)?;
        }
    }

    /// Decides on the next samples of some texels. All lists but theirs are per covered texel.
    fn allocator<'b>(
        &self,
        texels: &'b [CoveredTexel],
        variances: &'b [f32],
        samples: &'b [u32],
    ) -> SampleAllocator<'b> {
        SampleAllocator { texels, variances, samples, most: self.most, order: ORDER }
    }

    /// How many of the samples that a texel is to have its control variate saves, beside those that would take as long as
    /// it does; it would leave a share of the variance. `None` if that is too little for what it takes.
    fn saved_by_a_control(&self, to: SampleAllocation, variance_left: f32) -> Option<f32> {
        let more = to.samples.saturating_sub(self.sums[to.texel.place()].samples) * REPLICATES as u32;
        let saved = more as f32 * (1.0 - variance_left);
        // Near the sources it takes up to twenty times as long, but there is more to save, too: the noise of some texels
        // would take far more samples than one round foresees.
        let cost = self.cuts.of(to.texel).shared.control_cost();
        (saved > WORTH_A_CONTROL * cost as f32).then_some(saved - cost as f32)
    }

    /// Computes the control variates of texels that are to have so many samples, where they are worth it and as far as
    /// there is time. Returns whether there are any.
    fn add_controls(
        &mut self,
        planned: &[SampleAllocation],
        monitor: &mut BakeMonitor<'_>,
    ) -> Result<bool, BakeError> {
        let (texels, saved): (Vec<CoveredTexel>, Vec<f32>) = monitor.run_interruptible(1.0, || {
            let left_of_blocks = variance_left(&self.neighbourhoods, &self.sums, &self.cuts.blocks);
            let worth_it = |to: &SampleAllocation| {
                let left = left_of_blocks[self.cuts.block(to.texel) as usize];
                let is_new = self.sums[to.texel.place()].controlled_light.is_none();
                let saved = self.saved_by_a_control(*to, left).filter(|_| is_new);
                saved.map(|saved| (to.texel, saved))
            };
            planned.par_iter().filter_map(worth_it).unzip()
        })?;
        // Everything is smoothed once more.
        let saved = saved.iter().map(|saved| f64::from(*saved)).sum::<f64>();
        if saved < SMOOTHING * self.texels.len() as f64 {
            return Ok(false);
        }
        monitor.pass(PASS);
        let lights = in_chunks_until_deadline(texels.len(), monitor, |index| {
            let (texel, shared) = (texels[index], &self.cuts.of(texels[index]).shared);
            mean_controlled_light(self.sources, shared, &self.texels[texel.place()])
        })?;
        for (texel, light) in texels.iter().zip(&lights) {
            self.sums[texel.place()].controlled_light = Some(*light);
        }
        Ok(!lights.is_empty())
    }

    /// Adds the smoothed light to that of the individually sampled sources.
    pub fn add_to(self, direct: &mut [Direct]) {
        let variances = self.errors();
        for (place, direct) in direct.iter_mut().enumerate() {
            let sums = &self.sums[place];
            if sums.samples > 0 {
                let (estimates, variance) = (&self.smoothed.estimates[place], variances.cautious[place]);
                direct.baked += mean(estimates).max(Vec3::ZERO);
                direct.mixed += sums.mixed / (sums.samples * REPLICATES as u32) as f32;
                direct.variance += variance;
                direct.caution += variance - variances.expected[place];
                direct.rays += sums.rays;
                let taken = if self.is_interpolated(place) { 0 } else { sums.samples * REPLICATES as u32 };
                direct.samples_without_ray += taken.saturating_sub(sums.rays);
                if sums.controlled_light.is_some() {
                    // So that the gather knows how much of the time it has taken.
                    let shared = &self.cuts.of(CoveredTexel::new(place)).shared;
                    direct.samples_without_ray += control_cost(self.sources, shared, &self.texels[place]);
                }
                direct.sampled = true;
            }
        }
    }
}
