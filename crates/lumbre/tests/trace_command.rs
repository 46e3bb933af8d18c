//! `lumbre trace` and `lumbre compare` as their users meet them.

#![allow(clippy::unwrap_used, reason = "helpers of tests, which clippy does not count as tests")]

use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::Arc;

use bevy_ecs::world::World;
use glam::{DVec3, Vec3};
use lumbre::mesh::shapes;
use lumbre::optics::{Light, Material};
use lumbre::scene::{Camera, Medium, Mesh, Name, Quadric, Transform};

fn lumbre(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_lumbre")).args(arguments).output().unwrap()
}

fn stdout(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned()
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

/// A ball of glass over a floor, lit by a lamp.
fn glass() -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("glass.glb");
    let mut world = World::new();
    world.spawn((Mesh(Arc::new(shapes::plane(8.0, 8.0, 1, 1))), Material::matt(Vec3::splat(0.6))));
    let clear = Material { transmission: Vec3::ONE, ..Material::matt(Vec3::ZERO) };
    let fresnel = Medium { fresnel: true, ..Medium::default() };
    let ball = Mesh(Arc::new(shapes::uv_sphere(1.0, 24, 12)));
    let name = Name::new("crystal");
    world.spawn((name, ball, Quadric::sphere(1.0), clear, fresnel, Transform::from_xyz(0.0, 1.0, 0.0)));
    world.spawn((Name::new("lamp"), Light::point(Vec3::splat(9.0)), Transform::from_xyz(2.0, 4.0, 2.0)));
    let place = Transform::from_xyz(0.0, 1.5, 5.0).looking_at(DVec3::Y, DVec3::Y);
    world.spawn((Name::new("view"), Camera::default(), place));
    lumbre::scene::save(&mut world, &path).unwrap();
    (folder, path)
}

#[test]
fn a_picture_its_report_and_a_comparison() {
    let (folder, scene) = glass();
    let at = |name: &str| folder.path().join(name);
    let size = ["--size", "64x48"];
    let draw = |output: &Path, more: &[&str]| {
        let mut arguments = vec!["trace", text(&scene), "-o", text(output)];
        arguments.extend(size);
        arguments.extend(more);
        let output = lumbre(&arguments);
        assert!(output.status.success(), "{}", stderr(&output));
        output
    };
    let told = draw(&at("one.exr"), &["--depth", "8"]);
    assert!(stdout(&told).contains("64 x 48, 1 samples a pixel"), "{}", stdout(&told));
    let report = draw(&at("paths.exr"), &["--integrator", "path", "--samples", "16", "--json"]);
    let report: serde_json::Value = serde_json::from_slice(&report.stdout).unwrap();
    assert_eq!((report["ended"].as_str(), report["samples"][1].as_u64()), (Some("complete"), Some(16)));
    assert!(report["standard_error"].as_f64().unwrap() > 0.0);
    let image = image::open(at("one.exr")).unwrap();
    assert_eq!((image.width(), image.height()), (64, 48));
    draw(&at("one.png"), &["--depth", "8"]);
    // The same again is the same; shallower is not.
    draw(&at("two.png"), &["--depth", "8", "--threads", "1"]);
    assert_eq!(std::fs::read(at("one.png")).unwrap(), std::fs::read(at("two.png")).unwrap());
    draw(&at("flat.png"), &["--depth", "0"]);
    let compared = lumbre(&["compare", text(&at("one.png")), text(&at("two.png"))]);
    assert!(stdout(&compared).contains("as shown: the same"), "{}", stdout(&compared));
    let heat = at("heat.png");
    let compared =
        lumbre(&["compare", text(&at("one.png")), text(&at("flat.png")), "-o", text(&heat), "--json"]);
    let found: serde_json::Value = serde_json::from_slice(&compared.stdout).unwrap();
    assert!(found["flip"].as_f64().unwrap() > 0.01 && heat.exists(), "{found}");
}

#[test]
fn the_tree_of_a_pixel_names_what_it_meets() {
    let (_folder, scene) = glass();
    let tree = |format: &str| {
        let asked = ["trace", text(&scene), "--size", "64x48", "--pixel", "32,20", "--tree", format];
        let output = lumbre(&asked);
        assert!(output.status.success(), "{}", stderr(&output));
        stdout(&output)
    };
    let words = tree("text");
    assert!(
        words.contains("camera: crystal (front)") && words.contains("through crystal (index 1.500)"),
        "{words}"
    );
    let json: serde_json::Value = serde_json::from_str(&tree("json")).unwrap();
    assert_eq!(json["branches"].as_array().unwrap().len(), 2);
    assert!(tree("dot").starts_with("digraph") && tree("svg").starts_with("<svg"));
}

#[test]
fn bad_usage_is_told_what_to_do() {
    let (folder, scene) = glass();
    let output = folder.path().join("out.png");
    for (arguments, status, words) in [
        (vec!["trace", text(&scene)], 2, "--output"),
        (vec!["trace", text(&scene), "-o", "x.bmp"], 1, ".png and .exr"),
        (vec!["trace", text(&scene), "-o", text(&output), "--weight", "2"], 2, "0 to 1"),
        (vec!["trace", text(&scene), "-o", text(&output), "--integrator", "photon"], 2, "whitted"),
        (vec!["trace", text(&scene), "--pixel", "9999,0"], 1, "no pixel"),
        (vec!["trace", text(&scene), "-o", text(&output), "--camera", "nobody"], 1, "view"),
        (vec!["trace", text(&scene), "-o", text(&output), "--depth", "1001"], 2, "1000"),
        (vec!["compare", text(&scene), text(&scene)], 1, "no picture"),
    ] {
        let found = lumbre(&arguments);
        assert_eq!(found.status.code(), Some(status), "{arguments:?}: {}", stderr(&found));
        assert!(stderr(&found).contains(words), "{arguments:?}: {}", stderr(&found));
        assert!(!output.exists());
    }
}
