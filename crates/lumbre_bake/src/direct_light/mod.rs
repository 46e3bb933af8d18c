//! Direct light of every covered texel. Sources that matter by themselves are sampled individually, in passes: a few
//! shadow rays everywhere; many where the first pass saw a source partly, or saw other sources than a texel nearby,
//! unless its result was exact (so the faint ends of a penumbra are found from their neighbours); then more where the
//! requested error is not yet in reach. Under a time limit the later passes are made for one error after the other, from a
//! coarse one to the requested one. Sources that do not matter by themselves share samples: that is `shared_light`. So do
//! lamps where nearly everything lies in their penumbrae.

pub(crate) mod light_cuts;
pub(crate) mod light_visibility;
pub(crate) mod local_light;
pub(crate) mod shafts;
pub(crate) mod shared_light;

pub(crate) use local_light::LocalLight;

use std::collections::{BTreeSet, HashMap};

use glam::Vec3;

use crate::chunks::{decide, in_chunks, in_chunks_until_deadline};
use crate::coverage::{CoveredTexels, Texel, receiver};
use crate::denoise::Neighbourhoods;
use crate::direct_light::light_cuts::LightCuts;
use crate::direct_light::shafts::Shafts;
use crate::direct_light::shared_light::SharedLight;
use crate::monitor::BakeMonitor;
use crate::report::StageNotes;
use crate::sample_allocation::{SampleAllocation, allocate};
use crate::sampling::{Sequence, Stream};
use crate::sources::{Direct, SampledReceiver, Sources, VisibilitySummary};
use crate::texel_index::{CoveredTexel, MapTexel};
use crate::{BakeError, BakeOptions};

/// How far around a texel that saw a penumbra others may be in it too, in texels.
const REACH: u32 = 2;

/// Light that arrives from lamps, lights and emissive surfaces without a bounce.
pub(crate) struct DirectLight {
    /// Per covered texel.
    pub texels: Vec<Direct>,
    /// The local light of each of them, relative to which errors count.
    pub local: LocalLight,
}

impl DirectLight {
    /// Irradiance (mixed lights included) per texel of all maps; NaN where no surface is in the open.
    pub fn by_place(&self, texels: &CoveredTexels<'_>) -> Vec<Vec3> {
        let mut total = vec![Vec3::NAN; texels.layout.texels];
        for (covered, texel) in texels.open() {
            total[texel.index.place()] = self.texels[covered.place()].total();
        }
        total
    }
}

/// Computes the direct light of every covered texel, and the local light around it. Texels that are `known` from a
/// previous bake keep their light; an empty list means that none is known.
pub(crate) fn direct_light(
    sources: &Sources<'_>,
    texels: &CoveredTexels<'_>,
    known: &[Option<Direct>],
    options: &BakeOptions,
    monitor: &mut BakeMonitor<'_>,
) -> Result<(DirectLight, StageNotes), BakeError> {
    let mut sampler = SourceSampler::new(sources, texels, known, options, monitor)?;
    let mut light = sampler.first_pass(monitor)?;
    sampler.share_penumbrae(&mut light.direct, monitor)?;
    let mut shared = sampler.shared_light(monitor)?;
    let so_far = shared.as_ref().map(|shared| shared.with(&light.direct));
    monitor.pass(PASS_OF_LOCAL_LIGHT);
    let so_far = so_far.as_deref().unwrap_or(&light.direct);
    let local = LocalLight::new(sources, texels, &sampler.cuts.blocks, so_far, monitor)?;
    light.doubtful = sampler.doubtful_texels(&light.direct);
    let mut seconds_of_last_goal = 0.0;
    for (step, error) in error_goals(options).into_iter().enumerate() {
        if step > 0 && is_late_for_finer_goal(seconds_of_last_goal, monitor)? {
            monitor.cut_short();
            break;
        }
        let options = BakeOptions { error, ..*options };
        let goals = ErrorGoals::new(sources, texels, &options, shared.is_some());
        let [_, many, most] = options.effort().direct;
        sampler.sample(&light.with_fewer_samples(many), &mut light, monitor)?;
        let begun = monitor.seconds();
        sampler.refine(&mut light, &local, most, goals.individual, monitor)?;
        if let Some(shared) = &mut shared {
            let left = sum(&relative_variances(&light.direct, &local));
            let goal = |share: f64| goals.of_shared(share, left);
            let share = |samples: f64| goals.share_for(samples);
            shared.refine(&local, (share(0.0), &share), &goal, monitor)?;
        }
        seconds_of_last_goal = monitor.seconds() - begun;
    }
    let mut direct = light.direct;
    if let Some(shared) = shared {
        shared.add_to(&mut direct);
    }
    let rays = sampler.unknown().map(|texel| u64::from(direct[texel.place()].rays));
    let notes = StageNotes::of_rays(rays.sum());
    Ok((DirectLight { texels: direct, local }, notes))
}

/// The direct light of the individually sampled sources, as far as it has been sampled.
struct IndividualLight {
    /// Per covered texel.
    direct: Vec<Direct>,
    /// Samples that have been taken, per covered texel.
    samples: Vec<u32>,
    /// The texels that may need more samples than the first pass takes.
    doubtful: Vec<CoveredTexel>,
}

impl IndividualLight {
    /// Allocates `many` samples to each doubtful texel that has had fewer.
    fn with_fewer_samples(&self, many: u32) -> Vec<SampleAllocation> {
        let fewer = self.doubtful.iter().filter(|texel| self.samples[texel.place()] < many);
        fewer.map(|&texel| SampleAllocation { texel, samples: many }).collect()
    }
}

/// Samples the direct light of the texels that are not known from a previous bake, with everything that all passes
/// need.
struct SourceSampler<'a> {
    sources: &'a Sources<'a>,
    texels: &'a CoveredTexels<'a>,
    known: &'a [Option<Direct>],
    options: &'a BakeOptions,
    cuts: LightCuts,
    shafts: Shafts<'a>,
}

impl<'a> SourceSampler<'a> {
    fn new(
        sources: &'a Sources<'a>,
        texels: &'a CoveredTexels<'a>,
        known: &'a [Option<Direct>],
        options: &'a BakeOptions,
        monitor: &mut BakeMonitor<'_>,
    ) -> Result<Self, BakeError> {
        let mut cuts = monitor.run_interruptible(1.0, || LightCuts::new(sources, texels))?;
        let is_wanted = |texel: CoveredTexel| known_light(known, texel).is_none();
        let shafts =
            monitor.run_interruptible(1.0, || Shafts::new(sources, &texels.list, &cuts, is_wanted))?;
        // Where shadow rays would be needed anyway, one ray to any of the sources is worth as much as one to each of
        // them. Not so where all lamps have samples of their own: the unoccluded sum over them is exact, and rays only
        // find the visible share of it.
        cuts.share(sources, &shafts.unresolved(&cuts, |_, cut| !cut.has_all_lamps));
        Ok(Self { sources, texels, known, options, cuts, shafts })
    }

    fn is_wanted(&self, texel: CoveredTexel) -> bool {
        known_light(self.known, texel).is_none()
    }

    /// The texels whose light is not known from a previous bake.
    fn unknown(&self) -> impl Iterator<Item = CoveredTexel> {
        CoveredTexel::all(self.texels.list.len()).filter(|&texel| self.is_wanted(texel))
    }

    /// The light of the individually sampled sources at a texel, by so many samples of each.
    fn light(&self, covered: CoveredTexel, samples: u32) -> Direct {
        let texel = &self.texels.list[covered.place()];
        if texel.is_hidden() {
            return Direct::default();
        }
        let scene = self.sources.scene;
        let sampled = SampledReceiver {
            point: |x: f32, y: f32| texel.point(scene, x, y).map(|point| receiver(scene, &point)),
            visibility: &self.shafts.visibility(covered.place(), texel),
            sequence: Sequence::new(self.options.seed, Stream::DirectLight, texel.index.0),
            samples,
        };
        self.sources.irradiance_per_source(self.cuts.of(covered), &sampled)
    }

    /// The light of texels by a few samples, whatever time it takes.
    fn few_samples(
        &self,
        texels: &[CoveredTexel],
        few: u32,
        monitor: &mut BakeMonitor<'_>,
    ) -> Result<Vec<Direct>, BakeError> {
        let clock = monitor.clock();
        monitor.pass(PASS);
        in_chunks(texels.len(), monitor, |place| {
            self.light(texels[place], if clock.is_over() { few.min(LATE_SAMPLES) } else { few })
        })
    }

    /// Known light, and a few samples of every other texel: a complete map, whatever time it takes.
    fn first_pass(&self, monitor: &mut BakeMonitor<'_>) -> Result<IndividualLight, BakeError> {
        let unknown: Vec<CoveredTexel> = self.unknown().collect();
        let [usual, ..] = self.options.effort().direct;
        let is_time_short = decide(monitor, monitor.clock().is_past(SHORT_OF_TIME))?;
        let few = if is_time_short { usual.min(LATE_SAMPLES) } else { usual };
        let sampled = self.few_samples(&unknown, few, monitor)?;
        let count = self.texels.list.len();
        let mut direct: Vec<Direct> = CoveredTexel::all(count)
            .map(|texel| known_light(self.known, texel).unwrap_or_default())
            .collect();
        for (texel, light) in unknown.iter().zip(sampled) {
            direct[texel.place()] = light;
        }
        Ok(IndividualLight { direct, samples: vec![usual; count], doubtful: Vec::new() })
    }

    /// Makes lamps share samples in blocks that lie in their penumbrae for the most part: behind a grille, or among
    /// many thin blockers. The visible share of each texel by itself would take hundreds of rays, while smoothing makes
    /// use of the neighbours' samples. The light of these blocks is sampled again.
    fn share_penumbrae(
        &mut self,
        direct: &mut [Direct],
        monitor: &mut BakeMonitor<'_>,
    ) -> Result<(), BakeError> {
        let lamps = monitor.run_interruptible(0.0, || {
            let mut lamps = self.shafts.unresolved(&self.cuts, |_, cut| cut.has_all_lamps);
            if lamps.is_empty() {
                return lamps;
            }
            // Per block, its texels outside of penumbrae less those in them.
            let mut balance: HashMap<u32, i64> = HashMap::new();
            for texel in self.unknown().filter(|texel| !self.texels.list[texel.place()].is_hidden()) {
                let change = if direct[texel.place()].seen.partly { -1 } else { 1 };
                *balance.entry(self.cuts.block(texel)).or_default() += change;
            }
            lamps.retain(|(texel, _)| {
                balance.get(&self.cuts.block(*texel)).is_some_and(|balance| *balance < 0)
            });
            self.cuts.share(self.sources, &lamps);
            lamps
        })?;
        if lamps.is_empty() {
            return Ok(());
        }
        let blocks: BTreeSet<u32> = lamps.iter().map(|(texel, _)| self.cuts.block(*texel)).collect();
        let changed: Vec<CoveredTexel> =
            self.unknown().filter(|texel| blocks.contains(&self.cuts.block(*texel))).collect();
        let [few, ..] = self.options.effort().direct;
        for (texel, light) in changed.iter().zip(self.few_samples(&changed, few, monitor)?) {
            // What was seen before tells the neighbours that a penumbra is near.
            let Direct { rays, seen, .. } = direct[texel.place()];
            direct[texel.place()] = Direct { rays: rays + light.rays, seen, ..light };
        }
        Ok(())
    }

    /// The first round of the sources that share samples; `None` if there are none.
    fn shared_light(&self, monitor: &mut BakeMonitor<'_>) -> Result<Option<SharedLight<'_>>, BakeError> {
        if !self.cuts.share_samples() {
            return Ok(None);
        }
        let is_wanted = |place: usize| self.is_wanted(CoveredTexel::new(place));
        // Texels with known light have no shared samples, so the others must not be compared with them.
        let keys = self.cuts.keys().into_iter().enumerate();
        let groups: Vec<u32> = keys.map(|(place, key)| 2 * key + u32::from(is_wanted(place))).collect();
        let neighbourhoods = Neighbourhoods::new(self.texels, &groups);
        monitor.pass(PASS);
        let shared =
            SharedLight::new(self.sources, neighbourhoods, &self.cuts, is_wanted, self.options, monitor)?;
        Ok(Some(shared))
    }

    /// The texels in or near penumbras, as far as the first pass has found them.
    fn doubtful_texels(&self, direct: &[Direct]) -> Vec<CoveredTexel> {
        let mut texels = doubtful_texels(self.texels, direct);
        texels.retain(|&texel| self.is_wanted(texel) && direct[texel.place()].sampled);
        texels
    }

    /// Takes more samples of doubtful texels, up to `most`, mostly at the edges of shadows, until the sum of squared
    /// errors is down to `goal`, no texel can have more, or the time is up.
    fn refine(
        &self,
        light: &mut IndividualLight,
        local: &LocalLight,
        most: u32,
        goal: f64,
        monitor: &mut BakeMonitor<'_>,
    ) -> Result<(), BakeError> {
        loop {
            let variances = relative_variances(&light.direct, local);
            if sum(&variances) <= goal {
                return Ok(());
            }
            let texels = light.doubtful.iter().copied();
            let allocated = allocate(texels, &variances, &light.samples, most, ORDER, goal);
            if self.sample(&allocated, light, monitor)? == 0 {
                return Ok(());
            }
        }
    }

    /// Samples the texels of a list anew, as far as there is time; returns for how many of them there was. Their rays
    /// add up.
    fn sample(
        &self,
        wanted: &[SampleAllocation],
        light: &mut IndividualLight,
        monitor: &mut BakeMonitor<'_>,
    ) -> Result<usize, BakeError> {
        if wanted.is_empty() {
            return Ok(0);
        }
        monitor.pass(PASS);
        let sampled = in_chunks_until_deadline(wanted.len(), monitor, |index| {
            self.light(wanted[index].texel, wanted[index].samples)
        })?;
        for (SampleAllocation { texel, samples }, &sampled) in wanted.iter().zip(&sampled) {
            let rays = light.direct[texel.place()].rays + sampled.rays;
            light.direct[texel.place()] = Direct { rays, ..sampled };
            light.samples[texel.place()] = *samples;
        }
        Ok(sampled.len())
    }
}

/// The errors to aim at, one after the other. With a time limit they begin with a coarse one and go down by steps of
/// [`GOAL_STEP`] to the requested one: whenever the time is up, all texels are about equally good.
fn error_goals(options: &BakeOptions) -> Vec<f64> {
    let mut goals = vec![options.error];
    while options.time.is_some() && goals[goals.len() - 1] < MIN_FIRST_GOAL {
        goals.push(GOAL_STEP * goals[goals.len() - 1]);
    }
    goals.reverse();
    goals
}

/// Under a time limit the first error to aim at is at least this one.
const MIN_FIRST_GOAL: f64 = 0.08;

/// Each goal is so many times the next one. A step of 2 left up to half of the time unused, as the last goal that fits is
/// reached early or the next one does not fit.
const GOAL_STEP: f64 = std::f64::consts::SQRT_2;

/// Whether there is too little time to aim at the goal after the last one, whose refinement took so many seconds.
fn is_late_for_finer_goal(seconds: f64, monitor: &mut BakeMonitor<'_>) -> Result<bool, BakeError> {
    let is_late = monitor.clock().seconds_left().is_some_and(|left| left < TIME_OF_NEXT_GOAL * seconds);
    decide(monitor, is_late)
}

/// How many times as long as a goal the next one takes: half of the squared error takes 2^(1 / [`ORDER`]) times the
/// samples.
const TIME_OF_NEXT_GOAL: f64 = 1.6;

/// The light of a texel from a previous bake.
fn known_light(known: &[Option<Direct>], texel: CoveredTexel) -> Option<Direct> {
    known.get(texel.place()).copied().flatten()
}

/// What direct light may leave of the requested error, as sums over all texels of squared errors relative to the local
/// light.
struct ErrorGoals {
    /// The sum that is requested for the whole bake.
    total: f64,
    /// The least share of it for direct light.
    share: f64,
    /// The sum that individually sampled sources may leave.
    individual: f64,
    /// Whether light bounces, so that a final gather follows.
    has_gather: bool,
}

impl ErrorGoals {
    fn new(
        sources: &Sources<'_>,
        texels: &CoveredTexels<'_>,
        options: &BakeOptions,
        has_shared: bool,
    ) -> Self {
        let open = texels.open().count().max(1) as f64;
        let total = open * options.error.powi(2);
        let has_gather = sources.scene.surfaces.iter().any(|surface| !surface.is_black());
        // Shared samples are mostly cheaper than rays of the gather, so that direct light is held to a smaller share of
        // the error.
        let share = if has_shared && has_gather { MIN_SHARED_SHARE } else { INDIVIDUAL_SHARE };
        let individual = total * if has_shared { 0.5 * share } else { share };
        Self { total, share, individual, has_gather }
    }

    /// What sources that share samples may leave if direct light has this share of the total, and the individually
    /// sampled ones leave `left`.
    fn of_shared(&self, share: f64, left: f64) -> f64 {
        (self.total * share - left).max(self.individual)
    }

    /// The share of the total for direct light if shared sources need so many samples per texel to reach the least
    /// share.
    fn share_for(&self, samples: f64) -> f64 {
        if self.has_gather { share_beside_gather(samples) } else { self.share }
    }
}

/// The share of the requested squared error that direct light may leave where all sources are sampled individually.
const INDIVIDUAL_SHARE: f64 = 0.35;
/// Its least and greatest value where sources share samples and a gather follows.
const MIN_SHARED_SHARE: f64 = 0.2;
const MAX_SHARED_SHARE: f64 = 0.5;
/// The share that direct light and the gather may leave together.
const BOTH_SHARE: f64 = 0.85;
/// Cost of the gather: its rays per texel times the share of the squared error that they leave. From 7 in a room to 30
/// in the demo level.
const GATHER_COST: f64 = 30.0;

/// The share of the requested squared error for direct light, whose shared sources need so many samples per texel to
/// reach
/// [`MIN_SHARED_SHARE`]. As variance is inversely proportional to the samples, direct light and the gather take the
/// fewest samples together if their shares are in proportion to the square roots of their costs.
fn share_beside_gather(samples: f64) -> f64 {
    let (direct, gather) = ((samples * MIN_SHARED_SHARE).sqrt(), GATHER_COST.sqrt());
    (BOTH_SHARE * direct / (direct + gather)).clamp(MIN_SHARED_SHARE, MAX_SHARED_SHARE)
}

/// The power of the number of samples with which the variance falls at straight edges of shadows, as measured.
const ORDER: f64 = 1.5;

/// A pass's usual share of the time that it and the passes after it take.
const PASS: f32 = 0.5;
const PASS_OF_LOCAL_LIGHT: f32 = 0.2;

/// If more than this share of the time for direct light has passed before any is computed, time is short for a scene of
/// this size.
pub(crate) const SHORT_OF_TIME: f64 = 0.3;

/// Shadow rays of a texel in the first pass if time is short or over: still enough to estimate the error from their spread.
const LATE_SAMPLES: u32 = 4;

/// The expected variances relative to the squared local light.
fn relative_variances(direct: &[Direct], local: &LocalLight) -> Vec<f32> {
    let variances: Vec<f32> = direct.iter().map(|direct| direct.variance - direct.caution).collect();
    local.relative(&variances)
}

fn sum(numbers: &[f32]) -> f64 {
    numbers.iter().map(|&number| f64::from(number)).sum()
}

/// Texels that have, within [`REACH`], a texel (perhaps themselves) that saw a source partly, or one that saw other
/// sources than they did.
fn doubtful_texels(texels: &CoveredTexels<'_>, direct: &[Direct]) -> Vec<CoveredTexel> {
    let seen_at = |place: MapTexel| texels.open_at(place).map(|texel| direct[texel.place()].seen);
    let is_doubtful = |(covered, texel): &(CoveredTexel, &Texel)| {
        let summary = direct[covered.place()].seen;
        let map = &texels.layout.maps[texel.object as usize];
        let differs = |other: VisibilitySummary| other.partly || other.signature != summary.signature;
        map.neighbourhood(texel.x, texel.y, REACH).any(|near| seen_at(near).is_some_and(differs))
    };
    texels.open().filter(is_doubtful).map(|(covered, _)| covered).collect()
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    #[test]
    fn only_a_time_limit_makes_direct_light_go_through_coarser_goals() {
        let goals = |error: f64, time: Option<u64>| {
            error_goals(&BakeOptions { error, time: time.map(Duration::from_secs), ..BakeOptions::default() })
        };
        assert_eq!(goals(0.01, None), [0.01]);
        let limited = goals(0.01, Some(60));
        assert_eq!((limited.len(), limited[6]), (7, 0.01));
        assert!(limited[0] >= MIN_FIRST_GOAL && limited[1] < MIN_FIRST_GOAL);
        assert!(limited.is_sorted_by(|coarse, fine| (coarse / fine - GOAL_STEP).abs() < 1e-9));
        assert_eq!(goals(0.5, Some(60)), [0.5], "coarser than any goal");
    }
}
