//! The final gather: cosine rays from every texel read the light that leaves what they meet. Direct light there is that of
//! the texel hit; the bounces before are the patches', or, where the hit is near and the patches coarse against it,
//! those of real bounces more. Emission is not read: `direct` has counted it.

use std::f32::consts::FRAC_1_PI;

use glam::{Vec2, Vec3};

use super::divided_light::DividedLight;
use super::footprint::{Texel, receiver};
use super::tile_sequence::TileSequence;
use crate::sampling::{cosine_about, triangle_point};
use crate::scene::material::Side;
use crate::scene::{BakeScene, LightmapLayout, SurfaceHit};
use crate::transport::direct::Receiver;
use crate::transport::guide::Guide;
use crate::transport::patches::Patches;

/// Independent scrambles per texel: their spread is the texel's error.
pub(crate) const SCRAMBLES: usize = 4;

/// The light that leaves surfaces, as the gather reads it.
pub(crate) struct Outgoing<'a> {
    pub scene: &'a BakeScene,
    pub layout: &'a LightmapLayout,
    pub patches: &'a Patches,
    /// Per texel of all maps, direct irradiance (mixed lights included); NaN where there is none, or more than one.
    pub direct: &'a [Vec3],
    /// Of the texels that have more than one.
    pub divided: &'a DividedLight,
    /// Irradiance that a surface gets of an unhidden sky.
    pub sky: Vec3,
    /// Per patch, direct irradiance.
    pub patch_direct: &'a [Vec3],
    /// Per patch, irradiance by bounces and by the sky.
    pub patch_indirect: &'a [Vec3],
    /// Per patch, the errors of that, with their signs: by the form factors' noise, and by the patches' size.
    pub patch_error: &'a [Vec2],
    /// Hits nearer than this get a real bounce more, canonical units.
    pub near: f32,
    /// Where each patch's light comes from.
    pub guide: &'a Guide,
    /// Samples of each scramble in the first round.
    pub run: u32,
}

/// One in so many samples asks a real bounce beside the patch that it reads.
pub(crate) const CHECKED: u32 = 4;

/// Most real bounces that one ray makes between surfaces too near for patches.
const NEAR_BOUNCES: u32 = 6;

/// What one ray of the gather found.
#[derive(Default)]
struct Reading {
    light: Vec3,
    /// What the patches' errors leave in it.
    error: Vec2,
    /// Whether the patch that was read was checked, and by how much it is more than the real bounce.
    checked: bool,
    difference: Vec3,
    /// Rays beyond the first.
    rays: u32,
}

/// A surface that a ray has met.
struct Met {
    triangle: u32,
    side: Side,
    at: (f32, f32),
    patch: u32,
    reflectance: Vec3,
    /// Direct irradiance there.
    direct: Vec3,
    /// Of the ray, of unit length, and how far it went.
    direction: Vec3,
    distance: f32,
}

/// No light and no weight: what the guide named is not to be seen.
const NOTHING: (Vec3, f32) = (Vec3::ZERO, 0.0);

/// What a ray meets: a surface that reflects, or else what arrives all the same, times π as all light is here: the sky's, or none.
type Meeting<T> = Result<T, Vec3>;

/// What the direction of a ray about a receiver's normal is worth: cos θ / π, with what lies under the facet mirrored up.
fn kernel(receiver: &Receiver, direction: Vec3) -> f32 {
    let below = direction - receiver.geometric_normal * (2.0 * direction.dot(receiver.geometric_normal));
    (direction.dot(receiver.normal).max(0.0) + below.dot(receiver.normal).max(0.0)) * FRAC_1_PI
}

/// The weights of a scramble's samples: their mean is 1 in the long run, so that what they are beside it can be taken out of what was
/// gathered (regression; Owen and Zhou, "Safe and Effective Importance Sampling", 2000). Under light that is the same all around nothing
/// else differs.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Weights {
    pub sum: f32,
    pub squares: f32,
    /// Of each weight with the light that it brought.
    pub products: Vec3,
    /// And of that light, mean of the channels, with itself.
    pub light_squares: f32,
}

impl Weights {
    fn add(&mut self, weight: f32, light: Vec3) {
        self.sum += weight;
        self.squares += weight * weight;
        self.products += weight * light;
        self.light_squares += (light.element_sum() / 3.0).powi(2);
    }
}

/// What a texel has gathered: irradiance by bounces.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Gathered {
    /// Sum of the samples of each scramble.
    pub sums: [Vec3; SCRAMBLES],
    /// What tells how far their weights alone made them so.
    pub weights: [Weights; SCRAMBLES],
    /// Sum over all samples of what the patches' errors add.
    pub patch_errors: Vec2,
    /// Samples that asked a real bounce beside the patch, the sum of the differences and of their squares.
    pub checks: u32,
    pub differences: Vec3,
    pub squared_differences: f32,
    /// Sum over all samples of 1 / distance to what was met, canonical units.
    pub inverse_distances: f32,
    /// Samples of each scramble.
    pub samples: u32,
    /// Rays cast.
    pub rays: u64,
}

/// Variance of weights below which they are all the same.
const LEAST_SPREAD: f32 = 1e-4;
/// Share of the light's variance that goes with the weights where they are taken out.
const EXPLAINED: f32 = 0.6;

impl Gathered {
    /// The estimate of each scramble.
    pub fn estimates(&self) -> [Vec3; SCRAMBLES] {
        if self.samples == 0 {
            return [Vec3::ZERO; SCRAMBLES];
        }
        let count = self.samples as f32;
        std::array::from_fn(|own| {
            // How light goes with weight is taken from the other scrambles: so the mean stays what it is.
            let (mut light, mut weights) = (Vec3::ZERO, Weights::default());
            for other in (0..SCRAMBLES).filter(|&other| other != own) {
                light += self.sums[other];
                weights.sum += self.weights[other].sum;
                weights.squares += self.weights[other].squares;
                weights.products += self.weights[other].products;
                weights.light_squares += self.weights[other].light_squares;
            }
            let all = count * (SCRAMBLES - 1) as f32;
            let spread = weights.squares - weights.sum * weights.sum / all;
            let together = weights.products - light * (weights.sum / all);
            let grey = |light: Vec3| light.element_sum() / 3.0;
            let light_spread = weights.light_squares - grey(light).powi(2) / all;
            // From few samples the slope is noise itself: it has to explain most of what differs.
            let explained = grey(together).powi(2) > EXPLAINED * spread * light_spread;
            let slope = together / spread;
            let known = spread > LEAST_SPREAD * all && explained && slope.is_finite();
            let slope = if known { slope } else { Vec3::ZERO };
            self.sums[own] / count - slope * (self.weights[own].sum / count - 1.0)
        })
    }

    /// Mean of 1 / distance to what light comes from: the irradiance changes over lengths of its inverse (Ward, Rubinstein and Clear,
    /// "A Ray Tracing Solution for Diffuse Interreflection", 1988).
    pub fn inverse_distance(&self) -> f32 {
        self.inverse_distances / (self.samples.max(1) * SCRAMBLES as u32) as f32
    }

    /// What the patches' errors add to the mean of the scrambles.
    pub fn patch_error(&self) -> f32 {
        self.patch_errors.length() / (self.samples.max(1) * SCRAMBLES as u32) as f32
    }
}

impl Outgoing<'_> {
    /// Adds samples `self.samples..samples` of every scramble.
    pub fn gather(&self, texel: &Texel, gathered: &mut Gathered, samples: u32, seed: u32) {
        for (scramble, sum) in gathered.sums.iter_mut().enumerate() {
            let sequence = TileSequence::new(seed, 16 + scramble as u32, texel, self.run);
            for sample in gathered.samples..samples {
                let [x, y, u, v] = sequence.point(sample, 0);
                let Some(point) = texel.point(self.scene, x, y) else { continue };
                let receiver = receiver(self.scene, &point);
                gathered.rays += 1;
                let region = self.guide.regions.at(point.triangle, Side::Front, point.at);
                let met = match self.sample(&receiver, region, u, v) {
                    Ok(met) => met,
                    Err((light, weight)) => {
                        *sum += light;
                        gathered.weights[scramble].add(weight, light);
                        continue;
                    }
                };
                // In turn over scrambles, samples and texels, so that every neighbourhood has some at any number of samples.
                let turn =
                    (sample * SCRAMBLES as u32 + scramble as u32).wrapping_add(texel.index.wrapping_mul(7));
                let checked = turn.is_multiple_of(CHECKED);
                gathered.inverse_distances += met.1 / met.0.distance.max(f32::MIN_POSITIVE);
                let weight = met.1;
                let found = self.read(met, sequence, sample, checked);
                *sum += found.light;
                gathered.weights[scramble].add(weight, found.light);
                gathered.rays += u64::from(found.rays);
                gathered.patch_errors += found.error;
                gathered.checks += u32::from(found.checked);
                gathered.differences += found.difference;
                gathered.squared_differences += (found.difference.element_sum() / 3.0).powi(2);
            }
        }
        gathered.samples = gathered.samples.max(samples);
    }

    /// A point that a receiver's light by bounces comes from, with its weight, or else light that needs no point, with its weight: some of the samples, if the guide
    /// knows the receiver's region, are points of regions that it names, the others are what cosine rays meet; weighed by the balance heuristic
    /// (Veach and Guibas, "Optimally Combining Sampling Techniques for Monte Carlo Rendering", 1995, section 3.3).
    fn sample(
        &self,
        receiver: &Receiver,
        region: Option<u32>,
        u: f32,
        v: f32,
    ) -> Result<(Met, f32), (Vec3, f32)> {
        let Some(region) = region.filter(|&region| self.guide.knows(region)) else {
            return match self.meet_about(receiver, u, v) {
                Ok(met) => Ok((met, 1.0)),
                Err(light) => Err((light, 1.0)),
            };
        };
        let share = self.guide.share(region);
        let (met, other, probability) = if u < share {
            let (other, u, probability) = self.guide.pick(region, u / share).ok_or(NOTHING)?;
            (self.point_of(receiver, other, u, v).ok_or(NOTHING)?, other, probability)
        } else {
            // The sky is found by these alone.
            let met = self.meet_about(receiver, (u - share) / (1.0 - share), v);
            let met = met.map_err(|light| (light / (1.0 - share), 1.0 / (1.0 - share)))?;
            let other = self.guide.regions.at(met.triangle, met.side, met.at).ok_or(NOTHING)?;
            (met, other, self.guide.probability(region, other))
        };
        // Densities over the surfaces' area.
        let by_guide = probability / self.guide.regions.list[other as usize].area;
        let normal = self.scene.triangles[met.triangle as usize].side_normal(met.side);
        let cosine = -met.direction.dot(normal);
        let by_cosine = kernel(receiver, met.direction) * cosine / (met.distance * met.distance);
        let weight = by_cosine / ((1.0 - share) * by_cosine + share * by_guide);
        if cosine > 0.0 && weight.is_finite() { Ok((met, weight)) } else { Err(NOTHING) }
    }

    /// What a ray about a receiver's normal meets.
    fn meet_about(&self, receiver: &Receiver, u: f32, v: f32) -> Meeting<Met> {
        let mut direction = cosine_about(receiver.normal, u, v);
        let below = direction.dot(receiver.geometric_normal);
        if below <= 0.0 {
            // Under the facet though above the smooth surface: mirrored up.
            direction -= receiver.geometric_normal * (2.0 * below);
        }
        self.meet(receiver.origin, direction)
    }

    /// A point of a region, if the receiver sees it.
    fn point_of(&self, receiver: &Receiver, region: u32, u: f32, v: f32) -> Option<Met> {
        let region = &self.guide.regions.list[region as usize];
        let (triangle, side) = (region.triangle, region.side);
        let at = self.guide.regions.point(region, triangle_point(u, v));
        let surface = &self.scene.triangles[triangle as usize];
        let position = surface.position(at.0, at.1);
        let apart = position - receiver.position;
        let distance = apart.length();
        let direction = apart / distance;
        let faces =
            direction.dot(surface.side_normal(side)) < 0.0 && direction.dot(receiver.geometric_normal) > 0.0;
        let end = self.scene.off_surface_seen_from(triangle, side, position, receiver.origin);
        if !faces || self.scene.blocked(receiver.origin, end) {
            return None;
        }
        let patch = self.patches.at(triangle, side, at)?;
        let reflectance = self.reflectance(triangle, side, at);
        let direct = self.direct_at(triangle, side, at, patch);
        Some(Met { triangle, side, at, patch, reflectance, direct, direction, distance })
    }

    /// The light that leaves a point that was met, emission apart, times a weight.
    fn read(&self, (met, weight): (Met, f32), sequence: TileSequence, sample: u32, checked: bool) -> Reading {
        let mut reading = Reading { checked, ..Reading::default() };
        let mut weight = weight * met.reflectance;
        let (mut light, mut last) = (weight * met.direct, met);
        // In a gap narrower than patches there may be many.
        for bounce in 0..NEAR_BOUNCES {
            if last.distance >= self.near || weight == Vec3::ZERO {
                break;
            }
            let [u, v, ..] = sequence.point(sample, 2 + bounce);
            reading.rays += 1;
            let (met, chance) = match self.bounce(&last, None, u, v) {
                Ok(met) => met,
                Err((arriving, _)) => {
                    reading.light = light + weight * arriving;
                    return reading;
                }
            };
            weight *= chance * met.reflectance;
            light += weight * met.direct;
            last = met;
        }
        let indirect = self.patch_indirect[last.patch as usize];
        let grey = |color: Vec3| color.element_sum() / 3.0;
        if checked {
            let [u, v, ..] = sequence.point(sample, 1);
            reading.rays += 1;
            let region = self.guide.regions.at(last.triangle, last.side, last.at);
            let real = self.bounce(&last, region, u, v).map_or_else(
                |(light, _)| light,
                |(met, chance)| {
                    chance * met.reflectance * (met.direct + self.patch_indirect[met.patch as usize])
                },
            );
            reading.difference = weight * (indirect - real);
        }
        reading.light = light + weight * indirect;
        reading.error = self.patch_error[last.patch as usize] * grey(weight);
        reading
    }

    /// What a ray meets.
    fn meet(&self, origin: Vec3, direction: Vec3) -> Meeting<Met> {
        let (triangle, side, at, distance) = match self.scene.first_hit(origin, direction) {
            SurfaceHit::Lit { triangle, side, at, distance } => (triangle, side, at, distance),
            SurfaceHit::None => return Err(self.sky),
            SurfaceHit::Back | SurfaceHit::Inside => return Err(Vec3::ZERO),
        };
        let patch = self.patches.at(triangle, side, at).ok_or(Vec3::ZERO)?;
        let reflectance = self.reflectance(triangle, side, at);
        let direct = self.direct_at(triangle, side, at, patch);
        Ok(Met { triangle, side, at, patch, reflectance, direct, direction, distance })
    }

    /// What a surface's own light by bounces comes from: one sample, with its weight, placed by the guide for a region or by the cosine.
    fn bounce(&self, from: &Met, region: Option<u32>, u: f32, v: f32) -> Result<(Met, f32), (Vec3, f32)> {
        let surface = &self.scene.triangles[from.triangle as usize];
        let position = surface.position(from.at.0, from.at.1);
        let origin = self.scene.off_surface(from.triangle, from.side, position);
        let normal = surface.side_normal(from.side);
        let receiver = Receiver { position, origin, geometric_normal: normal, normal };
        self.sample(&receiver, region, u, v)
    }

    /// What a point of a surface reflects in all (its exitance without emission, W/m²), as the patches know it.
    pub fn leaving(&self, triangle: u32, side: Side, at: (f32, f32)) -> Vec3 {
        let Some(patch) = self.patches.at(triangle, side, at) else { return Vec3::ZERO };
        let irradiance = self.direct_at(triangle, side, at, patch) + self.patch_indirect[patch as usize];
        self.reflectance(triangle, side, at) * irradiance
    }

    fn reflectance(&self, triangle: u32, side: Side, (u, v): (f32, f32)) -> Vec3 {
        let scene_triangle = &self.scene.triangles[triangle as usize];
        let surface = &self.scene.surfaces[scene_triangle.surface as usize];
        if surface.varies() {
            surface.reflectance(side, scene_triangle.vertices, [1.0 - u - v, u, v])
        } else {
            self.patches.reflectance(triangle, side)
        }
    }

    /// Of the texel hit, or its part, or of the patch where no texel shows that side.
    fn direct_at(&self, triangle: u32, side: Side, (u, v): (f32, f32), patch: u32) -> Vec3 {
        if side == Side::Front {
            let scene_triangle = &self.scene.triangles[triangle as usize];
            let map = &self.layout.maps[scene_triangle.object as usize];
            let [a, b, c] = scene_triangle.uv;
            let uv = a + (b - a) * u + (c - a) * v;
            let (x, y) = (uv.x as u32, uv.y as u32);
            if x < map.width && y < map.height {
                let index = map.first + (y * map.width + x) as usize;
                let direct = self.direct[index];
                if !direct.x.is_nan() {
                    return direct;
                }
                if let Some(direct) = self.divided.at(index as u32, uv.fract()) {
                    return direct;
                }
            }
        }
        self.patch_direct[patch as usize]
    }
}
