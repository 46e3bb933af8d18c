//! Converged irradiance at points of a world's surfaces: f64, next-event estimation, Russian roulette, a bounding volume
//! hierarchy of its own. Front sides are diffuse, emitters one-sided, back sides black; the sky is one colour. Shares no code with the baker.

mod bounced;
mod bright;
mod choice;
mod directions;
pub mod hierarchy;
mod lamps;
mod pieces;
mod points;
mod punctual;
mod spherical_triangle;

use std::f64::consts::PI;

use bevy_ecs::world::World;
use glam::{DVec2, DVec3};
use lumbre_optics::Material;
use lumbre_scene::{GlobalTransform, MaterialTextures, Mesh, SceneSettings, StaticObject};
use rayon::prelude::*;

use super::random::Random;
use super::scenes::region::Region;
use bounced::{Bounced, SETS};
use bright::Bright;
use directions::Directions;
use hierarchy::{Hierarchy, Triangle};
use lamps::Lamps;
use punctual::PunctualLights;

pub struct PathTracer {
    pub scene: Hierarchy,
    lamps: Lamps,
    lights: PunctualLights,
    /// Radiance of what leaves the scene.
    sky: DVec3,
    directions: Directions,
    region: Option<Region>,
    bright: Option<Bright>,
    /// Where paths end at their first bounce.
    bounced: Option<Bounced>,
    pub offset: f64,
}

/// A point and its irradiance with standard errors, W/m².
#[derive(Clone, Copy, Debug)]
pub struct Irradiance {
    pub position: DVec3,
    pub normal: DVec3,
    pub value: DVec3,
    pub error: DVec3,
    /// Direct light changes much within a texel.
    pub edge: bool,
    /// In the level's region; everywhere in a scene that has none.
    pub inside: bool,
}

/// What is spent on a point: batches of `side`² paths until the standard error is that share of the irradiance.
#[derive(Clone, Copy, Debug)]
pub struct Effort {
    pub side: usize,
    pub error: f64,
    /// Fewest and most.
    pub batches: [usize; 2],
}

impl Effort {
    /// So many batches for every point.
    pub fn fixed(batches: usize, side: usize) -> Self {
        Self { side, error: 0.0, batches: [batches; 2] }
    }

    /// 0.4 %, unless 58,000 paths leave more.
    pub fn reference() -> Self {
        Self { side: 24, error: 0.004, batches: [8, 100] }
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
            bounced: None,
        };
        tracer.bright = tracer.region.is_some().then(|| Bright::new(&tracer));
        tracer
    }

    /// Ends paths at their first bounce by light that was gathered there before: far less noise in dark places, and light by two and more bounces
    /// that is even over a quarter of a metre.
    #[must_use]
    pub fn with_bounced(mut self, seed: u64) -> Self {
        self.bounced = Some(Bounced::new(&self, seed));
        self
    }

    /// Irradiance at places with their normals.
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

    /// The mean of batches and its standard error. Their number is decided by others, which do not count: an error that also decided when to
    /// end would be too small.
    fn converged(
        &self,
        position: DVec3,
        normal: DVec3,
        effort: Effort,
        random: &mut Random,
    ) -> (DVec3, DVec3) {
        let mut spread = |groups: usize, count: usize| {
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
            let (value, variance) = spread(fewest, 1);
            let error = effort.error * value.element_sum() / 3.0;
            let wanted = fewest as f64 * variance.element_sum() / (3.0 * error * error);
            // What is lit by rare paths may have met none yet: more of them then.
            count = if error > 0.0 { (wanted.ceil() as usize).clamp(fewest, most) } else { 4 * fewest };
        }
        // Batches of one set of bounced light are not independent: they make one group.
        let groups = if self.bounced.is_some() { SETS } else { count };
        let (value, variance) = spread(groups, count.div_ceil(groups));
        (value, DVec3::from_array(variance.to_array().map(f64::sqrt)))
    }

    /// An unbiased estimate by a jittered grid of first directions, and one of places on the lamps.
    fn batch(&self, position: DVec3, normal: DVec3, side: usize, set: usize, random: &mut Random) -> DVec3 {
        let origin = position + normal * self.offset;
        let mut bounced = DVec3::ZERO;
        for cell in 0..side * side {
            let mut jitter = |cell: usize| (cell as f64 + random.uniform()) / side as f64;
            let (u, v) = (jitter(cell % side), jitter(cell / side));
            let number = (cell as f64 + random.uniform()) / (side * side) as f64;
            bounced += self.reflected([origin, normal], number, random);
            if let Some((direction, weight)) = self.directions.choose(origin, normal, u, v) {
                bounced += PI * weight * self.radiance(origin, direction, set, random);
            }
        }
        self.direct_light([origin, normal], side, random) + bounced / (side * side) as f64
    }

    /// Irradiance straight from lamps and lights, by a jittered grid of `side`² places on them.
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
            } else if self.lights.are_sized() {
                sum += self.lights.each(&self.scene, at, random).unwrap_or_default();
            }
        }
        let once = few.filter(|_| !self.lights.are_sized()).unwrap_or_default();
        sum / (side * side) as f64 + once
    }

    /// Reflected (not emitted) radiance and that of the sky that comes from a direction.
    fn radiance(&self, mut origin: DVec3, mut direction: DVec3, set: usize, random: &mut Random) -> DVec3 {
        let (mut sum, mut weight) = (DVec3::ZERO, DVec3::ONE);
        for bounce in 1.. {
            let Some(hit) = self.scene.closest(origin, direction) else {
                sum += weight * self.sky;
                break;
            };
            let triangle = &self.scene.triangles[hit.triangle];
            let normal = triangle.normal;
            if normal.dot(direction) >= 0.0 {
                break;
            }
            weight *= triangle.reflectance;
            origin += direction * hit.distance;
            let sought =
                self.bright.as_ref().is_some_and(|b| b.seeks(self, hit.triangle, origin, hit.distance));
            origin += normal * self.offset;
            if !sought {
                sum += weight * self.one_direct([origin, normal], random) / PI;
            }
            if let Some(bounced) = &self.bounced {
                sum += weight * bounced.at(self, set, hit.triangle, origin) / PI;
                break;
            }
            sum += weight * self.reflected([origin, normal], random.uniform(), random) / PI;
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

    /// Light that comes by one bounce from what is brightly lit.
    fn reflected(&self, at: [DVec3; 2], number: f64, random: &mut Random) -> DVec3 {
        self.bright.as_ref().map_or(DVec3::ZERO, |bright| bright.irradiance(self, at, number, random))
    }

    /// Direct light by one shadow ray each to a lamp and a light.
    fn one_direct(&self, at: [DVec3; 2], random: &mut Random) -> DVec3 {
        let place = [random.uniform(), random.uniform()];
        let lamp = self.lamps.choice_near(at[0]).map_or(DVec3::ZERO, |choice| {
            self.lamps.irradiance(&self.scene, at, choice, place, random, self.offset)
        });
        lamp + self.lights.one(&self.scene, at, random)
    }
}

/// All that lights or hides, where it is in the world.
pub fn triangles(world: &mut World) -> Vec<Triangle> {
    let mut triangles = Vec::new();
    let mut meshes = world.query_filtered::<(&Mesh, &Material, Option<&MaterialTextures>, &GlobalTransform), bevy_ecs::prelude::With<StaticObject>>();
    for (object, (mesh, material, textures, transform)) in meshes.iter(world).enumerate() {
        let mirrored = transform.0.matrix3.determinant() < 0.0;
        let emissive = textures.and_then(|textures| textures.emissive.as_ref());
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
                reflectance: material.front.diffuse.as_dvec3(),
                emission: material.front.emission.as_dvec3(),
                picture,
                source: [object, index],
            });
        }
    }
    triangles
}
