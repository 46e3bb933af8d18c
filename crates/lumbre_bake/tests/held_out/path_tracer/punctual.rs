//! Point lights and suns, of which many are chosen from as lamps are. Not emissive triangles.

use std::f64::consts::{PI, TAU};

use bevy_ecs::world::World;
use glam::DVec3;
use lumbre_optics::{BakeMode, Light, LightKind};
use lumbre_scene::GlobalTransform;

use super::super::random::Random;
use super::choice::{Choice, ChoiceGrid};
use super::hierarchy::Hierarchy;

enum Place {
    /// And the distance where its light has faded to nothing, m.
    At(DVec3, f64),
    /// To the light, and half the angle that it has.
    Towards(DVec3, f64),
}

struct Punctual {
    place: Place,
    /// W/sr of a point, W/m² of a sun.
    strength: DVec3,
}

pub struct PunctualLights {
    lights: Vec<Punctual>,
    /// Of many points; suns are then chosen one by one.
    near: Option<ChoiceGrid>,
}

/// Up to so many are looked at one by one.
const FEW: usize = 64;
const CANDIDATES: usize = 8;

impl PunctualLights {
    /// Those that are baked whole. Lights with a cone, a radius or another law of distance are not known here.
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
        let near = (lights.len() > FEW).then(|| {
            let things = lights.iter().map(|light| match light.place {
                Place::At(place, _) => (place, 0.0, light.strength.element_sum()),
                Place::Towards(..) => panic!("a sun among many lights is not known to the path tracer"),
            });
            ChoiceGrid::new(scene.bounds(), &things.collect::<Vec<_>>())
        });
        Self { lights, near }
    }

    /// All of them, by one shadow ray each, if they are few.
    pub fn each(&self, scene: &Hierarchy, at: [DVec3; 2], random: &mut Random) -> Option<DVec3> {
        let few = self.near.is_none();
        few.then(|| self.lights.iter().map(|light| light.irradiance(scene, at, random)).sum())
    }

    /// Whether a second shadow ray of the same place may see something else.
    pub fn are_sized(&self) -> bool {
        self.lights.iter().any(|light| matches!(light.place, Place::Towards(_, angle) if angle > 0.0))
    }

    /// By what each gives at a place where nothing stands in the way.
    pub fn choice_for(&self, at: [DVec3; 2]) -> Choice {
        Choice::new(self.lights.iter().map(|light| light.unshadowed(at).element_sum()))
    }

    /// One of a choice.
    pub fn chosen(&self, scene: &Hierarchy, at: [DVec3; 2], choice: &Choice, number: f64) -> DVec3 {
        let Some((index, probability, _)) = choice.pick(number) else { return DVec3::ZERO };
        self.lights[index].irradiance(scene, at, &mut Random::new(index as u64)) / probability
    }

    /// One of them: of few by what each gives unhidden, of many by what a few candidates give.
    pub fn one(&self, scene: &Hierarchy, at: [DVec3; 2], random: &mut Random) -> DVec3 {
        let number = random.uniform();
        let Some(choice) = self.near.as_ref().and_then(|near| near.at(at[0])) else {
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
        let mut left = random.uniform() * sum;
        for (light, weight) in candidates {
            left -= weight;
            if left < 0.0 {
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
                // The window of KHR_lights_punctual.
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
