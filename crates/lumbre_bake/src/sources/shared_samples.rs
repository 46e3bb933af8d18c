//! The light of sources that share samples: each sample draws one of them, about in proportion to what it may bring, and one point of it, and
//! casts one shadow ray. What a sample takes is the same for ten sources and for ten thousand. Not which sources those are: that is
//! `light_cut`.

use glam::Vec3;
use lumbre_optics::BakeMode;

use super::emitter_walk::EmitterChoice;
use super::light_cut::{Branch, SharedSources};
use super::punctual::{self, FIRST_ID};
use crate::sampling::Sequence;
use crate::scene::Receiver;
use crate::sources::batches::{BATCHES, batch_of, variance_of_mean};
use crate::sources::direct::Direct;
use crate::sources::emitter_sample::sample_emitter;
use crate::sources::light_sources::Sources;

/// What one sample found: irradiance, W/m², over the probability of the choice.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct SourceSample {
    /// Of emissive triangles and static lights.
    pub baked: Vec3,
    /// Of mixed lights.
    pub mixed: Vec3,
    /// Whether a shadow ray was cast, and whether it found the source hidden.
    pub asked: bool,
    pub hidden: bool,
    /// 1 / distance to the point, canonical units; 0 where it could bring nothing.
    pub inverse_distance: f32,
}

/// The dimension sets of such samples: where on the receiver, and where on which source.
const PLACE_SET: u32 = 32;
const SOURCE_SET: u32 = 33;

impl Sources<'_> {
    /// One sample at a receiver by three numbers in [0, 1): which source, and where on it.
    pub fn sample(
        &self,
        shared: &SharedSources,
        receiver: &Receiver,
        [choice, u, v]: [f32; 3],
    ) -> SourceSample {
        let nothing = SourceSample::default();
        let Some((branch, choice, of_branch)) = self.pick_branch(shared, receiver, choice) else {
            return nothing;
        };
        match branch {
            Branch::Emitters(node) => {
                let EmitterChoice { emitter, probability, .. } =
                    self.emitter_tree.pick(node, receiver, choice);
                let emitter = &self.emitters[emitter as usize];
                let Some(sample) = sample_emitter(emitter, receiver, (u, v)) else { return nothing };
                let light = sample.light / (probability * of_branch);
                if !light.is_finite() {
                    return nothing;
                }
                let hidden = self.is_occluded(emitter, &sample, receiver);
                let baked = if hidden { Vec3::ZERO } else { light };
                let inverse_distance = sample.distance.max(f32::MIN_POSITIVE).recip();
                SourceSample { baked, mixed: Vec3::ZERO, asked: true, hidden, inverse_distance }
            }
            Branch::Lights(node) => {
                let Some((light, probability)) = self.light_tree.pick(node, receiver, choice) else {
                    return nothing;
                };
                let placed = &self.lights[light as usize];
                let Some(sampled) = punctual::sample_light(self.scene, placed, receiver, (u, v), false)
                else {
                    return nothing;
                };
                let light = placed.light.diffuse * (sampled.disc.max(0.0) / (probability * of_branch));
                let light = if sampled.visible && light.is_finite() { light } else { Vec3::ZERO };
                let distance = self.scene.space.position(placed.position).distance(receiver.position);
                let (baked, mixed) = match placed.light.bake {
                    BakeMode::Static => (light, Vec3::ZERO),
                    BakeMode::Mixed | BakeMode::Dynamic => (Vec3::ZERO, light),
                };
                let inverse_distance = distance.max(f32::MIN_POSITIVE).recip();
                SourceSample { baked, mixed, asked: true, hidden: !sampled.visible, inverse_distance }
            }
        }
    }

    /// Adds the mean irradiance of a receiver by so many samples; `point` maps the unit square onto its surface.
    pub(crate) fn add_shared_light(
        &self,
        shared: &SharedSources,
        sequence: Sequence,
        samples: u32,
        point: &impl Fn(f32, f32) -> Option<Receiver>,
        direct: &mut Direct,
    ) {
        if shared.is_empty() {
            return;
        }
        let per_sample = 1.0 / samples.max(1) as f32;
        let mut batches = [0.0f32; BATCHES];
        let (mut visible, mut hidden) = (0, 0);
        for sample in 0..samples {
            let [x, y, ..] = sequence.point(sample, PLACE_SET);
            let Some(receiver) = point(x, y) else { continue };
            let [choice, u, v, _] = sequence.point(sample, SOURCE_SET);
            let found = self.sample(shared, &receiver, [choice, u, v]);
            direct.baked += found.baked * per_sample;
            direct.mixed += found.mixed * per_sample;
            batches[batch_of(sample, samples)] += found.baked.element_sum() / 3.0;
            visible += u32::from(found.asked && !found.hidden);
            hidden += u32::from(found.hidden);
        }
        direct.rays += visible + hidden;
        direct.sampled = true;
        // Which sources these are differs from receiver to receiver: only a part tells of a shadow.
        direct.seen.add(FIRST_ID - 1, visible, hidden);
        direct.variance += variance_of_mean(batches.map(|sum| sum * per_sample * BATCHES as f32));
    }
}
