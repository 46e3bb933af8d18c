//! Loads files into Worlds with a camera, and converts command-line options to frame options.

use std::path::Path;

use anyhow::bail;
use bevy_ecs::prelude::*;
use lumbre::optics::{Light, LightKind};
use lumbre::render::{Display, FrameOptions, Gpu, meter, removable_effects};
use lumbre::scene::{
    self, ActiveCamera, Camera, Census, GlobalTransform, LoadOptions, LoadReport, Name, SceneSettings,
    SourceFile, reduce_lightmaps,
};

use crate::arguments::{Exposure, Frame, Reading};

/// The nodes of the loaded file in file order, by which `--camera INDEX` counts.
#[derive(Resource)]
struct FileOrder(Vec<Entity>);

/// A World, and the report of its loading.
pub struct Loaded {
    pub world: World,
    pub report: LoadReport,
}

/// Loads a scene and prints the importer's notes to standard error.
pub fn load(path: &Path, reading: &Reading) -> anyhow::Result<Loaded> {
    let mut world = World::new();
    let report = scene::load_with(&mut world, path, &load_options(reading))?;
    Ok(loaded(world, report, path))
}

/// Does what [`load`] does without printing notes, for a file that has been loaded before.
pub fn load_quietly(path: &Path, reading: &Reading) -> anyhow::Result<Loaded> {
    let mut world = World::new();
    let report = scene::load_with(&mut world, path, &load_options(reading))?;
    world.insert_resource(FileOrder(report.nodes.clone()));
    Ok(Loaded { world, report })
}

/// Does what [`load`] does, and also returns the file itself, to be written again with baked light.
pub fn load_source(path: &Path, reading: &Reading) -> anyhow::Result<(SourceFile, Loaded)> {
    let mut world = World::new();
    let mut source = SourceFile::read(path, &load_options(reading))?;
    let report = source.load_into(&mut world)?;
    Ok((source, loaded(world, report, path)))
}

/// Returns the options that the command line sets for reading files.
pub fn load_options(reading: &Reading) -> LoadOptions {
    LoadOptions { lenient: !reading.strict, root: reading.root.clone(), ..LoadOptions::default() }
}

fn loaded(mut world: World, report: LoadReport, path: &Path) -> Loaded {
    for note in &report.notes {
        eprintln!("lumbre: note: {}: {note}", path.display());
    }
    world.insert_resource(FileOrder(report.nodes.clone()));
    Loaded { world, report }
}

/// Adds default lights at the camera, with a note, if the World has no light.
fn light_by_default(world: &mut World, camera: Entity, path: &Path) {
    if scene::is_without_light(world) {
        eprintln!(
            "lumbre: note: {}: has no light that a frame shows; lit by a key and a fill light at the camera (--no-default-light leaves it dark)",
            path.display()
        );
        scene::add_default_light(world, camera);
    }
}

/// Fraction of a frame that has to be clipped to white before an exposure is metered without being asked for.
const CLIPPED: f64 = 0.02;

/// Returns the requested exposure, or a metered one if the file's lights are in candela or lux
/// (`photometric`, where no camera states an exposure) and too much would be white. A metered exposure is
/// printed to standard error. `None` leaves the camera's exposure.
pub fn exposure(
    asked: Option<Exposure>,
    photometric: bool,
    world: &mut World,
    gpu: &Gpu,
    options: &FrameOptions,
    aspect: f64,
    path: &Path,
) -> anyhow::Result<Option<f32>> {
    match asked {
        Some(Exposure::Factor(factor)) => return Ok(Some(factor)),
        Some(Exposure::Auto) => {}
        None if photometric && options.display == Display::Srgb => {}
        None => return Ok(None),
    }
    let metering = meter(gpu, world, options, aspect)?;
    let Some(metering) = metering.filter(|found| asked.is_some() || found.clipped > CLIPPED) else {
        return Ok(None);
    };
    eprintln!(
        "lumbre: note: {}: exposure {:.3e} ({:.1} EV), metered: the log-average luminance is {:.4} (--exposure X or EV for another)",
        path.display(),
        metering.exposure,
        metering.exposure_value(),
        metering.luminance
    );
    Ok(Some(metering.exposure))
}

/// Returns the frame options that the command line asks for, except for an exposure that has to be metered.
/// Adds a camera to a scene without one, and default lights to one without light.
pub fn frame_options(
    world: &mut World,
    frame: &Frame,
    display: Display,
    aspect: f64,
    path: &Path,
) -> anyhow::Result<FrameOptions> {
    let camera = camera(world, frame.camera.as_deref(), aspect)?;
    if !frame.no_default_light {
        light_by_default(world, camera, path);
    }
    let settings = &mut world.get_resource_or_insert_with(SceneSettings::default).frame;
    settings.light_threshold = frame.light_threshold.unwrap_or(settings.light_threshold);
    // --no-shadows is an option of the frame below; rays have it, too, without another scene.
    settings.shadows |= frame.shadows || frame.every_shadow;
    settings.shadow_resolution = frame.shadow_resolution.unwrap_or(settings.shadow_resolution);
    settings.shadow_filter = frame.shadow_filter.unwrap_or(settings.shadow_filter);
    settings.lightmap_format = frame.lightmap_format.unwrap_or(settings.lightmap_format);
    reduce_lightmaps(world, frame.lightmap_reduction);
    if frame.every_shadow {
        let mut lights = world.query::<&mut Light>();
        let lamps = lights.iter_mut(world).filter(|light| light.kind != LightKind::Ambient);
        lamps.for_each(|mut light| light.shadow = true);
    }
    let mut options = FrameOptions {
        camera: Some(camera),
        shading: frame.shading,
        reflection: frame.reflection,
        flat_rule: frame.flat_rule,
        specular_antialiasing: frame.specular_antialiasing,
        rendering_path: frame.rendering_path.unwrap_or_default(),
        lightmaps: !frame.no_lightmaps,
        irradiance_volumes: !frame.no_irradiance_volumes,
        shadows: !frame.no_shadows,
        refraction: !frame.no_refraction,
        mirror_depth: frame.mirror_depth.unwrap_or(FrameOptions::default().mirror_depth),
        multisample: match (frame.msaa, frame.no_msaa) {
            (true, _) => Some(true),
            (false, true) => Some(false),
            (false, false) => None,
        },
        display,
        exposure: match frame.exposure {
            Some(Exposure::Factor(factor)) => Some(factor),
            Some(Exposure::Auto) | None => None,
        },
        full_precision: display != Display::Srgb,
        ..FrameOptions::default()
    };
    for name in &frame.without {
        leave_out(world, &mut options, name)?;
    }
    Ok(options)
}

/// Takes an effect out of a World, or out of the options of its frame.
fn leave_out(world: &mut World, options: &mut FrameOptions, name: &str) -> anyhow::Result<()> {
    let removable = removable_effects(&Census::of(world), options);
    if let Some(effect) = removable.iter().find(|effect| effect.effect == name) {
        effect.remove(world, options);
        return Ok(());
    }
    let names: Vec<&str> = removable.iter().map(|effect| effect.effect).collect();
    bail!("there is no effect `{name}` to leave out; the scene calls for: {}", names.join(", "))
}

/// Returns the camera with a name or index, or else the active or first one, or a new one that sees
/// everything.
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

/// Returns the lower-case extension of a path.
pub fn extension(path: &Path) -> anyhow::Result<String> {
    match path.extension().and_then(|extension| extension.to_str()) {
        Some(extension) => Ok(extension.to_ascii_lowercase()),
        None => bail!("{}: the name has no extension to tell the format by", path.display()),
    }
}
