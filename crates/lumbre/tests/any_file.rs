//! Files as they come in practice: without light, in candela, or with faults, and how the program reacts.

#![allow(clippy::unwrap_used, reason = "helpers of tests, which clippy does not count as tests")]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::Arc;

use bevy_ecs::world::World;
use glam::{DVec3, Vec3};
use lumbre::optics::Material;
use lumbre::scene::{Camera, Mesh, StaticObject, Transform};
use serde_json::{Value, json};

fn lumbre(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_lumbre")).args(arguments).current_dir(folder).output().unwrap()
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn done(folder: &Path, arguments: &[&str]) -> String {
    let output = lumbre(folder, arguments);
    assert_eq!(output.status.code(), Some(0), "{arguments:?}: {}", stderr(&output));
    stderr(&output)
}

fn failed(folder: &Path, arguments: &[&str]) -> String {
    let output = lumbre(folder, arguments);
    assert_eq!(output.status.code(), Some(1), "{arguments:?}: {}", stderr(&output));
    stderr(&output)
}

/// Creates a folder with `room.gltf`, a grey box on a floor with a camera, whose JSON is modified by
/// `change`.
fn room(change: impl FnOnce(&mut Value)) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let mut world = World::new();
    let grey = Material::from_metallic_roughness(Vec3::splat(0.6), 0.0, 1.0);
    for (size, y) in [(Vec3::new(6.0, 0.2, 6.0), -0.1), (Vec3::ONE, 0.5)] {
        let mesh = Mesh(Arc::new(lumbre::mesh::shapes::cuboid(size, 1)));
        world.spawn((mesh, grey.clone(), StaticObject, Transform::from_xyz(0.0, y, 0.0)));
    }
    let eye = Transform::from_xyz(2.0, 2.0, 4.0).looking_at(DVec3::ZERO, DVec3::Y);
    world.spawn((Camera::default(), eye));
    let path = folder.path().join("room.gltf");
    lumbre::scene::save(&mut world, &path).unwrap();
    let mut root: Value = serde_json::from_slice(&fs::read(&path).unwrap()).unwrap();
    change(&mut root);
    fs::write(&path, root.to_string()).unwrap();
    (folder, path)
}

/// Adds a lamp of 2000 candela above the box.
fn lamp(root: &mut Value) {
    root["extensions"]["KHR_lights_punctual"] = json!({"lights": [{"type": "point", "intensity": 2000}]});
    let nodes = root["nodes"].as_array_mut().unwrap();
    nodes.push(json!({"translation": [1, 3, 1], "extensions": {"KHR_lights_punctual": {"light": 0}}}));
    let node = nodes.len() - 1;
    root["scenes"][0]["nodes"].as_array_mut().unwrap().push(node.into());
}

/// Returns the mean of a picture's channels, 0 to 255, and the fraction of white pixels.
fn mean_and_white(path: &Path) -> (f64, f64) {
    let picture = image::open(path).unwrap().into_rgb8();
    let mean = picture.as_raw().iter().map(|&channel| f64::from(channel)).sum::<f64>()
        / picture.as_raw().len() as f64;
    let white = picture.pixels().filter(|pixel| pixel.0.iter().all(|&channel| channel > 250)).count();
    (mean, white as f64 / f64::from(picture.width() * picture.height()))
}

#[test]
fn what_has_no_light_is_seen_by_that_of_the_camera() {
    let (folder, _) = room(|_| {});
    let size = ["--size", "96x64"];
    let said = done(folder.path(), &[&["render", "room.gltf", "-o", "a.png"], &size[..]].concat());
    assert!(said.contains("no light") && said.contains("--no-default-light"), "{said}");
    let (mean, white) = mean_and_white(&folder.path().join("a.png"));
    assert!(mean > 30.0 && white < 0.1, "{mean} {white}");

    let dark = [&["render", "room.gltf", "-o", "b.png", "--no-default-light"], &size[..]].concat();
    let said = done(folder.path(), &dark);
    assert!(!said.contains("default") && said.contains("the frame is black"), "{said}");
    assert_eq!(mean_and_white(&folder.path().join("b.png")).0, 0.0);

    // A tour gets the same default light.
    let said = done(folder.path(), &["play", "room.gltf", "--headless", "--frames", "1", "--size", "96x64"]);
    assert!(said.contains("no light"), "{said}");
    assert!(mean_and_white(&folder.path().join("frames/tour-001.png")).0 > 10.0);
    let dark = ["play", "room.gltf", "--headless", "--frames", "1", "--size", "96x64", "--no-default-light"];
    done(folder.path(), &dark);
    assert_eq!(mean_and_white(&folder.path().join("frames/tour-001.png")).0, 0.0);
}

#[test]
fn lamps_in_candela_are_exposed_by_metering() {
    let (folder, _) = room(lamp);
    let render = |file: &str, more: &[&str]| {
        let said =
            done(folder.path(), &[&["render", "room.gltf", "-o", file, "--size", "96x64"], more].concat());
        (said, mean_and_white(&folder.path().join(file)))
    };
    let (said, (mean, white)) = render("auto.png", &[]);
    assert!(said.contains("exposure") && said.contains("EV") && said.contains("log-average"), "{said}");
    assert!(mean > 20.0 && white < 0.1, "{mean} {white}");
    let first = fs::read(folder.path().join("auto.png")).unwrap();
    render("auto.png", &["--exposure", "auto"]);
    assert!(fs::read(folder.path().join("auto.png")).unwrap() == first, "the same each time");

    let (said, (_, white)) = render("one.png", &["--exposure", "1"]);
    assert!(!said.contains("metered") && white > 0.3, "{said} {white}");
    let (_, (dark, _)) = render("dark.png", &["--exposure", "20EV"]);
    assert!(dark < mean, "{dark}");

    // An .exr keeps radiance as it is, without metering.
    let said = done(folder.path(), &["render", "room.gltf", "-o", "a.exr", "--size", "96x64"]);
    assert!(!said.contains("exposure"), "{said}");
}

#[test]
fn a_camera_that_states_its_exposure_keeps_it() {
    let (folder, _) = room(|root| {
        lamp(root);
        let nodes = root["nodes"].as_array_mut().unwrap();
        let eye = nodes.iter_mut().find(|node| node["camera"].is_number()).unwrap();
        eye["extensions"] = json!({"LUMBRE_camera": {"exposure": 1.0}});
    });
    let said = done(folder.path(), &["render", "room.gltf", "-o", "a.png", "--size", "96x64"]);
    assert!(!said.contains("metered"), "{said}");
}

#[test]
fn where_there_is_nothing_to_bake_a_sky_is_offered() {
    let (folder, path) = room(|_| {});
    let said = failed(folder.path(), &["bake", "room.gltf", "-o", "out.glb"]);
    assert!(said.contains("nothing to bake"), "{said}");
    let command = said.split('`').nth(1).unwrap();
    let arguments: Vec<&str> = command.split(' ').skip(1).collect();
    let quick = ["--map-size", "16", "--error", "20%", "--quality", "draft", "--memory", "2GB"];
    done(folder.path(), &[arguments, quick.to_vec()].concat());
    let mut world = World::new();
    lumbre::scene::load(&mut world, &folder.path().join("out.glb")).unwrap();
    assert_eq!(world.query::<&lumbre::scene::Lightmap>().iter(&world).count(), 2);
    assert_eq!(world.resource::<lumbre::scene::SceneSettings>().sky, Vec3::ONE);
    // A baked file has light of its own.
    let said = done(folder.path(), &["render", "out.glb", "-o", "a.png", "--size", "96x64"]);
    assert!(!said.contains("no light") && mean_and_white(&folder.path().join("a.png")).0 > 20.0, "{said}");
    assert!(path.exists());
}

#[test]
fn the_level_itself_is_not_overwritten_unasked() {
    let (folder, path) = room(lamp);
    let before = fs::read(&path).unwrap();
    #[cfg(unix)]
    std::os::unix::fs::symlink(&path, folder.path().join("link.gltf")).unwrap();
    let ways: &[&str] =
        if cfg!(unix) { &["room.gltf", "./room.gltf", "link.gltf"] } else { &["room.gltf", "./room.gltf"] };
    for output in ways {
        let said = failed(folder.path(), &["bake", "room.gltf", "-o", output]);
        assert!(said.contains("--overwrite"), "{said}");
    }
    assert!(fs::read(&path).unwrap() == before);
    let quick = ["--map-size", "16", "--error", "20%", "--quality", "draft", "--overwrite"];
    done(folder.path(), &[&["bake", "room.gltf", "-o", "room.gltf"], &quick[..]].concat());
    let after: Value = serde_json::from_slice(&fs::read(&path).unwrap()).unwrap();
    assert!(after["extensions"]["LUMBRE_bake"].is_object());
}

#[test]
fn faults_are_repaired_with_a_note_or_refused_where_asked() {
    let (folder, _) = room(|root| {
        lamp(root);
        root["asset"] = json!({});
    });
    let said = done(folder.path(), &["render", "room.gltf", "-o", "a.png", "--size", "96x64"]);
    assert!(said.contains("note: room.gltf: asset.version"), "{said}");
    for command in [
        &["render", "room.gltf", "-o", "b.png", "--strict"][..],
        &["bake", "room.gltf", "-o", "b.glb", "--strict"],
        &["explain", "room.gltf", "--strict"],
        &["play", "room.gltf", "--headless", "--strict"],
    ] {
        let said = failed(folder.path(), command);
        assert!(said.contains("version"), "{command:?}: {said}");
    }
    assert!(!folder.path().join("b.png").exists());

    let said = failed(folder.path(), &["render", "nofile.glb", "-o", "a.png"]);
    assert_eq!(said.matches("nofile.glb").count(), 1, "{said}");
}
