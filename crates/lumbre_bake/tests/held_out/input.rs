//! Loads the input of an example: a file, or a held-out scene by its name.

use std::path::Path;

use bevy_ecs::world::World;

use super::scenes;

/// Builds the held-out scene of that name at its original scale; if there is none, loads the file.
pub fn world_of(input: &Path) -> Result<World, lumbre_scene::LoadError> {
    if let Some((scene, layout)) = input.to_str().and_then(scenes::find) {
        return Ok(scene(layout, 1.0));
    }
    let mut world = World::new();
    lumbre_scene::load(&mut world, input)?;
    Ok(world)
}
