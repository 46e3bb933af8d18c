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
    /// Lights that are shaded in full.
    pub dynamic: u32,
    /// These and the lights that are baked into the lightmaps.
    pub all: u32,
    /// Sum of the ambient lights.
    pub ambient: Vec3,
    /// Whether a baked light has an ambient colour.
    pub static_ambient: bool,
    pub directional: bool,
    pub point: bool,
    pub spot: bool,
}

impl LightSet {
    /// The lights of a World, counted.
    pub fn of(world: &mut World) -> Self {
        let mut set = Self::default();
        let mut query = world.query::<(&Light, &GlobalTransform)>();
        query
            .iter(world)
            .filter(|(light, transform)| shines(light, transform))
            .for_each(|(light, _)| set.add(light));
        set
    }

    fn add(&mut self, light: &Light) {
        if light.kind == LightKind::Ambient {
            self.ambient += light.ambient;
            return;
        }
        self.dynamic += u32::from(light.bake != BakeMode::Static);
        self.all += 1;
        self.static_ambient |= light.bake == BakeMode::Static && light.ambient != Vec3::ZERO;
        self.directional |= light.kind == LightKind::Directional;
        self.point |= light.kind == LightKind::Point;
        self.spot |= light.spot.is_some_and(|cone| !cone.is_everywhere());
    }
}

/// How far a light of the buffer goes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct LightReach {
    /// In the world.
    pub center: DVec3,
    /// Metres; infinite for a light without a range.
    pub radius: f64,
    /// Baked into the lightmaps in use.
    pub baked: bool,
}

impl LightReach {
    fn new(light: &Light, transform: &GlobalTransform) -> Self {
        let radius = match light.kind {
            LightKind::Point => f64::from(light.attenuation.range),
            LightKind::Ambient | LightKind::Directional => f64::INFINITY,
        };
        Self { center: transform.translation(), radius, baked: light.bake == BakeMode::Static }
    }
}

/// Writes the lights that are on and not black; entities in order, so that sums are the same every time.
pub(crate) fn extract_lights(
    world: &mut World,
    buffer: &mut GrowableBuffer<LightData>,
    origin: DVec3,
) -> (LightSet, Vec<LightReach>) {
    let mut set = LightSet::default();
    let mut query = world.query::<(Entity, &Light, &GlobalTransform)>();
    let mut found: Vec<_> =
        query.iter(world).filter(|(_, light, transform)| shines(light, transform)).collect();
    found.sort_by_key(|(entity, light, _)| (light.bake == BakeMode::Static, entity.index_u32()));
    found.iter().for_each(|(_, light, _)| set.add(light));
    found.retain(|(_, light, _)| light.kind != LightKind::Ambient);
    buffer.replace(found.iter().map(|(_, light, transform)| LightData::new(light, transform, origin)));
    let reaches = found.iter().map(|(_, light, transform)| LightReach::new(light, transform)).collect();
    (set, reaches)
}

/// Whether a light adds anything; one whose numbers are out of range is left out rather than let into a frame.
fn shines(light: &Light, transform: &GlobalTransform) -> bool {
    let colors = [light.ambient, light.diffuse, light.specular];
    let placed = transform.0.is_finite();
    placed
        && light.enabled
        && colors.iter().any(|color| *color != Vec3::ZERO)
        && light.validate("light").is_ok()
}
