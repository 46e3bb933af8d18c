//! The bounding box of a scene.

use bevy_ecs::prelude::*;

use crate::{Bounds, GlobalTransform, Mesh, hidden_entities};

/// The world-space bounding box of all meshes that are not hidden. Global transforms must be up to date.
pub fn scene_bounds(world: &mut World) -> Bounds {
    let mut bounds = Bounds::EMPTY;
    let hidden = hidden_entities(world);
    let mut query = world.query::<(Entity, &Mesh, &GlobalTransform)>();
    for (_, mesh, transform) in query.iter(world).filter(|object| !hidden.contains(&object.0)) {
        // Only vertices that a triangle uses are visible, so the indices are walked instead of the positions.
        for &index in &mesh.0.indices {
            if let Some(position) = mesh.0.positions.get(index as usize) {
                bounds.include(transform.0.transform_point3(position.as_dvec3()));
            }
        }
    }
    bounds
}
