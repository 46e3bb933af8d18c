//! Draws a baked file without a window and writes a PNG:
//! `cargo run --example draw_level -- LEVEL.baked.glb OUT.png [CAMERA] [WIDTH HEIGHT] [EXPOSURE]`.
//!
//! No tone curve is applied, so that the PNG's numbers can be compared: radiance times the exposure, clamped, encoded as sRGB.

use std::path::{Path, PathBuf};
use std::time::Duration;

use bevy::app::{AppExit, ScheduleRunnerPlugin};
use bevy::asset::{AssetPlugin, LoadState, RecursiveDependencyLoadState, UnapprovedPathMode};
use bevy::camera::RenderTarget;
use bevy::core_pipeline::tonemapping::Tonemapping;
use bevy::light::GlobalAmbientLight;
use bevy::pbr::Lightmap;
use bevy::prelude::*;
use bevy::render::render_resource::TextureFormat;
use bevy::render::view::screenshot::{Screenshot, ScreenshotCaptured, save_to_disk};
use bevy::window::ExitCondition;
use lumbre_bevy::LumbrePlugin;

/// Frames after everything is loaded and before the picture: pipelines are compiled and textures uploaded meanwhile.
const SETTLING_FRAMES: u32 = 30;

/// What was asked for.
#[derive(Resource)]
struct Asked {
    scene: Handle<WorldAsset>,
    out: PathBuf,
    camera: Option<String>,
    size: UVec2,
    exposure: f32,
}

/// How far it is.
#[derive(Resource, Default)]
enum Step {
    #[default]
    Loading,
    Settling(u32),
    Waiting,
}

fn main() -> AppExit {
    let mut arguments = std::env::args().skip(1);
    let (Some(level), Some(out)) = (arguments.next(), arguments.next()) else {
        eprintln!("usage: draw_level LEVEL.baked.glb OUT.png [CAMERA] [WIDTH HEIGHT] [EXPOSURE]");
        return AppExit::from_code(2);
    };
    let camera = arguments.next().filter(|name| !name.is_empty());
    let numbers: Vec<f32> = arguments.filter_map(|text| text.parse().ok()).collect();
    let size = match numbers[..] {
        [width, height, ..] => UVec2::new(width as u32, height as u32).clamp(UVec2::ONE, UVec2::splat(8192)),
        _ => UVec2::new(960, 540),
    };
    let exposure = numbers.get(2).copied().unwrap_or(1.0);
    let level = std::path::absolute(&level).unwrap_or_else(|_| PathBuf::from(level));
    let folder = level.parent().unwrap_or(Path::new("/")).to_string_lossy().into_owned();
    let name = level.file_name().unwrap_or_default().to_string_lossy().into_owned();

    let mut app = App::new();
    let files = AssetPlugin {
        file_path: folder,
        unapproved_path_mode: UnapprovedPathMode::Forbid,
        ..default()
    };
    let no_window =
        WindowPlugin { primary_window: None, exit_condition: ExitCondition::DontExit, ..default() };
    app.add_plugins((
        DefaultPlugins.set(files).set(no_window),
        ScheduleRunnerPlugin::run_loop(Duration::from_millis(10)),
        LumbrePlugin::default(),
    ));
    let scene = app.world().resource::<AssetServer>().load(GltfAssetLabel::Scene(0).from_asset(name));
    app.insert_resource(GlobalAmbientLight { brightness: 0.0, ..default() })
        .insert_resource(ClearColor(Color::BLACK))
        .insert_resource(Asked { scene: scene.clone(), out: PathBuf::from(out), camera, size, exposure })
        .init_resource::<Step>()
        .add_systems(Startup, move |mut commands: Commands| {
            commands.spawn(WorldAssetRoot(scene.clone()));
        })
        .add_systems(Update, advance);
    app.run()
}

fn advance(
    mut commands: Commands,
    mut step: ResMut<Step>,
    asked: Res<Asked>,
    assets: Res<AssetServer>,
    mut images: ResMut<Assets<Image>>,
    cameras: Query<(Entity, &GlobalTransform, &Projection, Option<&ChildOf>, Option<&Name>), With<Camera3d>>,
    names: Query<&Name>,
    lightmaps: Query<&Lightmap>,
    mut exit: MessageWriter<AppExit>,
) {
    match &mut *step {
        Step::Loading => {
            if let LoadState::Failed(error) = assets.load_state(&asked.scene) {
                error!("{error}");
                exit.write(AppExit::error());
            } else if let RecursiveDependencyLoadState::Failed(error) =
                assets.recursive_dependency_load_state(&asked.scene)
            {
                error!("{error}; are the .ktx2 images beside the file? `lumbre bake … --ktx2 rgb9e5` writes them");
                exit.write(AppExit::error());
            } else if assets.is_loaded_with_dependencies(&asked.scene) && !cameras.is_empty() {
                *step = Step::Settling(0);
            }
        }
        Step::Settling(frames) => {
            *frames += 1;
            if *frames == 2 {
                let is_asked = |own: Option<&Name>, parent: Option<&ChildOf>| {
                    let above = parent.and_then(|parent| names.get(parent.parent()).ok());
                    asked.camera.as_deref().is_none_or(|wanted| {
                        [own, above].into_iter().flatten().any(|name| name.as_str() == wanted)
                    })
                };
                let found = cameras.iter().find(|(_, _, _, parent, own)| is_asked(*own, *parent));
                let Some((_, place, projection, ..)) = found else {
                    error!("there is no camera of that name");
                    exit.write(AppExit::error());
                    return;
                };
                let target =
                    Image::new_target_texture(asked.size.x, asked.size.y, TextureFormat::Rgba8UnormSrgb, None);
                let target = RenderTarget::Image(images.add(target).into());
                let view = (Camera3d::default(), projection.clone(), place.compute_transform());
                let light = (lumbre_bevy::exposure(asked.exposure), Tonemapping::None, Msaa::Sample4);
                let (others, picture) = (cameras.iter().map(|(entity, ..)| entity), target.clone());
                others.for_each(|entity| commands.entity(entity).despawn());
                commands.spawn((view, light, target));
                commands.insert_resource(Picture(picture));
            }
            if *frames > SETTLING_FRAMES {
                info!("{} meshes have a lightmap", lightmaps.iter().count());
                *step = Step::Waiting;
                commands.queue(|world: &mut World| {
                    let target = world.resource::<Picture>().0.clone();
                    let out = world.resource::<Asked>().out.clone();
                    world.spawn(Screenshot(target)).observe(save_to_disk(out)).observe(
                        |_: On<ScreenshotCaptured>, mut exit: MessageWriter<AppExit>| {
                            exit.write(AppExit::Success);
                        },
                    );
                });
            }
        }
        Step::Waiting => {}
    }
}

/// What is drawn into.
#[derive(Resource)]
struct Picture(RenderTarget);
