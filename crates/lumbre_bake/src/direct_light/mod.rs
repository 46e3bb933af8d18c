//! Direct light of every covered texel. Sources that matter by themselves are sampled individually, in passes: a few
//! shadow rays everywhere (or, where time is too short for that, on a grid of texels from which `sparse_pass` lets the
//! others be interpolated); many where the first pass saw a source partly, or saw other sources than a texel nearby,
//! unless its result was exact (so the faint ends of a penumbra are found from their neighbours); then more where the
//! requested error is not yet in reach. Under a time limit the later passes are made for one error after the other, from a
//! coarse one to the requested one. Sources that do not matter by themselves share samples: that is `shared_light`. So do
//! lamps where a good part of a block of texels lies in penumbrae.

mod control_variates;
mod error_goals;
pub(crate) mod light_cuts;
pub(crate) mod light_visibility;
pub(crate) mod local_light;
pub(crate) mod shafts;
pub(crate) mod shared_light;
mod source_sampler;
mod sparse_pass;
pub(crate) mod views;

pub(crate) use local_light::LocalLight;
pub(crate) use source_sampler::SHORT_OF_TIME;

use glam::Vec3;

use error_goals::{ErrorGoals, error_goals};
use source_sampler::SourceSampler;

use crate::chunks::decide;
use crate::coverage::CoveredTexels;
use crate::monitor::BakeMonitor;
use crate::report::StageNotes;
use crate::sources::{Direct, Sources};
use crate::{BakeError, BakeOptions};

/// Light that arrives from lamps, lights and emissive surfaces without a bounce.
pub(crate) struct DirectLight {
    /// Per covered texel.
    pub texels: Vec<Direct>,
    /// The local light of each of them, relative to which errors count.
    pub local: LocalLight,
}

impl DirectLight {
    /// Samples that all texels together took, those that are known from a previous bake included: shadow rays to
    /// individual sources, and samples of the others.
    pub fn samples(&self) -> u64 {
        let of_texel = |direct: &Direct| u64::from(direct.rays) + u64::from(direct.samples_without_ray);
        self.texels.iter().map(of_texel).sum()
    }

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
    // Sharing samples whole blocks anew, which would take the time that the first pass has just saved.
    if light.is_complete {
        sampler.share_penumbrae(&mut light.direct, monitor)?;
    }
    let mut shared = sampler.shared_light(monitor)?;
    let so_far = shared.as_ref().map(|shared| shared.with(&light.direct));
    monitor.pass(PASS_OF_LOCAL_LIGHT);
    let so_far = so_far.as_deref().unwrap_or(&light.direct);
    let local = LocalLight::new(sources, texels, &sampler.cuts.blocks, so_far, monitor)?;
    light.doubtful = sampler.doubtful_texels(&light);
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
        sampler.refine(&mut light, &local, most, (goals.individual, goals.individual_enough), monitor)?;
        if let Some(shared) = &mut shared {
            shared.refine(&local, &goals, light.variance_left(&local), monitor)?;
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

/// Whether there is too little time to aim at the goal after the last one, whose refinement took so many seconds.
fn is_late_for_finer_goal(seconds: f64, monitor: &mut BakeMonitor<'_>) -> Result<bool, BakeError> {
    let is_late = monitor.clock().seconds_left().is_some_and(|left| left < TIME_OF_NEXT_GOAL * seconds);
    decide(monitor, is_late)
}

/// How many times as long as a goal the next one takes: half of the squared error takes
/// 2^(1 / [`source_sampler::ORDER`]) times the samples.
const TIME_OF_NEXT_GOAL: f64 = 1.6;

/// Share of the time after the first passes that finding the local light usually takes.
const PASS_OF_LOCAL_LIGHT: f32 = 0.2;
