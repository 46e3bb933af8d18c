//! Direct light of point, spot and directional lights, by shadow rays where it is not known what stands between. A light with a size is a
//! sphere, or a disc on the sky, of one radiance; its law of distance and its cone are those of its centre. Not emissive surfaces: those are
//! `direct`.

use glam::{DVec3, Vec3};
use lumbre_optics::{BakeMode, LightKind};

use super::punctual_irradiance::{PunctualIrradiance, of_center, over_parallelogram, punctual_irradiance};
use super::receiver_quadrature::ReceiverQuadrature;
use super::share_variance::share_variance;
use crate::sampling::{Sequence, cosine_direction, frame};
use crate::scene::Receiver;
use crate::scene::{BakeScene, PlacedLight};
use crate::sources::batches::{BATCHES, batch_of, variance_of_mean};
use crate::sources::direct::Direct;
use crate::sources::light_sources::Sources;
use crate::visibility::cut_out::{GAP, Pieces};
use crate::visibility::occluders::Visibility;
use crate::visibility::shadow_clipping::{LightVisibility, ReceiverShape};

/// Numbers of the lights as sources begin here: before it are parts of emissive surfaces.
pub(crate) const FIRST_ID: u32 = 1 << 31;

/// Inside the sphere, or near it, its disc is at most this large: a sine. It bounds what one sample weighs to 1/√(1 - this²) = 7.
const LARGEST_SINE: f64 = 0.99;

/// Fewest shadow rays to a near light: a thing the size of its fittings hides much of what it sends, from a small part of the texel.
const NEAR_SAMPLES: u32 = 64;

/// Of a receiver's side, half of the way from one row of its points to the next.
const HALF_A_ROW: f32 = 0.125;

/// One light as one sample meets it, per unit of its colour: irradiance.
pub(crate) struct LightSample {
    /// Of the light's centre, where the receiver faces it.
    center: f32,
    /// Of a point of its disc; not above 0 where that is under the receiver's horizon.
    pub disc: f32,
    pub visible: bool,
}

/// A light at a receiver, by all its samples.
#[derive(Default)]
struct LightEstimate {
    center: [f32; BATCHES],
    disc: [f32; BATCHES],
    seen: [f32; BATCHES],
    visible: u32,
    hidden: u32,
    /// Some of the disc is under the horizon.
    sets: bool,
}

impl LightEstimate {
    fn add(&mut self, sample: &LightSample, batch: usize) {
        self.center[batch] += sample.center;
        self.disc[batch] += sample.disc;
        self.sets |= sample.disc <= 0.0;
        if sample.visible {
            self.visible += 1;
            self.seen[batch] += sample.disc;
        } else {
            self.hidden += 1;
        }
    }

    /// Mean irradiance per unit of colour, and its variance: the light of the centre times the seen share of the disc, which is
    /// exact in full light and in full shadow; the seen disc's own mean where the horizon cuts it. The light of the centre may be known.
    fn mean(&self, samples: u32, known_center: Option<f32>) -> (f32, f32) {
        let samples = samples.max(1) as f32;
        let per_batch = BATCHES as f32 / samples;
        let total = |sums: &[f32; BATCHES]| sums.iter().sum::<f32>();
        let all = total(&self.disc);
        if self.sets || all <= 0.0 {
            return (total(&self.seen) / samples, variance_of_mean(self.seen.map(|sum| sum * per_batch)));
        }
        let center = known_center.unwrap_or(total(&self.center) / samples);
        let share = total(&self.seen) / all;
        let of_batch = |batch: usize| match self.disc[batch] > 0.0 {
            true => self.seen[batch] / self.disc[batch],
            false => share,
        };
        let shares = std::array::from_fn(of_batch);
        // Where its light is uneven, the seen share is as uncertain as the mean by the samples.
        let uneven = variance_of_mean(self.center.map(|sum| sum * per_batch));
        let partly = share_variance(shares, share, self.visible + self.hidden);
        (center * share, center * center * partly + share * share * uneven)
    }
}

impl Sources<'_> {
    /// Adds the light of some punctual lights, by number, to `direct`: mean over a receiver, by `samples` shadow rays to each; by none to those
    /// for which it is known what may stand `between`.
    pub(crate) fn punctual(
        &self,
        lights: &[u32],
        visibility: &Visibility<'_>,
        sequence: Sequence,
        samples: u32,
        point: &impl Fn(f32, f32) -> Option<Receiver>,
        direct: &mut Direct,
    ) {
        for &index in lights {
            self.light_irradiance(index, visibility, sequence, samples, point, direct);
        }
    }

    fn light_irradiance(
        &self,
        index: u32,
        visibility: &Visibility<'_>,
        sequence: Sequence,
        samples: u32,
        point: &impl Fn(f32, f32) -> Option<Receiver>,
        direct: &mut Direct,
    ) {
        let placed = &self.lights[index as usize];
        let known = visibility.of_light(index);
        let (mean, variance) = match known {
            Some(LightVisibility::Dark) => return,
            Some(LightVisibility::Hidden) => {
                direct.seen.add(FIRST_ID + index, 0, 1);
                return;
            }
            Some(known) if !placed.is_sized() => self.past_shadows(index, known, visibility, point, direct),
            known => {
                let clear = matches!(known, Some(LightVisibility::Clear));
                let center =
                    if placed.is_sized() { None } else { self.near_field_mean(placed, visibility, point) };
                self.by_shadow_rays(index, (clear, center), sequence, samples, point, direct)
            }
        };
        let color = placed.light.diffuse;
        match placed.light.bake {
            BakeMode::Static => {
                direct.baked += color * mean;
                direct.variance += (color.element_sum() / 3.0).powi(2) * variance;
            }
            BakeMode::Mixed | BakeMode::Dynamic => direct.mixed += color * mean,
        }
    }

    /// Of a light without size that is near a receiver on a plane the mean over all of it, whatever lies between.
    fn near_field_mean(
        &self,
        light: &PlacedLight,
        visibility: &Visibility<'_>,
        point: &impl Fn(f32, f32) -> Option<Receiver>,
    ) -> Option<f32> {
        over_parallelogram(self.scene, light, visibility.square.as_ref()?, &point(0.5, 0.5)?)
    }

    /// Mean irradiance of a light per unit of its colour, and its variance, by samples; by no rays if all is `clear`, and that of its `center`
    /// as it is known, if it is.
    fn by_shadow_rays(
        &self,
        index: u32,
        (clear, center): (bool, Option<f32>),
        sequence: Sequence,
        samples: u32,
        point: &impl Fn(f32, f32) -> Option<Receiver>,
        direct: &mut Direct,
    ) -> (f32, f32) {
        let light = &self.lights[index as usize];
        let mut sum = LightEstimate::default();
        let sequence = sequence.of(1 + index);
        let sized = light.is_sized();
        let samples = if center.is_some() && !clear { samples.max(NEAR_SAMPLES) } else { samples };
        for sample in 0..samples {
            let [a, b, c, d] = sequence.point(sample, 0);
            let (x, y, u, v) = if sized { (c, d, a, b) } else { (a, b, c, d) };
            let Some(receiver) = point(x, y) else { continue };
            if let Some(sampled) = sample_light(self.scene, light, &receiver, (u, v), clear) {
                sum.add(&sampled, batch_of(sample, samples));
            }
        }
        direct.rays += if clear { 0 } else { sum.visible + sum.hidden };
        direct.sampled |= !clear || sum.sets;
        direct.seen.add(FIRST_ID + index, sum.visible, sum.hidden);
        // Of a near light a shadow takes what the few samples in it do not tell.
        sum.mean(samples, center.filter(|_| sum.hidden == 0))
    }

    /// The same for a light without size, exactly but for what differs within a lit piece of the receiver.
    fn past_shadows(
        &self,
        index: u32,
        known: &LightVisibility,
        visibility: &Visibility<'_>,
        point: &impl Fn(f32, f32) -> Option<Receiver>,
        direct: &mut Direct,
    ) -> (f32, f32) {
        let light = &self.lights[index as usize];
        let arriving = |receiver: &Receiver| of_center(self.scene, light, receiver);
        let by_points = || ReceiverQuadrature::mean(|x, y| Some(Vec3::splat(arriving(&point(x, y)?))));
        let open = || match self.near_field_mean(light, visibility, point) {
            Some(mean) => (Vec3::splat(mean), 0.0),
            None => by_points(),
        };
        let (LightVisibility::Shadows(origin, shadows), Some(shape)) = (known, &visibility.receiver_shape)
        else {
            direct.seen.add(FIRST_ID + index, 1, 0);
            let (open, variance) = open();
            return (open.x, variance);
        };
        let Some(middle) = point(0.5, 0.5) else { return (0.0, 0.0) };
        let (mut sum, mut lit, mut room) = (0.0, 0.0, Pieces::new());
        let exact = origin.lit(shape, shadows, &mut room, |place: DVec3, share| {
            sum += share * f64::from(arriving(&Receiver { position: place.as_vec3(), ..middle }));
            lit += share;
        });
        let (hidden, lit) = (u32::from(lit < 1.0 - GAP), (lit as f32).min(1.0));
        direct.seen.add(FIRST_ID + index, u32::from(lit > 0.0), hidden);
        if lit == 0.0 {
            return (0.0, 0.0);
        }
        // Of a near light a shadow takes what no piece's middle tells.
        let (open, variance) = if hidden == 0 { open() } else { by_points() };
        // Pieces have one point each, all of the receiver several.
        let whole = arriving(&middle);
        let mean = match shape {
            ReceiverShape::Parallelogram(_) if whole > 0.0 => open.x * (sum / f64::from(whole)) as f32,
            _ => sum as f32,
        };
        // Of points in four rows or more, an edge is off by half a row at most.
        let of_edges = if hidden > 0 && !exact { (open.x * HALF_A_ROW).powi(2) / 3.0 } else { 0.0 };
        (mean, variance * lit * lit + of_edges)
    }
}

/// What a point of a receiver gets of a light whose disc is sampled at (u, v) of the unit square; `None` where it gets nothing
/// whatever lies between. If all is `clear`, nothing does.
///
/// The disc is that of directions within the sphere's silhouette, sin θ = radius / distance, sampled evenly in its projection onto
/// the plane across the axis to its centre. With ω the direction, E = strength · ⟨V n·ω / a·ω⟩: a sphere of one radiance gives
/// exactly n·a where it is whole above the horizon, as a point does.
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
        // `frame` is orthonormal to f32: what is left of the axis in it is taken out.
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
        // Up to where the sphere begins: what is inside it, its bulb, hides nothing.
        let across = direction.cross(axis).length() * distance;
        let depth = (f64::from(light.radius).powi(2) - across * across).max(0.0).sqrt();
        let reach = (distance * direction.dot(axis) - depth).max(0.0);
        let position = scene.space.world(receiver.position);
        let target = if sine > 0.0 { position + direction * reach } else { placed.position };
        scene.blocked(receiver.origin, scene.space.position(target))
    };
    Some(LightSample { center, disc, visible: !blocked })
}
