//! On random worlds the passes and shader variants that `explain` predicts without a device are those that a frame
//! draws, and an effect that it reports as not called for is in no shader.

use std::sync::Arc;

use bevy_ecs::prelude::*;
use glam::{UVec3, Vec2, Vec3, Vec4};
use lumbre_mesh::shapes;
use lumbre_optics::{
    AlphaMode, Attenuation, BakeMode, Distribution, Fog, FogMode, Light, Material, ReflectionModel, Shading,
    SpotCone, Surface,
};
use lumbre_render::{Display, FrameOptions, Offscreen, OffscreenFormat, Renderer, RenderingPath};
use lumbre_scene::{
    AmbientCube, Camera, Census, ChildOf, DynamicObject, EmissiveLight, Hidden, IrradianceVolume, Lightmap,
    LightmapEncoding, LightmapImage, MaterialTextures, Mesh, NormalTexture, OcclusionTexture, SceneSettings,
    StaticObject, Transform,
};
use lumbre_tests::panes::{image, sharp};

use crate::adapter::gpu;

/// A pseudo-random generator that gives the same numbers in every run.
struct Random(u64);

impl Random {
    fn below(&mut self, end: u64) -> u64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) % end
    }

    fn once_in(&mut self, count: u64) -> bool {
        self.below(count) == 0
    }

    fn one_of<T: Copy>(&mut self, choices: &[T]) -> T {
        choices[self.below(choices.len() as u64) as usize]
    }
}

fn random_light(random: &mut Random) -> Light {
    let color = Vec3::splat(3.0);
    let light = match random.below(4) {
        0 => Light::directional(color),
        1 => Light::spot(color, SpotCone::Smooth { inner: 0.2, outer: 0.6 }),
        2 => Light {
            kind: lumbre_optics::LightKind::Ambient,
            ambient: Vec3::splat(0.1),
            ..Light::point(Vec3::ZERO)
        },
        _ => Light::point(color),
    };
    let range = if random.once_in(2) { 20.0 } else { f32::INFINITY };
    Light {
        attenuation: Attenuation { range, ..Attenuation::INVERSE_SQUARE },
        bake: random.one_of(&[BakeMode::Dynamic, BakeMode::Mixed, BakeMode::Static]),
        enabled: !random.once_in(5),
        shadow: random.once_in(3),
        radius: if random.once_in(2) { 0.1 } else { 0.0 },
        ..light
    }
}

fn random_material(random: &mut Random) -> Material {
    let specular = if random.once_in(2) { Vec3::splat(0.3) } else { Vec3::ZERO };
    let emission = if random.once_in(4) { Vec3::splat(2.0) } else { Vec3::ZERO };
    let front = Surface {
        specular,
        emission,
        shininess: random.one_of(&[8.0, 90.0, 5000.0]),
        ..Material::matt(Vec3::ONE).front
    };
    Material {
        front,
        alpha: 0.7,
        alpha_mode: random.one_of(&[
            AlphaMode::Opaque,
            AlphaMode::Opaque,
            AlphaMode::Opaque,
            AlphaMode::Mask { cutoff: 0.5 },
            AlphaMode::Blend,
        ]),
        transmission: if random.once_in(6) { Vec3::splat(0.5) } else { Vec3::ZERO },
        double_sided: random.once_in(3),
        unlit: random.once_in(6),
        distribution: random.one_of(&[Distribution::default(), Distribution::Gaussian]),
        ..Material::default()
    }
}

fn random_textures(random: &mut Random) -> MaterialTextures {
    let texture = || sharp(&image(2, &[[200, 128, 255, 255]; 4]));
    MaterialTextures {
        base_color: random.once_in(2).then(texture),
        emissive: random.once_in(3).then(texture),
        normal: random.once_in(2).then(|| NormalTexture { texture: texture(), scale: 1.0 }),
        occlusion: random.once_in(3).then(|| OcclusionTexture { texture: texture(), strength: 1.0 }),
        metallic_roughness: None,
    }
}

/// A few visible balls with random components.
fn random_world(random: &mut Random) -> World {
    let mut world = World::new();
    let lightmap = Arc::new(LightmapImage {
        name: "map".to_owned(),
        width: 2,
        height: 2,
        texels: vec![Vec3::ONE; 4],
        encoding: LightmapEncoding::default(),
    });
    for number in 0..1 + random.below(6) {
        let mut ball = shapes::uv_sphere(0.3, 8, 4);
        ball.uv1 = vec![Vec2::splat(0.5); ball.positions.len()];
        if random.once_in(4) {
            ball.colors = vec![Vec4::ONE; ball.positions.len()];
        }
        let place = Transform::from_xyz(number as f64 * 0.5 - 1.5, 0.0, 0.0);
        let entity = world.spawn((Mesh(Arc::new(ball)), random_material(random), place)).id();
        let mut entity = world.entity_mut(entity);
        if random.once_in(3) {
            entity.insert(random_textures(random));
        }
        if random.once_in(3) {
            entity.insert(Lightmap { image: Arc::clone(&lightmap) });
        }
        if random.once_in(3) {
            entity.insert(random.one_of(Shading::ALL));
        }
        if random.once_in(4) {
            entity.insert(random.one_of(ReflectionModel::ALL));
        }
        if random.once_in(4) {
            entity.insert(EmissiveLight);
        }
        if random.once_in(8) {
            entity.insert(Hidden);
        }
    }
    for number in 0..random.below(7) {
        world.spawn((random_light(random), Transform::from_xyz(number as f64 - 3.0, 2.0, 3.0)));
    }
    if random.once_in(3) {
        let cubes = vec![AmbientCube([Vec3::splat(0.3); 6]); random.one_of(&[1, 2])];
        // Two cubes for one cell are invalid.
        world.spawn((
            IrradianceVolume { resolution: UVec3::ONE, cubes, inside: Vec::new() },
            Transform::IDENTITY,
        ));
    }
    world.spawn((Camera::default(), Transform::from_xyz(0.0, 0.0, 6.0)));
    let fog = Fog { mode: FogMode::Exponential { density: 0.1 }, color: Vec3::splat(0.3) };
    world.insert_resource(SceneSettings {
        shading: random.one_of(Shading::ALL),
        reflection: random.one_of(ReflectionModel::ALL),
        two_sided: random.once_in(2),
        local_viewer: !random.once_in(4),
        fog: random.once_in(3).then_some(fog),
        specular_antialiasing: random.once_in(3),
        ..SceneSettings::default()
    });
    world
}

#[test]
fn what_is_explained_is_what_is_drawn() {
    let mut random = Random(11);
    let mut renderer = Renderer::new(gpu());
    let target = Offscreen::new(gpu(), 48, 32, OffscreenFormat::Rgba8).unwrap();
    let (mut passes_seen, mut variants_seen) =
        (std::collections::BTreeSet::new(), std::collections::BTreeSet::new());
    let mut called_for = std::collections::BTreeMap::new();
    for number in 0..40 {
        let mut world = random_world(&mut random);
        let options = FrameOptions {
            lightmaps: !random.once_in(4),
            irradiance_volumes: !random.once_in(4),
            shadows: !random.once_in(4),
            multisample: random.once_in(8).then_some(true),
            full_precision: random.once_in(8),
            display: random.one_of(Display::ALL),
            shading: random.once_in(6).then_some(Shading::Gouraud),
            rendering_path: RenderingPath::ALL[number % 3],
            ..FrameOptions::default()
        };
        let report = renderer.render(&mut world, &target.target(), &options).unwrap();
        assert_eq!(report.statistics.objects_outside, 0, "all is in view");
        let explained = renderer.explain(&mut world, &options, 48, 32).unwrap();
        let named: Vec<&str> = explained
            .frame
            .passes
            .iter()
            .filter(|pass| pass.group.is_some())
            .map(|pass| pass.name.as_str())
            .collect();
        let drawn: Vec<&str> = report.plan.running().collect();
        assert_eq!(named, drawn, "passes of World {number}");
        assert_eq!(explained.variants, renderer.drawn_variants(), "variants of World {number}");
        assert_eq!(explained.census, *report.census, "census of World {number}");
        assert_eq!(Census::of(&mut world), *report.census, "census of World {number}");

        let has = |feature: &str| {
            explained.variants.keys().any(|variant| variant.split(' ').any(|word| word == feature))
        };
        for line in explained.census.lines() {
            // The feature of an effect, and whether every object with the effect has it, or lights or options may
            // make it unused.
            let (feature, always) = match line.effect {
                "fog" => ("FOG", true),
                "vertex colours" => ("VERTEX_COLOR", true),
                "base colour textures" => ("BASE_COLOR_TEXTURE", true),
                "emissive textures" => ("EMISSIVE_TEXTURE", true),
                "alpha mask" => ("ALPHA_MASK", true),
                "lightmaps" => ("LIGHTMAP", false),
                "irradiance volumes" => ("IRRADIANCE_VOLUME", false),
                "two-sided" => ("TWO_SIDED", false),
                "normal textures" => ("NORMAL_TEXTURE", false),
                "occlusion textures" => ("OCCLUSION_TEXTURE", false),
                "spot lights" => ("SPOT_LIGHTS", false),
                "polygon lights" => ("POLYGON_LIGHTS", false),
                "shadows" => ("SHADOWS", false),
                _ => continue,
            };
            *called_for.entry(line.effect).or_insert(0) += usize::from(has(feature));
            let shown = line.called_for && explained.census.meshes > 0;
            assert!(
                !has(feature) || line.called_for,
                "World {number} draws {feature} without {}",
                line.effect
            );
            assert!(!always || has(feature) || !shown, "World {number} has {} and draws none", line.effect);
        }
        passes_seen.extend(drawn.into_iter().map(str::to_owned));
        variants_seen.extend(explained.variants.into_keys());
    }
    // Checks that the worlds were sufficiently different.
    assert!(passes_seen.len() >= 5, "{passes_seen:?}");
    assert!(variants_seen.len() > 50, "{} variants", variants_seen.len());
    assert!(called_for.values().all(|count| *count > 0), "{called_for:?}");
}

/// Changes a component of some object or light, or its place in the hierarchy.
fn change(random: &mut Random, world: &mut World) {
    let objects: Vec<Entity> = world.query_filtered::<Entity, With<Mesh>>().iter(world).collect();
    let lights: Vec<Entity> = world.query_filtered::<Entity, With<Light>>().iter(world).collect();
    let (Some(object), other) = (pick(random, &objects), pick(random, &objects)) else { return };
    let light = pick(random, &lights);
    let mut entity = world.entity_mut(object);
    match (random.below(13), light) {
        (0, _) => {
            entity.insert(random_material(random));
        }
        (1, _) => {
            entity.insert(Hidden);
        }
        (2, _) => {
            entity.remove::<Hidden>();
        }
        (3, _) => {
            entity.insert(random.one_of(Shading::ALL));
        }
        (4, _) => {
            entity.remove::<(Shading, ReflectionModel, MaterialTextures)>();
        }
        (5, _) => {
            entity.insert(random_textures(random));
        }
        (6, _) => {
            entity.remove::<Lightmap>();
        }
        (7, _) => {
            entity.insert(Mesh(Arc::new(shapes::uv_sphere(0.2, 6, 3))));
        }
        (8, _) => {
            entity.insert((StaticObject, EmissiveLight));
        }
        (9, _) => {
            entity.insert(DynamicObject);
        }
        (10, Some(light)) => {
            world.entity_mut(light).insert(random_light(random));
        }
        (11, _) if objects.len() > 1 => entity.despawn(),
        // Makes it a child of an object that may be hidden.
        (_, _) if other.is_some_and(|other| other > object) => {
            entity.insert(ChildOf(other.unwrap_or(object)));
        }
        _ => world.resource_mut::<SceneSettings>().two_sided ^= true,
    }
}

fn pick(random: &mut Random, entities: &[Entity]) -> Option<Entity> {
    (!entities.is_empty()).then(|| random.one_of(entities))
}

#[test]
fn the_census_follows_every_change() {
    let mut random = Random(5);
    let mut renderer = Renderer::new(gpu());
    let target = Offscreen::new(gpu(), 16, 16, OffscreenFormat::Rgba8).unwrap();
    let mut different = std::collections::HashSet::new();
    for _ in 0..6 {
        let mut world = random_world(&mut random);
        for step in 0..25 {
            let report = renderer.render(&mut world, &target.target(), &FrameOptions::default()).unwrap();
            assert_eq!(Census::of(&mut world), *report.census, "after {step} changes");
            different.insert(format!("{:?}", report.census));
            change(&mut random, &mut world);
        }
    }
    assert!(different.len() > 60, "{} different ones", different.len());
}

#[test]
fn what_hangs_from_something_hidden_is_not_drawn() {
    let mut world = World::new();
    let ball = || (Mesh(Arc::new(shapes::uv_sphere(0.3, 8, 4))), Transform::IDENTITY);
    let group = world.spawn(Transform::IDENTITY).id();
    let below = world.spawn((Transform::IDENTITY, ChildOf(group))).id();
    world.spawn((ball(), ChildOf(below)));
    world.spawn((ball(), EmissiveLight, Material::emissive(Vec3::ONE), ChildOf(group)));
    world.spawn((Camera::default(), Transform::from_xyz(0.0, 0.0, 6.0)));
    let mut renderer = Renderer::new(gpu());
    let target = Offscreen::new(gpu(), 16, 16, OffscreenFormat::Rgba8).unwrap();
    let mut counts = |world: &mut World| {
        let report = renderer.render(world, &target.target(), &FrameOptions::default()).unwrap();
        (report.statistics.objects, report.statistics.lights > 0)
    };
    assert_eq!(counts(&mut world), (2, true));
    world.entity_mut(group).insert(Hidden);
    assert_eq!(counts(&mut world), (0, false));
    world.entity_mut(group).remove::<Hidden>();
    world.entity_mut(below).insert(Hidden);
    assert_eq!(counts(&mut world), (1, true));
}
