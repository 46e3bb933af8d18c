//! Direct light from point lights, spotlights and suns, with and without a size. If there are many, they are sampled
//! like lamps. Emissive triangles are in `lamps`.

use std::f64::consts::{PI, TAU};

use bevy_ecs::world::World;
use glam::DVec3;
use lumbre_optics::{BakeMode, Light, LightKind, SpotCone};
use lumbre_scene::GlobalTransform;

use super::super::random::Random;
use super::choice::{Choice, ChoiceGrid};
use super::hierarchy::Hierarchy;

enum Place {
    /// A sphere around a position, or a point if its radius is 0. Its light has faded to nothing at a distance of
    /// `range` metres.
    At { position: DVec3, radius: f64, range: f64 },
    /// The direction to a sun, and half of its angular diameter.
    Towards(DVec3, f64),
}

struct Punctual {
    place: Place,
    /// W/sr for a point light, W/m² for a sun.
    strength: DVec3,
    /// The axis and the cone of a spotlight.
    cone: Option<(DVec3, SpotCone)>,
}

pub struct PunctualLights {
    lights: Vec<Punctual>,
    /// Used if there are many point lights.
    grid: Option<ChoiceGrid>,
}

/// Up to this number of lights, each is evaluated.
const FEW: usize = 64;
/// The number of candidates for a shadow ray if there are many lights.
const CANDIDATES: usize = 8;

impl PunctualLights {
    /// Collects the lights that are baked entirely. Other laws of attenuation than the inverse square are not supported.
    pub fn new(world: &mut World, scene: &Hierarchy) -> Self {
        let baked = |light: &Light| light.enabled && light.bake == BakeMode::Static;
        let lights: Vec<_> = world
            .query::<(&Light, &GlobalTransform)>()
            .iter(world)
            .filter(|(light, _)| baked(light) && light.kind != LightKind::Ambient)
            .map(|(light, place)| {
                let range = f64::from(light.attenuation.range);
                let cone = light.spot.map(|cone| (place.forward(), cone));
                let place = match light.kind {
                    LightKind::Directional => Place::Towards(-place.forward(), 0.5 * f64::from(light.angle)),
                    _ => Place::At { position: place.translation(), radius: f64::from(light.radius), range },
                };
                Punctual { place, strength: light.diffuse.as_dvec3() * PI, cone }
            })
            .collect();
        let grid = (lights.len() > FEW).then(|| {
            let sources = lights.iter().map(|light| match light.place {
                Place::At { position, .. } => (position, 0.0, light.strength.element_sum()),
                Place::Towards(..) => panic!("a sun among many lights is not known to the path tracer"),
            });
            ChoiceGrid::new(scene.bounds(), &sources.collect::<Vec<_>>())
        });
        Self { lights, grid }
    }

    /// The irradiance of all lights, by one shadow ray each; `None` if they are many.
    pub fn each(&self, scene: &Hierarchy, at: [DVec3; 2], random: &mut Random) -> Option<DVec3> {
        let few = self.grid.is_none();
        few.then(|| self.lights.iter().map(|light| light.irradiance(scene, at, random)).sum())
    }

    /// Whether any light has a size, so that shadow rays from the same point to it may differ.
    pub fn have_size(&self) -> bool {
        self.lights.iter().any(Punctual::has_size)
    }

    /// A distribution over the lights by their unshadowed irradiance at a point.
    pub fn choice_for(&self, at: [DVec3; 2]) -> Choice {
        Choice::new(self.lights.iter().map(|light| light.unshadowed(at).element_sum()))
    }

    /// Estimates the irradiance by one light, chosen from the distribution.
    pub fn chosen(&self, scene: &Hierarchy, at: [DVec3; 2], choice: &Choice, number: f64) -> DVec3 {
        let Some((index, probability, _)) = choice.pick(number) else { return DVec3::ZERO };
        self.lights[index].irradiance(scene, at, &mut Random::new(index as u64)) / probability
    }

    /// Estimates the irradiance by one shadow ray. The light is chosen by its unshadowed irradiance: among all lights
    /// if they are few, otherwise among a few candidates.
    pub fn one(&self, scene: &Hierarchy, at: [DVec3; 2], random: &mut Random) -> DVec3 {
        let number = random.uniform();
        let Some(choice) = self.grid.as_ref().and_then(|grid| grid.at(at[0])) else {
            if self.lights.is_empty() {
                return DVec3::ZERO;
            }
            let Some((index, probability, _)) = self.choice_for(at).pick(number) else { return DVec3::ZERO };
            return self.lights[index].irradiance(scene, at, random) / probability;
        };
        let mut candidates = [(0, 0.0); CANDIDATES];
        for (index, candidate) in candidates.iter_mut().enumerate() {
            let Some((light, probability, _)) = choice.pick((index as f64 + number) / CANDIDATES as f64)
            else {
                continue;
            };
            *candidate = (light, self.lights[light].unshadowed(at).element_sum() / probability);
        }
        let sum: f64 = candidates.iter().map(|(_, weight)| weight).sum();
        let mut remaining = random.uniform() * sum;
        for (light, weight) in candidates {
            remaining -= weight;
            if remaining < 0.0 {
                let light = &self.lights[light];
                let share = sum / (light.unshadowed(at).element_sum() * CANDIDATES as f64);
                return light.irradiance(scene, at, random) * share;
            }
        }
        DVec3::ZERO
    }
}

impl Punctual {
    fn has_size(&self) -> bool {
        match self.place {
            Place::At { radius, .. } => radius > 0.0,
            Place::Towards(_, angle) => angle > 0.0,
        }
    }

    /// The irradiance of a surface that faces the light's middle, and the direction to that.
    fn facing(&self, origin: DVec3) -> (DVec3, DVec3) {
        let (direction, strength) = match self.place {
            Place::At { position, range, .. } => {
                let towards = position - origin;
                let squared = towards.length_squared();
                // The range attenuation recommended by KHR_lights_punctual.
                let window = (1.0 - (squared / (range * range)).powi(2)).clamp(0.0, 1.0);
                (towards / squared.sqrt(), self.strength * (window / squared))
            }
            Place::Towards(direction, _) => (direction, self.strength),
        };
        (
            strength * self.cone.map_or(1.0, |(axis, cone)| share_of_cone(cone, -direction.dot(axis))),
            direction,
        )
    }

    /// The irradiance without shadows, roughly for a light with a size, of which a part may be above the horizon while
    /// its middle is not.
    fn unshadowed(&self, [origin, normal]: [DVec3; 2]) -> DVec3 {
        let (light, direction) = self.facing(origin);
        light * normal.dot(direction).max(if self.has_size() { 0.2 } else { 0.0 })
    }

    /// Estimates the irradiance by one shadow ray. A light with a size has the same radiance everywhere, with which it
    /// brings as much light as its middle would.
    fn irradiance(&self, scene: &Hierarchy, at: [DVec3; 2], random: &mut Random) -> DVec3 {
        let [origin, normal] = at;
        let (light, middle) = self.facing(origin);
        if light == DVec3::ZERO {
            return light;
        }
        match self.place {
            Place::At { position, radius, .. } if radius > 0.0 => {
                // A point anywhere on the sphere, of which the half that faces away brings nothing.
                let outwards = on_sphere(-1.0 + 2.0 * random.uniform(), random.uniform());
                let target = position + outwards * radius;
                let (towards, to_middle) = (target - origin, position - origin);
                let direction = towards.normalize();
                let cosines = normal.dot(direction).max(0.0) * (-outwards.dot(direction)).max(0.0);
                // The radiance is the light of the middle over π r²/d²; the density of points is 1/(4 π r²).
                let share = 4.0 * cosines * to_middle.length_squared() / towards.length_squared();
                if share > 0.0 { light * share * scene.transmission(origin, target) } else { DVec3::ZERO }
            }
            Place::At { position, .. } => {
                light * normal.dot(middle).max(0.0) * scene.transmission(origin, position)
            }
            Place::Towards(_, angle) => {
                // Uniform over the solid angle of the disc, in which the mean of the cosine to its middle is
                // (1 + cos)/2.
                let height = 1.0 - random.uniform() * (1.0 - angle.cos());
                let aside = on_sphere(height, random.uniform());
                let (right, up) = middle.any_orthonormal_pair();
                let direction = (right * aside.x + up * aside.y + middle * aside.z).normalize();
                let cosine = normal.dot(direction).max(0.0) * 2.0 / (1.0 + angle.cos());
                light * cosine * scene.transmission_along(origin, direction)
            }
        }
    }
}

/// The point of the unit sphere at a height along z and a share of a turn about it.
fn on_sphere(height: f64, turn: f64) -> DVec3 {
    let radius = (1.0 - height * height).max(0.0).sqrt();
    DVec3::new(radius * (TAU * turn).cos(), radius * (TAU * turn).sin(), height)
}

/// The share of a spotlight's light at an angle of this cosine to its axis: OpenGL's cone and that of
/// KHR_lights_punctual.
fn share_of_cone(cone: SpotCone, cosine: f64) -> f64 {
    match cone {
        SpotCone::Exponent { cutoff, exponent } => {
            let inside = cosine >= f64::from(cutoff).cos();
            if inside { cosine.max(0.0).powf(f64::from(exponent)) } else { 0.0 }
        }
        SpotCone::Smooth { inner, outer } => {
            let [inner, outer] = [inner, outer].map(|angle| f64::from(angle).cos());
            ((cosine - outer) / (inner - outer).max(1e-3)).clamp(0.0, 1.0).powi(2)
        }
    }
}
