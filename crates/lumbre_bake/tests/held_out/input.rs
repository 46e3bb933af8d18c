//! What a program of ours is asked to look at: a file, or a held-out scene by its name. Not the scenes.

use std::path::Path;

use bevy_ecs::world::World;

use super::scenes;

/// The held-out scene of that name, at its own scale, or what the file holds.
pub fn world_of(input: &Path) -> Result<World, lumbre_scene::LoadError> {
    if let Some((scene, layout)) = input.to_str().and_then(scenes::find) {
        return Ok(scene(layout, 1.0));
    }
    let mut world = World::new();
    lumbre_scene::load(&mut world, input)?;
    Ok(world)
}
