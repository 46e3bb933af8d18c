//! `lumbre trace` and `lumbre compare` as their users see them.

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

/// Creates a folder with a scene: a glass ball above a floor, lit by a lamp.
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
    // The same command gives the same picture on any number of threads; a smaller depth gives another one.
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

/// Reads the channels of an OpenEXR file by name.
fn channels(path: &Path) -> std::collections::BTreeMap<String, Vec<f32>> {
    let image = exr::prelude::read_first_flat_layer_from_file(path).unwrap();
    let list = image.layer_data.channel_data.list;
    list.into_iter()
        .map(|channel| (channel.name.to_string(), channel.sample_data.values_as_f32().collect()))
        .collect()
}

#[test]
fn auxiliary_pictures_are_layers_of_open_exr_and_files_beside_png() {
    let (folder, scene) = glass();
    let at = |name: &str| folder.path().join(name);
    for integrator in ["whitted", "path"] {
        let (exr, asked) =
            (at("out.exr"), "albedo,normal,depth,rays,standard-error,direct,bounced,light:*,light:lamp");
        let told = lumbre(&[
            "trace",
            text(&scene),
            "-o",
            text(&exr),
            "--size",
            "40x30",
            "--samples",
            "8",
            "--integrator",
            integrator,
            "--aov",
            asked,
        ]);
        assert!(told.status.success(), "{}", stderr(&told));
        let found = channels(&exr);
        let light = found.keys().filter(|name| name.starts_with("light:") && name.ends_with(".R")).count();
        assert_eq!(light, if integrator == "whitted" { 3 } else { 2 }, "{:?}", found.keys());
        let more = 3 * (1 + 2 + 1 + 2 + light) + 2;
        assert_eq!(found.len(), more, "{:?}", found.keys());
        for channel in ["R", "G", "B"] {
            let sum =
                |names: &[String], pixel: usize| names.iter().map(|name| found[name][pixel]).sum::<f32>();
            let parts = ["direct", "indirect"].map(|part| format!("{part}.{channel}"));
            let lights = found.keys().filter(|name| name.starts_with("light:") && name.ends_with(channel));
            let lights: Vec<String> = lights.cloned().collect();
            for (pixel, &whole) in found[channel].iter().enumerate() {
                for sum in [sum(&parts, pixel), sum(&lights, pixel)] {
                    assert!((sum - whole).abs() <= 1e-5 * whole.max(1e-3), "{sum} for {whole}");
                }
            }
        }
        assert!(found["depth.Z"].iter().any(|depth| depth.is_infinite()));
        assert!(found["rays.Y"].iter().all(|rays| *rays >= 8.0));
        let known = found["standard-error.G"].iter().filter(|error| error.is_finite()).count();
        assert_eq!(known, if integrator == "path" { 40 * 30 } else { 0 }, "only paths have noise");
        assert!(integrator == "whitted" || found["standard-error.G"].iter().any(|error| *error > 0.0));
    }
    // A reader of three channels gets the picture.
    assert_eq!(image::open(at("out.exr")).unwrap().width(), 40);
    let png = at("out.png");
    let asked =
        ["trace", text(&scene), "-o", text(&png), "--size", "40x30", "--aov", "normal,depth,light:lamp"];
    let told = lumbre(&asked);
    assert!(told.status.success() && stderr(&told).contains("m away"), "{}", stderr(&told));
    for name in ["out.normal.png", "out.depth.png", "out.light-lamp.png"] {
        assert_eq!(image::open(at(name)).unwrap().width(), 40, "{name}");
    }
    let refused = |aov: &str| lumbre(&["trace", text(&scene), "-o", text(&png), "--aov", aov]);
    let (unknown, nobody) = (refused("beauty"), refused("light:moon"));
    assert!(unknown.status.code() == Some(2) && stderr(&unknown).contains("albedo, normal"));
    assert!(nobody.status.code() == Some(1) && stderr(&nobody).contains("\"lamp\""), "{}", stderr(&nobody));
}

#[test]
fn paths_go_on_where_they_were_left() {
    let (folder, scene) = glass();
    let at = |name: &str| folder.path().join(name);
    let draw = |output: &str, more: &[&str]| {
        let output = at(output);
        let mut asked = vec!["trace", text(&scene), "-o", text(&output), "--size", "48x36"];
        asked.extend(["--integrator", "path"]);
        asked.extend(more);
        lumbre(&asked)
    };
    let done = |output: Output| assert!(output.status.success(), "{}", stderr(&output));
    done(draw("whole.exr", &["--samples", "96"]));
    assert!(!at("whole.exr.samples").exists(), "nobody asked for them");
    done(draw("parts.exr", &["--samples", "32", "--resume"]));
    let kept = std::fs::read(at("parts.exr.samples")).unwrap();
    done(draw("parts.exr", &["--samples", "96", "--resume"]));
    let read = |name: &str| std::fs::read(at(name)).unwrap();
    assert!(read("whole.exr") == read("parts.exr"), "the same bits");
    // A picture that ran out of time is continued just the same.
    done(draw("timed.exr", &["--samples", "96", "--time", "0.01", "--resume"]));
    done(draw("timed.exr", &["--samples", "96", "--resume"]));
    assert!(read("whole.exr") == read("timed.exr"), "the same bits");
    // Samples of another picture and damaged samples are refused and left as they are.
    let other = draw("parts.exr", &["--samples", "96", "--resume", "--no-shadows"]);
    assert!(
        other.status.code() == Some(1) && stderr(&other).contains("another picture"),
        "{}",
        stderr(&other)
    );
    let of_other_noise = draw("parts.exr", &["--samples", "96", "--resume", "--seed", "2"]);
    assert!(stderr(&of_other_noise).contains("another picture"), "{}", stderr(&of_other_noise));
    std::fs::write(at("parts.exr.samples"), &kept[..kept.len() / 2]).unwrap();
    let cut = draw("parts.exr", &["--samples", "96", "--resume"]);
    assert!(cut.status.code() == Some(1) && stderr(&cut).contains("damaged"), "{}", stderr(&cut));
    assert!(stderr(&cut).contains("remove it"), "{}", stderr(&cut));
    assert_eq!(read("parts.exr.samples").len(), kept.len() / 2);
    let names = std::fs::read_dir(folder.path()).unwrap();
    let names: Vec<_> = names.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    assert!(names.iter().all(|name| !name.starts_with('.')), "nothing half-written is left: {names:?}");
}

#[cfg(unix)]
#[test]
fn an_interruption_keeps_the_picture_and_its_samples() {
    let (folder, scene) = glass();
    let output = folder.path().join("out.png");
    let asked = ["trace", text(&scene), "-o", text(&output), "--size", "64x48", "--integrator", "path"];
    let mut program = Command::new(env!("CARGO_BIN_EXE_lumbre"))
        .args(asked)
        .args(["--error", "1e-9", "--quiet"])
        .stderr(std::process::Stdio::piped())
        .spawn()
        .unwrap();
    std::thread::sleep(std::time::Duration::from_secs(1));
    let interrupt = Command::new("kill").args(["-INT", &program.id().to_string()]).status().unwrap();
    assert!(interrupt.success());
    let ended = program.wait().unwrap();
    let mut words = String::new();
    std::io::Read::read_to_string(program.stderr.as_mut().unwrap(), &mut words).unwrap();
    assert!(ended.code() == Some(1) && words.contains("--resume goes on"), "{words}");
    assert!(output.exists() && folder.path().join("out.png.samples").exists());
    // If the requested error is already reached, the run ends at once.
    let told = lumbre(&[&asked[..], &["--error", "0.5", "--resume", "--json"]].concat());
    let report: serde_json::Value = serde_json::from_slice(&told.stdout).unwrap();
    assert_eq!(report["ended"].as_str(), Some("error"), "{}", stderr(&told));
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
    // A graph names every branch as the text does: its medium, its weight and the terms of its sum.
    let (graph, drawing) = (tree("dot"), tree("svg"));
    assert!(graph.starts_with("digraph") && drawing.starts_with("<svg") && drawing.ends_with("</svg>\n"));
    for line in words.lines().map(str::trim).filter(|line| line.starts_with('+') || line.contains("S = ")) {
        assert!(graph.contains(line), "{line} in {graph}");
    }
    for part in words.split(", ").filter(|part| part.starts_with("counts ")) {
        assert!(graph.contains(part.lines().next().unwrap_or_default()), "{part} in {graph}");
    }
    let points = words.matches(" m through ").count();
    assert!(points > 1 && graph.matches(" m through ").count() == points, "{graph}");
    // Every point is drawn in both views, with the name of its object.
    assert_eq!(drawing.matches("<circle").count(), 2 * points, "{drawing}");
    assert_eq!(drawing.matches("<text").count(), 2 * points + 2, "{drawing}");
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
