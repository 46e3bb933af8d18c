//! Direct light at a small piece of surface (a texel, a patch): emissive triangles by Lambert's formula times the seen
//! share of their light; with it what `punctual` lights send. Not bounces.

use std::f32::consts::PI;

use glam::{DVec3, Vec3};
use lumbre_optics::LightKind;
use serde::{Deserialize, Serialize};

use super::cut_out::Pieces;
use super::emitter_tree::{EXACT_EMITTERS, EmitterTree, TERM_ERROR};
use super::emitter_walk::Chosen;
use super::emitters::{Emitter, lamps};
use super::light_cut::{FEW_LIGHTS, LightCut};
use super::light_tree::{LightTree, has_place};
use super::receiver_quadrature::ReceiverQuadrature;
use super::share_variance::{share_variance, uneven_variance};
use super::visibility::{PartOccluders, Visibility};
use super::visible_part::visible_part;
use crate::sampling::{Sequence, hash, triangle_point};
use crate::scene::{BakeScene, PlacedLight};

/// A point of a receiver.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Receiver {
    /// On the surface.
    pub position: Vec3,
    /// Just off it.
    pub origin: Vec3,
    /// Unit, of the side that receives.
    pub geometric_normal: Vec3,
    /// Unit, smooth.
    pub normal: Vec3,
}

/// Irradiance, W/m².
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub(crate) struct Direct {
    /// From emissive triangles and static lights: goes into the map.
    pub baked: Vec3,
    /// From mixed lights: bounces only.
    pub mixed: Vec3,
    /// Variance that sampling leaves in `baked`, mean of the channels, as it is stated of this receiver alone.
    pub variance: f32,
    /// The part of it that is caution: what it is more than is to be expected of many such receivers.
    pub caution: f32,
    /// Rays cast.
    pub rays: u32,
    /// Whether samples had a part in it: more would tell more.
    pub sampled: bool,
    /// What of the sources was seen.
    pub seen: Seen,
}

/// What a receiver saw of the sources.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Seen {
    /// Some source was seen by one sample and not by another: a penumbra, or a shadow's edge.
    pub partly: bool,
    /// One number for each combination of hidden sources.
    pub signature: u32,
}

impl Seen {
    /// What the samples to source `id` found. Sources that are wholly seen, or that do not shine here, leave no mark: which of them
    /// are asked together differs from receiver to receiver.
    pub(super) fn add(&mut self, id: u32, visible: u32, hidden: u32) {
        self.partly |= visible > 0 && hidden > 0;
        if hidden > 0 && visible == 0 {
            self.signature ^= hash(id.wrapping_add(1));
        }
    }
}

impl Direct {
    /// What bounces.
    pub fn total(&self) -> Vec3 {
        self.baked + self.mixed
    }
}

/// The sources of a scene.
pub(crate) struct Sources<'a> {
    pub scene: &'a BakeScene,
    pub emitters: Vec<Emitter>,
    pub(super) emitter_tree: EmitterTree,
    pub lights: Vec<PlacedLight>,
    pub(super) light_tree: LightTree,
    /// Lights that have samples of their own everywhere, by number: those in the sky, and all where they are few.
    pub(super) lights_apart: Vec<u32>,
    /// Irradiance that a surface gets of an unhidden sky: π times its radiance, W/m². Not direct light here: the rays of the
    /// form factors and of the final gather find it where they meet nothing.
    pub sky: Vec3,
}

/// Batches of samples whose spread tells the error of their mean (the method of batch means): each is a low-discrepancy sequence of its own. (One
/// in every four samples is not: their spread is several times larger than the error.) All together are spread better than apart, so that the true
/// error is smaller.
pub(super) const BATCHES: usize = 4;

/// The batch of one of so many samples.
pub(super) fn batch_of(sample: u32, samples: u32) -> usize {
    (sample as usize * BATCHES / samples.max(1) as usize).min(BATCHES - 1)
}

/// Four batches tell their own spread badly, and at straight edges they agree better than they should: it counts twice.
const FEW_BATCHES: f32 = 2.0;

/// Variance of the mean of all batches, from each batch's mean.
pub(super) fn variance_of_mean(batches: [f32; BATCHES]) -> f32 {
    let mean = batches.iter().sum::<f32>() / BATCHES as f32;
    let squares: f32 = batches.iter().map(|batch| (batch - mean).powi(2)).sum();
    FEW_BATCHES * squares / (BATCHES * (BATCHES - 1)) as f32
}

/// Whether all that shines is inside of rooms: outside of them it is dark. `sky` is its radiance.
pub(crate) fn shines_inside_only(
    scene: &BakeScene,
    emitters: &[Emitter],
    lights: &[PlacedLight],
    sky: Vec3,
) -> bool {
    let inside =
        |points: &[Vec3]| scene.rooms.iter().any(|room| points.iter().all(|&point| room.surely_holds(point)));
    let light = |placed: &PlacedLight| {
        placed.light.kind != LightKind::Directional && inside(&[scene.space.position(placed.position)])
    };
    !scene.masked
        && sky == Vec3::ZERO
        && lights.iter().all(light)
        && emitters.iter().all(|emitter| inside(&emitter.corners))
}

impl<'a> Sources<'a> {
    /// Of a scene, its emissive triangles, its punctual lights and its sky's radiance.
    pub fn new(scene: &'a BakeScene, emitters: Vec<Emitter>, lights: Vec<PlacedLight>, sky: Vec3) -> Self {
        let emitter_tree = EmitterTree::new(&emitters, &lamps(scene, &emitters));
        let few = lights.len() <= FEW_LIGHTS;
        let shares_samples = |index: &u32| !few && has_place(&lights[*index as usize]);
        let (together, lights_apart) = (0..lights.len() as u32).partition(shares_samples);
        let light_tree = LightTree::new(&lights, together, scene.space);
        Self { scene, emitters, emitter_tree, lights, light_tree, lights_apart, sky: sky * PI }
    }

    /// The emissive triangles among them that are to be kept, and no lights.
    pub fn only_emitters(&self, keep: impl Fn(&Emitter) -> bool) -> Self {
        let emitters: Vec<Emitter> = self.emitters.iter().filter(|emitter| keep(emitter)).cloned().collect();
        let emitter_tree = EmitterTree::new(&emitters, &lamps(self.scene, &emitters));
        Self {
            scene: self.scene,
            emitters,
            emitter_tree,
            lights: Vec::new(),
            light_tree: LightTree::default(),
            lights_apart: Vec::new(),
            sky: Vec3::ZERO,
        }
    }

    /// Whether nothing shines.
    pub fn is_empty(&self) -> bool {
        self.emitters.is_empty() && self.lights.is_empty() && !self.has_sky()
    }

    /// Whether the sky shines.
    pub fn has_sky(&self) -> bool {
        self.sky != Vec3::ZERO
    }

    /// The emitters of a part of the emissive surfaces, by number.
    pub fn emitters_of(&self, part: u32) -> &[u32] {
        self.emitter_tree.emitters_of(part)
    }

    /// Mean irradiance of a receiver by `samples` shadow rays to each source that matters and some to the others together; `point` maps the
    /// unit square onto its surface.
    pub fn irradiance(
        &self,
        sequence: Sequence,
        samples: u32,
        point: &impl Fn(f32, f32) -> Option<Receiver>,
    ) -> Direct {
        let Some(anchor) = point(0.5, 0.5) else { return Direct::default() };
        let corners = [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)];
        let corners = corners.iter().filter_map(|&(x, y)| point(x, y));
        let reach = corners.map(|corner| corner.position.distance(anchor.position)).fold(0.0, f32::max);
        let cut = self.cut(&anchor, reach, &[]);
        let mut direct = self.own(&cut, &Visibility::UNKNOWN, sequence, samples, point);
        self.rest(&cut.rest, sequence, SAMPLES_OF_REST * samples, point, &mut direct);
        direct
    }

    /// Mean irradiance by the sources that have samples of their own; without shadow rays where it is known what may stand `between`: those
    /// are as exact as the receiver's points.
    pub fn own(
        &self,
        cut: &LightCut,
        visibility: &Visibility<'_>,
        sequence: Sequence,
        samples: u32,
        point: &impl Fn(f32, f32) -> Option<Receiver>,
    ) -> Direct {
        let mut direct = Direct::default();
        if !cut.lamps.is_empty() {
            let light = self.emitted(&cut.lamps, visibility, sequence, samples, point, &mut direct);
            direct.baked += light;
        }
        self.punctual(&cut.lights, visibility, sequence, samples, point, &mut direct);
        direct
    }

    /// E = Σ (mean of the exact unoccluded light) x (seen light / all light, by the same samples) over lamps: exact in
    /// full light and in full shadow of each, and in between its error is that of the share alone.
    fn emitted(
        &self,
        parts: &[u32],
        visibility: &Visibility<'_>,
        sequence: Sequence,
        samples: u32,
        point: &impl Fn(f32, f32) -> Option<Receiver>,
        direct: &mut Direct,
    ) -> Vec3 {
        let Some(anchor) = point(0.5, 0.5) else { return Vec3::ZERO };
        let weights: Vec<f32> =
            parts.iter().map(|&part| self.emitter_tree.weight(part, &anchor, 0.0)).collect();
        let brightest = weights.iter().copied().fold(f32::MIN_POSITIVE, f32::max);
        let grey = |light: Vec3| light.element_sum() / 3.0;
        let mut irradiance = Vec3::ZERO;
        for (place, (&part, weight)) in parts.iter().zip(weights).enumerate() {
            let own = allotted(samples, weight / brightest);
            let set = if place == 0 { 0 } else { FIRST_SET + place as u32 };
            let unoccluded = || {
                ReceiverQuadrature::mean(|x, y| {
                    point(x, y).map(|receiver| self.emitter_tree.unoccluded(&self.emitters, part, &receiver))
                })
            };
            let known =
                visibility.parts.iter().find(|occluders| occluders.part == part).and_then(|occluders| {
                    match occluders.emitters.is_empty() {
                        true => Some(unoccluded()),
                        false => self.seen_past(occluders, sequence, (own, set), point, direct),
                    }
                });
            // What one term for many emitters leaves.
            let by_terms = if self.emitter_tree.emitters(part) > EXACT_EMITTERS { TERM_ERROR } else { 0.0 };
            if let Some((light, variance)) = known {
                irradiance += light;
                direct.variance += variance + (by_terms * grey(light)).powi(2);
                continue;
            }
            let mut share = self.seen_share(part, &anchor, sequence, (own, set), point, direct);
            if share.mean == Vec3::ZERO && share.asked > 0 {
                continue;
            }
            let (light, uneven) = unoccluded();
            if share.asked == 0 && light != Vec3::ZERO {
                // Of few samples all may be of sides that look away.
                share = self.seen_share(part, &anchor, sequence, (AGAIN * own, set), point, direct);
            }
            irradiance += light * share.mean;
            direct.variance += grey(light).powi(2) * share.variance + uneven * grey(share.mean).powi(2);
            direct.variance += (by_terms * grey(light * share.mean)).powi(2);
        }
        irradiance
    }

    /// The light of a part of which it is known what may stand between, at as many points as are worth so many shadow rays, and its variance;
    /// `None` if some point sees it in too many pieces.
    fn seen_past(
        &self,
        occluders: &PartOccluders,
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
        direct.seen.add(occluders.part, seen, hidden);
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
    fn seen_share(
        &self,
        part: u32,
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
            let Chosen { emitter, u, probability } = self.emitter_tree.pick(part, anchor, u);
            let emitter = &self.emitters[emitter as usize];
            let Some(sample) = sample_emitter(emitter, &receiver, (u, v)) else { continue };
            let light = sample.light / probability;
            if !light.is_finite() {
                continue;
            }
            all += light;
            batch_all[at] += light.element_sum() / 3.0;
            if self.hides(emitter, &sample, &receiver) {
                hidden += 1;
            } else {
                visible += 1;
                seen += light;
                batch_seen[at] += light.element_sum() / 3.0;
            }
        }
        direct.rays += visible + hidden;
        direct.sampled = true;
        direct.seen.add(part, visible, hidden);
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
    pub(super) fn hides(&self, emitter: &Emitter, sample: &EmitterSample, receiver: &Receiver) -> bool {
        let (triangle, side) = (emitter.triangle, emitter.side);
        let target = self.scene.off_surface_seen_from(triangle, side, sample.target, receiver.origin);
        self.scene.blocked(receiver.origin, target)
    }
}

/// A point of an emitter, and the irradiance that the emitter would bring if it were all like this point.
pub(super) struct EmitterSample {
    pub target: Vec3,
    pub light: Vec3,
    pub distance: f32,
}

/// The point of an emitter at (u, v) of the unit square; none where no light leaves or arrives.
pub(super) fn sample_emitter(
    emitter: &Emitter,
    receiver: &Receiver,
    (u, v): (f32, f32),
) -> Option<EmitterSample> {
    let [p, q, r] = emitter.corners.map(|corner| corner - receiver.position);
    let (a, b) = triangle_point(u, v);
    let mut towards = p + (q - p) * a + (r - p) * b;
    let height = -p.dot(emitter.normal);
    if height <= 0.0 {
        return None;
    }
    // What a point of it is worth differs by the distance where it is near: there directions are drawn evenly instead.
    let nearest = p.length_squared().min(q.length_squared()).min(r.length_squared());
    let by_direction = match emitter.area > WIDE * nearest.max(height * height) {
        true => spherical_triangle([p, q, r], u, v),
        false => None,
    };
    let mut per_cosine = 0.0;
    if let Some((direction, solid_angle)) = by_direction {
        let down = -direction.dot(emitter.normal);
        if down <= 0.0 {
            return None;
        }
        (towards, per_cosine) = (direction * (height / down), solid_angle);
    }
    let distance_squared = towards.length_squared();
    let direction = towards.normalize_or_zero();
    let (cosine, emitted) = (direction.dot(receiver.normal), -direction.dot(emitter.normal));
    if cosine <= 0.0 || emitted <= 0.0 || direction.dot(receiver.geometric_normal) <= 0.0 {
        return None;
    }
    if by_direction.is_none() {
        per_cosine = emitted * emitter.area / distance_squared;
    }
    let target = receiver.position + towards;
    let light = emitter.radiance * (cosine * per_cosine);
    Some(EmitterSample { target, light, distance: distance_squared.sqrt() })
}

/// Of an emitter's area, over its squared distance, from which on its directions are sampled and not its points.
const WIDE: f32 = 0.05;

/// A direction at (u, v) of the unit square to a triangle, evenly spread over its solid angle, and that angle (Arvo, "Stratified Sampling of
/// Spherical Triangles", 1995). None where it is too narrow for numbers of single precision.
fn spherical_triangle(corners: [Vec3; 3], u: f32, v: f32) -> Option<(Vec3, f32)> {
    let [a, b, c] = corners.map(|corner| corner.as_dvec3().normalize_or_zero());
    let normal = |p: DVec3, q: DVec3| p.cross(q).try_normalize();
    let (ab, bc, ca) = (normal(a, b)?, normal(b, c)?, normal(c, a)?);
    let (alpha, beta, gamma) = (ab.angle_between(-ca), bc.angle_between(-ab), ca.angle_between(-bc));
    let solid_angle = alpha + beta + gamma - std::f64::consts::PI;
    if solid_angle.is_nan() || solid_angle <= 1e-6 {
        return None;
    }
    let part = std::f64::consts::PI + f64::from(u) * solid_angle;
    let ((sine, cosine), (sine_part, cosine_part)) = (alpha.sin_cos(), part.sin_cos());
    let (s, t) = (sine_part * cosine - cosine_part * sine, cosine_part * cosine + sine_part * sine);
    let (k, l) = (t + cosine, s - sine * a.dot(b));
    let along = (l + (l * t - k * s) * cosine) / ((l * s + k * t) * sine);
    if along.is_nan() {
        return None;
    }
    let along = along.clamp(-1.0, 1.0);
    let beside = |p: DVec3, axis: DVec3| (p - axis * p.dot(axis)).normalize_or_zero();
    let edge = a * along + beside(c, a) * (1.0 - along * along).sqrt();
    let height = 1.0 - f64::from(v) * (1.0 - edge.dot(b));
    let direction = b * height + beside(edge, b) * (1.0 - height * height).max(0.0).sqrt();
    direction.is_finite().then(|| (direction.as_vec3(), solid_angle as f32))
}

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

/// Samples of the sources that share them, for each of a source that has samples of its own.
const SAMPLES_OF_REST: u32 = 4;

/// The dimension sets of lamps begin here: before it are the punctual lights'.
const FIRST_SET: u32 = 34;

/// Of `samples` for the brightest source, those of one that brings `part` of it: a power of two, as batches are best spread.
pub(super) fn allotted(samples: u32, part: f32) -> u32 {
    let least = (samples / 4).max(BATCHES as u32).min(samples);
    ((samples as f32 * part) as u32).next_power_of_two().clamp(least, samples)
}
