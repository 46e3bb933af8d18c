//! The command line as its users see it: exit statuses, messages, files and pipes.

#![allow(clippy::unwrap_used, reason = "helpers of tests, which clippy does not count as tests")]

use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::Arc;

use bevy_ecs::world::World;
use glam::{DVec3, Vec3};
use lumbre::optics::{Light, Material, Surface};
use lumbre::scene::{Camera, DynamicObject, Mesh, StaticObject, Transform};

fn lumbre(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_lumbre")).args(arguments).output().unwrap()
}

fn stdout(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned()
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Creates a folder with a small level: a floor, a ball, a lamp panel, a light and cameras.
fn level() -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("level.glb");
    let mut world = World::new();
    let floor = Arc::new(lumbre::mesh::shapes::cuboid(Vec3::new(6.0, 0.2, 6.0), 1));
    world.spawn((Mesh(floor), Material::matt(Vec3::new(0.6, 0.5, 0.4)), StaticObject));
    let ball = Arc::new(lumbre::mesh::shapes::uv_sphere(0.7, 24, 12));
    let red = Material::from_metallic_roughness(Vec3::new(0.8, 0.1, 0.1), 0.0, 0.4);
    world.spawn((Mesh(ball), red, StaticObject, Transform::from_xyz(0.0, 0.9, 0.0)));
    let lamp = Surface { emission: Vec3::splat(8.0), ..Surface::default() };
    let panel = Arc::new(lumbre::mesh::shapes::cuboid(Vec3::new(1.0, 0.1, 1.0), 1));
    let glow = Material { front: lamp, ..Material::default() };
    world.spawn((Mesh(panel), glow, StaticObject, Transform::from_xyz(-2.0, 3.0, 0.0)));
    world.spawn((Light::point(Vec3::splat(3.0)), Transform::from_xyz(1.5, 2.5, 1.5)));
    world.spawn((
        bevy_ecs::name::Name::new("view"),
        Camera::default(),
        Transform::from_xyz(0.0, 2.5, 6.0).looking_at(DVec3::new(0.0, 0.8, 0.0), DVec3::Y),
    ));
    for (name, x) in [("tour 1", -3.0), ("tour 2", 3.0)] {
        let place = Transform::from_xyz(x, 2.0, 5.0).looking_at(DVec3::new(0.0, 0.8, 0.0), DVec3::Y);
        world.spawn((bevy_ecs::name::Name::new(name), Camera::default(), place));
    }
    lumbre::scene::save(&mut world, &path).unwrap();
    (folder, path)
}

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

#[test]
fn help_shows_examples_and_bad_usage_exits_with_2() {
    for command in
        [vec!["--help"], vec!["bake", "--help"], vec!["render", "--help"], vec!["explain", "--help"]]
    {
        let output = lumbre(&command);
        assert_eq!(output.status.code(), Some(0));
        assert!(stdout(&output).contains("Examples:"), "{command:?}");
    }
    for command in [
        vec!["paint"],
        vec!["render", "a.glb"],
        vec!["render", "a.glb", "-o", "a.png", "--shading", "shiny"],
        vec!["render", "a.glb", "-o", "a.png", "--size", "0x5"],
        vec!["bake", "a.glb", "-o", "b.glb", "--error", "-1"],
        vec!["bake", "a.glb", "-o", "b.glb", "--map-size", "64", "--texels-per-meter", "2"],
    ] {
        let output = lumbre(&command);
        assert_eq!(output.status.code(), Some(2), "{command:?}: {}", stderr(&output));
        assert!(stdout(&output).is_empty());
    }
}

#[test]
fn what_is_neither_a_command_nor_a_file_is_told_apart() {
    let output = lumbre(&["paint"]);
    assert!(stderr(&output).contains("neither"), "{}", stderr(&output));
    for command in ["play", "bake", "render", "trace", "compare", "explain", "cost", "tune"] {
        assert!(stderr(&output).contains(command), "{command}: {}", stderr(&output));
        let help = lumbre(&[command, "--help"]);
        assert!(stdout(&help).contains("Examples:"), "{command}: {}", stdout(&help));
    }
    let output = lumbre(&["nowhere.glb", "--headless"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(stderr(&output).contains("nowhere.glb"), "{}", stderr(&output));
    let output = lumbre(&["play", "--help"]);
    for wanted in ["NAME.baked.glb", "drop a file", "Esc cancels", "  X  ", "  P  ", "  ,  ", "  .  "] {
        assert!(stdout(&output).contains(wanted), "{wanted}: {}", stdout(&output));
    }
    let output = lumbre(&["cost", "--help"]);
    for study in lumbre::cost::STUDIES {
        let line = format!("  {} ", study.name);
        assert!(stdout(&output).contains(&line), "{line}: {}", stdout(&output));
    }
}

#[test]
fn a_failed_job_exits_with_1_and_names_the_file() {
    let (folder, path) = level();
    let missing = lumbre(&["render", "nowhere.glb", "-o", "x.png"]);
    assert_eq!(missing.status.code(), Some(1));
    assert!(stderr(&missing).contains("nowhere.glb"), "{}", stderr(&missing));

    let broken = folder.path().join("broken.glb");
    std::fs::write(&broken, &std::fs::read(&path).unwrap()[..200]).unwrap();
    let output = lumbre(&["explain", text(&broken)]);
    assert_eq!(output.status.code(), Some(1));
    assert!(stderr(&output).contains("broken.glb"), "{}", stderr(&output));

    let gif = folder.path().join("frame.gif");
    let output = lumbre(&["render", text(&path), "-o", text(&gif)]);
    assert_eq!(output.status.code(), Some(1));
    assert!(stderr(&output).contains(".gif") && !gif.exists());

    let camera = folder.path().join("frame.png");
    let output = lumbre(&["render", text(&path), "-o", text(&camera), "--camera", "roof"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(stderr(&output).contains("view"), "the cameras that there are: {}", stderr(&output));
    let unwritable = lumbre(&["render", text(&path), "-o", text(&folder.path().join("no/such/frame.png"))]);
    assert_eq!(unwritable.status.code(), Some(1));
    assert!(stderr(&unwritable).contains("frame.png"), "{}", stderr(&unwritable));
}

#[test]
fn frames_and_timings_are_written_whole() {
    let (folder, path) = level();
    let (png, exr, times) =
        (folder.path().join("frame.png"), folder.path().join("frame.exr"), folder.path().join("times.json"));
    let output = lumbre(&[
        "render",
        text(&path),
        "-o",
        text(&png),
        "--size",
        "96x64",
        "--camera",
        "view",
        "--frames",
        "3",
        "--timings",
        text(&times),
    ]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    assert!(stdout(&output).is_empty());
    let frame = image::open(&png).unwrap().to_rgb8();
    assert_eq!(frame.dimensions(), (96, 64));
    let red = frame.pixels().filter(|pixel| pixel.0[0] / 2 > pixel.0[1] && pixel.0[0] > 60).count();
    assert!(red > 50, "the ball is not to be seen: {red} red pixels");

    let timings: serde_json::Value = serde_json::from_slice(&std::fs::read(&times).unwrap()).unwrap();
    let frames = timings["frames"].as_array().unwrap();
    assert!(timings["census"]["meshes"].as_u64() > Some(0), "{}", timings["census"]);
    assert_eq!(frames.len(), 3);
    let forward =
        frames[2]["passes"].as_array().unwrap().iter().find(|pass| pass["name"] == "forward").unwrap();
    assert_eq!(forward["lights_tested"], 1);
    assert!(forward["fragment_invocations"].as_u64().unwrap() > 500);
    let wall = frames[2]["wall_ms"].as_f64().unwrap();
    assert!(wall > 0.0 && forward["light_evaluations"].is_null());
    // The time measured outside includes the time that the renderer measured, whose parts add up.
    let account = &frames[2]["accounting"];
    let number = |value: &serde_json::Value| value.as_f64().unwrap();
    assert!(number(&account["wall_ms"]) <= wall, "{account}");
    let stages: f64 = account["stages"].as_array().unwrap().iter().map(|stage| number(&stage["ms"])).sum();
    let parts = stages + number(&account["between_ms"]) + number(&account["passes_ms"])
        - number(&account["overlapped_ms"]);
    let remainder = number(&frames[2]["remainder_ms"]);
    assert!((parts + remainder - number(&account["wall_ms"])).abs() < 1e-6, "{account}");
    let effects = account["effects"].as_array().unwrap();
    let bytes: u64 = effects.iter().map(|effect| effect["uploaded_bytes"].as_u64().unwrap()).sum();
    assert_eq!(bytes, 0, "nothing changes between the frames");
    assert!(frames[0]["accounting"]["effects"].as_array().unwrap().iter().any(|effect| {
        effect["effect"] == "scene"
            && effect["uploaded_bytes"].as_u64() > Some(0)
            && effect["pipelines_made"].as_u64() > Some(0)
    }));

    let account = folder.path().join("account.txt");
    let output = lumbre(&[
        "render",
        text(&path),
        "-o",
        text(&png),
        "--size",
        "96x64",
        "--camera",
        "view",
        "--timings",
        text(&account),
        "--count-lights",
    ]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let account = std::fs::read_to_string(&account).unwrap();
    let of_forward: Vec<&str> =
        account.lines().find(|line| line.contains("  forward ")).unwrap().split_whitespace().collect();
    let [tested, contributing] = [of_forward.len() - 2, of_forward.len() - 1]
        .map(|column| of_forward[column].parse::<u64>().unwrap_or_else(|_| panic!("{account}")));
    assert!(tested > 500 && contributing > 0 && contributing <= tested, "{account}");
    assert!(account.contains("wall clock") && account.contains("remainder"), "{account}");
    let unmeasured = lumbre(&["render", text(&path), "-o", text(&png), "--count-lights"]);
    assert_eq!(unmeasured.status.code(), Some(2), "nobody would see the counts");

    let output = lumbre(&[
        "render",
        text(&path),
        "-o",
        text(&exr),
        "--size",
        "96x64",
        "--camera",
        "view",
        "--shading",
        "flat",
    ]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let linear = image::open(&exr).unwrap().to_rgb32f();
    assert!(linear.pixels().any(|pixel| pixel.0[0] > 1.0), "an EXR keeps the lamp's radiance");
    let left_over = std::fs::read_dir(folder.path()).unwrap().count();
    assert_eq!(left_over, 5, "level, two frames, the timings and an account; nothing half-written");
}

#[test]
fn a_bake_is_loaded_explained_and_drawn() {
    let (folder, path) = level();
    let baked = folder.path().join("level.baked.glb");
    let arguments =
        ["bake", text(&path), "-o", text(&baked), "--quality", "draft", "--map-size", "32", "--json"];
    let output = lumbre(&arguments);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let report: serde_json::Value = serde_json::from_str(&stdout(&output)).unwrap();
    assert!(report["estimated_error"].as_f64().unwrap() < 0.2);
    assert!(!stderr(&output).contains('\r'), "a progress bar in a pipe: {}", stderr(&output));

    let short = stdout(&lumbre(&["explain", text(&path)]));
    assert!(short.contains("+ meshes: 3 meshes to draw\n") && short.contains("--all"), "{short}");
    assert!(
        short.lines().count() < 20
            && short.contains("without linear frame, shadow maps, shadow planes, g-buffer, lightmap"),
        "{short}"
    );
    let measured = stdout(&lumbre(&["explain", text(&path), "--measure=0.1", "--size", "64x48"]));
    let of_emission = measured.lines().find(|line| line.contains("+ emission: 1 mesh")).unwrap_or(&measured);
    assert!(of_emission.contains(" ms, ") && of_emission.ends_with(" % of the picture)"), "{measured}");
    assert!(measured.contains("The account of a frame") && measured.contains("lights tested"), "{measured}");
    let before = stdout(&lumbre(&["explain", text(&path), "--all"]));
    assert!(before.contains("the scene has no lightmapped mesh"), "{before}");
    assert!(!before.contains("LIGHTMAP"), "{before}");
    let after = lumbre(&["explain", text(&baked), "--format", "json"]);
    let after: serde_json::Value = serde_json::from_str(&stdout(&after)).unwrap();
    assert_eq!(after["census"]["lightmapped"], 3);
    let variants = after["variants"].as_object().unwrap();
    assert!(variants.keys().all(|variant| variant.contains("LIGHTMAP")), "{variants:?}");
    assert!(variants.keys().all(|variant| !variant.contains("TEXTURE")), "{variants:?}");
    assert!(stdout(&lumbre(&["explain", text(&baked), "--format", "dot"])).starts_with("digraph"));

    // Before the bake the lamp panel lights nothing, and afterwards it lights the floor.
    let red_sum = |path: &Path, name: &str| {
        let frame = folder.path().join(name);
        let output = lumbre(&[
            "render",
            text(path),
            "-o",
            text(&frame),
            "--size",
            "64x48",
            "--camera",
            "view",
            "--display",
            "linear",
        ]);
        assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
        let frame = image::open(&frame).unwrap().to_rgb32f();
        frame.pixels().map(|pixel| f64::from(pixel.0[0].min(1.0))).sum::<f64>()
    };
    let (unlit, lit) = (red_sum(&path, "before.exr"), red_sum(&baked, "after.exr"));
    assert!(lit > 1.2 * unlit, "baked light adds to the frame: {unlit} before, {lit} after");
}

#[test]
fn playing_without_a_display_draws_a_tour() {
    let (folder, path) = level();
    let frames = folder.path().join("tour");
    let output = Command::new(env!("CARGO_BIN_EXE_lumbre"))
        .args(["play", text(&path), "--frames-dir", text(&frames), "--frames", "7", "--size", "192x108"])
        .env_remove("DISPLAY")
        .env_remove("WAYLAND_DISPLAY")
        .env_remove("WAYLAND_SOCKET")
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let paths: Vec<PathBuf> = stdout(&output).lines().map(PathBuf::from).collect();
    assert_eq!(paths.len(), 7, "{paths:?}");
    // A file without a command is played.
    let again = folder.path().join("again");
    let frames = ["--headless", "--frames-dir", text(&again), "--frames", "7", "--size", "192x108"];
    let output = lumbre(&[&[text(&path)], &frames[..]].concat());
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    assert_eq!(stdout(&output).lines().count(), 7);
    let same = |path: &PathBuf| {
        let other = again.join(path.file_name().unwrap());
        image::open(path).unwrap().to_rgb8() == image::open(other).unwrap().to_rgb8()
    };
    assert!(paths.iter().all(same));
    let pictures: Vec<_> = paths.iter().map(|path| image::open(path).unwrap().to_rgb8()).collect();
    assert!(pictures.iter().all(|picture| picture.dimensions() == (192, 108)));
    assert!(pictures[0] != pictures[pictures.len() / 2], "the tour stands still");
}

#[test]
fn what_moves_in_a_baked_level_is_lit_by_the_bake() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    // A red wall that is lit by a panel, and a moving white ball in front of it.
    let mut world = World::new();
    let block = |size: Vec3| Mesh(Arc::new(lumbre::mesh::shapes::cuboid(size, 1)));
    let wall = (block(Vec3::new(0.2, 3.0, 3.0)), Material::matt(Vec3::new(0.8, 0.05, 0.05)), StaticObject);
    world.spawn((wall, Transform::from_xyz(-1.5, 0.0, 0.0)));
    let glow = Surface { emission: Vec3::splat(12.0), ..Surface::default() };
    let panel =
        (block(Vec3::new(0.1, 1.0, 1.0)), Material { front: glow, ..Material::default() }, StaticObject);
    world.spawn((panel, Transform::from_xyz(2.5, 0.0, 0.0)));
    let ball = Mesh(Arc::new(lumbre::mesh::shapes::uv_sphere(0.5, 24, 12)));
    world.spawn((ball, Material::matt(Vec3::splat(0.8)), DynamicObject, Transform::from_xyz(-0.6, 0.0, 0.0)));
    let eye = Transform::from_xyz(-0.6, 0.0, 3.0).looking_at(DVec3::new(-0.6, 0.0, 0.0), DVec3::Y);
    world.spawn((Camera::default(), eye));
    lumbre::scene::save(&mut world, &path("level.glb")).unwrap();

    let explained = |file: &str| stdout(&lumbre(&["explain", text(&path(file)), "--all"]));
    assert!(explained("level.glb").contains("no volume, though 1 mesh moves: `lumbre bake`"));
    let (level, baked) = (path("level.glb"), path("baked.glb"));
    let bake = ["bake", text(&level), "-o", text(&baked), "--map-size", "32", "--quality", "draft"];
    let output = lumbre(&bake);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    assert!(explained("baked.glb").contains("1 mesh without a lightmap, lit by 1 volume"));

    let drawn = |more: &[&str]| {
        let picture = path("picture.png");
        let mut arguments = vec!["render", text(&baked), "-o", text(&picture), "--size", "64x64"];
        arguments.extend(more);
        let output = lumbre(&arguments);
        assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
        image::open(&picture).unwrap().into_rgb8()
    };
    let lit = drawn(&[]);
    // The left side of the ball faces the wall, and its right side the panel.
    let [left, right] = [21, 42].map(|column| lit.get_pixel(column, 32).0.map(u32::from));
    assert!(left[0] > 30 && left[0] > 2 * left[1], "{left:?}");
    assert!(right[1] > 60 && right[0] < 2 * right[1], "{right:?}");
    let dark = drawn(&["--no-irradiance-volumes"]);
    assert_eq!([21, 42].map(|column| dark.get_pixel(column, 32).0), [[0; 3]; 2], "negative control");
}
