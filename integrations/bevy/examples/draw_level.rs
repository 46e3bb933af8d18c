//! Draws a baked file without a window and writes what it looks like, or its radiance:
//! `cargo run --example draw_level -- LEVEL.baked.glb OUT.png|OUT.pfm [CAMERA] [WIDTH HEIGHT] [EXPOSURE]`.
//!
//! No tone curve is applied, so that the numbers can be compared: radiance times the exposure, in a PNG clamped and encoded as sRGB, in a
//! portable float map as it is (Bevy's own frame has sixteen bits a channel).

use std::path::{Path, PathBuf};
use std::time::Duration;

use bevy::app::{AppExit, ScheduleRunnerPlugin};
use bevy::asset::{AssetPlugin, LoadState, RecursiveDependencyLoadState, UnapprovedPathMode};
use bevy::camera::primitives::{Aabb, CascadesFrusta, CubemapFrusta, Frustum};
use bevy::camera::visibility::{
    CascadesVisibleEntities, CubemapVisibleEntities, DynamicSkinnedMeshBounds, NoFrustumCulling,
    VisibilityClass, VisibleEntities, VisibleMeshEntities,
};
use bevy::camera::{CameraMainTextureUsages, Hdr, RenderTarget};
use bevy::core_pipeline::tonemapping::Tonemapping;
use bevy::gltf::{
    GltfExtras, GltfMaterialExtras, GltfMaterialName, GltfMeshExtras, GltfMeshName, GltfSceneExtras,
    GltfSceneName,
};
use bevy::light::{CascadeShadowConfig, Cascades, GlobalAmbientLight};
use bevy::mesh::morph::MorphWeights;
use bevy::mesh::skinning::SkinnedMesh;
use bevy::pbr::Lightmap;
use bevy::prelude::*;
use bevy::render::render_resource::TextureFormat;
use bevy::render::view::screenshot::{Screenshot, ScreenshotCaptured};
use bevy::transform::components::TransformTreeChanged;
use bevy::window::ExitCondition;
use half::f16;
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
        eprintln!("usage: draw_level LEVEL.baked.glb OUT.png|OUT.pfm [CAMERA] [WIDTH HEIGHT] [EXPOSURE]");
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
    let files =
        AssetPlugin { file_path: folder, unapproved_path_mode: UnapprovedPathMode::Forbid, ..default() };
    let no_window =
        WindowPlugin { primary_window: None, exit_condition: ExitCondition::DontExit, ..default() };
    app.add_plugins((
        DefaultPlugins.set(files).set(no_window),
        ScheduleRunnerPlugin::run_loop(Duration::from_millis(10)),
        LumbrePlugin::default(),
    ));
    register(&mut app);
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

/// What the scene of a glTF file holds. Only needed here, where Bevy is built without its feature `reflect_auto_register`.
fn register(app: &mut App) {
    macro_rules! types {
        ($($kind:ty),* $(,)?) => { $(app.register_type::<$kind>();)* };
    }
    types!(
        ChildOf,
        Children,
        Name,
        Transform,
        GlobalTransform,
        TransformTreeChanged,
        Visibility,
        InheritedVisibility,
        ViewVisibility
    );
    types!(Mesh3d, Aabb, GltfExtras, GltfSceneExtras, GltfMeshExtras, GltfMeshName, GltfMaterialExtras);
    types!(
        GltfMaterialName,
        GltfSceneName,
        SkinnedMesh,
        DynamicSkinnedMeshBounds,
        NoFrustumCulling,
        MorphWeights
    );
    types!(
        PointLight,
        SpotLight,
        DirectionalLight,
        CubemapFrusta,
        CubemapVisibleEntities,
        VisibleMeshEntities
    );
    types!(Cascades, CascadesFrusta, CascadeShadowConfig, CascadesVisibleEntities, Frustum, VisibleEntities);
    types!(Camera, Camera3d, Projection, CameraMainTextureUsages, RenderTarget, VisibilityClass);
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
                error!(
                    "{error}; are the .ktx2 images beside the file? `lumbre bake … --ktx2 rgb9e5` writes them"
                );
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
                let format = if asked.wants_radiance() { RADIANCE } else { TextureFormat::Rgba8UnormSrgb };
                let target = Image::new_target_texture(asked.size.x, asked.size.y, format, None);
                let target = RenderTarget::Image(images.add(target).into());
                let view = (Camera3d::default(), projection.clone(), place.compute_transform());
                let light = (lumbre_bevy::exposure(asked.exposure), Tonemapping::None, Msaa::Sample4);
                let (others, picture) = (cameras.iter().map(|(entity, ..)| entity), target.clone());
                others.for_each(|entity| commands.entity(entity).despawn());
                let camera = commands.spawn((view, light, target)).id();
                if asked.wants_radiance() {
                    commands.entity(camera).insert(Hdr);
                }
                commands.insert_resource(Picture(picture));
            }
            if *frames > SETTLING_FRAMES {
                info!("{} meshes have a lightmap", lightmaps.iter().count());
                *step = Step::Waiting;
                commands.queue(|world: &mut World| {
                    let target = world.resource::<Picture>().0.clone();
                    world.spawn(Screenshot(target)).observe(save);
                });
            }
        }
        Step::Waiting => {}
    }
}

/// Writes the picture and ends the program.
fn save(captured: On<ScreenshotCaptured>, asked: Res<Asked>, mut exit: MessageWriter<AppExit>) {
    let written = match asked.wants_radiance() {
        true => portable_float_map(&captured.image).and_then(|map| std::fs::write(&asked.out, map)),
        false => png(&captured.image, &asked.out),
    };
    exit.write(match written {
        Ok(()) => AppExit::Success,
        Err(error) => {
            error!("{}: {error}", asked.out.display());
            AppExit::error()
        }
    });
}

fn png(image: &Image, out: &Path) -> std::io::Result<()> {
    let image = image.clone().try_into_dynamic().map_err(std::io::Error::other)?;
    image.to_rgb8().save(out).map_err(std::io::Error::other)
}

/// Three channels as little-endian floats, the bottom row first.
fn portable_float_map(image: &Image) -> std::io::Result<Vec<u8>> {
    let missing = || std::io::Error::other("the picture was not read back");
    let data = image.data.as_deref().ok_or_else(missing)?;
    let mut map = format!("PF\n{} {}\n-1.0\n", image.width(), image.height()).into_bytes();
    for row in data.chunks_exact(8 * image.width() as usize).rev() {
        for texel in row.chunks_exact(8) {
            for channel in texel.chunks_exact(2).take(3) {
                let value = f16::from_le_bytes([channel[0], channel[1]]);
                map.extend(value.to_f32().to_le_bytes());
            }
        }
    }
    Ok(map)
}

/// What radiance is drawn into.
const RADIANCE: TextureFormat = TextureFormat::Rgba16Float;

impl Asked {
    fn wants_radiance(&self) -> bool {
        self.out.extension().is_some_and(|extension| extension == "pfm")
    }
}

/// What is drawn into.
#[derive(Resource)]
struct Picture(RenderTarget);
