//! Path tracer for converged irradiance at points of a world's surfaces: f64, next-event estimation, Russian roulette,
//! and a bounding volume hierarchy of its own. Front sides are diffuse, emitters one-sided, back sides black unless the
//! world's rule lights them; sheets let a part of the light pass in a straight line; the sky has one colour. It shares
//! no code with the baker, nor with `lumbre_trace`, which it is compared with.

mod bright;
mod choice;
mod directions;
pub mod hierarchy;
mod indirect_cache;
mod lamps;
mod pieces;
mod points;
mod punctual;
mod spherical_triangle;

use std::f64::consts::PI;

use bevy_ecs::world::World;
use glam::{DVec2, DVec3};
use lumbre_optics::{AlphaMode, Material};
use lumbre_scene::{GlobalTransform, MaterialTextures, Mesh, SceneSettings, StaticObject};
use rayon::prelude::*;

use super::random::Random;
use super::scenes::region::Region;
use bright::BrightPieces;
use directions::Directions;
use hierarchy::{Hierarchy, Triangle};
use indirect_cache::{IndirectCache, SETS};
use lamps::Lamps;
use punctual::PunctualLights;

/// The bounce at which paths end that read the rest of their light from a cache. With the first one, and pieces of a
/// quarter of a metre, points of `cellar_0` were 1.3 % too bright; with the second one 1.0 %, and with smaller pieces, too,
/// 0.6 %.
const LAST_BOUNCE: usize = 2;

pub struct PathTracer {
    pub scene: Hierarchy,
    lamps: Lamps,
    lights: PunctualLights,
    /// The radiance that a ray which leaves the scene brings.
    sky: DVec3,
    directions: Directions,
    region: Option<Region>,
    bright: Option<BrightPieces>,
    /// If there is one, paths end at their [`LAST_BOUNCE`] and read the rest of their light from it.
    indirect_cache: Option<IndirectCache>,
    /// The distance from a surface at which rays start.
    pub offset: f64,
}

/// A point with its irradiance and the standard errors of that, W/m².
#[derive(Clone, Copy, Debug)]
pub struct Irradiance {
    pub position: DVec3,
    pub normal: DVec3,
    pub value: DVec3,
    pub error: DVec3,
    /// Whether the direct light changes much within a texel of the point.
    pub edge: bool,
    /// Whether the point is in the level's region; always true in a scene that has none.
    pub inside: bool,
}

/// The effort for a point: batches of `side`² paths, as many as bring the standard error down to the share `error` of
/// the irradiance.
#[derive(Clone, Copy, Debug)]
pub struct Effort {
    pub side: usize,
    pub error: f64,
    /// The smallest and the largest number of batches.
    pub batches: [usize; 2],
}

impl Effort {
    /// The same number of batches for every point.
    pub fn fixed(batches: usize, side: usize) -> Self {
        Self { side, error: 0.0, batches: [batches; 2] }
    }

    /// A standard error of 0.4 %, unless it is still larger after 58,000 paths.
    pub fn reference() -> Self {
        Self::reference_to(0.004)
    }

    /// This standard error as a share of the irradiance, unless it is still larger after 58,000 paths, or after as
    /// many more as the square of a share below 0.4 % calls for.
    pub fn reference_to(error: f64) -> Self {
        let share = (0.004 / error).max(1.0);
        Self { side: 24, error, batches: [8, (100.0 * share * share).min(1e6) as usize] }
    }
}

impl PathTracer {
    pub fn new(world: &mut World) -> Self {
        lumbre_scene::update_transforms(world);
        let scene = Hierarchy::new(triangles(world));
        let sky =
            world.get_resource::<SceneSettings>().map_or(DVec3::ZERO, |settings| settings.sky.as_dvec3());
        let region = world.get_resource::<Region>().cloned();
        let [low, high] = scene.bounds();
        let mut tracer = Self {
            lamps: Lamps::new(&scene),
            lights: PunctualLights::new(world, &scene),
            sky,
            directions: Directions::new(region.clone()),
            region,
            offset: 1e-9 * (high - low).length(),
            scene,
            bright: None,
            indirect_cache: None,
        };
        tracer.bright = tracer.region.is_some().then(|| BrightPieces::new(&tracer));
        tracer
    }

    /// Precomputes a cache of indirect light in which paths end at their [`LAST_BOUNCE`]: dark places have far less
    /// noise, but the light of more bounces than that is constant over pieces of a tenth of a metre, and its own noise
    /// is the same for all points.
    #[must_use]
    pub fn with_indirect_cache(mut self, seed: u64) -> Self {
        self.indirect_cache = Some(IndirectCache::new(&self, seed));
        self
    }

    /// Computes the irradiance at places with their normals.
    pub fn at(&self, places: &[(DVec3, DVec3)], effort: Effort, seed: u64) -> Vec<Irradiance> {
        let irradiance = |(index, &(position, normal)): (usize, &(DVec3, DVec3))| {
            let mut random = Random::new(seed ^ ((index as u64 + 1) << 20));
            let (value, error) = self.converged(position, normal, effort, &mut random);
            let edge = self.near_shadow_edge(position, normal, value);
            let inside = self.region.as_ref().is_none_or(|region| region.holds(position));
            Irradiance { position, normal, value, error, edge, inside }
        };
        places.par_iter().enumerate().map(irradiance).collect()
    }

    /// Returns the mean over batches and its standard error. A first set of batches, which is then discarded, decides
    /// how many are needed: if the same samples decided when to stop, their standard error would come out too small.
    fn converged(
        &self,
        position: DVec3,
        normal: DVec3,
        effort: Effort,
        random: &mut Random,
    ) -> (DVec3, DVec3) {
        let mut mean_and_variance = |groups: usize, count: usize| {
            let (mut sum, mut squares) = (DVec3::ZERO, DVec3::ZERO);
            for group in 0..groups {
                let batch = |_| self.batch(position, normal, effort.side, group % SETS, random);
                let value = (0..count).map(batch).sum::<DVec3>() / count as f64;
                sum += value;
                squares += value * value;
            }
            let n = groups as f64;
            let value = sum / n;
            (value, (squares / n - value * value).max(DVec3::ZERO) / (n - 1.0))
        };
        let [fewest, most] = effort.batches;
        let mut count = most;
        if fewest < most {
            let (value, variance) = mean_and_variance(fewest, 1);
            let error = effort.error * value.element_sum() / 3.0;
            let needed = fewest as f64 * variance.element_sum() / (3.0 * error * error);
            // A point without light so far may be lit by rare paths only: it gets more batches than the minimum.
            count = if error > 0.0 { (needed.ceil() as usize).clamp(fewest, most) } else { 4 * fewest };
        }
        // Batches that use the same set of the cache are not independent: they form one group.
        let groups = if self.indirect_cache.is_some() { SETS } else { count };
        let (value, variance) = mean_and_variance(groups, count.div_ceil(groups));
        (value, DVec3::from_array(variance.to_array().map(f64::sqrt)))
    }

    /// One estimate of the irradiance, by a jittered grid of first directions and another one of places on the lamps.
    fn batch(&self, position: DVec3, normal: DVec3, side: usize, set: usize, random: &mut Random) -> DVec3 {
        let origin = position + normal * self.offset;
        let mut bounced = DVec3::ZERO;
        for cell in 0..side * side {
            let mut jitter = |cell: usize| (cell as f64 + random.uniform()) / side as f64;
            let (u, v) = (jitter(cell % side), jitter(cell / side));
            let number = (cell as f64 + random.uniform()) / (side * side) as f64;
            bounced += self.light_from_bright_pieces([origin, normal], number, random);
            if let Some((direction, weight)) = self.directions.choose(origin, normal, u, v) {
                bounced += PI * weight * self.radiance(origin, direction, set, random);
            }
        }
        self.direct_light([origin, normal], side, random) + bounced / (side * side) as f64
    }

    /// The direct irradiance from lamps and lights, by a jittered grid of `side`² places on them.
    fn direct_light(&self, at: [DVec3; 2], side: usize, random: &mut Random) -> DVec3 {
        let lamps = self.lamps.choice_for(&self.scene, at[0], at[1]);
        let few = self.lights.each(&self.scene, at, random);
        let lights = if few.is_some() { None } else { Some(self.lights.choice_for(at)) };
        let mut sum = DVec3::ZERO;
        for cell in 0..side * side {
            let mut jitter = |cell: usize| (cell as f64 + random.uniform()) / side as f64;
            let place = [jitter(cell % side), jitter(cell / side)];
            sum += self.lamps.irradiance(&self.scene, at, &lamps, place, random, self.offset);
            if let Some(choice) = &lights {
                let number = (cell as f64 + random.uniform()) / (side * side) as f64;
                sum += self.lights.chosen(&self.scene, at, choice, number);
            } else if self.lights.have_size() {
                sum += self.lights.each(&self.scene, at, random).unwrap_or_default();
            }
        }
        let once = few.filter(|_| !self.lights.have_size()).unwrap_or_default();
        sum / (side * side) as f64 + once
    }

    /// The radiance that arrives from a direction, reflected or from the sky, but not emitted by the surface that is
    /// hit: direct light samples the emitters.
    fn radiance(&self, mut origin: DVec3, mut direction: DVec3, set: usize, random: &mut Random) -> DVec3 {
        let (mut sum, mut weight) = (DVec3::ZERO, DVec3::ONE);
        for bounce in 1.. {
            let Some(hit) = self.scene.closest(origin, direction) else {
                sum += weight * self.sky;
                break;
            };
            let triangle = &self.scene.triangles[hit.triangle];
            let is_front = triangle.normal.dot(direction) < 0.0;
            let (normal, reflectance) = match is_front {
                true => (triangle.normal, triangle.reflectance),
                false => (-triangle.normal, triangle.back_reflectance),
            };
            origin += direction * hit.distance;
            let (reflects, passes) = (reflectance.element_sum(), triangle.transmission.element_sum());
            if passes > 0.0 {
                let share = passes / (reflects + passes);
                if random.uniform() < share {
                    weight *= triangle.transmission / share;
                    origin -= normal * self.offset;
                    continue;
                }
                weight /= 1.0 - share;
            }
            if reflects == 0.0 {
                break;
            }
            weight *= reflectance;
            let already_sampled =
                self.bright.as_ref().is_some_and(|b| b.samples(self, hit.triangle, origin, hit.distance));
            origin += normal * self.offset;
            if !already_sampled {
                sum += weight * self.direct_light_by_one_ray([origin, normal], random) / PI;
            }
            if let Some(cache) = self.indirect_cache.as_ref().filter(|_| bounce >= LAST_BOUNCE) {
                sum += weight * cache.at(self, set, hit.triangle, origin) / PI;
                break;
            }
            sum += weight * self.light_from_bright_pieces([origin, normal], random.uniform(), random) / PI;
            if bounce > 2 {
                let survives = weight.max_element().min(0.95);
                if random.uniform() >= survives {
                    break;
                }
                weight /= survives;
            }
            let chosen = self.directions.choose(origin, normal, random.uniform(), random.uniform());
            let Some((next, share)) = chosen else { break };
            weight *= share;
            direction = next;
        }
        sum
    }

    /// The irradiance that brightly lit pieces reflect to a point, by one sample.
    fn light_from_bright_pieces(&self, at: [DVec3; 2], number: f64, random: &mut Random) -> DVec3 {
        self.bright.as_ref().map_or(DVec3::ZERO, |bright| bright.irradiance(self, at, number, random))
    }

    /// The direct irradiance, by one shadow ray to a lamp and one to a punctual light.
    fn direct_light_by_one_ray(&self, at: [DVec3; 2], random: &mut Random) -> DVec3 {
        let place = [random.uniform(), random.uniform()];
        let lamp = self.lamps.choice_near(at[0]).map_or(DVec3::ZERO, |choice| {
            self.lamps.irradiance(&self.scene, at, choice, place, random, self.offset)
        });
        lamp + self.lights.one(&self.scene, at, random)
    }
}

/// The triangles of all static objects in world space.
pub fn triangles(world: &mut World) -> Vec<Triangle> {
    let mut triangles = Vec::new();
    let lights_backs = world.get_resource::<SceneSettings>().copied().unwrap_or_default().two_sided;
    let mut meshes = world.query_filtered::<(&Mesh, &Material, Option<&MaterialTextures>, &GlobalTransform), bevy_ecs::prelude::With<StaticObject>>();
    for (object, (mesh, material, textures, transform)) in meshes.iter(world).enumerate() {
        let mirrored = transform.0.matrix3.determinant() < 0.0;
        let emissive = textures.and_then(|textures| textures.emissive.as_ref());
        let covers = material.alpha_mode == AlphaMode::Blend;
        let opacity = if covers { f64::from(material.alpha) } else { 1.0 };
        let reflectance = material.front.diffuse.as_dvec3() * opacity;
        let transmission = material.transmission.as_dvec3() + DVec3::splat(1.0 - opacity);
        let back_reflectance = if lights_backs && material.double_sided { reflectance } else { DVec3::ZERO };
        for (index, corners) in mesh.0.triangles().enumerate() {
            let [a, mut b, mut c] =
                corners.map(|v| transform.0.transform_point3(mesh.0.positions[v as usize].as_dvec3()));
            if mirrored {
                (b, c) = (c, b);
            }
            let cross = (b - a).cross(c - a);
            let Some(normal) = cross.try_normalize() else { continue };
            let picture = emissive.map(|texture| {
                let mut at =
                    corners.map(|v| mesh.0.uv0.get(v as usize).map_or(DVec2::ZERO, |uv| uv.as_dvec2()));
                if mirrored {
                    at.swap(1, 2);
                }
                (texture.image.clone(), at)
            });
            triangles.push(Triangle {
                a,
                ab: b - a,
                ac: c - a,
                normal,
                area: cross.length() / 2.0,
                reflectance,
                back_reflectance,
                transmission,
                emission: material.front.emission.as_dvec3(),
                picture,
                source: [object, index],
            });
        }
    }
    triangles
}
