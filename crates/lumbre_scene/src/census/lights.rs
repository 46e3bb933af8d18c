//! Which lights of a World shine, and how many there are of each kind. Not which of them reach what.

use bevy_ecs::prelude::*;
use glam::Vec3;
use lumbre_optics::{BakeMode, Light, LightKind};
use serde::Serialize;

use crate::GlobalTransform;

/// Counts of lights that shine: those that are on, not black, and hold numbers that a file may have.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct LightCensus {
    /// All that follow but `lights_off` are among them.
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
    /// Baked whole.
    pub static_lights: usize,
    /// Baked but for their direct light.
    pub mixed_lights: usize,
    /// Not baked.
    pub dynamic_lights: usize,
    /// Lights that ask for a shadow.
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

    /// Counts one more light that shines.
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

/// Where a light stands; an ambient one needs no place.
pub fn light_place(light: &Light, transform: Option<&GlobalTransform>) -> Option<GlobalTransform> {
    transform.copied().or_else(|| (light.kind == LightKind::Ambient).then(GlobalTransform::default))
}

/// Whether a light adds anything to a frame: it is on, not black, stands somewhere, and holds numbers that a file may have.
pub fn shines(light: &Light, transform: Option<&GlobalTransform>) -> bool {
    let colors = [light.ambient, light.diffuse, light.specular];
    light.enabled
        && light_place(light, transform).is_some_and(|place| place.0.is_finite())
        && colors.iter().any(|color| *color != Vec3::ZERO)
        && light.validate("light").is_ok()
}
