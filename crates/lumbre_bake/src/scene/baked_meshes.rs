//! Which meshes of a World a bake includes. Not how they are read: that is `from_world`.

use std::collections::HashSet;

use bevy_ecs::prelude::*;
use lumbre_optics::Material;
use lumbre_scene::{ChildOf, DynamicObject, Mesh, StaticObject, hidden_entities};

/// The entities of the meshes that a bake includes: those with a `StaticObject` that are neither hidden nor unlit nor part
/// of a `DynamicObject`. An unlit surface, such as a sky dome, neither takes light nor blocks it, as in a frame.
pub fn baked_meshes(world: &mut World) -> HashSet<Entity> {
    let hidden = hidden_entities(world);
    let mut meshes = world.query_filtered::<(Entity, &Material, Option<&ChildOf>), (With<Mesh>, With<StaticObject>, Without<DynamicObject>)>();
    let is_baked = |(entity, material, parent): (Entity, &Material, Option<&ChildOf>)| {
        let is_left_out = material.unlit || hidden.contains(&entity) || has_dynamic_ancestor(world, parent);
        (!is_left_out).then_some(entity)
    };
    meshes.iter(world).filter_map(is_baked).collect()
}

/// Whether `parent` or one of its ancestors is a dynamic object, so that its descendants move with it.
pub(super) fn has_dynamic_ancestor(world: &World, parent: Option<&ChildOf>) -> bool {
    let mut ancestor = parent.map(ChildOf::parent);
    while let Some(entity) = ancestor {
        if world.get::<DynamicObject>(entity).is_some() {
            return true;
        }
        ancestor = world.get::<ChildOf>(entity).map(ChildOf::parent);
    }
    false
}
