//! The content hash: equal for equal scenes, other for everything that may change a texel.

#![allow(clippy::unwrap_used, reason = "helpers of tests, which clippy does not count as tests")]

use std::ops::ControlFlow;
use std::sync::Arc;
use std::time::Duration;

use bevy_ecs::prelude::*;
use glam::Vec3;
use lumbre_bake::{BakeOptions, ContentHash, Density, FormFactorMethod, Quality, Solver, bake, content_hash};
use lumbre_optics::{AlphaMode, BakeMode, Light, Material};
use lumbre_scene::{Camera, DynamicObject, Hidden, Mesh, Name, Transform};

#[path = "common/corner.rs"]
mod corner;

use corner::corner;

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
            world.spawn((Mesh(Arc::clone(&ball)), Material::default(), DynamicObject));
            world.spawn((Mesh(ball), Material::default(), lumbre_scene::StaticObject, Hidden));
            world.spawn(Light::point(Vec3::ONE));
        }),
        "cameras, dynamic and hidden objects and dynamic lights are not baked"
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
        ("back", |world| material(world, |m| m.back = Some(m.front.clone()))),
        ("mask", |world| material(world, |m| m.alpha_mode = AlphaMode::Mask { cutoff: 0.5 })),
        ("double-sided", |world| material(world, |m| m.double_sided = !m.double_sided)),
        ("unlit", |world| material(world, |m| m.unlit = true)),
        ("light's colour", |world| light(world, |l| l.diffuse.z += 1e-6)),
        ("light's attenuation", |world| light(world, |l| l.attenuation.quadratic += 1e-6)),
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
    let mut seen = vec![("nothing", hash(|_| {}))];
    for (what, change) in changes {
        let changed = hash(change);
        for (other, known) in &seen {
            assert_ne!(changed, *known, "{what} and {other}");
        }
        seen.push((what, changed));
    }
    let default = BakeOptions::default();
    let options = [
        ("density", BakeOptions { density: Density::MapSize(64), ..default }),
        ("map size", BakeOptions { density: Density::MapSize(65), ..default }),
        ("texels", BakeOptions { density: Density::TexelsPerMeter(64.0), ..default }),
        ("error", BakeOptions { error: 0.02, ..default }),
        ("quality", BakeOptions { quality: Quality::Draft, ..default }),
        ("gap", BakeOptions { gap: 4, ..default }),
        ("seed", BakeOptions { seed: 1, ..default }),
        ("form factors", BakeOptions { form_factors: FormFactorMethod::GlobalLines, ..default }),
        ("resolution error", BakeOptions { resolution_error: false, ..default }),
        ("solver", BakeOptions { solver: Solver::Jacobi, ..default }),
        ("denoise", BakeOptions { denoise: false, ..default }),
        ("memory", BakeOptions { memory: Some(1 << 30), ..default }),
    ];
    for (what, options) in options {
        let changed = content_hash(&mut corner(), &options).unwrap();
        for (other, known) in &seen {
            assert_ne!(changed, *known, "{what} and {other}");
        }
        seen.push((what, changed));
    }
}

#[test]
fn the_report_names_the_hash() {
    let options =
        BakeOptions { density: Density::MapSize(16), quality: Quality::Draft, ..BakeOptions::default() };
    let mut world = corner();
    let expected = content_hash(&mut world, &options).unwrap().to_string();
    let report = bake(&mut world, &options, &mut |_| ControlFlow::Continue(())).unwrap();
    assert_eq!(report.content_hash, expected);
}
