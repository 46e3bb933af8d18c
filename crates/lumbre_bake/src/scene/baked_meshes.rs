//! Which meshes of a World a bake includes. Not how they are read: that is `from_world`.

use std::collections::HashSet;

use bevy_ecs::prelude::*;
use lumbre_optics::Material;
use lumbre_scene::{ChildOf, DynamicObject, GlobalTransform, Mesh, StaticObject, hidden_entities};

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

/// The area of all meshes that a bake includes, in square metres. Global transforms must be up to date.
pub fn baked_area(world: &mut World) -> f64 {
    let baked = baked_meshes(world);
    let mut meshes = world.query::<(Entity, &Mesh, &GlobalTransform)>();
    let area = |(_, mesh, place): (Entity, &Mesh, &GlobalTransform)| {
        let corner = |index: u32| {
            let position = mesh.0.positions.get(index as usize).copied().unwrap_or_default();
            place.0.transform_point3(position.as_dvec3())
        };
        let areas = mesh.0.triangles().map(|triangle| {
            let [a, b, c] = triangle.map(corner);
            0.5 * (b - a).cross(c - a).length()
        });
        areas.filter(|area| area.is_finite()).sum::<f64>()
    };
    meshes.iter(world).filter(|(entity, ..)| baked.contains(entity)).map(area).sum()
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
