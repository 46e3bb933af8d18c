//! Direct light of emissive triangles: Lambert's exact formula for what is unoccluded, times the share that is seen, which shadow rays or the exact
//! clipping of occluders tell. Not point lights: those are `punctual`.

use glam::Vec3;

use super::batches::{BATCHES, batch_of};
use super::direct::Direct;
use super::emitter_sample::{EmitterSample, sample_emitter};
use super::emitter_tree::{EXACT_EMITTERS, TERM_ERROR};
use super::emitter_walk::EmitterChoice;
use super::emitters::Emitter;
use super::light_sources::Sources;
use super::receiver_quadrature::ReceiverQuadrature;
use super::share_variance::{share_variance, uneven_variance};
use crate::sampling::Sequence;
use crate::scene::Receiver;
use crate::visibility::cut_out::Pieces;
use crate::visibility::occluders::{LampOccluders, Visibility};
use crate::visibility::visible_part::visible_part;

/// The part of a source that is seen, per channel, and its variance.
struct Share {
    mean: Vec3,
    variance: f32,
    /// Samples that could bring light.
    asked: u32,
}

/// So many times the samples where none of them could bring light, though there is some.
const AGAIN: u32 = 16;

/// Shadow rays that take about as long as one point that sees a source exactly.
const RAYS_OF_A_POINT: u32 = 8;

/// The dimension sets of lamps begin here: before it are the punctual lights'.
const FIRST_SET: u32 = 34;

/// Of `samples` for the brightest source, those of one that brings a `fraction` of it: a power of two, as batches are best spread.
fn samples_for(samples: u32, fraction: f32) -> u32 {
    let least = (samples / 4).max(BATCHES as u32).min(samples);
    ((samples as f32 * fraction) as u32).next_power_of_two().clamp(least, samples)
}

impl Sources<'_> {
    /// E = Σ (mean of the exact unoccluded light) x (seen light / all light, by the same samples) over lamps: exact in
    /// full light and in full shadow of each, and in between its error is that of the share alone.
    pub(crate) fn area_light_irradiance(
        &self,
        nodes: &[u32],
        visibility: &Visibility<'_>,
        sequence: Sequence,
        samples: u32,
        point: &impl Fn(f32, f32) -> Option<Receiver>,
        direct: &mut Direct,
    ) -> Vec3 {
        let Some(anchor) = point(0.5, 0.5) else { return Vec3::ZERO };
        let weights: Vec<f32> =
            nodes.iter().map(|&node| self.emitter_tree.weight(node, &anchor, 0.0)).collect();
        let brightest = weights.iter().copied().fold(f32::MIN_POSITIVE, f32::max);
        let grey = |light: Vec3| light.element_sum() / 3.0;
        let mut irradiance = Vec3::ZERO;
        for (place, (&node, weight)) in nodes.iter().zip(weights).enumerate() {
            let own = samples_for(samples, weight / brightest);
            let set = if place == 0 { 0 } else { FIRST_SET + place as u32 };
            let unoccluded = || {
                ReceiverQuadrature::mean(|x, y| {
                    point(x, y).map(|receiver| self.emitter_tree.unoccluded(&self.emitters, node, &receiver))
                })
            };
            let known =
                visibility.lamps.iter().find(|occluders| occluders.node == node).and_then(|occluders| {
                    match occluders.emitters.is_empty() {
                        true => Some(unoccluded()),
                        false => self.visible_past_occluders(occluders, sequence, (own, set), point, direct),
                    }
                });
            // What one term for many emitters leaves.
            let by_terms = if self.emitter_tree.emitters(node) > EXACT_EMITTERS { TERM_ERROR } else { 0.0 };
            if let Some((light, variance)) = known {
                irradiance += light;
                direct.variance += variance + (by_terms * grey(light)).powi(2);
                continue;
            }
            let mut share = self.visible_fraction(node, &anchor, sequence, (own, set), point, direct);
            if share.mean == Vec3::ZERO && share.asked > 0 {
                continue;
            }
            let (light, uneven) = unoccluded();
            if share.asked == 0 && light != Vec3::ZERO {
                // Of few samples all may be of sides that look away.
                share = self.visible_fraction(node, &anchor, sequence, (AGAIN * own, set), point, direct);
            }
            irradiance += light * share.mean;
            direct.variance += grey(light).powi(2) * share.variance + uneven * grey(share.mean).powi(2);
            direct.variance += (by_terms * grey(light * share.mean)).powi(2);
        }
        irradiance
    }

    /// The light of a part of which it is known what may stand between, at as many points as are worth so many shadow rays, and its variance;
    /// `None` if some point sees it in too many pieces.
    fn visible_past_occluders(
        &self,
        occluders: &LampOccluders,
        sequence: Sequence,
        (samples, set): (u32, u32),
        point: &impl Fn(f32, f32) -> Option<Receiver>,
        direct: &mut Direct,
    ) -> Option<(Vec3, f32)> {
        let points = (samples / RAYS_OF_A_POINT).max(BATCHES as u32);
        let (mut sums, mut counts) = ([Vec3::ZERO; BATCHES], [0u32; BATCHES]);
        let (mut least, mut most) = (f32::INFINITY, 0.0f32);
        let (mut seen, mut hidden) = (0, 0);
        let mut room = Pieces::new();
        for sample in 0..points {
            let [x, y, ..] = sequence.point(sample, set);
            let Some(receiver) = point(x, y) else { continue };
            let (position, normal) = (receiver.position.as_dvec3(), receiver.normal.as_dvec3());
            let (mut light, mut cut) = (Vec3::ZERO, false);
            for (emitter, blockers) in &occluders.emitters {
                let emitter = &self.emitters[*emitter as usize];
                let visible = visible_part(position, normal, &emitter.corners_f64, blockers, &mut room)?;
                light += emitter.radiance * (std::f64::consts::PI * visible.factor) as f32;
                cut |= visible.hidden;
            }
            let grey = light.element_sum() / 3.0;
            (least, most) = (least.min(grey), most.max(grey));
            seen += u32::from(grey > 0.0);
            hidden += u32::from(cut);
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
        let of_batch = |batch: usize| match counts[batch] {
            0 => mean.element_sum() / 3.0,
            own => sums[batch].element_sum() / (3 * own) as f32,
        };
        Some((mean, uneven_variance(std::array::from_fn(of_batch), most - least, count)))
    }

    /// The share of a part's light that is seen, by so many samples of dimension set `set`.
    fn visible_fraction(
        &self,
        node: u32,
        anchor: &Receiver,
        sequence: Sequence,
        (samples, set): (u32, u32),
        point: &impl Fn(f32, f32) -> Option<Receiver>,
        direct: &mut Direct,
    ) -> Share {
        let (mut all, mut seen) = (Vec3::ZERO, Vec3::ZERO);
        let (mut visible, mut hidden) = (0u32, 0u32);
        let (mut batch_all, mut batch_seen) = ([0.0f32; BATCHES], [0.0f32; BATCHES]);
        for sample in 0..samples {
            let at = batch_of(sample, samples);
            let [x, y, u, v] = sequence.point(sample, set);
            let Some(receiver) = point(x, y) else { continue };
            let EmitterChoice { emitter, u, probability } = self.emitter_tree.pick(node, anchor, u);
            let emitter = &self.emitters[emitter as usize];
            let Some(sample) = sample_emitter(emitter, &receiver, (u, v)) else { continue };
            let light = sample.light / probability;
            if !light.is_finite() {
                continue;
            }
            all += light;
            batch_all[at] += light.element_sum() / 3.0;
            if self.is_occluded(emitter, &sample, &receiver) {
                hidden += 1;
            } else {
                visible += 1;
                seen += light;
                batch_seen[at] += light.element_sum() / 3.0;
            }
        }
        direct.rays += visible + hidden;
        direct.sampled = true;
        direct.seen.add(node, visible, hidden);
        let share = |seen: f32, all: f32| if all > 0.0 { seen / all } else { 0.0 };
        let mean = Vec3::new(share(seen.x, all.x), share(seen.y, all.y), share(seen.z, all.z));
        let grey = share(batch_seen.iter().sum(), batch_all.iter().sum());
        let shares = std::array::from_fn(|at| match batch_all[at] > 0.0 {
            true => batch_seen[at] / batch_all[at],
            false => grey,
        });
        let asked = visible + hidden;
        Share { mean, variance: share_variance(shares, grey, asked), asked }
    }

    /// Whether something stands before a point of an emitter.
    pub(crate) fn is_occluded(&self, emitter: &Emitter, sample: &EmitterSample, receiver: &Receiver) -> bool {
        let (triangle, side) = (emitter.triangle, emitter.side);
        let target = self.scene.off_surface_seen_from(triangle, side, sample.target, receiver.origin);
        self.scene.blocked(receiver.origin, target)
    }
}
