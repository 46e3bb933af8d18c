//! Direct light from point lights and suns. If there are many, they are sampled like lamps. Emissive triangles are in
//! `lamps`.

use std::f64::consts::{PI, TAU};

use bevy_ecs::world::World;
use glam::DVec3;
use lumbre_optics::{BakeMode, Light, LightKind};
use lumbre_scene::GlobalTransform;

use super::super::random::Random;
use super::choice::{Choice, ChoiceGrid};
use super::hierarchy::Hierarchy;

enum Place {
    /// The position of a point light, and the distance in metres at which its light has faded to nothing.
    At(DVec3, f64),
    /// The direction to a sun, and half of its angular diameter.
    Towards(DVec3, f64),
}

struct Punctual {
    place: Place,
    /// W/sr for a point light, W/m² for a sun.
    strength: DVec3,
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
    /// Collects the lights that are baked entirely. Lights with a cone, a radius or another law of attenuation are not
    /// supported.
    pub fn new(world: &mut World, scene: &Hierarchy) -> Self {
        let baked = |light: &Light| light.enabled && light.bake == BakeMode::Static;
        let lights: Vec<_> = world
            .query::<(&Light, &GlobalTransform)>()
            .iter(world)
            .filter(|(light, _)| baked(light) && light.kind != LightKind::Ambient)
            .map(|(light, place)| {
                assert!(
                    light.spot.is_none() && light.radius == 0.0,
                    "a light that the path tracer does not know"
                );
                let place = match light.kind {
                    LightKind::Directional => Place::Towards(-place.forward(), 0.5 * f64::from(light.angle)),
                    _ => Place::At(place.translation(), f64::from(light.attenuation.range)),
                };
                Punctual { place, strength: light.diffuse.as_dvec3() * PI }
            })
            .collect();
        let grid = (lights.len() > FEW).then(|| {
            let sources = lights.iter().map(|light| match light.place {
                Place::At(place, _) => (place, 0.0, light.strength.element_sum()),
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
        self.lights.iter().any(|light| matches!(light.place, Place::Towards(_, angle) if angle > 0.0))
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
    fn unshadowed(&self, [origin, normal]: [DVec3; 2]) -> DVec3 {
        match self.place {
            Place::At(place, range) => {
                let towards = place - origin;
                let squared = towards.length_squared();
                // The range attenuation recommended by KHR_lights_punctual.
                let window = (1.0 - (squared / (range * range)).powi(2)).clamp(0.0, 1.0);
                self.strength * (window * normal.dot(towards).max(0.0) / (squared * squared.sqrt()))
            }
            Place::Towards(direction, _) => self.strength * normal.dot(direction).max(0.0),
        }
    }

    fn irradiance(&self, scene: &Hierarchy, at: [DVec3; 2], random: &mut Random) -> DVec3 {
        let light = self.unshadowed(at);
        if light == DVec3::ZERO {
            return light;
        }
        let hidden = match self.place {
            Place::At(place, _) => scene.hidden(at[0], place),
            Place::Towards(mut direction, angle) => {
                if angle > 0.0 {
                    let (right, up) = direction.any_orthonormal_pair();
                    let (radius, turn) = (angle.tan() * random.uniform().sqrt(), TAU * random.uniform());
                    direction += (right * turn.cos() + up * turn.sin()) * radius;
                }
                scene.hidden_along(at[0], direction)
            }
        };
        if hidden { DVec3::ZERO } else { light }
    }
}
