//! Scenes as files, both those that were passed and those that studies create. Each is measured as read from
//! its file, so that a point's command reproduces the result.

use std::path::PathBuf;

use bevy_ecs::prelude::*;
use lumbre_scene::{
    ActiveCamera, Camera, LoadOptions, add_default_light, default_camera, is_without_light, load_with, save,
    update_transforms,
};

use crate::command_line::quoted;
use crate::{Conditions, CostError};

/// A scene in a file.
#[derive(Clone, Debug)]
pub struct SceneFile {
    /// Its name in the report.
    pub name: String,
    path: PathBuf,
    /// Its path in commands, which are run in the report's folder.
    in_commands: String,
}

impl SceneFile {
    /// Returns the files that were passed.
    ///
    /// # Errors
    /// [`CostError::File`] if a file does not exist.
    pub fn given(conditions: &Conditions<'_>) -> Result<Vec<Self>, CostError> {
        let scene = |path: &PathBuf| {
            let whole = path.canonicalize();
            let whole = whole.map_err(|source| CostError::File { path: path.clone(), source })?;
            let name = path.file_stem().map_or("scene".into(), |stem| stem.to_string_lossy());
            let in_commands = quoted(&whole.to_string_lossy());
            Ok(Self { name: name.into_owned(), path: whole, in_commands })
        };
        conditions.files.iter().map(scene).collect()
    }

    /// Writes a scene that a study has created below the report's folder.
    ///
    /// # Errors
    /// [`CostError::File`], [`CostError::Save`].
    pub fn made(conditions: &Conditions<'_>, name: &str, mut world: World) -> Result<Self, CostError> {
        let folder = conditions.folder.join("scenes");
        std::fs::create_dir_all(&folder)
            .map_err(|source| CostError::File { path: folder.clone(), source })?;
        // `with_extension` would cut off the part of a name that follows a dot.
        let path = folder.join(format!("{name}.glb"));
        save(&mut world, &path)?;
        Ok(Self { name: name.replace('-', " "), path, in_commands: format!("scenes/{name}.glb") })
    }

    /// Reads the scene. As in `lumbre render`, a scene without a camera gets one that sees everything, and a
    /// scene without light gets a light at the camera.
    ///
    /// # Errors
    /// [`CostError::Load`].
    pub fn open(&self, aspect: f64) -> Result<World, CostError> {
        let mut world = World::new();
        let options = LoadOptions { lenient: true, ..LoadOptions::default() };
        let report = load_with(&mut world, &self.path, &options)?;
        update_transforms(&mut world);
        let active = world.query_filtered::<Entity, (With<Camera>, With<ActiveCamera>)>().iter(&world).next();
        let first = || report.nodes.iter().copied().find(|node| world.get::<Camera>(*node).is_some());
        let camera = match active.or_else(first) {
            Some(camera) => camera,
            None => {
                let made = default_camera(&mut world, aspect);
                world.spawn(made).id()
            }
        };
        world.entity_mut(camera).insert(ActiveCamera);
        if is_without_light(&mut world) {
            add_default_light(&mut world, camera);
        }
        update_transforms(&mut world);
        Ok(world)
    }

    /// Returns the name of a series for this scene, which includes the scene's name if there are several
    /// scenes.
    pub fn series(&self, conditions: &Conditions<'_>, name: &str) -> String {
        if conditions.files.len() > 1 { format!("{name}, {}", self.name) } else { name.to_owned() }
    }

    /// Returns its path in commands, which are run in the report's folder.
    pub fn in_commands(&self) -> &str {
        &self.in_commands
    }
}
