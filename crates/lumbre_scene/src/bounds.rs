//! How large a scene is. Not what is in it.

use bevy_ecs::prelude::*;

use crate::{Bounds, GlobalTransform, Mesh, hidden_entities};

/// The box around every mesh that is not hidden, in the world. Global transforms must be up to date.
pub fn scene_bounds(world: &mut World) -> Bounds {
    let mut bounds = Bounds::EMPTY;
    let hidden = hidden_entities(world);
    let mut query = world.query::<(Entity, &Mesh, &GlobalTransform)>();
    for (_, mesh, transform) in query.iter(world).filter(|object| !hidden.contains(&object.0)) {
        // Vertices that no triangle uses are not seen.
        for &index in &mesh.0.indices {
            if let Some(position) = mesh.0.positions.get(index as usize) {
                bounds.include(transform.0.transform_point3(position.as_dvec3()));
            }
        }
    }
    bounds
}
