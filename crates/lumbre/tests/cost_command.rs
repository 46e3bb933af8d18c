//! `lumbre cost` and `lumbre tune` as their users see them.

#![allow(clippy::unwrap_used, reason = "helpers of tests, which clippy does not count as tests")]

use std::collections::BTreeSet;
use std::path::Path;
use std::process::{Command, Output};
use std::sync::Arc;

use bevy_ecs::world::World;
use glam::{DVec3, Vec3};
use lumbre::cost::{CostReport, command_words, read_picture, read_report};
use lumbre::optics::{Fog, FogMode, Light, Material, SpotCone};
use lumbre::scene::{Camera, Mesh, Name, SceneSettings, Transform, load, save};

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

#[test]
fn a_small_report_and_what_changed_since() {
    let folder = tempfile::tempdir().unwrap();
    let report = folder.path().join("report");
    let asked = ["cost", "-o", text(&report), "--quick", "--study", "reflection", "--size", "24x16"];
    let output = lumbre(&asked);
    assert!(output.status.success(), "{}", stderr(&output));
    assert!(
        stdout(&output).contains("Reflection models compared with Phong's (28 points"),
        "{}",
        stdout(&output)
    );
    assert!(stdout(&output).trim_end().ends_with("index.html"), "{}", stdout(&output));
    assert!(stderr(&output).contains("lumbre: reflection: "), "{}", stderr(&output));
    let found = read_report(&report).unwrap();
    assert_eq!((found.settings.size, found.settings.quick), ((24, 16), true));
    assert!(found.machine.threads > 0 && !found.machine.adapter.is_empty());
    for name in ["index.html", "cost.csv", "cost.json", "scenes/ball-exponent-8.glb"] {
        assert!(report.join(name).exists(), "{name} is missing");
    }
    // The command of a point reproduces its picture.
    let point = &found.studies[0].points[1];
    let mut words: Vec<&str> = point.command.split(' ').skip(1).collect();
    words.iter_mut().filter(|word| **word == "20").for_each(|word| *word = "2");
    let again =
        Command::new(env!("CARGO_BIN_EXE_lumbre")).args(&words).current_dir(&report).output().unwrap();
    assert!(again.status.success(), "{}: {}", point.command, stderr(&again));
    let kept = format!("{}.exr", point.picture.as_ref().unwrap().picture);
    let compared = lumbre(&["compare", text(&report.join(kept)), text(&report.join("frame.exr")), "--json"]);
    let compared: serde_json::Value = serde_json::from_slice(&compared.stdout).unwrap();
    assert_eq!(compared["largest"].as_f64(), Some(0.0), "{compared}");

    // A resumed report measures nothing again.
    let resumed = lumbre(&[&asked[..], &["--resume"]].concat());
    assert!(resumed.status.success(), "{}", stderr(&resumed));
    assert_eq!(read_report(&report).unwrap(), found);

    let json = report.join("cost.json");
    let same = lumbre(&["cost", "--compare", text(&json), text(&report)]);
    assert!(same.status.success(), "{}", stderr(&same));
    assert!(stdout(&same).contains("0 counts, errors or points are worse"), "{}", stdout(&same));
    let planted = |name: &str, plant: &dyn Fn(&mut CostReport)| {
        let mut report = found.clone();
        plant(&mut report);
        let path = folder.path().join(name);
        std::fs::write(&path, serde_json::to_string(&report).unwrap()).unwrap();
        path
    };
    let counted = planted("counted.json", &|report| {
        *report.studies[0].points[2].counts.get_mut("fragment invocations").unwrap() *= 1.5;
    });
    let worse = lumbre(&["cost", "--compare", text(&json), text(&counted)]);
    assert_eq!(worse.status.code(), Some(1), "{}", stdout(&worse));
    assert!(stdout(&worse).contains("fragment invocations"), "{}", stdout(&worse));
    let better = lumbre(&["cost", "--compare", text(&counted), text(&json)]);
    assert!(better.status.success(), "{}", stdout(&better));
    let within = lumbre(&["cost", "--compare", text(&json), text(&counted), "--factor", "2"]);
    assert!(within.status.success(), "{}", stdout(&within));
    // Increased times are listed, and are a failure only with `--times`.
    let slower = planted("slower.json", &|report| {
        let time = report.studies[0].points[0].milliseconds.as_mut().unwrap();
        (time.lower, time.median, time.upper) = (9.0 * time.upper, 10.0 * time.upper, 11.0 * time.upper);
    });
    let told = lumbre(&["cost", "--compare", text(&json), text(&slower)]);
    assert!(told.status.success() && stdout(&told).contains("and 1 times"), "{}", stdout(&told));
    let failed = lumbre(&["cost", "--compare", text(&json), text(&slower), "--times"]);
    assert_eq!(failed.status.code(), Some(1), "{}", stdout(&failed));
}

/// A ball on a floor in fog, under a lamp and a spotlight that ask for no shadow.
fn foggy(path: &Path) {
    let mut world = World::new();
    let fog = Fog { mode: FogMode::Exponential { density: 0.05 }, color: Vec3::splat(0.4) };
    world.insert_resource(SceneSettings { fog: Some(fog), ..SceneSettings::default() });
    let floor = Mesh(Arc::new(lumbre::mesh::shapes::plane(8.0, 8.0, 1, 1)));
    world.spawn((Name::new("floor"), floor, Material::matt(Vec3::splat(0.6))));
    let ball = Mesh(Arc::new(lumbre::mesh::shapes::uv_sphere(0.6, 24, 13)));
    let shiny = Material::from_metallic_roughness(Vec3::new(0.6, 0.3, 0.2), 0.0, 0.4);
    world.spawn((Name::new("ball"), ball, shiny, Transform::from_xyz(0.0, 0.9, 0.0)));
    world.spawn((Name::new("lamp"), Light::point(Vec3::splat(6.0)), Transform::from_xyz(1.0, 3.0, 0.5)));
    let spot = Light::spot(Vec3::splat(8.0), SpotCone::Smooth { inner: 0.3, outer: 0.5 });
    let aimed = Transform::from_xyz(-2.0, 3.0, 1.0).looking_at(DVec3::ZERO, DVec3::Y);
    world.spawn((Name::new("spotlight"), spot, aimed));
    let eye = Transform::from_xyz(0.4, 1.6, 3.5).looking_at(DVec3::new(0.0, 0.6, 0.0), DVec3::Y);
    world.spawn((Name::new("the eye's place"), Camera::default(), eye));
    save(&mut world, path).unwrap();
}

/// Every point of these studies, by its own command: the picture that comes is the one that the report keeps, to the bit.
#[test]
fn commands_make_the_pictures_of_their_points_again() {
    let folder = tempfile::tempdir().unwrap();
    let (scene, report) = (folder.path().join("a foggy yard.glb"), folder.path().join("report"));
    foggy(&scene);
    let asked = ["cost", text(&scene), "-o", text(&report), "--quick", "--seed", "3", "--size", "32x24"];
    let studies = ["--study", "tour", "--study", "effects", "--study", "precision"];
    let output = lumbre(&[&asked[..], &studies].concat());
    assert!(output.status.success(), "{}", stderr(&output));
    let found = read_report(&report).unwrap();
    let run = |words: &[String]| {
        let mut words = words[1..].to_vec();
        words.iter_mut().filter(|word| **word == "20").for_each(|word| *word = "1".into());
        let program = env!("CARGO_BIN_EXE_lumbre");
        let output = Command::new(program).args(&words).current_dir(&report).output().unwrap();
        assert!(output.status.success(), "{words:?}: {}", stderr(&output));
    };
    let (mut drawn, mut again, mut different) = (0, 0, BTreeSet::new());
    for study in &found.studies {
        for point in &study.points {
            let name = format!("{}, {}, {}", study.name, point.series, point.label);
            let kept = read_picture(&report, &point.picture.as_ref().unwrap().picture).unwrap();
            for words in command_words(&point.command) {
                let made = match words[1].as_str() {
                    "render" => {
                        run(&words);
                        drawn += 1;
                        read_picture(&report, "frame").unwrap()
                    }
                    "trace" => {
                        run(&words);
                        drawn += 1;
                        read_picture(&report, "picture").unwrap()
                    }
                    "cost" => {
                        let folder = report.join("again");
                        // One run makes all points of its study.
                        if again == 0 {
                            run(&words);
                        }
                        again += 1;
                        let settings = read_report(&folder).unwrap().settings;
                        assert_eq!(settings, found.settings, "{}", point.command);
                        read_picture(&folder, &point.picture.as_ref().unwrap().picture).unwrap()
                    }
                    other => panic!("{name}: {other}"),
                };
                assert!(made == kept, "{name}: {} makes another picture", point.command);
                let bits = made.radiance.iter().flat_map(|pixel| pixel.to_array()).map(f64::to_bits);
                different.insert(bits.collect::<Vec<_>>());
            }
        }
    }
    assert!(drawn > 20 && again > 7, "{drawn} {again}");
    // Not one picture that is the same whatever is asked for.
    assert!(different.len() > 20, "{} pictures differ", different.len());
}

#[test]
fn bad_arguments_are_refused_with_what_to_do() {
    let folder = tempfile::tempdir().unwrap();
    let out = text(folder.path()).to_owned();
    let garbage = folder.path().join("garbage.json");
    std::fs::write(&garbage, "{\"studies\": 3}").unwrap();
    let cases: &[(&[&str], i32, &str)] = &[
        (&["cost"], 2, "--output"),
        (
            &["cost", "-o", &out, "--study", "shadnig"],
            1,
            "there is no study `shadnig`; there are: shading, scan, need, lamps",
        ),
        (&["cost", "-o", &out, "--size", "4x4"], 2, "each from 8 to 4096"),
        (&["cost", "-o", &out, "--size", "9000x10"], 2, "each from 8 to 4096"),
        (&["cost", "-o", &out, "--factor", "2"], 2, "cannot be used with"),
        (&["cost", "-o", &out, "--times"], 2, "cannot be used with"),
        (&["cost", "--compare", "a.json"], 2, "2 values"),
        (&["cost", "--compare", "a.json", "b.json", "--quick"], 2, "--quick"),
        (&["cost", "--compare", "a.json", "b.json", "--counts-only"], 2, "--counts-only"),
        (&["cost", "--compare", "a.json", "b.json", "--factor", "0.5"], 2, "at least 1"),
        (&["cost", "--compare", "a.json", "b.json"], 1, "a.json"),
        (&["cost", "--compare", text(&garbage), text(&garbage)], 1, "is no report of lumbre cost"),
        (&["cost", "missing.glb", "-o", &out, "--study", "shading"], 1, "missing.glb"),
    ];
    for (arguments, status, words) in cases {
        let output = lumbre(arguments);
        assert_eq!(output.status.code(), Some(*status), "{arguments:?}: {}", stderr(&output));
        assert!(stderr(&output).contains(words), "{arguments:?}: {}", stderr(&output));
    }
}

#[test]
fn a_level_with_the_settings_that_keep_a_time() {
    let folder = tempfile::tempdir().unwrap();
    let (level, tuned) = (folder.path().join("level.glb"), folder.path().join("tuned.glb"));
    let mut world = World::new();
    let ball = Mesh(Arc::new(lumbre::mesh::shapes::uv_sphere(1.0, 24, 13)));
    world.spawn((Name::new("ball"), ball, Material::default()));
    let torch =
        Light { shadow: true, ..Light::spot(Vec3::splat(20.0), SpotCone::Smooth { inner: 0.3, outer: 0.5 }) };
    let aimed = Transform::from_xyz(0.0, 3.0, 3.0).looking_at(DVec3::ZERO, DVec3::Y);
    world.spawn((Name::new("torch"), torch, aimed));
    save(&mut world, &level).unwrap();
    let tune = |goal: [&str; 2]| {
        lumbre(
            &[&["tune", text(&level), "--quick", "--size", "48x32", "-o", text(&tuned)], &goal[..]].concat(),
        )
    };

    // No settings are this fast, so nothing is written.
    let output = tune(["--frame-ms", "0.000001"]);
    assert_eq!(output.status.code(), Some(1), "{}", stdout(&output));
    assert!(stdout(&output).contains("No settings keep within"), "{}", stdout(&output));
    assert!(!tuned.exists());

    // All settings are this accurate: the fastest is chosen, whichever it is on this machine, and the file
    // has it.
    let output = tune(["--error", "1000"]);
    assert!(output.status.success(), "{}", stderr(&output));
    let said = stdout(&output);
    let command = said.lines().find(|line| line.starts_with("lumbre render ")).unwrap();
    let mut read = World::new();
    load(&mut read, &tuned).unwrap();
    let SceneSettings { shading, frame, .. } = *read.resource::<SceneSettings>();
    assert_eq!(frame.multisample, Some(command.contains("--msaa")), "{command}");
    assert!(command.contains(&format!("--light-threshold {}", frame.light_threshold)), "{command}");
    let of_maps = format!(
        "--shadow-filter {} --shadow-resolution {}",
        frame.shadow_filter.name(),
        frame.shadow_resolution
    );
    assert!(command.contains("--no-shadows") || command.contains(&of_maps), "{command}");
    assert!(command.contains(&format!("--shading {shading}")), "{command}");
    // Whether shadows are drawn is a setting of the level's frames. Its lights still ask for them.
    assert_eq!(frame.shadows, !command.contains("--no-shadows"), "{command}");
    let mut lights = read.query::<&Light>();
    assert!(lights.iter(&read).all(|light| light.shadow));

    // Everything else is unchanged: the buffers, and whatever other programs have put into the JSON.
    let parts = |path: &Path| {
        let bytes = std::fs::read(path).unwrap();
        let length = u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
        let json: serde_json::Value = serde_json::from_slice(&bytes[20..20 + length]).unwrap();
        (json, bytes[20 + length..].to_vec())
    };
    let ((mut before, buffers), (mut after, same)) = (parts(&level), parts(&tuned));
    assert_eq!(buffers, same);
    let used = after["extensionsUsed"].as_array().unwrap();
    assert!(used.iter().any(|name| name == "LUMBRE_scene"), "{used:?}");
    for json in [&mut before, &mut after] {
        json["extensionsUsed"] = "".into();
        json["scenes"][0]["extensions"]["LUMBRE_scene"]["shading"] = "".into();
        json["scenes"][0]["extensions"]["LUMBRE_scene"]["frame"] = "".into();
    }
    assert_eq!(before, after);
    let gltf = folder.path().join("tuned.gltf");
    let output =
        lumbre(&["tune", text(&level), "--quick", "--size", "48x32", "--error", "1000", "-o", text(&gltf)]);
    assert_eq!(output.status.code(), Some(1), "{}", stdout(&output));
    assert!(stderr(&output).contains("the same ending"), "{}", stderr(&output));

    // Without a goal there is nothing to write.
    let output = lumbre(&["tune", text(&level), "-o", text(&tuned)]);
    assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
}
