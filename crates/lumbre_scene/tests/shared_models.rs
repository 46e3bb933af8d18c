//! Every model in the shared folder must load. Prints a message and passes if the folder is missing.

#![allow(clippy::unwrap_used, reason = "a test stops where something is not as it has to be")]

mod support;

use std::path::{Path, PathBuf};

use bevy_ecs::prelude::*;
use glam::DVec3;
use lumbre_scene::{
    GlobalTransform, Mesh, Primitive, SceneSettings, StaticObject, default_camera, load, save, scene_bounds,
};

fn shared() -> Option<PathBuf> {
    let path = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared"));
    if !path.is_dir() {
        eprintln!("SKIPPED: {} is missing, so no shared model was loaded", path.display());
        return None;
    }
    Some(path.to_owned())
}

#[test]
fn every_shared_model_loads() {
    let Some(shared) = shared() else { return };
    let mut count = 0;
    for folder in ["models", "conformance/opengl", "conformance/bake"] {
        for entry in std::fs::read_dir(shared.join(folder)).unwrap() {
            let path = entry.unwrap().path();
            if path.extension().is_none_or(|extension| extension != "glb") {
                continue;
            }
            let mut world = World::new();
            let report = load(&mut world, &path).unwrap_or_else(|error| panic!("{error}"));
            assert!(report.triangles > 0, "{} has no triangles", path.display());
            let mut primitives = world.query::<(&Mesh, &Primitive, &GlobalTransform, &StaticObject)>();
            let found: usize = primitives.iter(&world).map(|(mesh, ..)| mesh.0.triangle_count()).sum();
            assert_eq!(found, report.triangles);
            assert!(world.contains_resource::<SceneSettings>());
            eprintln!("{}: {} triangles, notes {:?}", path.display(), report.triangles, report.notes);
            count += 1;
        }
    }
    assert!(count >= 12, "only {count} models were found");
}

#[test]
fn the_cornell_box_is_seen_from_its_open_side() {
    let Some(shared) = shared() else { return };
    let mut world = World::new();
    load(&mut world, &shared.join("models/cornell_box.glb")).unwrap();
    let bounds = scene_bounds(&mut world);
    let (transform, _) = default_camera(&mut world, 1.0);
    // The box is open towards +Z; the other five sides are walls.
    let side = (transform.translation - bounds.center()).normalize();
    assert!(side.dot(DVec3::Z) > 0.99, "the camera is towards {side}");
}

#[test]
fn the_shared_models_survive_saving() {
    let Some(shared) = shared() else { return };
    let folder = tempfile::tempdir().unwrap();
    for name in ["models/cornell_box.glb", "conformance/opengl/case_2.glb", "conformance/opengl/case_3.glb"] {
        let (mut first, mut second) = (World::new(), World::new());
        load(&mut first, &shared.join(name)).unwrap();
        let path = folder.path().join("again.glb");
        save(&mut first, &path).unwrap();
        load(&mut second, &path).unwrap_or_else(|error| panic!("{name}: {error}"));
        assert_eq!(support::described(&mut second), support::described(&mut first), "{name}");
        gltf::Gltf::open(&path).unwrap_or_else(|error| panic!("{name}: {error}"));
    }
}
