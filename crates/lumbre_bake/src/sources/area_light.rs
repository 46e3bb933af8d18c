//! Direct light of emissive triangles: Lambert's exact formula for the unoccluded light, times the visible fraction,
//! which shadow rays or the exact clipping of occluders determine. Point lights are in `punctual`.

use glam::Vec3;

use super::batches::{BATCHES, batch_of};
use super::direct::Direct;
use super::emitter_sample::{EmitterSample, sample_emitter};
use super::emitter_tree::{EXACT_EMITTERS, TERM_ERROR};
use super::emitter_walk::EmitterChoice;
use super::emitters::Emitter;
use super::light_sources::Sources;
use super::receiver_quadrature::ReceiverQuadrature;
use super::sampled_receiver::{SampledReceiver, SurfacePoints};
use super::share_variance::{share_variance, uneven_variance};
use crate::color::channel_mean;
use crate::scene::Receiver;
use crate::visibility::visible_part::visible_part;
use crate::visibility::{LampOccluders, PolygonClipper};

/// An estimate of the visible fraction of a source's light, per channel.
struct VisibleFraction {
    mean: Vec3,
    variance: f32,
    /// Shadow rays cast: samples that could bring light.
    rays: u32,
}

/// Factor by which the number of samples grows if none of them could bring light although the source does.
const RETRY_FACTOR: u32 = 16;

/// Distance of a flat texel from a lamp, in sides of the texel, from which on its middle stands for all of it: of the light
/// of a small lamp right opposite, that makes an error of h²/(3d²) = 0.03 %.
const FAR: f32 = 32.0;

/// Shadow rays that cost about as much as computing a source's visible part exactly at one point.
const RAYS_PER_EXACT_POINT: u32 = 8;

/// Base of the dimension sets of all lamps but the first, which uses set 0. Lower sets belong to the samples that
/// sources share.
const FIRST_SET: u32 = 34;

/// The number of samples for a source that brings a `fraction` of the brightest source's light, where that gets
/// `samples`. It is a power of two, for which batches are best distributed.
fn samples_for(samples: u32, fraction: f32) -> u32 {
    let least = (samples / 4).max(BATCHES as u32).min(samples);
    ((samples as f32 * fraction) as u32).next_power_of_two().clamp(least, samples)
}

impl Sources<'_> {
    /// E = Σ (mean of the exact unoccluded light) x (visible light / all light, by the same samples) over lamps. This
    /// is exact where a lamp is fully visible or fully hidden; in between, its error is that of the visible fraction
    /// alone. `nodes` are the lamps' nodes in the emitter tree; rays and variance are added to `direct`.
    pub(crate) fn area_light_irradiance(
        &self,
        nodes: &[u32],
        sampled: &SampledReceiver<'_, impl SurfacePoints>,
        direct: &mut Direct,
    ) -> Vec3 {
        let Some(anchor) = (sampled.point)(0.5, 0.5) else { return Vec3::ZERO };
        let weights: Vec<f32> =
            nodes.iter().map(|&node| self.emitter_tree.weight(node, &anchor, 0.0)).collect();
        let brightest = weights.iter().copied().fold(f32::MIN_POSITIVE, f32::max);
        let mut irradiance = Vec3::ZERO;
        for (place, (&node, weight)) in nodes.iter().zip(weights).enumerate() {
            let samples = samples_for(sampled.samples, weight / brightest);
            let set = if place == 0 { 0 } else { FIRST_SET + place as u32 };
            let unoccluded = || self.mean_unoccluded(node, &anchor, sampled);
            let occluders = sampled.visibility.lamps.iter().find(|occluders| occluders.node == node);
            let known = occluders.and_then(|occluders| match occluders.emitters.is_empty() {
                true => Some(unoccluded()),
                false => self.visible_past_occluders(occluders, sampled, (samples, set), direct),
            });
            // Relative error of approximating many emitters by one term.
            let term_error = if self.emitter_tree.emitters(node) > EXACT_EMITTERS { TERM_ERROR } else { 0.0 };
            if let Some((light, variance)) = known {
                irradiance += light;
                direct.variance += variance + (term_error * channel_mean(light)).powi(2);
                continue;
            }
            let mut fraction = self.visible_fraction(node, &anchor, sampled, (samples, set), direct);
            if fraction.mean == Vec3::ZERO && fraction.rays > 0 {
                continue;
            }
            let (light, uneven) = unoccluded();
            if fraction.rays == 0 && light != Vec3::ZERO {
                // All of a few samples may have hit emitters that face away.
                fraction =
                    self.visible_fraction(node, &anchor, sampled, (RETRY_FACTOR * samples, set), direct);
            }
            irradiance += light * fraction.mean;
            direct.variance += channel_mean(light).powi(2) * fraction.variance
                + uneven * channel_mean(fraction.mean).powi(2);
            direct.variance += (term_error * channel_mean(light * fraction.mean)).powi(2);
        }
        irradiance
    }

    /// The mean light of a lamp over a receiver, without occluders, and the squared error of that mean. `anchor` is the
    /// receiver's middle.
    fn mean_unoccluded(
        &self,
        node: u32,
        anchor: &Receiver,
        sampled: &SampledReceiver<'_, impl SurfacePoints>,
    ) -> (Vec3, f32) {
        let at = |receiver: &Receiver| self.emitter_tree.unoccluded(&self.emitters, node, receiver);
        let sides_away = sampled.flat_side.map(|side| self.emitter_tree.distance(node, anchor) / side);
        match sides_away.filter(|sides_away| *sides_away > FAR) {
            _ if sampled.is_point => (at(anchor), 0.0),
            Some(sides_away) => {
                let light = at(anchor);
                (light, (channel_mean(light) / (3.0 * sides_away * sides_away)).powi(2))
            }
            None => ReceiverQuadrature::mean(|x, y| (sampled.point)(x, y).map(|receiver| at(&receiver))),
        }
    }

    /// The mean light of a lamp whose possible occluders are known, and its variance, computed exactly at as many
    /// points as cost about `samples` shadow rays. `None` if the occluders cut the lamp into too many pieces at some
    /// point.
    fn visible_past_occluders(
        &self,
        occluders: &LampOccluders,
        sampled: &SampledReceiver<'_, impl SurfacePoints>,
        (samples, set): (u32, u32),
        direct: &mut Direct,
    ) -> Option<(Vec3, f32)> {
        let points = (samples / RAYS_PER_EXACT_POINT).max(BATCHES as u32);
        let (mut sums, mut counts) = ([Vec3::ZERO; BATCHES], [0u32; BATCHES]);
        let (mut least, mut most) = (f32::INFINITY, 0.0f32);
        let (mut seen, mut hidden) = (0, 0);
        let mut pieces = PolygonClipper::new();
        for sample in 0..points {
            let [x, y, ..] = sampled.sequence.point(sample, set);
            let Some(receiver) = (sampled.point)(x, y) else { continue };
            let (position, normal) = (receiver.position.as_dvec3(), receiver.normal.as_dvec3());
            let (mut light, mut is_cut) = (Vec3::ZERO, false);
            for (emitter, blockers) in &occluders.emitters {
                let emitter = &self.emitters[*emitter as usize];
                let visible = visible_part(position, normal, &emitter.corners_f64, blockers, &mut pieces)?;
                light += emitter.radiance * (std::f64::consts::PI * visible.factor) as f32;
                is_cut |= visible.hidden;
            }
            let mean = channel_mean(light);
            (least, most) = (least.min(mean), most.max(mean));
            seen += u32::from(mean > 0.0);
            hidden += u32::from(is_cut);
            let batch = batch_of(sample, points);
            sums[batch] += light;
            counts[batch] += 1;
        }
        direct.seen.add(occluders.node, seen, hidden);
        direct.sampled = true;
        let count = counts.iter().sum::<u32>();
        if count == 0 {
            return Some((Vec3::ZERO, 0.0));
        }
        let mean = sums.iter().sum::<Vec3>() / count as f32;
        let batch_mean = |batch: usize| match counts[batch] {
            0 => channel_mean(mean),
            count => sums[batch].element_sum() / (3 * count) as f32,
        };
        Some((mean, uneven_variance(std::array::from_fn(batch_mean), most - least, count)))
    }

    /// Estimates the visible fraction of a lamp's light by `samples` shadow samples of dimension set `set`.
    fn visible_fraction(
        &self,
        node: u32,
        anchor: &Receiver,
        sampled: &SampledReceiver<'_, impl SurfacePoints>,
        (samples, set): (u32, u32),
        direct: &mut Direct,
    ) -> VisibleFraction {
        let (mut all, mut seen) = (Vec3::ZERO, Vec3::ZERO);
        let (mut visible, mut hidden) = (0u32, 0u32);
        let (mut batch_all, mut batch_seen) = ([0.0f32; BATCHES], [0.0f32; BATCHES]);
        for sample in 0..samples {
            // Where a single ray is wanted, the first sample that can bring light ends the search. Only a retry takes
            // more than one.
            if sampled.samples == 1 && visible + hidden > 0 {
                break;
            }
            let batch = batch_of(sample, samples);
            let [x, y, u, v] = sampled.sequence.point(sample, set);
            let Some(receiver) = (sampled.point)(x, y) else { continue };
            let EmitterChoice { emitter, u, probability } = self.emitter_tree.pick(node, anchor, u);
            let emitter = &self.emitters[emitter as usize];
            let Some(sample) = sample_emitter(emitter, &receiver, (u, v)) else { continue };
            let light = sample.light / probability;
            if sample.is_below_facet || !light.is_finite() {
                continue;
            }
            all += light;
            batch_all[batch] += channel_mean(light);
            if self.is_occluded(emitter, &sample, &receiver) {
                hidden += 1;
            } else {
                visible += 1;
                seen += light;
                batch_seen[batch] += channel_mean(light);
            }
        }
        direct.rays += visible + hidden;
        direct.sampled = true;
        direct.seen.add(node, visible, hidden);
        let fraction = |seen: f32, all: f32, otherwise: f32| if all > 0.0 { seen / all } else { otherwise };
        let all_channels = fraction(batch_seen.iter().sum(), batch_all.iter().sum(), 0.0);
        // Few samples may have met none of the lamp's parts that shine in some channel.
        let of_channel = |channel: usize| fraction(seen[channel], all[channel], all_channels);
        let mean = Vec3::from_array(std::array::from_fn(of_channel));
        let batch_fractions = std::array::from_fn(|batch| match batch_all[batch] > 0.0 {
            true => batch_seen[batch] / batch_all[batch],
            false => all_channels,
        });
        let rays = visible + hidden;
        VisibleFraction { mean, variance: share_variance(batch_fractions, all_channels, rays), rays }
    }

    /// Whether a sampled point of an emitter is hidden from a receiver.
    pub(crate) fn is_occluded(&self, emitter: &Emitter, sample: &EmitterSample, receiver: &Receiver) -> bool {
        let (triangle, side) = (emitter.triangle, emitter.side);
        let target = self.scene.off_surface_seen_from(triangle, side, sample.target, receiver.origin);
        self.scene.blocked(receiver.origin, target)
    }
}
