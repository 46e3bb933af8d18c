//! Which lights of a World shine, and how many there are of each kind. It does not determine what they reach.

use bevy_ecs::prelude::*;
use glam::Vec3;
use lumbre_optics::{BakeMode, Light, LightKind};
use serde::Serialize;

use crate::GlobalTransform;

/// Counts of the lights that shine: enabled, not black, and with valid parameters.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct LightCensus {
    /// All lights that shine; the other counts except `lights_off` are subsets of them.
    pub lights: usize,
    /// Lights that do not shine.
    pub lights_off: usize,
    /// Ambient lights.
    pub ambient_lights: usize,
    /// Directional lights.
    pub directional_lights: usize,
    /// Point lights without a cone.
    pub point_lights: usize,
    /// Point and directional lights with a cone.
    pub spot_lights: usize,
    /// Lights whose direct and indirect light is baked.
    pub static_lights: usize,
    /// Lights of which only the indirect light is baked.
    pub mixed_lights: usize,
    /// Lights that are not baked.
    pub dynamic_lights: usize,
    /// Lights that cast shadows.
    pub shadow_lights: usize,
}

impl LightCensus {
    /// Counts the lights of a World.
    pub fn of(world: &mut World) -> Self {
        let mut census = Self::default();
        let mut query = world.query::<(&Light, Option<&GlobalTransform>)>();
        for (light, place) in query.iter(world) {
            match shines(light, place) {
                true => census.add(light),
                false => census.lights_off += 1,
            }
        }
        census
    }

    /// Counts one more light, which must shine.
    pub fn add(&mut self, light: &Light) {
        self.lights += 1;
        *match (light.kind, light.spot) {
            (LightKind::Ambient, _) => &mut self.ambient_lights,
            (_, Some(cone)) if !cone.is_everywhere() => &mut self.spot_lights,
            (LightKind::Directional, _) => &mut self.directional_lights,
            (LightKind::Point, _) => &mut self.point_lights,
        } += 1;
        *match light.bake {
            BakeMode::Static => &mut self.static_lights,
            BakeMode::Mixed => &mut self.mixed_lights,
            BakeMode::Dynamic => &mut self.dynamic_lights,
        } += 1;
        self.shadow_lights += usize::from(light.shadow && light.kind != LightKind::Ambient);
    }
}

/// The transform of a light. An ambient light without one gets the identity, as it needs no position.
pub fn light_place(light: &Light, transform: Option<&GlobalTransform>) -> Option<GlobalTransform> {
    transform.copied().or_else(|| (light.kind == LightKind::Ambient).then(GlobalTransform::default))
}

/// Returns true if a light can contribute to a frame: it is enabled, not black, has a finite transform
/// (unless it is ambient) and valid parameters.
pub fn shines(light: &Light, transform: Option<&GlobalTransform>) -> bool {
    let colors = [light.ambient, light.diffuse, light.specular];
    light.enabled
        && light_place(light, transform).is_some_and(|place| place.0.is_finite())
        && colors.iter().any(|color| *color != Vec3::ZERO)
        && light.validate("light").is_ok()
}
