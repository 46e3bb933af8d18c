//! The light of sources that share samples. Each sample chooses one source, about in proportion to the light that it
//! may bring, and a point on it, and casts one shadow ray, so the cost of a sample hardly depends on the number of
//! sources. `light_cut` decides which sources share samples.

use glam::Vec3;
use lumbre_optics::BakeMode;

use super::batches::{BATCHES, batch_of, variance_of_mean};
use super::direct::Direct;
use super::emitter_sample::sample_emitter;
use super::emitter_walk::EmitterChoice;
use super::light_cut::{Branch, SharedSources};
use super::light_sources::Sources;
use super::punctual::{self, FIRST_ID};
use super::sampled_receiver::SurfacePoints;
use crate::color::channel_mean;
use crate::sampling::Sequence;
use crate::scene::Receiver;

/// The estimate by one sample: irradiance, W/m², divided by the probability of the source.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct SourceSample {
    /// From emissive triangles and static lights.
    pub baked: Vec3,
    /// From mixed lights.
    pub mixed: Vec3,
    /// Whether the sample counts as a shadow ray.
    pub has_ray: bool,
    /// Whether the source is hidden.
    pub hidden: bool,
    /// 1 / distance to the source's point, canonical units; 0 if it could bring no light.
    pub inverse_distance: f32,
}

/// Dimension set for the point on the receiver.
const PLACE_SET: u32 = 32;
/// Dimension set for the choice of the source and the point on it.
const SOURCE_SET: u32 = 33;

impl Sources<'_> {
    /// One sample at a receiver by three numbers in [0, 1): the first chooses the source, the others the point on it.
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
                SourceSample { baked, mixed: Vec3::ZERO, has_ray: true, hidden, inverse_distance }
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
                SourceSample { baked, mixed, has_ray: true, hidden: !sampled.visible, inverse_distance }
            }
        }
    }

    /// Adds the mean irradiance of a receiver by the shared sources, estimated by `samples` samples, to `direct`.
    /// `point` maps the unit square onto the receiver's surface.
    pub(crate) fn add_shared_light(
        &self,
        shared: &SharedSources,
        sequence: Sequence,
        samples: u32,
        point: &impl SurfacePoints,
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
            let light = self.sample(shared, &receiver, [choice, u, v]);
            direct.baked += light.baked * per_sample;
            direct.mixed += light.mixed * per_sample;
            batches[batch_of(sample, samples)] += channel_mean(light.baked);
            visible += u32::from(light.has_ray && !light.hidden);
            hidden += u32::from(light.hidden);
        }
        direct.rays += visible + hidden;
        direct.sampled = true;
        // The shared sources differ from receiver to receiver, so they are summarised under one id.
        direct.seen.add(FIRST_ID - 1, visible, hidden);
        direct.variance += variance_of_mean(batches.map(|sum| sum * per_sample * BATCHES as f32));
    }
}
