//! Direct light of the sources that share samples, of every covered texel: a few samples everywhere, smoothed over neighbours that have the
//! same light cut, then more where they are worth most, until what direct light may leave of the error asked for is reached. Not the
//! samples: those are `shared_samples`'; not the sources that have samples of their own: those are `lighting`'s.

use glam::Vec3;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::light_cuts::LightCuts;
use super::local_light::LocalLight;
use crate::chunks::{in_chunks, in_chunks_until_deadline};
use crate::coverage::footprint::{Texel, receiver};
use crate::coverage::tile_sequence::TileSequence;
use crate::denoise::neighbourhoods::Neighbourhoods;
use crate::denoise::replicates::spread;
use crate::denoise::replicates::{Estimates, REPLICATES, mean};
use crate::denoise::smooth::smooth;
use crate::monitor::BakeMonitor;
use crate::sample_allocation::{SampleAllocation, allocate_within};
use crate::sampling::{Stream, hash};
use crate::sources::direct::Direct;
use crate::sources::light_cut::SharedSources;
use crate::sources::light_sources::Sources;
use crate::texel_index::CoveredTexel;
use crate::{BakeError, BakeOptions};

/// What a texel has found.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub(crate) struct Shared {
    /// Sum of the samples of each replicate, of what is baked.
    pub sums: [Vec3; REPLICATES],
    /// Sum of all samples, of mixed lights.
    pub mixed: Vec3,
    /// Sum of 1 / distance to what was asked, canonical units.
    pub inverse_distances: f32,
    /// Samples of each replicate.
    pub samples: u32,
    /// Rays cast.
    pub rays: u32,
}

/// Order of the variance's fall with the samples: between random ones (1) and Sobol's of something smooth (3).
const ORDER: f64 = 1.25;
/// The most by which a round lowers what is left: the first estimates are rough, and a goal out of reach would take all that can be had.
const MAX_OF_A_ROUND: f64 = 8.0;
/// A round that leaves more than this of the squared error was the last, and one that leaves so many times what was asked: to smooth
/// everything once more takes longer than what is left is worth.
const STALLED: f64 = 0.9;
const ENOUGH: f64 = 1.15;
/// A round's usual share of the time that this one and those after it take.
const PASS: f32 = 0.6;

impl Shared {
    fn estimates(&self) -> Estimates {
        self.sums.map(|sum| sum / self.samples.max(1) as f32)
    }

    fn inverse_distance(&self) -> f32 {
        self.inverse_distances / (self.samples.max(1) * REPLICATES as u32) as f32
    }

    /// Adds samples up to `samples` of each replicate.
    fn add(
        &mut self,
        sources: &Sources<'_>,
        shared: &SharedSources,
        texel: &Texel,
        run: u32,
        samples: u32,
        seed: u32,
    ) {
        for (replicate, sum) in self.sums.iter_mut().enumerate() {
            let sequence = TileSequence::new(seed, Stream::SharedLight(replicate as u32), texel, run);
            for sample in self.samples..samples {
                let [x, y, ..] = sequence.first(sample);
                let Some(point) = texel.point(sources.scene, x, y) else { continue };
                let receiver = receiver(sources.scene, &point);
                let [choice, u, v, _] = sequence.point(sample, 1);
                let found = sources.sample(shared, &receiver, [choice, u, v]);
                *sum += found.baked;
                self.mixed += found.mixed;
                self.inverse_distances += found.inverse_distance;
                self.rays += u32::from(found.has_ray);
            }
        }
        self.samples = self.samples.max(samples);
    }
}

/// The texels, as this stage needs them.
pub(crate) struct SharedLight<'a> {
    sources: &'a Sources<'a>,
    texels: &'a [Texel],
    cuts: &'a LightCuts,
    neighbourhoods: Neighbourhoods<'a>,
    options: &'a BakeOptions,
    /// Samples of each replicate: in the first round, and at most.
    first: u32,
    most: u32,
    pub found: Vec<Shared>,
}

impl<'a> SharedLight<'a> {
    /// The first round: a few samples of every texel that is `wanted`, by its place.
    ///
    /// # Errors
    /// [`BakeError::Cancelled`].
    pub fn new(
        sources: &'a Sources<'a>,
        neighbourhoods: Neighbourhoods<'a>,
        cuts: &'a LightCuts,
        wanted: impl Fn(usize) -> bool + Sync,
        options: &'a BakeOptions,
        monitor: &mut BakeMonitor<'_>,
    ) -> Result<Self, BakeError> {
        let texels = neighbourhoods.texels;
        let [first, most] = options.effort().shared.map(|samples| samples.div_ceil(REPLICATES as u32));
        let mut light =
            Self { sources, texels, cuts, neighbourhoods, options, first, most, found: Vec::new() };
        // A complete map first, whatever time it takes; where that is limited, roughly.
        let begun = monitor.seconds();
        let few = if options.time.is_some() { 1 } else { first };
        light.found = in_chunks(texels.len(), monitor, |place| {
            let mut own = Shared::default();
            if wanted(place) {
                light.add(place, &mut own, few);
            }
            own
        })?;
        let samples = monitor.clock().affordable(few, first, monitor.seconds() - begun);
        if samples > few {
            let more = in_chunks_until_deadline(texels.len(), monitor, |place| {
                let mut own = light.found[place];
                if wanted(place) {
                    light.add(place, &mut own, samples);
                }
                own
            })?;
            light.found.splice(..more.len(), more);
        }
        Ok(light)
    }

    fn add(&self, place: usize, own: &mut Shared, samples: u32) {
        let (texel, shared) = (&self.texels[place], &self.cuts.of(place).shared);
        if !texel.is_hidden() && !shared.is_empty() {
            own.add(
                self.sources,
                shared,
                texel,
                self.first,
                samples,
                hash(self.options.seed ^ Stream::SharedLight(0).number()),
            );
        }
    }

    /// What is known so far, without smoothing, in addition to the light of the sources that have samples of their own.
    pub fn with(&self, direct: &[Direct]) -> Vec<Direct> {
        let both = |(direct, own): (&Direct, &Shared)| {
            let mut both = *direct;
            both.baked += mean(&own.estimates());
            both
        };
        direct.par_iter().zip(&self.found).map(both).collect()
    }

    /// More rounds, and what they bring, added to `direct`. `goal` tells for a share of the squared error asked for the sum over all texels of
    /// squared errors, relative to the light around them, that may then be left; `share` tells that share, for so many samples for each texel
    /// as are foreseen for the `least` one.
    ///
    /// # Errors
    /// [`BakeError::Cancelled`].
    pub fn finish(
        mut self,
        direct: &mut [Direct],
        local: &LocalLight,
        (least, share): (f64, &impl Fn(f64) -> f64),
        goal: &impl Fn(f64) -> f64,
        monitor: &mut BakeMonitor<'_>,
    ) -> Result<(), BakeError> {
        let (mut before, mut chosen) = (f64::INFINITY, None);
        let (estimates, variances) = loop {
            let raw: Vec<Estimates> = self.found.par_iter().map(Shared::estimates).collect();
            let (estimates, bias) = monitor.run_interruptible(1.0, || match self.options.denoise {
                true => {
                    let near: Vec<f32> = self.found.par_iter().map(Shared::inverse_distance).collect();
                    smooth(&self.neighbourhoods, &raw, &near)
                }
                false => (raw, vec![0.0; self.found.len()]),
            })?;
            let spread = monitor.run_interruptible(1.0, || spread(&self.neighbourhoods, &estimates))?;
            let variances = spread.with(&bias);
            let relative = local.relative_errors(&variances);
            let asked = |texel: &CoveredTexel| self.found[texel.place()].samples > 0;
            let asking = CoveredTexel::all(self.texels.len()).filter(asked);
            let summed =
                |squares: &[f32]| asking.clone().map(|texel| f64::from(squares[texel.place()])).sum::<f64>();
            let left = summed(&relative.expected);
            let stalled = left > STALLED * before;
            let samples: Vec<u32> = self.found.iter().map(|own| own.samples).collect();
            let taken: u64 = samples.iter().map(|&samples| u64::from(samples)).sum();
            let count = asking.clone().count() as u64;
            let budget = self.options.effort().budget(count) / REPLICATES as u64;
            let budget = budget.saturating_sub(taken);
            // Samples are given out by the cautious figures; the goal is one of expected ones.
            let feared = summed(&relative.cautious) / left;
            let allocate = |goal: f64| -> Vec<SampleAllocation> {
                let asking = asking.clone();
                allocate_within(budget, asking, &relative.cautious, &samples, self.most, ORDER, feared * goal)
            };
            // Before the least share is in reach of a round, a few texels of which little is known hide what the others take.
            if chosen.is_none() && left <= MAX_OF_A_ROUND * goal(least) {
                let more = |own: &SampleAllocation| u64::from(own.samples - samples[own.texel.place()]);
                let foreseen = taken + allocate(goal(least)).iter().map(more).sum::<u64>();
                chosen = Some(share((foreseen * REPLICATES as u64) as f64 / count.max(1) as f64));
            }
            let goal = goal(chosen.unwrap_or(least));
            if left <= goal * ENOUGH || stalled || monitor.clock().is_over() {
                break (estimates, variances);
            }
            before = left;
            let wanted = allocate(goal.max(left / MAX_OF_A_ROUND));
            monitor.pass(PASS);
            let more = in_chunks_until_deadline(wanted.len(), monitor, |index| {
                let SampleAllocation { texel, samples } = wanted[index];
                let mut own = self.found[texel.place()];
                self.add(texel.place(), &mut own, samples);
                own
            })?;
            if more.is_empty() {
                break (estimates, variances);
            }
            for (allocated, own) in wanted.iter().zip(more) {
                self.found[allocated.texel.place()] = own;
            }
        };
        for (place, (direct, own)) in direct.iter_mut().zip(&self.found).enumerate() {
            if own.samples > 0 {
                let (estimates, variance) = (&estimates[place], variances.cautious[place]);
                direct.baked += mean(estimates).max(Vec3::ZERO);
                direct.mixed += own.mixed / (own.samples * REPLICATES as u32) as f32;
                direct.variance += variance;
                direct.caution += variance - variances.expected[place];
                direct.rays += own.rays;
                direct.sampled = true;
            }
        }
        Ok(())
    }
}
