//! Direct light at a small piece of surface (a texel, a patch): emissive triangles by Lambert's formula times the seen
//! share of their light, punctual lights by shadow rays. Not bounces.

use std::f32::consts::PI;
use std::f64::consts::PI as PI_F64;

use glam::{DVec3, Vec3};
use lumbre_optics::{BakeMode, LightKind, evaluate_light};

use super::emitters::{Emitter, emitters};
use super::polygon::point_to_triangle;
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
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Direct {
    /// From emissive triangles and static lights: goes into the map.
    pub baked: Vec3,
    /// From mixed lights: bounces only.
    pub mixed: Vec3,
    /// Variance that sampling leaves in `baked`, mean of the channels.
    pub variance: f32,
    /// Rays cast.
    pub rays: u32,
    /// What of the sources was seen.
    pub seen: Seen,
}

/// What a receiver saw of the sources.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Seen {
    /// Some source was seen by one sample and not by another: a penumbra, or a shadow's edge.
    pub partly: bool,
    /// One number for each combination of seen and hidden sources.
    pub signature: u32,
}

impl Seen {
    fn add(&mut self, visible: u32, hidden: u32) {
        self.partly |= visible > 0 && hidden > 0;
        self.signature = hash(self.signature ^ (u32::from(visible > 0) + 2 * u32::from(hidden > 0)));
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
    scene: &'a BakeScene,
    pub emitters: Vec<Emitter>,
    pub lights: Vec<PlacedLight>,
}

/// Runs of samples whose spread tells the error of their mean: each is a low-discrepancy sequence of its own. (One in every four samples
/// is not: their spread is several times larger than the error.) All together are spread better than apart, so that the true error is smaller.
const GROUPS: usize = 4;

fn group_of(sample: u32, samples: u32) -> usize {
    (sample as usize * GROUPS / samples.max(1) as usize).min(GROUPS - 1)
}

/// Exact unoccluded light at evenly spread points of a receiver, in pairs about its middle, so that what is left is of second order
/// in its size.
struct Unoccluded {
    sum: Vec3,
    least: f32,
    most: f32,
}

/// Points of a receiver at which it is, in the unit square: the first four where the light hardly changes, and sixteen more where it does.
/// Each coordinate takes every value once, and neither has to do with the other: a list of points, too, is read evenly.
const FEW: [u32; 4] = [1, 3, 0, 2];
const MANY: [u32; 16] = [5, 3, 15, 11, 7, 1, 13, 9, 6, 2, 14, 8, 4, 0, 12, 10];

/// Light that differs by this part of its mean over the first points calls for more: at a lamp's edge it changes within a texel.
const UNEVEN: f32 = 0.05;

impl Unoccluded {
    fn at<const N: usize>(points: [u32; N], light: impl Fn(f32, f32) -> Option<Vec3>) -> (Self, f32) {
        let mut found = Self { sum: Vec3::ZERO, least: f32::INFINITY, most: 0.0 };
        let mut count = 0.0;
        for (x, y) in points.into_iter().enumerate() {
            let middle = |place: u32| (place as f32 + 0.5) / N as f32;
            let Some(light) = light(middle(x as u32), middle(y)) else { continue };
            let grey = light.element_sum() / 3.0;
            found = Self { sum: found.sum + light, least: found.least.min(grey), most: found.most.max(grey) };
            count += 1.0;
        }
        (found, count)
    }

    /// The mean over a receiver, and its squared error: what differs by d of the mean within it leaves d² at second order, and a
    /// sixteenth of that for points four times as dense.
    fn mean(light: impl Fn(f32, f32) -> Option<Vec3>) -> (Vec3, f32) {
        let (mut found, mut count) = Self::at(FEW, &light);
        let mut dense = 1.0;
        if found.most - found.least > UNEVEN * found.most {
            (found, count) = Self::at(MANY, &light);
            dense = 16.0;
        }
        if count == 0.0 {
            return (Vec3::ZERO, 0.0);
        }
        let mean = found.sum / count;
        let grey = mean.element_sum() / 3.0;
        let apart = if grey > 0.0 { (found.most - found.least) / grey } else { 0.0 };
        (mean, (grey * 0.25 * apart.min(1.0).powi(2) / dense).powi(2))
    }
}

/// Variance of the mean of all groups, from each group's mean.
fn variance_of_mean(groups: [f32; GROUPS]) -> f32 {
    let mean = groups.iter().sum::<f32>() / GROUPS as f32;
    groups.iter().map(|group| (group - mean).powi(2)).sum::<f32>() / (GROUPS * (GROUPS - 1)) as f32
}

/// Up to this many emitters, the unoccluded light of all is summed exactly at each point.
const EXACT_EMITTERS: usize = 48;

impl<'a> Sources<'a> {
    pub fn new(scene: &'a BakeScene, lights: Vec<PlacedLight>) -> Self {
        Self { scene, emitters: emitters(scene), lights }
    }

    /// Whether nothing shines.
    pub fn is_empty(&self) -> bool {
        self.emitters.is_empty() && self.lights.is_empty()
    }

    /// Mean irradiance of a receiver by `samples` shadow rays to the emitters and to each light; `point` maps the unit
    /// square onto its surface.
    pub fn irradiance(
        &self,
        sequence: Sequence,
        samples: u32,
        point: &impl Fn(f32, f32) -> Option<Receiver>,
    ) -> Direct {
        let mut direct = Direct::default();
        if !self.emitters.is_empty() {
            let light = self.emitted(sequence, samples, point, &mut direct);
            direct.baked += light;
        }
        for (index, light) in self.lights.iter().enumerate() {
            let irradiance = self.lit_by(light, index as u32, sequence, samples, point, &mut direct);
            match light.light.bake {
                BakeMode::Static => direct.baked += irradiance,
                BakeMode::Mixed | BakeMode::Dynamic => direct.mixed += irradiance,
            }
        }
        direct
    }

    /// E = (mean of the exact unoccluded light) x (seen light / all light, by the same samples): exact in full light and
    /// in full shadow, and in between its error is that of the share alone.
    fn emitted(
        &self,
        sequence: Sequence,
        samples: u32,
        point: &impl Fn(f32, f32) -> Option<Receiver>,
        direct: &mut Direct,
    ) -> Vec3 {
        let Some(anchor) = point(0.5, 0.5) else { return Vec3::ZERO };
        let Some(choice) = Choice::new(&self.emitters, &anchor) else { return Vec3::ZERO };
        let exact = self.emitters.len() <= EXACT_EMITTERS;
        let (mut all, mut seen) = (Vec3::ZERO, Vec3::ZERO);
        let (mut visible, mut hidden) = (0u32, 0u32);
        let (mut group_all, mut group_seen) = ([0.0f32; GROUPS], [0.0f32; GROUPS]);
        for sample in 0..samples {
            let group = group_of(sample, samples);
            let [x, y, u, v] = sequence.point(sample, 0);
            let Some(receiver) = point(x, y) else { continue };
            let (chosen, u, probability) = choice.pick(u);
            let emitter = &self.emitters[chosen];
            let (a, b) = triangle_point(u, v);
            let [p, q, r] = emitter.corners;
            let target = p + (q - p) * a + (r - p) * b;
            let towards = target - receiver.position;
            let distance_squared = towards.length_squared();
            let direction = towards.normalize_or_zero();
            let (cosine, emitted) = (direction.dot(receiver.normal), -direction.dot(emitter.normal));
            if cosine <= 0.0 || emitted <= 0.0 || direction.dot(receiver.geometric_normal) <= 0.0 {
                continue;
            }
            let light =
                emitter.radiance * (cosine * emitted * emitter.area / (distance_squared * probability));
            if !light.is_finite() {
                continue;
            }
            all += light;
            group_all[group] += light.element_sum() / 3.0;
            direct.rays += 1;
            let target = self.scene.off_surface(emitter.triangle, emitter.side, target);
            if self.scene.blocked(receiver.origin, target) {
                hidden += 1;
            } else {
                visible += 1;
                seen += light;
                group_seen[group] += light.element_sum() / 3.0;
            }
        }
        direct.seen.add(visible, hidden);
        if exact && visible == 0 {
            Vec3::ZERO
        } else if exact {
            let share = |seen: f32, all: f32| if all > 0.0 { seen / all } else { 0.0 };
            let share = Vec3::new(share(seen.x, all.x), share(seen.y, all.y), share(seen.z, all.z));
            let (unoccluded, uneven) =
                Unoccluded::mean(|x, y| point(x, y).map(|point| self.unoccluded(&point)));
            let shares = std::array::from_fn(|at| match group_all[at] > 0.0 {
                true => group_seen[at] / group_all[at],
                false => share.element_sum() / 3.0,
            });
            direct.variance += (unoccluded.element_sum() / 3.0).powi(2) * variance_of_mean(shares);
            direct.variance += uneven * (share.element_sum() / 3.0).powi(2);
            unoccluded * share
        } else {
            let per_group = GROUPS as f32 / samples.max(1) as f32;
            direct.variance += variance_of_mean(group_seen.map(|seen| seen * per_group));
            seen / samples.max(1) as f32
        }
    }

    /// Light of all emitters as if nothing were between.
    fn unoccluded(&self, receiver: &Receiver) -> Vec3 {
        let (position, normal) = (receiver.position.as_dvec3(), receiver.normal.as_dvec3());
        let light = |emitter: &Emitter| {
            emitter.radiance.as_dvec3() * (PI_F64 * point_to_triangle(position, normal, &emitter.corners_f64))
        };
        self.emitters.iter().map(light).sum::<DVec3>().as_vec3()
    }

    fn lit_by(
        &self,
        light: &PlacedLight,
        index: u32,
        sequence: Sequence,
        samples: u32,
        point: &impl Fn(f32, f32) -> Option<Receiver>,
        direct: &mut Direct,
    ) -> Vec3 {
        let space = self.scene.space;
        let mut sum = Vec3::ZERO;
        let mut group_sums = [0.0f32; GROUPS];
        let (mut visible, mut hidden) = (0u32, 0u32);
        for sample in 0..samples {
            let [x, y, ..] = sequence.point(sample, 1 + index % 32);
            let Some(receiver) = point(x, y) else { continue };
            let arriving =
                evaluate_light(&light.light, light.position, light.axis, space.world(receiver.position));
            let direction = arriving.direction.as_vec3();
            let cosine = direction.dot(receiver.normal);
            let strength = arriving.attenuation * arriving.spot;
            if cosine <= 0.0 || strength <= 0.0 || direction.dot(receiver.geometric_normal) <= 0.0 {
                continue;
            }
            direct.rays += 1;
            let blocked = if light.light.kind == LightKind::Directional {
                self.scene.blocked_towards(receiver.origin, direction)
            } else {
                self.scene.blocked(receiver.origin, space.position(light.position))
            };
            if blocked {
                hidden += 1;
            } else {
                visible += 1;
                let light = (arriving.diffuse * strength).as_vec3() * (PI * cosine);
                sum += light;
                group_sums[group_of(sample, samples)] += light.element_sum() / 3.0;
            }
        }
        direct.seen.add(visible, hidden);
        if light.light.bake == BakeMode::Static {
            let per_group = GROUPS as f32 / samples.max(1) as f32;
            direct.variance += variance_of_mean(group_sums.map(|sum| sum * per_group));
        }
        sum / samples.max(1) as f32
    }
}

/// Emitters by their likely share of the light at a receiver.
struct Choice {
    /// Running sums, the last 1.
    cumulative: Vec<f32>,
}

impl Choice {
    /// `None` if the receiver is behind them all.
    fn new(emitters: &[Emitter], anchor: &Receiver) -> Option<Self> {
        let mut cumulative = Vec::with_capacity(emitters.len());
        let mut sum = 0.0f64;
        for emitter in emitters {
            let [a, b, c] = emitter.corners;
            let to_center = (a + b + c) / 3.0 - anchor.position;
            let distance_squared = to_center.length_squared();
            // Cosines at the centre, raised by the angle that the emitter subtends: never 0 where light may arrive.
            let spread = (emitter.area / (distance_squared + emitter.area)).sqrt();
            let direction = to_center.normalize_or_zero();
            let receives = (direction.dot(anchor.normal) + spread).clamp(0.05, 1.0);
            let emits = (spread - direction.dot(emitter.normal)).clamp(0.05, 1.0);
            let power = emitter.radiance.element_sum() * emitter.area;
            sum += f64::from(power * receives * emits / (distance_squared + emitter.area));
            cumulative.push(sum);
        }
        (sum > 0.0 && sum.is_finite())
            .then(|| Self { cumulative: cumulative.into_iter().map(|value| (value / sum) as f32).collect() })
    }

    /// The emitter at `u`, the position within its interval stretched to [0, 1), and its probability.
    fn pick(&self, u: f32) -> (usize, f32, f32) {
        let index = self.cumulative.partition_point(|&end| end <= u).min(self.cumulative.len() - 1);
        let start = if index == 0 { 0.0 } else { self.cumulative[index - 1] };
        let probability = (self.cumulative[index] - start).max(f32::MIN_POSITIVE);
        (index, ((u - start) / probability).clamp(0.0, 1.0 - f32::EPSILON), probability)
    }
}
