//! The content hash is equal for equal scenes and differs for every change that may change a texel.

#![allow(clippy::unwrap_used, reason = "helpers of tests, which clippy does not count as tests")]

use std::sync::Arc;
use std::time::Duration;

use bevy_ecs::prelude::*;
use glam::Vec3;
use lumbre_bake::{
    Bake, BakeOptions, ContentHash, Density, FormFactorMethod, Probes, Quality, Solver, content_hash,
};
use lumbre_optics::{AlphaMode, BakeMode, Light, LightKind, Lobe, Material, SpotCone, Surface};
use lumbre_scene::{
    Camera, DynamicObject, EmissiveLight, Hidden, Image, LightmapScale, MaterialTextures, Mesh,
    MetallicRoughnessTexture, Name, TextureReference, Transform, Wrap,
};

use crate::corner::corner;

fn hash(change: impl FnOnce(&mut World)) -> ContentHash {
    let mut world = corner();
    change(&mut world);
    content_hash(&mut world, &BakeOptions::default()).unwrap()
}

fn object(world: &mut World, name: &str) -> Entity {
    let mut named = world.query::<(Entity, &Name)>();
    named.iter(world).find(|(_, found)| found.as_str() == name).unwrap().0
}

fn material(world: &mut World, change: impl FnOnce(&mut Material)) {
    let floor = object(world, "floor");
    change(&mut world.get_mut::<Material>(floor).unwrap());
}

fn light(world: &mut World, change: impl FnOnce(&mut Light)) {
    let mut lights = world.query::<&mut Light>();
    change(&mut lights.single_mut(world).unwrap());
}

fn mesh(world: &mut World, change: impl FnOnce(&mut lumbre_mesh::TriangleMesh)) {
    let floor = object(world, "floor");
    let mut mesh = world.get_mut::<Mesh>(floor).unwrap();
    change(Arc::make_mut(&mut mesh.0));
}

/// Adds a dynamic object at the floor's edge, which the grid of probes has to enclose.
fn add_dynamic_ball(world: &mut World, at: f64) {
    let ball = Arc::new(lumbre_mesh::shapes::uv_sphere(0.3, 8, 4));
    let place = Transform::from_xyz(at, 0.5, 2.5);
    world.spawn((Mesh(ball), Material::default(), DynamicObject, place));
}

/// The hash of the scene with a textured floor, after a change of its textures.
fn textured(change: impl FnOnce(&mut MaterialTextures)) -> ContentHash {
    textured_with(Lobe::Bare, change)
}

/// The same with this lobe.
fn textured_with(lobe: Lobe, change: impl FnOnce(&mut MaterialTextures)) -> ContentHash {
    hash(|world| {
        material(world, |material| material.lobe = lobe);
        let image = Image { name: "tiles".into(), width: 2, height: 1, rgba: vec![9; 8] };
        let reference = TextureReference::new(Arc::new(image));
        let of_metal = MetallicRoughnessTexture {
            texture: reference.clone(),
            base_color: Vec3::ONE,
            metallic: 0.5,
            roughness: 0.5,
            dielectric: Vec3::splat(0.04),
        };
        let mut textures = MaterialTextures {
            base_color: Some(reference.clone()),
            emissive: Some(reference),
            metallic_roughness: Some(of_metal),
            ..MaterialTextures::default()
        };
        change(&mut textures);
        let floor = object(world, "floor");
        world.entity_mut(floor).insert(textures);
    })
}

#[test]
fn everything_of_a_texture_that_is_read_changes_the_hash() {
    type Change = fn(&mut TextureReference);
    let changes: &[(&str, Change)] = &[
        ("pixel", |t| Arc::make_mut(&mut t.image).rgba[5] ^= 1),
        ("shape", |t| {
            let image = Arc::make_mut(&mut t.image);
            (image.width, image.height) = (1, 2);
        }),
        ("wrap u", |t| t.sampler.wrap_u = Wrap::ClampToEdge),
        ("wrap v", |t| t.sampler.wrap_v = Wrap::ClampToEdge),
        ("set", |t| t.tex_coord = 1),
        ("offset", |t| t.offset.y += 1e-6),
        ("rotation", |t| t.rotation += 1e-6),
        ("scale u", |t| t.scale.x += 1e-6),
        ("scale v", |t| t.scale.y += 1e-3),
    ];
    let mut hashes = vec![("none of it", textured(|_| {})), ("no texture", hash(|_| {}))];
    let mut add = |what, changed| {
        for (other, known) in &hashes {
            assert_ne!(changed, *known, "{what} and {other}");
        }
        hashes.push((what, changed));
    };
    for (what, change) in changes {
        add(what, textured(|textures| change(textures.base_color.as_mut().unwrap())));
        add(what, textured(|textures| change(textures.emissive.as_mut().unwrap())));
        add(what, textured(|textures| change(&mut textures.metallic_roughness.as_mut().unwrap().texture)));
    }
    add("factor", textured(|t| t.metallic_roughness.as_mut().unwrap().base_color.x = 0.5));
    add("metallic", textured(|t| t.metallic_roughness.as_mut().unwrap().metallic = 0.6));
    add("no base colour", textured(|t| t.base_color = None));
    add("no emission", textured(|t| t.emissive = None));
    add("no metal", textured(|t| t.metallic_roughness = None));
    let roughness = textured(|t| t.metallic_roughness.as_mut().unwrap().roughness = 0.9);
    assert_eq!(roughness, textured(|_| {}), "bare highlights are not baked");
}

#[test]
fn what_stands_for_the_highlight_of_a_metal_changes_the_hash() {
    let look = |base: Vec3, metallic: f32, roughness: f32| {
        let mut look = Material::from_metallic_roughness(base, metallic, roughness);
        // Compared by its highlight alone.
        look.front.diffuse = Vec3::splat(0.1);
        hash(|world| material(world, |material| *material = look))
    };
    let metal = look(Vec3::splat(0.9), 1.0, 0.6);
    assert_ne!(metal, look(Vec3::splat(0.9), 1.0, 0.7));
    assert_ne!(metal, look(Vec3::splat(0.8), 1.0, 0.6));
    assert_eq!(look(Vec3::splat(0.9), 0.0, 0.6), look(Vec3::splat(0.2), 0.0, 0.9), "plastics have none");
    let by_texture = |roughness: f32, lobe: Lobe| {
        textured_with(lobe, |textures| textures.metallic_roughness.as_mut().unwrap().roughness = roughness)
    };
    let energy_conserving = by_texture(0.5, Lobe::EnergyConserving);
    assert_ne!(energy_conserving, by_texture(0.6, Lobe::EnergyConserving));
    assert_ne!(energy_conserving, by_texture(0.5, Lobe::Bare));
}

#[test]
fn dynamic_objects_matter_only_if_probes_are_baked() {
    let never = BakeOptions { probes: Probes::Never, ..BakeOptions::default() };
    let mut still = corner();
    let mut moved = corner();
    add_dynamic_ball(&mut moved, 0.0);
    let hash = |world: &mut World| content_hash(world, &never).unwrap();
    assert_eq!(hash(&mut still), hash(&mut moved));
    let lamp = object(&mut moved, "lamp");
    moved.entity_mut(lamp).insert(EmissiveLight);
    assert_eq!(hash(&mut still), hash(&mut moved));
    // A copy of the ball in the same place does not change the grid of probes.
    let automatic = BakeOptions::default();
    let one = content_hash(&mut moved, &automatic).unwrap();
    add_dynamic_ball(&mut moved, 0.0);
    assert_eq!(one, content_hash(&mut moved, &automatic).unwrap());
}

#[test]
fn the_same_scene_has_the_same_hash_whatever_else_is_in_the_world() {
    let plain = hash(|_| {});
    assert_eq!(plain, hash(|_| {}));
    assert_eq!(plain.to_string().len(), 64);
    assert_eq!(
        plain,
        hash(|world| {
            world.spawn((Camera::default(), Transform::from_xyz(0.0, 1.0, 5.0)));
            let ball = Arc::new(lumbre_mesh::shapes::uv_sphere(0.3, 8, 4));
            world.spawn((Mesh(Arc::clone(&ball)), Material::default(), DynamicObject, Hidden));
            world.spawn((Mesh(ball), Material::default(), lumbre_scene::StaticObject, Hidden));
            world.spawn(Light::point(Vec3::ONE));
        }),
        "cameras, hidden objects and dynamic lights are not baked"
    );
    assert_eq!(
        plain,
        hash(|world| material(world, |m| m.front.specular = Vec3::ONE)),
        "highlights are not baked"
    );
    let (mut world, default) = (corner(), BakeOptions::default());
    for same in [
        BakeOptions { threads: Some(1), ..default },
        BakeOptions { time: Some(Duration::from_secs(1)), ..default },
    ] {
        assert_eq!(content_hash(&mut world, &same).unwrap(), plain, "{same:?}");
    }
}

#[test]
fn everything_that_may_change_a_texel_changes_the_hash() {
    type Change = fn(&mut World);
    let changes: &[(&str, Change)] = &[
        ("position", |world| mesh(world, |mesh| mesh.positions[3].x += 1e-6)),
        ("normal", |world| mesh(world, |mesh| mesh.normals[3].x += 1e-6)),
        ("winding", |world| mesh(world, |mesh| mesh.indices.swap(0, 1))),
        ("uv1", |world| mesh(world, |mesh| mesh.uv1 = vec![glam::Vec2::ZERO; mesh.positions.len()])),
        ("color", |world| mesh(world, |mesh| mesh.colors = vec![glam::Vec4::ONE; mesh.positions.len()])),
        ("reflectance", |world| material(world, |m| m.front.diffuse.y += 1e-6)),
        ("emission", |world| material(world, |m| m.front.emission.y += 1e-6)),
        ("back", |world| material(world, |m| m.back = Some(m.front))),
        ("mask", |world| material(world, |m| m.alpha_mode = AlphaMode::Mask { cutoff: 0.5 })),
        ("double-sided", |world| material(world, |m| m.double_sided = !m.double_sided)),
        ("unlit", |world| material(world, |m| m.unlit = true)),
        ("light's colour", |world| light(world, |l| l.diffuse.z += 1e-6)),
        ("light's attenuation", |world| light(world, |l| l.attenuation.quadratic += 1e-6)),
        ("light's constant attenuation", |world| light(world, |l| l.attenuation.constant += 1e-6)),
        ("light's linear attenuation", |world| light(world, |l| l.attenuation.linear += 1e-6)),
        ("light's clamp", |world| light(world, |l| l.attenuation.clamp = !l.attenuation.clamp)),
        ("light's range", |world| light(world, |l| l.attenuation.range = 7.0)),
        ("light's radius", |world| light(world, |l| l.radius = 0.1)),
        ("light's angle", |world| light(world, |l| l.angle = 0.1)),
        ("light's kind", |world| light(world, |l| l.kind = LightKind::Directional)),
        ("spot", |world| light(world, |l| l.spot = Some(SpotCone::Exponent { cutoff: 1.0, exponent: 2.0 }))),
        ("cutoff", |world| {
            light(world, |l| l.spot = Some(SpotCone::Exponent { cutoff: 0.9, exponent: 2.0 }))
        }),
        ("exponent", |world| {
            light(world, |l| l.spot = Some(SpotCone::Exponent { cutoff: 1.0, exponent: 3.0 }))
        }),
        ("smooth spot", |world| light(world, |l| l.spot = Some(SpotCone::Smooth { inner: 1.0, outer: 2.0 }))),
        ("light's place", |world| {
            let mut lights = world.query_filtered::<&mut Transform, With<Light>>();
            lights.single_mut(world).unwrap().translation.y += 1e-9;
        }),
        ("sky", |world| {
            let mut settings = lumbre_scene::SceneSettings::default();
            settings.sky.z = 1e-6;
            world.insert_resource(settings);
        }),
        ("name", |world| {
            let floor = object(world, "floor");
            world.entity_mut(floor).insert(Name::new("ground"));
        }),
        ("alpha", |world| {
            material(world, |m| (m.alpha, m.alpha_mode) = (0.5, AlphaMode::Mask { cutoff: 0.5 }))
        }),
        ("cutoff of a mask", |world| material(world, |m| m.alpha_mode = AlphaMode::Mask { cutoff: 0.4 })),
        ("blend", |world| material(world, |m| m.alpha_mode = AlphaMode::Blend)),
        ("back's emission", |world| {
            material(world, |m| m.back = Some(Surface { emission: Vec3::ONE, ..m.front }));
        }),
        ("uv0", |world| mesh(world, |mesh| mesh.uv0[3].x += 1e-6)),
        ("scaled", |world| {
            let crate_ = object(world, "box");
            world.get_mut::<Transform>(crate_).unwrap().scale.y *= 1.0 + 1e-9;
        }),
        ("gone", |world| {
            let crate_ = object(world, "box");
            world.despawn(crate_);
        }),
        ("scale", |world| {
            let crate_ = object(world, "box");
            world.entity_mut(crate_).insert(LightmapScale(2.0));
        }),
        ("something moves", |world| add_dynamic_ball(world, 0.0)),
        ("it moves elsewhere", |world| add_dynamic_ball(world, 1e-9)),
        ("and a face shines in real time", |world| {
            add_dynamic_ball(world, 0.0);
            let lamp = object(world, "lamp");
            world.entity_mut(lamp).insert(EmissiveLight);
        }),
        ("light's baking", |world| light(world, |l| l.bake = BakeMode::Mixed)),
        ("light off", |world| light(world, |l| l.enabled = false)),
        ("moved", |world| {
            let crate_ = object(world, "box");
            world.get_mut::<Transform>(crate_).unwrap().translation.x += 1e-9;
        }),
        ("dynamic now", |world| {
            let crate_ = object(world, "box");
            world.entity_mut(crate_).insert(DynamicObject);
        }),
    ];
    let mut hashes = vec![("nothing", hash(|_| {}))];
    for (what, change) in changes {
        let changed = hash(change);
        for (other, known) in &hashes {
            assert_ne!(changed, *known, "{what} and {other}");
        }
        hashes.push((what, changed));
    }
    // Hiding an object has the same effect as removing it.
    let hidden = hash(|world| {
        let crate_ = object(world, "box");
        world.entity_mut(crate_).insert(Hidden);
    });
    assert!(hashes.contains(&("gone", hidden)));
    // The pattern names every field, so that a new option does not compile until it is added here and to the list
    // below.
    let default = BakeOptions::default();
    let BakeOptions {
        density: _,
        atlas_size: _,
        error: _,
        time: _,
        quality: _,
        gap: _,
        seed: _,
        threads: _,
        solver: _,
        denoise: _,
        seams: _,
        probes: _,
        probe_spacing: _,
        memory: _,
        form_factors: _,
        resolution_error: _,
        separate_light: _,
        patch_texels: _,
    } = default;
    let options = [
        ("density", BakeOptions { density: Density::MapSize(64), ..default }),
        ("map size", BakeOptions { density: Density::MapSize(65), ..default }),
        ("texels", BakeOptions { density: Density::TexelsPerMeter(64.0), ..default }),
        ("error", BakeOptions { error: 0.02, ..default }),
        ("quality", BakeOptions { quality: Quality::Draft, ..default }),
        ("gap", BakeOptions { gap: 4, ..default }),
        ("seed", BakeOptions { seed: 1, ..default }),
        ("form factors", BakeOptions { form_factors: FormFactorMethod::GlobalLines, ..default }),
        ("separate light", BakeOptions { separate_light: true, ..default }),
        ("resolution error", BakeOptions { resolution_error: false, ..default }),
        ("solver", BakeOptions { solver: Solver::Jacobi, ..default }),
        ("denoise", BakeOptions { denoise: false, ..default }),
        ("atlas", BakeOptions { atlas_size: Some(256), ..default }),
        ("seams", BakeOptions { seams: false, ..default }),
        ("probes", BakeOptions { probes: Probes::Always, ..default }),
        ("no probes", BakeOptions { probes: Probes::Never, probe_spacing: Some(0.5), ..default }),
        ("probe spacing", BakeOptions { probe_spacing: Some(0.5), ..default }),
        ("patches", BakeOptions { patch_texels: Some(8.0), ..default }),
        ("memory", BakeOptions { memory: Some(1 << 30), ..default }),
    ];
    for (what, options) in options {
        let changed = content_hash(&mut corner(), &options).unwrap();
        for (other, known) in &hashes {
            assert_ne!(changed, *known, "{what} and {other}");
        }
        hashes.push((what, changed));
    }
}

#[test]
fn the_report_names_the_hash() {
    let options =
        BakeOptions { density: Density::MapSize(16), quality: Quality::Draft, ..BakeOptions::default() };
    let mut world = corner();
    let expected = content_hash(&mut world, &options).unwrap().to_string();
    let report = Bake::new(&options).run(&mut world).unwrap();
    assert_eq!(report.content_hash, expected);
}
