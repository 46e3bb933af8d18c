//! Selects the triangles of a level that stop the player. How they stop a body is in `walking`.

use bevy_ecs::prelude::*;
use glam::DVec3;
use lumbre_scene::{Extras, GlobalTransform, Mesh, StaticObject, hidden_entities};

/// Returns the triangles of all visible static meshes in world space, metres, except those whose node has
/// `extras.lumbre_demo.solid = false`. Global transforms must be up to date.
pub fn level_triangles(world: &mut World) -> Vec<[DVec3; 3]> {
    let hidden = hidden_entities(world);
    let mut meshes =
        world.query_filtered::<(Entity, &Mesh, &GlobalTransform, Option<&ChildOf>), With<StaticObject>>();
    let mut extras = world.query::<&Extras>();
    let mut triangles = Vec::new();
    for (_, mesh, place, parent) in meshes.iter(world).filter(|object| !hidden.contains(&object.0)) {
        let said = parent.and_then(|parent| extras.get(world, parent.parent()).ok());
        if said.is_some_and(|extras| extras.0.pointer("/lumbre_demo/solid") == Some(&false.into())) {
            continue;
        }
        for triangle in mesh.0.triangles() {
            let corner = |index: u32| mesh.0.positions.get(index as usize);
            if let [Some(a), Some(b), Some(c)] = triangle.map(corner) {
                triangles.push([a, b, c].map(|corner| place.0.transform_point3(corner.as_dvec3())));
            }
        }
    }
    triangles
}
