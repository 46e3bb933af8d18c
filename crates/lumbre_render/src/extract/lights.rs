//! Lights of a frame: those that are on, dynamic ones first. Which of them reach what is not decided here.

use bevy_ecs::prelude::*;
use glam::{DVec3, Vec3};
use lumbre_optics::{BakeMode, Light, LightKind};
use lumbre_scene::GlobalTransform;

use crate::growable_buffer::GrowableBuffer;
use crate::layout::LightData;

/// What the shaders need to know of a frame's lights.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct LightSet {
    /// Lights [0, dynamic) are shaded in full.
    pub dynamic: u32,
    /// Lights [dynamic, all) are baked into the lightmaps.
    pub all: u32,
    /// Sum of the ambient lights.
    pub ambient: Vec3,
    pub directional: bool,
    pub point: bool,
    pub spot: bool,
}

impl LightSet {
    /// The lights of a World, counted.
    pub fn of(world: &mut World) -> Self {
        let mut set = Self::default();
        let mut query = world.query::<&Light>();
        query.iter(world).filter(|light| shines(light)).for_each(|light| set.add(light));
        set
    }

    fn add(&mut self, light: &Light) {
        if light.kind == LightKind::Ambient {
            self.ambient += light.ambient;
            return;
        }
        self.dynamic += u32::from(light.bake != BakeMode::Static);
        self.all += 1;
        self.directional |= light.kind == LightKind::Directional;
        self.point |= light.kind == LightKind::Point;
        self.spot |= light.spot.is_some_and(|cone| !cone.is_everywhere());
    }
}

/// Writes the lights that are on and not black; entities in order, so that sums are the same every time.
pub(crate) fn extract_lights(
    world: &mut World,
    buffer: &mut GrowableBuffer<LightData>,
    origin: DVec3,
) -> LightSet {
    let mut set = LightSet::default();
    let mut query = world.query::<(Entity, &Light, &GlobalTransform)>();
    let mut found: Vec<_> = query.iter(world).filter(|(_, light, _)| shines(light)).collect();
    found.sort_by_key(|(entity, light, _)| (light.bake == BakeMode::Static, *entity));
    found.iter().for_each(|(_, light, _)| set.add(light));
    let positional = found.iter().filter(|(_, light, _)| light.kind != LightKind::Ambient);
    buffer.replace(positional.map(|(_, light, transform)| LightData::new(light, transform, origin)));
    set
}

/// Whether a light adds anything; one whose numbers are out of range is left out rather than let into a frame.
fn shines(light: &Light) -> bool {
    let colors = [light.ambient, light.diffuse, light.specular];
    light.enabled && colors.iter().any(|color| *color != Vec3::ZERO) && light.validate("light").is_ok()
}
