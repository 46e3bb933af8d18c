//! Whether a World has light that a bake takes. Not the baking.

use bevy_ecs::prelude::*;
use glam::Vec3;
use lumbre_optics::{Light, Material};
use lumbre_scene::SceneSettings;

use crate::{PlacedLight, baked_meshes};

/// Whether anything gives light that a bake takes: lamps, emission, a sky.
pub fn has_light_to_bake(world: &mut World) -> bool {
    let bright = |color: Vec3| color.max_element() > 0.0;
    let emits = |material: &Material| {
        let back = material.back.as_ref().filter(|_| material.double_sided);
        bright(material.front.emission) || back.is_some_and(|back| bright(back.emission))
    };
    let baked = baked_meshes(world);
    world.get_resource::<SceneSettings>().is_some_and(|settings| bright(settings.sky))
        || world.query::<&Light>().iter(world).any(PlacedLight::is_baked)
        || world
            .query::<(Entity, &Material)>()
            .iter(world)
            .any(|(entity, material)| emits(material) && baked.contains(&entity))
}
