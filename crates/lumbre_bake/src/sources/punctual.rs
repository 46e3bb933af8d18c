//! Direct light of point, spot and directional lights, by shadow rays where the possible occluders are unknown. A light
//! with a size is a sphere, or a disc on the sky, of uniform radiance; its attenuation and cone are those of its
//! centre. Emissive surfaces are in `area_light`.

use glam::{DVec3, Vec3};
use lumbre_optics::{BakeMode, LightKind};

use super::batches::{BATCHES, batch_of, variance_of_mean};
use super::direct::Direct;
use super::light_sources::Sources;
use super::punctual_irradiance::{
    PunctualIrradiance, center_irradiance, over_parallelogram, punctual_irradiance,
};
use super::receiver_quadrature::ReceiverQuadrature;
use super::sampled_receiver::{SampledReceiver, SurfacePoints};
use super::share_variance::share_variance;
use crate::color::channel_mean;
use crate::sampling::{cosine_direction, frame};
use crate::scene::Receiver;
use crate::scene::{BakeScene, PlacedLight};
use crate::visibility::cut_out::GAP;
use crate::visibility::{LightVisibility, PolygonClipper, ReceiverShape};

/// Offset of the lights' ids in [`VisibilitySummary::add`](super::direct::VisibilitySummary::add); lower ids are nodes
/// of the emitter tree.
pub(crate) const FIRST_ID: u32 = 1 << 31;

/// Largest sine of the angular radius of a light's disc, for receivers inside the sphere or near it. It bounds the
/// weight of one sample to 1/√(1 - this²) = 7.
const LARGEST_SINE: f64 = 0.99;

/// Fewest shadow rays to a near light: even an object as small as its fittings hides much of its light, from a small
/// part of the texel.
const NEAR_SAMPLES: u32 = 64;

/// Fewest shadow rays that are worth more than the points of a receiver, of which there are at most sixteen.
const FEWEST_BEYOND_POINTS: u32 = 32;

/// Half of the distance between two rows of a receiver's sample points, as a fraction of its side.
const HALF_A_ROW: f32 = 0.125;

/// One sample of a light, as irradiance per unit of the light's colour.
pub(crate) struct LightSample {
    /// Light of the light's centre; 0 if the receiver faces away from it.
    center: f32,
    /// Light of the sampled point of its disc; not above 0 where that is below the receiver's horizon.
    pub disc: f32,
    pub visible: bool,
}

/// Sums over the samples of one light at a receiver, by batch.
#[derive(Default)]
struct LightEstimate {
    /// Sampled points of the receiver.
    points: [u32; BATCHES],
    center: [f32; BATCHES],
    disc: [f32; BATCHES],
    /// The part of `disc` that is visible.
    seen: [f32; BATCHES],
    visible: u32,
    hidden: u32,
    /// Whether some of the disc is below the horizon.
    crosses_horizon: bool,
}

impl LightEstimate {
    fn add(&mut self, sample: &LightSample, batch: usize) {
        self.center[batch] += sample.center;
        self.disc[batch] += sample.disc;
        self.crosses_horizon |= sample.disc <= 0.0;
        if sample.visible {
            self.visible += 1;
            self.seen[batch] += sample.disc;
        } else {
            self.hidden += 1;
        }
    }

    /// Mean irradiance per unit of colour, and its variance. This is the light of the centre times the visible fraction
    /// of the disc, which is exact in full light and in full shadow; where the horizon cuts the disc, it is the mean of
    /// the visible samples. `known_center` replaces the sampled light of the centre.
    fn mean(&self, known_center: Option<f32>) -> (f32, f32) {
        let samples = self.points.iter().sum::<u32>().max(1) as f32;
        let batch_means = |sums: &[f32; BATCHES]| {
            std::array::from_fn(|batch| sums[batch] / self.points[batch].max(1) as f32)
        };
        let total = |sums: &[f32; BATCHES]| sums.iter().sum::<f32>();
        let all = total(&self.disc);
        if self.crosses_horizon || all <= 0.0 {
            return (total(&self.seen) / samples, variance_of_mean(batch_means(&self.seen)));
        }
        let center = known_center.unwrap_or(total(&self.center) / samples);
        let fraction = total(&self.seen) / all;
        let batch_fraction = |batch: usize| match self.disc[batch] > 0.0 {
            true => self.seen[batch] / self.disc[batch],
            false => fraction,
        };
        let fractions = std::array::from_fn(batch_fraction);
        // Where the light varies over the receiver, the mean of the visible part is as uncertain as the samples' mean.
        let center_variance = variance_of_mean(batch_means(&self.center));
        let fraction_variance = share_variance(fractions, fraction, self.visible + self.hidden);
        (center * fraction, center * center * fraction_variance + fraction * fraction * center_variance)
    }
}

impl Sources<'_> {
    /// Adds the mean light over a receiver of a punctual light, given by its index, to `direct`. Casts no shadow rays to a
    /// light whose possible occluders are known.
    pub(crate) fn add_punctual(
        &self,
        index: u32,
        sampled: &SampledReceiver<'_, impl SurfacePoints>,
        direct: &mut Direct,
    ) {
        let placed = &self.lights[index as usize];
        let known = sampled.visibility.of_light(index);
        let (mean, variance) = match known {
            Some(LightVisibility::Dark) => return,
            Some(LightVisibility::Hidden) => {
                direct.seen.add(FIRST_ID + index, 0, 1);
                return;
            }
            Some(known) if !placed.is_sized() => self.past_shadows(index, known, sampled, direct),
            known => {
                let clear = matches!(known, Some(LightVisibility::Clear));
                self.by_shadow_rays(index, (clear, &sampled.point), sampled, direct)
            }
        };
        let color = placed.light.diffuse;
        match placed.light.bake {
            BakeMode::Static => {
                direct.baked += color * mean;
                direct.variance += channel_mean(color).powi(2) * variance;
            }
            BakeMode::Mixed | BakeMode::Dynamic => direct.mixed += color * mean,
        }
    }

    /// Mean irradiance over a whole parallelogram receiver by a near light without size, ignoring occlusion; `None` if
    /// [`over_parallelogram`] does not apply.
    fn near_field_mean(
        &self,
        light: &PlacedLight,
        sampled: &SampledReceiver<'_, impl SurfacePoints>,
    ) -> Option<f32> {
        let square = sampled.visibility.square.as_ref()?;
        over_parallelogram(self.scene, light, square, &(sampled.point)(0.5, 0.5)?)
    }

    /// Mean irradiance by a light per unit of its colour, and its variance, estimated by samples. Casts no rays if the
    /// light is known to be `clear`. The rays start at the places that `point` gives for points of the unit square.
    fn by_shadow_rays(
        &self,
        index: u32,
        (clear, point): (bool, &dyn Fn(f32, f32) -> Option<Receiver>),
        sampled: &SampledReceiver<'_, impl SurfacePoints>,
        direct: &mut Direct,
    ) -> (f32, f32) {
        let light = &self.lights[index as usize];
        let mut estimate = LightEstimate::default();
        let sequence = sampled.sequence.of(1 + index);
        let (is_sized, samples) = (light.is_sized(), sampled.samples);
        // The unoccluded mean of its centre's light, if known.
        let center = if is_sized { None } else { self.near_field_mean(light, sampled) };
        let samples = if center.is_some() && !clear { samples.max(NEAR_SAMPLES) } else { samples };
        for sample in 0..samples {
            let [a, b, c, d] = sequence.point(sample, 0);
            let (x, y, u, v) = if is_sized { (c, d, a, b) } else { (a, b, c, d) };
            let Some(receiver) = point(x, y) else { continue };
            let batch = batch_of(sample, samples);
            estimate.points[batch] += 1;
            if let Some(light_sample) = sample_light(self.scene, light, &receiver, (u, v), clear) {
                estimate.add(&light_sample, batch);
            }
        }
        if estimate.points == [0; BATCHES] && sampled.covered.is_some() {
            // What is covered is too little for so few points: those that stand for it do not miss it.
            return self.by_shadow_rays(index, (clear, &sampled.point), sampled, direct);
        }
        direct.rays += if clear { 0 } else { estimate.visible + estimate.hidden };
        direct.sampled |= !clear || estimate.crosses_horizon;
        direct.seen.add(FIRST_ID + index, estimate.visible, estimate.hidden);
        // The light of a near light varies strongly over the receiver, so the known mean does not apply to its lit part
        // alone.
        estimate.mean(center.filter(|_| estimate.hidden == 0))
    }

    /// The same for a light without size whose visibility is known. Shadows are exact on a receiver that is a
    /// parallelogram, and the light is approximated as constant within each of its lit pieces; on another receiver they
    /// are known at some of its points, and many samples are shadow rays to all of it.
    fn past_shadows(
        &self,
        index: u32,
        known: &LightVisibility,
        sampled: &SampledReceiver<'_, impl SurfacePoints>,
        direct: &mut Direct,
    ) -> (f32, f32) {
        let light = &self.lights[index as usize];
        let arriving = |receiver: &Receiver| center_irradiance(self.scene, light, receiver);
        let point = &sampled.point;
        let by_points = || ReceiverQuadrature::mean(|x, y| Some(Vec3::splat(arriving(&point(x, y)?))));
        let unoccluded = || match self.near_field_mean(light, sampled) {
            Some(mean) => (Vec3::splat(mean), 0.0),
            None => by_points(),
        };
        let shape = &sampled.visibility.receiver_shape;
        let (LightVisibility::Shadows(origin, shadows), Some(shape)) = (known, shape) else {
            direct.seen.add(FIRST_ID + index, 1, 0);
            let (mean, variance) = unoccluded();
            return (mean.x, variance);
        };
        let Some(middle) = point(0.5, 0.5) else { return (0.0, 0.0) };
        // Points that stand for the receiver are only the first estimate of where a shadow's edge crosses it.
        let covered = sampled.covered.filter(|_| matches!(shape, ReceiverShape::Points(_)));
        if let Some(covered) = covered.filter(|_| sampled.samples >= FEWEST_BEYOND_POINTS) {
            return self.by_shadow_rays(index, (false, covered), sampled, direct);
        }
        let (mut sum, mut lit, mut pieces) = (0.0, 0.0, PolygonClipper::new());
        let is_exact = origin.lit(shape, shadows, &mut pieces, |place: DVec3, share| {
            sum += share * f64::from(arriving(&Receiver { position: place.as_vec3(), ..middle }));
            lit += share;
        });
        let (hidden, lit) = (u32::from(lit < 1.0 - GAP), (lit as f32).min(1.0));
        direct.sampled |= covered.is_some() && hidden > 0 && lit > 0.0;
        direct.seen.add(FIRST_ID + index, u32::from(lit > 0.0), hidden);
        if lit == 0.0 {
            return (0.0, 0.0);
        }
        // The exact mean of a near light is dominated by the points closest to it, which a shadow may cover.
        let (open, variance) = if hidden == 0 { unoccluded() } else { by_points() };
        // `sum` samples each piece at one point; scale it by the ratio of the better unoccluded mean to the light at
        // the middle.
        let at_middle = arriving(&middle);
        let mean = match shape {
            ReceiverShape::Parallelogram(_) if at_middle > 0.0 => {
                open.x * (sum / f64::from(at_middle)) as f32
            }
            _ => sum as f32,
        };
        // With points in four rows or more, a shadow edge is off by half a row at most.
        let edge_variance = if hidden > 0 && !is_exact { (open.x * HALF_A_ROW).powi(2) / 3.0 } else { 0.0 };
        (mean, variance * lit * lit + edge_variance)
    }
}

/// Samples a light at a receiver, with (u, v) of the unit square choosing a point of its disc. `None` if the light
/// brings nothing there even without occluders. If `clear`, there are no occluders and no shadow ray is cast.
///
/// The disc contains the directions within the sphere's silhouette, sin θ = radius / distance. It is sampled uniformly
/// in its projection onto the plane perpendicular to the axis towards the light's centre. With ω the direction, a the
/// axis and V the visibility, E = strength · ⟨V n·ω / a·ω⟩: a sphere of uniform radiance that is entirely above the
/// horizon gives exactly n·a, as a point does.
pub(crate) fn sample_light(
    scene: &BakeScene,
    placed: &PlacedLight,
    receiver: &Receiver,
    (u, v): (f32, f32),
    clear: bool,
) -> Option<LightSample> {
    let light = &placed.light;
    let PunctualIrradiance { axis, distance, strength } =
        punctual_irradiance(scene, placed, receiver.position)?;
    let directional = light.kind == LightKind::Directional;
    let sine =
        if directional { (0.5 * f64::from(light.angle)).sin() } else { f64::from(light.radius) / distance };
    let sine = if sine > 0.0 { sine.min(LARGEST_SINE) } else { 0.0 };
    let (normal, facet) = (receiver.normal.as_dvec3(), receiver.geometric_normal.as_dvec3());
    let cosine = axis.dot(normal);
    if cosine <= -sine || axis.dot(facet) <= -sine {
        return None;
    }
    let mut direction = axis;
    let mut along = 1.0;
    if sine > 0.0 {
        let [x, y] = frame(axis.as_vec3()).map(|side| side.as_dvec3());
        let disc = cosine_direction(u, v).as_dvec3() * sine;
        along = (1.0 - disc.x * disc.x - disc.y * disc.y).max(0.0).sqrt();
        // `frame` is orthonormal only to f32 precision, so its remaining component along the axis is removed.
        let across = x * disc.x + y * disc.y;
        direction = (axis * along + (across - axis * across.dot(axis))).normalize_or(axis);
    }
    let weight = direction.dot(normal) / along;
    let center = (strength * cosine.max(0.0)) as f32;
    let disc = (strength * weight) as f32;
    if !disc.is_finite() || !center.is_finite() {
        return None;
    }
    if weight <= 0.0 || direction.dot(facet) <= 0.0 {
        return Some(LightSample { center, disc: disc.min(0.0), visible: false });
    }
    let blocked = if clear {
        false
    } else if directional {
        scene.blocked_towards(receiver.origin, direction.as_vec3())
    } else {
        // The ray ends at the sphere's surface: geometry inside it, such as a bulb, does not block its light.
        let across = direction.cross(axis).length() * distance;
        let depth = (f64::from(light.radius).powi(2) - across * across).max(0.0).sqrt();
        let reach = (distance * direction.dot(axis) - depth).max(0.0);
        let position = scene.space.world(receiver.position);
        let target = if sine > 0.0 { position + direction * reach } else { placed.position };
        scene.blocked(receiver.origin, scene.space.position(target))
    };
    Some(LightSample { center, disc, visible: !blocked })
}
