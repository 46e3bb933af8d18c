//! From a file to a World with a camera, and from the command line's words to a frame's options.

use std::path::{Path, PathBuf};

use anyhow::bail;
use bevy_ecs::prelude::*;
use lumbre::render::{Display, FrameOptions};
use lumbre::scene::{self, ActiveCamera, Camera, GlobalTransform, Name};

use crate::arguments::Frame;

/// The nodes of the loaded file, in its order: `--camera INDEX` counts by it.
#[derive(Resource)]
struct FileOrder(Vec<Entity>);

/// Loads a scene; what the importer has to remark goes to standard error.
pub fn load(path: &Path) -> anyhow::Result<World> {
    Ok(load_with_files(path)?.0)
}

/// [`load`], and the files beside the one that is named.
pub fn load_with_files(path: &Path) -> anyhow::Result<(World, Vec<PathBuf>)> {
    let mut world = World::new();
    let report = scene::load(&mut world, path)?;
    for note in &report.notes {
        eprintln!("lumbre: note: {}: {note}", path.display());
    }
    world.insert_resource(FileOrder(report.nodes));
    Ok((world, report.files))
}

/// The options that the command line asks for. A scene without a camera gets one.
pub fn frame_options(
    world: &mut World,
    frame: &Frame,
    display: Display,
    aspect: f64,
) -> anyhow::Result<FrameOptions> {
    Ok(FrameOptions {
        camera: Some(camera(world, frame.camera.as_deref(), aspect)?),
        shading: frame.shading,
        reflection: frame.reflection,
        flat_rule: frame.flat_rule,
        specular_antialiasing: frame.specular_antialiasing,
        lightmaps: !frame.no_lightmaps,
        multisample: frame.msaa,
        display,
        exposure: frame.exposure,
        full_precision: display != Display::Srgb,
        ..FrameOptions::default()
    })
}

/// The camera by name or index, or the first one, or one made to see everything.
fn camera(world: &mut World, asked: Option<&str>, aspect: f64) -> anyhow::Result<Entity> {
    let order = world.remove_resource::<FileOrder>().map_or(Vec::new(), |order| order.0);
    let place = |entity: Entity| order.iter().position(|node| *node == entity).unwrap_or(usize::MAX);
    let mut query = world
        .query_filtered::<(Entity, Option<&Name>, Has<ActiveCamera>), (With<Camera>, With<GlobalTransform>)>(
        );
    let mut cameras: Vec<(usize, Entity, String, bool)> = query
        .iter(world)
        .map(|(entity, name, active)| {
            (place(entity), entity, name.map_or(String::new(), ToString::to_string), active)
        })
        .collect();
    cameras.sort();
    let active = cameras.iter().find(|(.., active)| *active).map(|(_, entity, ..)| *entity);
    let cameras: Vec<(Entity, String)> =
        cameras.into_iter().map(|(_, entity, name, _)| (entity, name)).collect();
    let Some(asked) = asked else {
        if let Some(active) = active {
            return Ok(active);
        }
        return Ok(match cameras.first() {
            Some((entity, _)) => *entity,
            None => {
                let made = scene::default_camera(world, aspect);
                let entity = world.spawn(made).id();
                scene::update_transforms(world);
                entity
            }
        });
    };
    if let Some((entity, _)) = cameras.iter().find(|(_, name)| name == asked) {
        return Ok(*entity);
    }
    if let Some((entity, _)) = asked.parse::<usize>().ok().and_then(|index| cameras.get(index)) {
        return Ok(*entity);
    }
    let names: Vec<_> = cameras.iter().enumerate().map(|(i, (_, name))| format!("{i} {name}")).collect();
    if names.is_empty() {
        bail!("there is no camera `{asked}`: the scene has none (leave --camera out to see all of it)");
    }
    bail!("there is no camera `{asked}`; there are: {}", names.join(", "))
}

/// Lower-case extension of a path.
pub fn extension(path: &Path) -> anyhow::Result<String> {
    match path.extension().and_then(|extension| extension.to_str()) {
        Some(extension) => Ok(extension.to_ascii_lowercase()),
        None => bail!("{}: the name has no extension to tell the format by", path.display()),
    }
}
