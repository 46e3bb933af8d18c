//! Checks that only what is needed exists, for every effect that the renderer knows, each with a scene that calls
//! for it and the same scene without it. Without the effect no pass runs for it, no shader contains a feature,
//! function or binding of it, nothing is uploaded for it, its modules need not exist, and the frame is bit for bit
//! that of a renderer that never had it. The resulting table is docs/effects.md, which must agree line by line
//! except for the times.

use std::collections::BTreeSet;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use bevy_ecs::prelude::*;
use glam::{DVec3, UVec3, Vec3, Vec4};
use lumbre_mesh::shapes;
use lumbre_optics::{
    AlphaMode, Attenuation, BakeMode, Distribution, Fog, FogMode, Fresnel, Light, Lobe, Material,
    ReflectionModel, Shading, SpotCone,
};
use lumbre_render::effects::BuiltIn;
use lumbre_render::{
    Display, FrameOptions, FrameReport, LightLists, Measure, Offscreen, OffscreenFormat, Renderer,
    RenderingPath,
};
use lumbre_scene::{
    AmbientCube, Camera, Census, EmissiveLight, IrradianceVolume, Lightmap, LightmapEncoding, LightmapImage,
    MaterialTextures, Mesh, MetallicRoughnessTexture, NormalTexture, OcclusionTexture, SceneSettings,
    ShadowFilter, Transform,
};
use lumbre_shaders::{Kept, MODULES, Program, UnnamedFeatures};
use lumbre_tests::panes::{image, sharp};

use super::own_effects::bloom::{Bloom, BloomEffect};
use super::own_effects::outline::{OutlineEffect, Outlined};
use crate::adapter::gpu;

/// Side length of the frames in pixels.
const SIZE: u32 = 96;
/// Number of frames over which the median of a time is taken.
const TIMED: usize = 5;
/// Number of cells of a row that are the same on every machine; the times after them are not.
const LASTING: usize = 6;

/// A scene under construction: a ball in front of a camera, and the options of the frame.
struct Scene {
    world: World,
    ball: Entity,
    camera: Entity,
    options: FrameOptions,
    format: OffscreenFormat,
}

/// One effect of the table.
struct Row {
    /// Its name in the census, if it has one there.
    effect: &'static str,
    called_for_by: &'static str,
    /// Features of a shader variant with the effect and not without it; none for separate passes.
    features: &'static [&'static str],
    /// Prepares the scene, with the effect and without.
    before: fn(&mut Scene),
    add: fn(&mut Scene),
}

/// A matt ball under Phong shading, whose mesh has everything that a lightmap and textures need; no light.
fn scene() -> Scene {
    let mut ball = shapes::uv_sphere(1.0, 24, 12);
    ball.uv1.clone_from(&ball.uv0);
    let mut world = World::new();
    let ball = world.spawn((Mesh(Arc::new(ball)), Material::matt(Vec3::splat(0.6)))).id();
    let camera = world.spawn((Camera::default(), Transform::from_xyz(0.0, 0.0, 3.5))).id();
    world.insert_resource(SceneSettings { ambient: Vec3::splat(0.1), ..SceneSettings::default() });
    // Forward shading for all scenes.
    let options = FrameOptions { rendering_path: RenderingPath::Forward, ..FrameOptions::default() };
    Scene { world, ball, camera, options, format: OffscreenFormat::Rgba8 }
}

fn nothing(_: &mut Scene) {}

fn spawn(scene: &mut Scene, light: Light) {
    let place = Transform::from_xyz(1.0, 2.0, 4.0).looking_at(DVec3::ZERO, DVec3::Y);
    scene.world.spawn((light, place));
}

fn point_light(scene: &mut Scene) {
    spawn(scene, Light::point(Vec3::splat(9.0)));
}

fn directional_light(scene: &mut Scene) {
    spawn(scene, Light::directional(Vec3::splat(0.7)));
}

fn cone() -> Light {
    Light::spot(Vec3::splat(9.0), SpotCone::Smooth { inner: 0.1, outer: 0.4 })
}

/// A light with a range of some metres.
fn ranged(light: Light) -> Light {
    Light { attenuation: Attenuation { range: 20.0, ..light.attenuation }, ..light }
}

/// Adds an irradiance volume around the ball.
fn in_a_volume(scene: &mut Scene) {
    let cubes = vec![AmbientCube([Vec3::splat(0.5); 6]); 8];
    let volume = IrradianceVolume { resolution: UVec3::splat(2), cubes, inside: Vec::new() };
    scene.world.spawn((volume, Transform::from_scale(4.0)));
}

fn settings(scene: &mut Scene, change: impl FnOnce(&mut SceneSettings)) {
    change(&mut scene.world.resource_mut::<SceneSettings>());
}

fn material(scene: &mut Scene, change: impl FnOnce(&mut Material)) {
    let mut ball = scene.world.entity_mut(scene.ball);
    change(&mut ball.get_mut::<Material>().unwrap());
}

fn textures(scene: &mut Scene, textures: MaterialTextures) {
    scene.world.entity_mut(scene.ball).insert(textures);
}

fn texture() -> lumbre_scene::TextureReference {
    sharp(&image(2, &[[200, 128, 255, 255], [90, 128, 255, 255], [128, 200, 255, 255], [128, 90, 255, 255]]))
}

/// Adds a small ball between the other one and its light.
fn occluder(scene: &mut Scene) {
    let small = Mesh::from(shapes::uv_sphere(0.2, 12, 6));
    scene.world.spawn((small, Material::matt(Vec3::splat(0.6)), Transform::from_xyz(0.4, 0.8, 1.6)));
}

/// Adds a point light, and a highlight to the ball.
fn glossy(scene: &mut Scene) {
    point_light(scene);
    material(scene, |material| {
        material.front.specular = Vec3::splat(0.4);
        material.front.shininess = 40.0;
    });
}

fn microfacets(scene: &mut Scene) {
    glossy(scene);
    settings(scene, |settings| settings.reflection = ReflectionModel::TorranceSparrow);
}

fn fog(scene: &mut Scene, mode: FogMode) {
    let fog = Fog { mode, color: Vec3::splat(0.3) };
    settings(scene, |settings| settings.fog = Some(fog));
}

const ROWS: &[Row] = &[
    Row {
        effect: "flat shading",
        called_for_by: "`Shading::Flat` of object, scene or options, and a light",
        features: &["SHADING_FLAT"],
        before: point_light,
        add: |scene| settings(scene, |settings| settings.shading = Shading::Flat),
    },
    Row {
        effect: "Gouraud shading",
        called_for_by: "`Shading::Gouraud`, and a light",
        features: &["SHADING_GOURAUD"],
        before: point_light,
        add: |scene| settings(scene, |settings| settings.shading = Shading::Gouraud),
    },
    Row {
        effect: "Phong shading",
        called_for_by: "`Shading::Phong` (here instead of Gouraud), and a light",
        features: &["SHADING_PHONG"],
        before: |scene| {
            point_light(scene);
            scene.options.shading = Some(Shading::Gouraud);
        },
        add: |scene| scene.options.shading = Some(Shading::Phong),
    },
    Row {
        effect: "point lights",
        called_for_by: "a point light that is on",
        features: &["LIGHTS", "DYNAMIC_LIGHTS", "POINT_LIGHTS"],
        before: nothing,
        add: point_light,
    },
    Row {
        effect: "directional lights",
        called_for_by: "a directional light that is on",
        features: &["DIRECTIONAL_LIGHTS"],
        before: point_light,
        add: directional_light,
    },
    Row {
        effect: "spot lights",
        called_for_by: "a light with a cone",
        features: &["SPOT_LIGHTS"],
        before: point_light,
        add: |scene| spawn(scene, cone()),
    },
    Row {
        effect: "polygon lights",
        called_for_by: "an emissive mesh with `EmissiveLight`",
        features: &["POLYGON_LIGHTS"],
        before: point_light,
        add: |scene| {
            let panel = Mesh::from(shapes::plane(1.0, 1.0, 1, 1));
            let place =
                Transform::from_xyz(0.0, 2.0, 0.0).looking_at(DVec3::new(0.0, 2.0, -1.0), DVec3::NEG_Y);
            scene.world.spawn((panel, Material::emissive(Vec3::splat(4.0)), EmissiveLight, place));
        },
    },
    Row {
        effect: "static lights",
        called_for_by: "a light that is baked, on a surface without a lightmap or with a highlight",
        features: &["STATIC_LIGHTS"],
        before: point_light,
        add: |scene| spawn(scene, Light { bake: BakeMode::Static, ..Light::point(Vec3::splat(5.0)) }),
    },
    Row {
        effect: "clusters of inverse-square lights",
        called_for_by: "many lights with a range, or `LightLists::Clusters`",
        features: &["CLUSTERS", "INVERSE_SQUARE_CLUSTERS", "UNIFORM_LIGHTS"],
        before: |scene| spawn(scene, ranged(Light::point(Vec3::splat(9.0)))),
        add: |scene| scene.options.light_lists = LightLists::Clusters,
    },
    Row {
        effect: "clusters of inverse-square spot lights",
        called_for_by: "the same, with cones as glTF's have them",
        features: &["CLUSTERS", "INVERSE_SQUARE_CLUSTERS", "INVERSE_SQUARE_SPOTS", "UNIFORM_LIGHTS"],
        before: |scene| spawn(scene, ranged(cone())),
        add: |scene| scene.options.light_lists = LightLists::Clusters,
    },
    Row {
        effect: "clusters of lights with a shadow",
        called_for_by: "the same, with `shadow`",
        features: &["CLUSTERS", "SHADOWED_CLUSTERS"],
        before: |scene| {
            occluder(scene);
            spawn(scene, ranged(Light { shadow: true, ..Light::point(Vec3::splat(9.0)) }));
        },
        add: |scene| scene.options.light_lists = LightLists::Clusters,
    },
    Row {
        effect: "clusters of spot lights with a shadow",
        called_for_by: "the same, with cones as glTF's have them",
        features: &["CLUSTERS", "SHADOWED_CLUSTERS", "INVERSE_SQUARE_SPOTS"],
        before: |scene| {
            occluder(scene);
            spawn(scene, ranged(Light { shadow: true, ..cone() }));
        },
        add: |scene| scene.options.light_lists = LightLists::Clusters,
    },
    Row {
        effect: "clusters of other lights",
        called_for_by: "the same, for other lights with a range: OpenGL's cones, attenuations of their own",
        features: &["CLUSTERS", "RANGED_CLUSTERS"],
        before: |scene| {
            let cone = SpotCone::Exponent { cutoff: 0.5, exponent: 2.0 };
            spawn(scene, ranged(Light::spot(Vec3::splat(9.0), cone)));
        },
        add: |scene| scene.options.light_lists = LightLists::Clusters,
    },
    Row {
        effect: "deferred shading",
        called_for_by: "`RenderingPath::Deferred`; by itself under many lights with a range that meet small triangles",
        features: &["DEFERRED"],
        before: |scene| spawn(scene, ranged(Light::point(Vec3::splat(9.0)))),
        add: |scene| scene.options.rendering_path = RenderingPath::Deferred,
    },
    Row {
        effect: "deferred shading in compute shaders",
        called_for_by: "`RenderingPath::DeferredCompute`; by itself on a GPU where shading is deferred (here against \
                        `RenderingPath::Deferred`)",
        features: &["IN_COMPUTE"],
        before: |scene| {
            spawn(scene, ranged(Light::point(Vec3::splat(9.0))));
            scene.options.rendering_path = RenderingPath::Deferred;
        },
        add: |scene| scene.options.rendering_path = RenderingPath::DeferredCompute,
    },
    Row {
        effect: "shadows",
        called_for_by: "a light with `shadow` (here a spot light)",
        features: &["SHADOWS"],
        before: |scene| {
            occluder(scene);
            spawn(scene, cone());
        },
        add: |scene| each_light(scene, |light| light.shadow = true),
    },
    Row {
        effect: "shadows of point lights",
        called_for_by: "a point light with `shadow`",
        features: &["SHADOWS", "SHADOW_CUBES"],
        before: |scene| {
            occluder(scene);
            point_light(scene);
        },
        add: |scene| each_light(scene, |light| light.shadow = true),
    },
    Row {
        effect: "shadows of directional lights",
        called_for_by: "a directional light with `shadow`",
        features: &["SHADOWS", "SHADOW_CASCADES"],
        before: |scene| {
            occluder(scene);
            directional_light(scene);
        },
        add: |scene| each_light(scene, |light| light.shadow = true),
    },
    Row {
        effect: "soft shadows",
        called_for_by: "a light with `shadow` and a radius",
        features: &["SOFT_SHADOWS"],
        before: |scene| {
            occluder(scene);
            spawn(scene, Light { shadow: true, ..cone() });
        },
        add: |scene| each_light(scene, |light| light.radius = 0.2),
    },
    Row {
        effect: "hard shadows",
        called_for_by: "a light with `shadow` under `ShadowFilter::Hard`",
        features: &["HARD_SHADOWS"],
        before: |scene| {
            occluder(scene);
            spawn(scene, Light { shadow: true, ..cone() });
        },
        add: |scene| settings(scene, |settings| settings.frame.shadow_filter = ShadowFilter::Hard),
    },
    Row {
        effect: "specular",
        called_for_by: "a specular coefficient above 0",
        features: &["LOCAL_VIEWER"],
        before: point_light,
        add: |scene| material(scene, |material| material.front.specular = Vec3::splat(0.4)),
    },
    Row {
        effect: "sharp highlights",
        called_for_by: "an exponent above 256",
        features: &["SHARP_HIGHLIGHTS"],
        before: glossy,
        add: |scene| material(scene, |material| material.front.shininess = 5000.0),
    },
    Row {
        effect: "Phong reflection",
        called_for_by: "`ReflectionModel::Phong` (here instead of Blinn)",
        features: &["REFLECTION_PHONG"],
        before: |scene| {
            glossy(scene);
            scene.options.reflection = Some(ReflectionModel::Blinn);
        },
        add: |scene| scene.options.reflection = Some(ReflectionModel::Phong),
    },
    Row {
        effect: "Blinn reflection",
        called_for_by: "`ReflectionModel::Blinn` (here and below instead of Phong)",
        features: &["REFLECTION_BLINN"],
        before: glossy,
        add: |scene| scene.options.reflection = Some(ReflectionModel::Blinn),
    },
    Row {
        effect: "Blinn 4n reflection",
        called_for_by: "`ReflectionModel::Blinn4n`",
        features: &["REFLECTION_BLINN_4N"],
        before: glossy,
        add: |scene| scene.options.reflection = Some(ReflectionModel::Blinn4n),
    },
    Row {
        effect: "matched Blinn reflection",
        called_for_by: "`ReflectionModel::BlinnMatched`",
        features: &["REFLECTION_BLINN_MATCHED"],
        before: glossy,
        add: |scene| scene.options.reflection = Some(ReflectionModel::BlinnMatched),
    },
    Row {
        effect: "Torrance-Sparrow reflection",
        called_for_by: "`ReflectionModel::TorranceSparrow`",
        features: &["REFLECTION_TORRANCE_SPARROW"],
        before: glossy,
        add: |scene| scene.options.reflection = Some(ReflectionModel::TorranceSparrow),
    },
    Row {
        effect: "microfacets spread as a power of the cosine",
        called_for_by: "the material's `distribution`, under Torrance-Sparrow",
        features: &["MICROFACETS", "DISTRIBUTION_COSINE_POWER"],
        before: microfacets,
        add: |scene| material(scene, |material| material.distribution = Distribution::CosinePower),
    },
    Row {
        effect: "microfacets spread as a Gaussian",
        called_for_by: "the material's `distribution`, under Torrance-Sparrow",
        features: &["MICROFACETS", "DISTRIBUTION_GAUSSIAN"],
        before: microfacets,
        add: |scene| material(scene, |material| material.distribution = Distribution::Gaussian),
    },
    Row {
        effect: "microfacets of a conductor",
        called_for_by: "the material's `fresnel`, under Torrance-Sparrow",
        features: &["MICROFACETS", "FRESNEL_CONDUCTOR"],
        before: microfacets,
        add: |scene| {
            let fresnel = Fresnel::Conductor { eta: Vec3::splat(0.2), absorption: Vec3::splat(3.0) };
            material(scene, |material| material.fresnel = fresnel);
        },
    },
    Row {
        effect: "microfacets by their reflectance at normal incidence",
        called_for_by: "the material's `fresnel`, under Torrance-Sparrow",
        features: &["MICROFACETS", "FRESNEL_NORMAL_REFLECTANCE"],
        before: microfacets,
        add: |scene| material(scene, |material| material.fresnel = Fresnel::NormalReflectance),
    },
    Row {
        effect: "energy-conserving highlights",
        called_for_by: "`Lobe::EnergyConserving` of the material, as glTF's have it",
        features: &["ENERGY_CONSERVING"],
        before: glossy,
        add: |scene| material(scene, |material| material.lobe = Lobe::EnergyConserving),
    },
    Row {
        effect: "specular antialiasing",
        called_for_by: "scene or options, under Phong shading",
        features: &["SPECULAR_ANTIALIASING"],
        before: glossy,
        add: |scene| scene.options.specular_antialiasing = Some(true),
    },
    Row {
        effect: "lightmaps",
        called_for_by: "a mesh with `Lightmap`",
        features: &["LIGHTMAP", "UV1"],
        before: point_light,
        add: |scene| {
            let lightmap = LightmapImage {
                name: "map".to_owned(),
                width: 2,
                height: 2,
                texels: vec![Vec3::splat(0.5); 4],
                encoding: LightmapEncoding::default(),
            };
            scene.world.entity_mut(scene.ball).insert(Lightmap { image: Arc::new(lightmap) });
        },
    },
    Row {
        effect: "irradiance volumes",
        called_for_by: "an `IrradianceVolume` that can be used, and a lit mesh without `Lightmap`",
        features: &["IRRADIANCE_VOLUME"],
        before: point_light,
        add: in_a_volume,
    },
    Row {
        effect: "metals under baked light",
        called_for_by: "a lightmap or a volume, and a highlight of `Lobe::EnergyConserving` with a coefficient above .04",
        features: &["BAKED_METAL"],
        before: |scene| {
            point_light(scene);
            in_a_volume(scene);
            material(scene, |material| material.lobe = Lobe::EnergyConserving);
            material(scene, |material| material.front.specular = Vec3::splat(0.04));
        },
        add: |scene| material(scene, |material| material.front.specular = Vec3::splat(0.4)),
    },
    Row {
        effect: "base colour textures",
        called_for_by: "a material with one",
        features: &["BASE_COLOR_TEXTURE", "UV0"],
        before: point_light,
        add: |scene| {
            textures(scene, MaterialTextures { base_color: Some(texture()), ..MaterialTextures::default() });
        },
    },
    Row {
        effect: "base colour textures on light of vertices",
        called_for_by: "the same under flat or Gouraud shading",
        features: &["BASE_COLOR_TEXTURE", "MODULATED", "UV0"],
        before: |scene| {
            glossy(scene);
            scene.options.shading = Some(Shading::Gouraud);
        },
        add: |scene| {
            textures(scene, MaterialTextures { base_color: Some(texture()), ..MaterialTextures::default() });
        },
    },
    Row {
        effect: "emissive textures",
        called_for_by: "a material with one",
        features: &["EMISSIVE_TEXTURE", "UV0"],
        before: |scene| {
            point_light(scene);
            material(scene, |material| material.front.emission = Vec3::splat(0.3));
        },
        add: |scene| {
            textures(scene, MaterialTextures { emissive: Some(texture()), ..MaterialTextures::default() });
        },
    },
    Row {
        effect: "metallic-roughness textures",
        called_for_by: "a material with one",
        features: &["METALLIC_ROUGHNESS_TEXTURE", "UV0"],
        before: glossy,
        add: |scene| {
            let metallic_roughness = Some(MetallicRoughnessTexture {
                texture: texture(),
                base_color: Vec3::splat(0.6),
                metallic: 1.0,
                roughness: 1.0,
                dielectric: Vec3::splat(0.04),
            });
            textures(scene, MaterialTextures { metallic_roughness, ..MaterialTextures::default() });
        },
    },
    Row {
        effect: "normal textures",
        called_for_by: "a material with one, under Phong shading and a light",
        features: &["NORMAL_TEXTURE", "UV0"],
        before: point_light,
        add: |scene| {
            let normal = Some(NormalTexture { texture: texture(), scale: 1.0 });
            textures(scene, MaterialTextures { normal, ..MaterialTextures::default() });
        },
    },
    Row {
        effect: "occlusion textures",
        called_for_by: "a material with one",
        features: &["OCCLUSION_TEXTURE", "UV0"],
        before: point_light,
        add: |scene| {
            let occlusion = Some(OcclusionTexture { texture: texture(), strength: 1.0 });
            textures(scene, MaterialTextures { occlusion, ..MaterialTextures::default() });
        },
    },
    Row {
        effect: "vertex colours",
        called_for_by: "a mesh with COLOR_0",
        features: &["VERTEX_COLOR"],
        before: point_light,
        add: |scene| {
            let mut ball = scene.world.entity_mut(scene.ball);
            let mut mesh = (*ball.get::<Mesh>().unwrap().0).clone();
            mesh.colors = vec![Vec4::new(1.0, 0.5, 0.2, 1.0); mesh.positions.len()];
            ball.insert(Mesh(Arc::new(mesh)));
        },
    },
    Row {
        effect: "alpha mask",
        called_for_by: "a material with `AlphaMode::Mask`",
        features: &["ALPHA", "ALPHA_MASK"],
        before: |scene| {
            point_light(scene);
            material(scene, |material| material.alpha = 0.3);
        },
        add: |scene| material(scene, |material| material.alpha_mode = AlphaMode::Mask { cutoff: 0.5 }),
    },
    Row {
        effect: "alpha blending",
        called_for_by: "a material with `AlphaMode::Blend`",
        features: &["ALPHA"],
        before: point_light,
        add: |scene| {
            material(scene, |material| (material.alpha, material.alpha_mode) = (0.5, AlphaMode::Blend));
        },
    },
    Row {
        effect: "two-sided",
        called_for_by: "a double-sided material where the scene lights both sides",
        features: &["TWO_SIDED"],
        // Seen from inside the ball.
        before: |scene| {
            point_light(scene);
            settings(scene, |settings| settings.two_sided = false);
            material(scene, |material| material.double_sided = true);
            scene.world.entity_mut(scene.ball).insert(Transform::from_scale(9.0));
        },
        add: |scene| settings(scene, |settings| settings.two_sided = true),
    },
    Row {
        effect: "refraction",
        called_for_by: "a material with `transmission` that is not blended",
        features: &[],
        before: |scene| {
            point_light(scene);
            occluder(scene);
        },
        add: |scene| material(scene, |material| material.transmission = Vec3::splat(0.8)),
    },
    Row {
        effect: "planar mirrors",
        called_for_by: "a flat mesh whose material has `mirror`, or `transmission` with `Medium::fresnel`",
        features: &[],
        before: |scene| {
            point_light(scene);
            let place = Transform::from_xyz(0.0, -1.1, 0.0);
            let floor = Mesh::from(shapes::plane(4.0, 4.0, 1, 1));
            scene.world.spawn((floor, Material::matt(Vec3::splat(0.2)), place));
        },
        add: |scene| {
            for (mesh, mut material) in
                scene.world.query::<(&Mesh, &mut Material)>().iter_mut(&mut scene.world)
            {
                material.mirror = if mesh.0.triangle_count() == 2 { Vec3::splat(0.7) } else { Vec3::ZERO };
            }
        },
    },
    Row {
        effect: "linear fog",
        called_for_by: "the scene's fog, by its mode",
        features: &["FOG", "FOG_LINEAR"],
        before: point_light,
        add: |scene| fog(scene, FogMode::Linear { start: 1.0, end: 9.0 }),
    },
    Row {
        effect: "exponential fog",
        called_for_by: "the same",
        features: &["FOG", "FOG_EXPONENTIAL"],
        before: point_light,
        add: |scene| fog(scene, FogMode::Exponential { density: 0.1 }),
    },
    Row {
        effect: "squared exponential fog",
        called_for_by: "the same",
        features: &["FOG", "FOG_EXPONENTIAL_SQUARED"],
        before: point_light,
        add: |scene| fog(scene, FogMode::ExponentialSquared { density: 0.1 }),
    },
    Row {
        effect: "depth cueing",
        called_for_by: "the same",
        features: &["FOG", "FOG_DEPTH_CUE"],
        before: point_light,
        add: |scene| {
            fog(scene, FogMode::DepthCue { start: 1.0, end: 9.0, near_weight: 1.0, far_weight: 0.2 });
        },
    },
    Row {
        effect: "tone curve and sRGB",
        called_for_by: "`Display::Srgb`, where no effect needs the linear frame",
        features: &["DISPLAY_SRGB", "ENCODE_SRGB"],
        before: |scene| {
            point_light(scene);
            scene.options.display = Display::Linear;
        },
        add: |scene| scene.options.display = Display::Srgb,
    },
    Row {
        effect: "OpenGL's clamp",
        called_for_by: "`Display::Clamp`",
        features: &["CLAMP", "DISPLAY_CLAMP"],
        before: |scene| {
            // Fog mixed in shows the difference between a colour above 1 and one clamped to 1.
            spawn(scene, Light::point(Vec3::splat(90.0)));
            fog(scene, FogMode::Exponential { density: 0.1 });
            scene.options.display = Display::Linear;
        },
        add: |scene| scene.options.display = Display::Clamp,
    },
    Row {
        effect: "OpenGL's clamp of vertices",
        called_for_by: "`Display::Clamp` under flat or Gouraud shading",
        features: &["CLAMP", "CLAMP_VERTICES", "DISPLAY_CLAMP"],
        before: |scene| {
            spawn(scene, Light::point(Vec3::splat(90.0)));
            scene.options.shading = Some(Shading::Gouraud);
            scene.options.display = Display::Linear;
        },
        add: |scene| scene.options.display = Display::Clamp,
    },
    Row {
        effect: "several samples per pixel",
        called_for_by: "`FrameOptions::multisample`",
        features: &["HALF_RANGE"],
        before: point_light,
        add: |scene| scene.options.multisample = Some(true),
    },
    Row {
        effect: "counts of lights",
        called_for_by: "`Measure::Lights`",
        features: &["COUNT_LIGHTS"],
        before: point_light,
        add: |scene| scene.options.measure = Measure::Lights,
    },
    Row {
        effect: "bloom (a program's own)",
        called_for_by: "a camera with `Bloom` of integrations/own_program",
        features: &["HALF_RANGE"],
        before: point_light,
        add: |scene| {
            scene.world.entity_mut(scene.camera).insert(Bloom { strength: 0.3, levels: 3 });
        },
    },
    Row {
        effect: "outline (a program's own)",
        called_for_by: "an object with `Outlined` of integrations/own_program",
        features: &[],
        before: point_light,
        add: |scene| {
            scene.world.entity_mut(scene.ball).insert(Outlined { color: Vec3::X });
        },
    },
];

/// Lines of the census that cause no work of their own in a frame, each with what it amounts to.
const NO_EFFECT: &[(&str, &str)] = &[
    ("meshes", "what is drawn at all"),
    ("shading by need", "one of the shadings above, chosen on the CPU"),
    ("own reflection models", "one of the models above"),
    ("global ambient", "a number of the frame's uniform"),
    ("sky", "the same, and the colour that the background is cleared to"),
    ("ambient lights", "summed into that number before the frame"),
    ("dynamic lights", "point, directional or spot lights"),
    ("mixed lights", "the same"),
    ("emission", "a number of the material"),
    ("textures", "one of the textures above"),
    ("back materials", "numbers of a two-sided material"),
    ("unlit", "leaves out"),
    ("fog", "one of its modes"),
    ("dynamic objects", "for the baker"),
    ("static objects", "for the baker"),
];

/// Features that have no scene here, each with the reason.
const NO_SCENE: &[(&str, &str)] = &[
    ("AMBIENT_LIGHTS", "never: ambient lights are summed before the frame"),
    ("LIT", "what an unlit material leaves out"),
    ("MATT", "leaves out highlights"),
    ("CONSTANT", "leaves out all but one colour of a surface"),
    ("DISPLAY", "that the display is folded in, with a tone curve, a clamp or neither"),
    ("VIEWPORT", "frames in a part of their target: `display`'s tests"),
    ("MULTISAMPLED", "depths of several samples behind glass: `refraction`'s tests"),
    ("SHEET", "panes: `refraction`'s tests"),
    ("BODY", "solid glass: `refraction`'s tests"),
    ("PICTURED", "flat glass that mirrors: `refraction`'s tests"),
    ("FRONT_FACES", "light through glass, pixel by pixel on software rasterizers: `refraction`'s tests"),
    ("G_BUFFER_DETAILS", "what the G-buffer holds of lightmaps and textures: `rendering_paths`' tests"),
    ("TABLES_IN_TEXTURES", "of the device: where a processor draws"),
    (
        "SUBGROUPS_OF_8",
        "of the device: a processor whose fragments load records for each other; see tests/shared_records.rs of lumbre_render",
    ),
    ("DECODE_SRGB", "targets that encode by themselves: `display`'s tests"),
];

fn each_light(scene: &mut Scene, change: impl Fn(&mut Light)) {
    scene.world.query::<&mut Light>().iter_mut(&mut scene.world).for_each(|mut light| change(&mut light));
}

/// What a frame consisted of.
struct Drawn {
    bytes: Vec<u8>,
    passes: Vec<String>,
    variants: Vec<String>,
    report: FrameReport,
    /// Median time of several frames, each of which was waited for.
    milliseconds: f64,
}

fn renderer() -> Renderer {
    Renderer::builder().with(OutlineEffect::new(2.0)).with(BloomEffect::default()).build(gpu())
}

fn draw(renderer: &mut Renderer, scene: &mut Scene) -> Drawn {
    let target = Offscreen::new(gpu(), SIZE, SIZE, scene.format).unwrap();
    let report = renderer.render(&mut scene.world, &target.target(), &scene.options).unwrap();
    let bytes = target.read_rgba8(gpu()).unwrap();
    let variants = renderer.drawn_variants().into_keys().collect();
    let passes = report.plan.running().map(str::to_owned).collect();
    let mut times: Vec<f64> = (0..TIMED)
        .map(|_| {
            let begun = Instant::now();
            renderer.render(&mut scene.world, &target.target(), &scene.options).unwrap();
            renderer.wait().unwrap();
            begun.elapsed().as_secs_f64() * 1e3
        })
        .collect();
    times.sort_by(f64::total_cmp);
    Drawn { bytes, passes, variants, report, milliseconds: times[TIMED / 2] }
}

/// Returns the WGSL of a variant, from the modules whose path satisfies `is_there`.
fn wgsl(variant: &str, is_there: impl Fn(&str) -> bool) -> String {
    let modules: Vec<_> = MODULES
        .iter()
        .filter(|(path, _)| is_there(path))
        .map(|(path, source)| (*path, (*source).into()))
        .collect();
    let features: Vec<_> = variant.split(' ').map(|feature| (feature, true)).collect();
    let program = Program {
        modules: &modules,
        root: if variant.split(' ').any(|word| word == "DEFERRED") { "deferred_lighting" } else { "forward" },
        features: &features,
        unnamed: UnnamedFeatures::AreOff,
        kept: Kept::EntryPoints,
    };
    match program.to_wgsl() {
        Ok(wgsl) => wgsl,
        Err(error) => panic!("{variant}: {error}"),
    }
}

/// Returns the declarations of a program as a set, because the compiler does not fix their order.
fn declarations(wgsl: &str) -> BTreeSet<&str> {
    wgsl.split("\n\n").map(str::trim).collect()
}

/// The contents of the shaders of some variants.
#[derive(Default)]
struct Contents {
    /// WESL modules from which anything in them comes.
    modules: BTreeSet<&'static str>,
    /// Group, binding and name of what is bound.
    bindings: BTreeSet<(u32, u32, String)>,
}

/// Returns the module that a name in WGSL comes from, with its name there. The compiler joins `package`, the path
/// and the name with underscores, and puts the number of its own underscores in front of each part.
fn origin(name: &str) -> Option<(&'static str, String)> {
    let escaped = |part: &str| match part.matches('_').count() {
        0 => part.to_owned(),
        underscores => format!("_{underscores}{part}"),
    };
    let found = MODULES.iter().find_map(|(path, _)| {
        let parts: Vec<String> = path.split('/').map(escaped).collect();
        let item = name.strip_prefix(&format!("package_{}_", parts.join("_")))?;
        Some((*path, item))
    });
    found.map(|(path, item)| {
        (path, item.trim_start_matches(|c: char| c == '_' || c.is_ascii_digit()).to_owned())
    })
}

fn contents(variants: &[String]) -> Contents {
    let mut contents = Contents::default();
    for variant in variants {
        let source = wgsl(variant, |_| true);
        let module = naga::front::wgsl::parse_str(&source).unwrap();
        // Types and constants too, which are not instructions but come from a module.
        let names = source.split(|letter: char| !(letter.is_ascii_alphanumeric() || letter == '_'));
        contents.modules.extend(names.filter_map(|name| Some(origin(name)?.0)));
        for (_, global) in module.global_variables.iter() {
            if let (Some(bound), Some(name)) = (&global.binding, &global.name) {
                let name = origin(name).map_or_else(|| name.clone(), |(_, item)| item);
                contents.bindings.insert((bound.group, bound.binding, name));
            }
        }
    }
    contents
}

fn words(variants: &[String]) -> BTreeSet<&str> {
    variants.iter().flat_map(|variant| variant.split(' ')).collect()
}

/// Compares both frames of a row and returns its line of the table.
fn line(row: &Row) -> String {
    let without = || {
        let mut scene = scene();
        (row.before)(&mut scene);
        scene
    };
    let mut with = without();
    (row.add)(&mut with);

    let plain = draw(&mut Renderer::new(gpu()), &mut without());
    let mut renderer = renderer();
    let effect = draw(&mut renderer, &mut with);
    // Lists of lights and deferred shading lead to the same picture in another way, and counting does not change
    // it.
    let same_picture = ["CLUSTERS", "COUNT_LIGHTS", "DEFERRED", "IN_COMPUTE"]
        .iter()
        .any(|feature| row.features.contains(feature));
    let shown = effect.bytes != plain.bytes || same_picture;
    assert!(shown, "{}: the scene does not show it", row.effect);
    // What remains of the effect in a renderer that has drawn it, and in one that has it but never drew it.
    let after = draw(&mut renderer, &mut without());
    let beside = draw(&mut self::renderer(), &mut without());
    for (what, other) in [("after it", &after), ("beside it", &beside)] {
        assert!(other.bytes == plain.bytes, "{}: other bits {what}", row.effect);
        assert_eq!(other.passes, plain.passes, "{}: other passes {what}", row.effect);
        assert_eq!(other.variants, plain.variants, "{}: other shaders {what}", row.effect);
    }
    // A renderer without the effects that have nothing to do here draws the same.
    let idle =
        BuiltIn::ALL.into_iter().filter(|effect| !plain.passes.iter().any(|pass| pass == effect.name()));
    let smaller = idle.fold(Renderer::builder(), |builder, effect| builder.without(effect));
    let smaller = draw(&mut smaller.build(gpu()), &mut without());
    assert!(smaller.bytes == plain.bytes, "{}: other bits in a renderer without what is idle", row.effect);
    assert_eq!((&smaller.passes, &smaller.variants), (&plain.passes, &plain.variants), "{}", row.effect);
    let uploads = |drawn: &Drawn| drawn.report.statistics.uploads;
    assert_eq!(uploads(&beside), uploads(&plain), "{}: something is uploaded for it", row.effect);

    for feature in row.features {
        assert!(words(&effect.variants).contains(feature), "{}: no {feature} with it", row.effect);
        assert!(!words(&plain.variants).contains(feature), "{}: {feature} without it", row.effect);
    }
    let (has, had) = (contents(&effect.variants), contents(&plain.variants));
    let modules = has.modules.difference(&had.modules).copied();
    // The root module of other variants has no path in names, and is imported where deferred shading is the root.
    let modules: Vec<_> = modules.filter(|module| *module != "forward").collect();
    // The frame is that of a renderer without these modules, as its shaders are textually the same.
    for variant in &plain.variants {
        let built_without = wgsl(variant, |path| !modules.contains(&path));
        let same = declarations(&built_without) == declarations(&wgsl(variant, |_| true));
        assert!(same, "{}: another shader without {modules:?}: {variant}", row.effect);
    }
    let passes: Vec<_> =
        effect.passes.iter().filter(|pass| !plain.passes.contains(pass)).map(String::as_str).collect();
    let bindings: Vec<_> = has.bindings.difference(&had.bindings).collect();
    let bindings: Vec<_> =
        bindings.iter().map(|(group, binding, name)| format!("{group}.{binding} {name}")).collect();
    let listed = |words: Vec<String>| if words.is_empty() { "–".to_owned() } else { words.join(", ") };
    let code = |words: Vec<&str>| words.into_iter().map(|word| format!("`{word}`")).collect::<Vec<_>>();
    let bytes = |drawn: &Drawn| uploads(drawn).total();
    format!(
        "| {} | {} | {} | {} | {} | {:+} | {:.2} | {:.2} |",
        row.effect,
        row.called_for_by,
        listed(code(passes)),
        listed(bindings),
        listed(code(modules)),
        bytes(&effect) as i64 - bytes(&plain) as i64,
        effect.milliseconds,
        // Drawn by a renderer with the same effects.
        beside.milliseconds,
    )
}

/// Returns the cells of a line that do not depend on the machine.
fn lasting(line: &str) -> Vec<&str> {
    line.trim_matches('|').split('|').map(str::trim).take(LASTING).collect()
}

#[test]
fn without_an_effect_there_is_nothing_of_it() {
    let lines: Vec<String> = ROWS.iter().map(line).collect();
    println!("{}", lines.join("\n"));
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/effects.md");
    let text = std::fs::read_to_string(&path).unwrap();
    let is_row = |line: &&str| line.starts_with("| ") && !line.starts_with("| effect |");
    if std::env::var_os("LUMBRE_WRITE_GOLDENS").is_some() {
        let (mut new, mut rows) = (String::new(), Some(lines.join("\n") + "\n"));
        for line in text.lines() {
            new += &if is_row(&line) { rows.take().unwrap_or_default() } else { line.to_owned() + "\n" };
            if line.starts_with("|---") && !text.lines().any(|line| is_row(&line)) {
                new += &rows.take().unwrap_or_default();
            }
        }
        std::fs::write(&path, new).unwrap();
        return;
    }
    let documented: Vec<_> = text.lines().filter(is_row).map(lasting).collect();
    let found: Vec<_> = lines.iter().map(|line| lasting(line)).collect();
    assert_eq!(documented, found, "docs/effects.md; LUMBRE_WRITE_GOLDENS=1 writes it anew");
}

#[test]
fn the_table_has_every_effect_and_every_feature() {
    let rows: BTreeSet<&str> = ROWS.iter().map(|row| row.effect).collect();
    assert_eq!(rows.len(), ROWS.len(), "each effect once");
    for line in Census::of(&mut World::new()).lines() {
        let excused = NO_EFFECT.iter().any(|(effect, _)| *effect == line.effect);
        assert!(rows.contains(line.effect) != excused, "{} has no scene here, or two places", line.effect);
    }
    // All features that any shader tests.
    let mut asked = BTreeSet::new();
    for (_, source) in MODULES {
        for condition in source.split("@if").skip(1) {
            let (mut depth, mut end) = (0, 0);
            for (index, letter) in condition.char_indices() {
                depth += i32::from(letter == '(') - i32::from(letter == ')');
                if depth == 0 {
                    end = index;
                    break;
                }
            }
            let words =
                condition[..end].split(|letter: char| !(letter.is_ascii_alphanumeric() || letter == '_'));
            asked.extend(words.filter(|word| !word.is_empty()));
        }
    }
    assert!(asked.len() > 40, "only {} features were read: {asked:?}", asked.len());
    let covered: BTreeSet<&str> = ROWS.iter().flat_map(|row| row.features).copied().collect();
    for feature in asked {
        let excused = NO_SCENE.iter().any(|(other, _)| *other == feature);
        assert!(covered.contains(feature) != excused, "{feature} has no scene here, or two places");
    }
}

#[test]
fn names_tell_where_they_come_from() {
    let variant = [
        "LIT",
        "LIGHTS",
        "DYNAMIC_LIGHTS",
        "POINT_LIGHTS",
        "FOG",
        "FOG_LINEAR",
        "SHADING_PHONG",
        "REFLECTION_PHONG",
    ];
    let contents = contents(&[variant.join(" ")]);
    for module in ["frame", "lighting", "optics/fog", "optics/evaluate_light", "optics/two_sided"] {
        assert!(contents.modules.contains(module), "{module} in {:?}", contents.modules);
    }
    assert!(!contents.modules.contains("lightmap") && !contents.modules.contains("shadows"));
    assert!(contents.bindings.contains(&(0, 5, "light_list".to_owned())), "{:?}", contents.bindings);
}
