//! The light of sources that share samples. Each sample chooses one source, about in proportion to the light that it
//! may bring, and a point on it, and casts one shadow ray, so the cost of a sample hardly depends on the number of
//! sources. `light_cut` decides which sources share samples.

use glam::Vec3;
use lumbre_optics::BakeMode;

use super::batches::{BATCHES, batch_of, variance_of_mean};
use super::direct::Direct;
use super::emitter_sample::sample_emitter;
use super::emitter_walk::EmitterChoice;
use super::light_cut::{Branch, BranchChoice, SharedSources};
use super::light_sources::Sources;
use super::punctual::{self, FIRST_ID};
use super::punctual_irradiance::center_irradiance;
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
    /// The control variate: the same as `baked` without occluders, if the source is controlled; mean of the channels.
    /// Its mean over all samples is [`Sources::controlled_light`].
    pub control: f32,
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
        let Some(BranchChoice { branch, u: choice, probability: of_branch, is_controlled }) =
            self.pick_branch(shared, receiver, choice)
        else {
            return nothing;
        };
        let control = |light: Vec3| if is_controlled { channel_mean(light) } else { 0.0 };
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
                if sample.is_below_facet {
                    return SourceSample { control: control(light), ..nothing };
                }
                let hidden = self.is_occluded(emitter, &sample, receiver);
                SourceSample {
                    baked: if hidden { Vec3::ZERO } else { light },
                    mixed: Vec3::ZERO,
                    control: control(light),
                    has_ray: true,
                    hidden,
                    inverse_distance: sample.distance.max(f32::MIN_POSITIVE).recip(),
                }
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
                if !light.is_finite() {
                    return nothing;
                }
                let arriving = if sampled.visible { light } else { Vec3::ZERO };
                let distance = self.scene.space.position(placed.position).distance(receiver.position);
                let sample = SourceSample {
                    has_ray: true,
                    hidden: !sampled.visible,
                    inverse_distance: distance.max(f32::MIN_POSITIVE).recip(),
                    ..nothing
                };
                match placed.light.bake {
                    BakeMode::Static => SourceSample { baked: arriving, control: control(light), ..sample },
                    BakeMode::Mixed | BakeMode::Dynamic => SourceSample { mixed: arriving, ..sample },
                }
            }
        }
    }

    /// The baked light of the controlled sources at a receiver, without occluders.
    pub fn controlled_light(&self, shared: &SharedSources, receiver: &Receiver) -> Vec3 {
        let of_branch = |branch: Branch| match branch {
            Branch::Emitters(node) => self.emitter_tree.unoccluded(&self.emitters, node, receiver),
            Branch::Lights(node) => self.light_tree.children(node).err().map_or(Vec3::ZERO, |light| {
                let placed = &self.lights[light as usize];
                placed.light.diffuse * center_irradiance(self.scene, placed, receiver)
            }),
        };
        shared.controlled().map(of_branch).sum()
    }

    /// A lower bound of the distance from a receiver to the controlled sources, canonical units; infinite if there are
    /// none.
    pub fn nearest_controlled(&self, shared: &SharedSources, receiver: &Receiver) -> f32 {
        let distance = |branch: Branch| match branch {
            Branch::Emitters(node) => self.emitter_tree.distance(node, receiver),
            Branch::Lights(node) => self.light_tree.distance(node, receiver),
        };
        shared.controlled().map(distance).fold(f32::INFINITY, f32::min)
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

#[cfg(test)]
mod tests {
    use lumbre_mesh::shapes;
    use lumbre_optics::Light;

    use super::*;
    use crate::sampling::Stream;
    use crate::scene::laid_out::mesh_laid_out;
    use crate::scene::{PlacedLight, Side};
    use crate::sources::Emitter;
    use crate::{BakeOptions, Density};

    /// A square lamp of two triangles that shines down from a height.
    fn square_lamp([x, z]: [f32; 2], height: f32, side: f32, radiance: Vec3) -> [Emitter; 2] {
        let corner = |dx: f32, dz: f32| Vec3::new(x + dx * side, height, z + dz * side);
        let [a, b, c, d] = [corner(0.0, 0.0), corner(0.0, 1.0), corner(1.0, 1.0), corner(1.0, 0.0)];
        [[c, b, a], [d, c, a]].map(|corners| Emitter {
            corners,
            corners_f64: corners.map(|corner| corner.as_dvec3()),
            normal: Vec3::NEG_Y,
            area: 0.5 * side * side,
            radiance,
            triangle: 0,
            side: Side::Front,
        })
    }

    /// The samples' control variate has the mean that is computed exactly: with lamps near and far, a point light, and a
    /// shading normal that leans away from the facet. Only then is subtracting the one and adding the other no bias.
    #[test]
    fn the_mean_of_the_control_variate_is_the_exact_light() {
        let options = BakeOptions { density: Density::MapSize(16), ..BakeOptions::default() };
        let (_, scene) = mesh_laid_out(shapes::plane(2.0, 2.0, 1, 1), &options);
        let mut emitters: Vec<Emitter> = Vec::new();
        for lamp in 0..12u16 {
            let place = [f32::from(lamp % 4) * 0.5 - 1.0, f32::from(lamp / 4) * 0.5 - 0.7];
            emitters.extend(square_lamp(place, 0.3 + 0.1 * f32::from(lamp), 0.2, Vec3::new(1.0, 0.5, 0.1)));
        }
        // More than are sampled individually; those that are mixed do not count as baked light.
        let placed = |number: u16| PlacedLight {
            light: Light {
                bake: if number.is_multiple_of(4) { BakeMode::Mixed } else { BakeMode::Static },
                ..Light::point(Vec3::splat(0.02))
            },
            position: glam::DVec3::new(0.1 * f64::from(number) - 1.0, 0.5, 0.2),
            axis: glam::DVec3::NEG_Y,
        };
        let sources = Sources::new(&scene, emitters, (0..20).map(placed).collect(), Vec3::ZERO);
        assert!(sources.individually_sampled_lights.is_empty());
        let position = Vec3::new(0.1, 0.1, 0.0);
        let leaning = Vec3::new(-0.8, 0.6, 0.0);
        let (mut below_facet, mut near) = (0, 0);
        for (normal, geometric_normal) in
            [(Vec3::Y, Vec3::Y), (leaning, Vec3::Y), (Vec3::Y, leaning), (Vec3::Y, Vec3::X)]
        {
            let receiver = Receiver { position, origin: position, geometric_normal, normal };
            let every_node: Vec<u32> = (0..48).collect();
            let shared = sources.cut(&receiver, 0.0, &every_node).shared;
            assert!(shared.controlled().count() > 1, "{normal}");
            let exact = channel_mean(sources.controlled_light(&shared, &receiver));
            let sequence = Sequence::new(3, Stream::Test(94), 0);
            let count = 1 << 14;
            near += u32::from(shared.is_near());
            let mut sum = 0.0;
            for number in 0..count {
                let [choice, u, v, _] = sequence.point(number, 0);
                let sample = sources.sample(&shared, &receiver, [choice, u, v]);
                sum += f64::from(sample.control);
                below_facet += u32::from(sample.control > 0.0 && !sample.has_ray);
            }
            let mean = sum / f64::from(count);
            assert!(
                exact > 0.01 && (mean / f64::from(exact) - 1.0).abs() < 2e-3,
                "{normal}: {mean}, {exact}"
            );
        }
        assert!(below_facet > 0 && near > 0, "{below_facet} samples below the facet, {near} near cuts");
    }
}
