//! A level and other files in a window of a virtual X server: pictures with the overlay, resizing, a lost
//! device, recorded input, orbiting, dropped files (simulated in the event loop, and by another program over
//! X11), background bakes, and an adapting exposure.
//!
//! A window needs the main thread and an event loop of its own, so every scenario is a process: this program
//! starts itself.

mod drag_and_drop;

use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

use anyhow::ensure;
use bevy_ecs::world::World;
use glam::{DVec3, Vec3};
use lumbre_bake::{BakeOptions, Density};
use lumbre_demo::{Action, PlayOptions, Trial};
use lumbre_mesh::shapes::cuboid;
use lumbre_optics::{Light, Material, Shading, Surface};
use lumbre_scene::{
    Camera, DynamicObject, Mesh, Name, SceneSettings, StaticObject, Transform, save, update_transforms,
};

/// Environment variable that tells a child process its scenario.
const SCENARIO: &str = "LUMBRE_WINDOW_SCENARIO";
/// Environment variable that tells a child process where to write its picture.
const PICTURE: &str = "LUMBRE_WINDOW_PICTURE";
/// Environment variable with a folder in which the pictures are kept.
const KEEP: &str = "LUMBRE_WINDOW_KEEP";
const SIZE: (u32, u32) = (640, 400);
/// Size of a window with two pictures side by side, and a panel over a part of the right one.
const SIZE_OF_TWO: (u32, u32) = (1000, 600);

/// The scenario in which this process drops the file on the child's window.
const DROPPED_OVER_X11: &str = "dropped over X11";
/// Number of frames that the child waits for that file.
const FRAMES_FOR_A_DROP: u32 = 200;

/// Checks the picture of a scenario.
type Judge = fn(&Path);
/// Every scenario by name, with the check of its picture.
const SCENARIOS: [(&str, Judge); 20] = [
    ("overlay", picture_with_overlay),
    ("no overlay", picture_without_overlay),
    ("resize", picture_of_other_size),
    ("lost device", picture_with_overlay),
    ("recorded input", picture_with_overlay),
    ("a file", picture_of_the_red_box),
    ("turned", picture_of_the_green_side),
    ("its camera", picture_from_its_camera),
    ("dropped", picture_of_the_red_box),
    (DROPPED_OVER_X11, picture_of_the_red_box),
    ("dropped and broken", picture_of_the_red_box_and_an_error),
    ("not baked", picture_without_baked_light),
    ("baked", picture_with_baked_light),
    ("baked at once", picture_with_baked_light),
    ("bake cancelled", picture_without_baked_light),
    ("bake of nothing that shines", picture_under_a_sky),
    ("adapted", picture_with_an_exposure),
    ("beside its reference", picture_of_the_dark_and_the_bright_wall),
    ("reference on a new device", picture_of_the_dark_and_the_bright_wall),
    ("better settings", picture_of_two_bright_walls),
];

fn main() {
    if let Ok(scenario) = std::env::var(SCENARIO) {
        let picture = PathBuf::from(std::env::var_os(PICTURE).expect("the parent process sets it"));
        play(&scenario, &picture).expect("the window works");
        return;
    }
    let Some(server) = Server::start() else {
        eprintln!(
            "SKIPPED: Xvfb is not installed, no window was opened (Debian and Ubuntu: apt-get install xvfb)"
        );
        return;
    };
    let folder = tempfile::tempdir().expect("a temporary folder");
    for (scenario, judge) in SCENARIOS {
        let picture = folder.path().join("picture.png");
        let mut window = Command::new(std::env::current_exe().expect("this program"))
            .env(SCENARIO, scenario)
            .env(PICTURE, &picture)
            .env("DISPLAY", &server.display)
            // Mesa warns without it.
            .env("XDG_RUNTIME_DIR", folder.path())
            .env_remove("WAYLAND_DISPLAY")
            .env_remove("WAYLAND_SOCKET")
            .spawn()
            .expect("this program starts");
        if scenario == DROPPED_OVER_X11 {
            // URIs encode blanks and non-ASCII letters differently from paths.
            let dropped = folder.path().join("a box, größer.glb");
            write_box(&dropped);
            drag_and_drop::drop_file(&server.display, &dropped).expect("the window takes the file");
        }
        let status = window.wait().expect("this program ends");
        assert!(status.success(), "{scenario}: {status}");
        judge(&picture);
        if let Some(folder) = std::env::var_os(KEEP) {
            let kept = Path::new(&folder).join(format!("{scenario}.png"));
            std::fs::copy(&picture, kept).expect("the folder to keep pictures in");
        }
        std::fs::remove_file(&picture).expect("the picture was there");
        eprintln!("test {scenario} ... ok");
    }
}

fn play(scenario: &str, picture: &Path) -> anyhow::Result<()> {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    let level = here.join("../../assets/demo.glb");
    let mut options = PlayOptions {
        size: SIZE,
        screenshot: Some(picture.to_owned()),
        quit_after: Some(10),
        wait_for_work: true,
        ..PlayOptions::default()
    };
    options.open.bake = BakeOptions { density: Density::MapSize(32), error: 0.1, ..BakeOptions::default() };
    let folder = tempfile::tempdir()?;
    let file = |name: &str, write: fn(&Path)| {
        let path = folder.path().join(name);
        write(&path);
        path
    };
    let hide = (0, Trial::Act(Action::ToggleOverlay));
    let level = match scenario {
        "a file" => {
            options.trials = vec![hide];
            file("box.glb", write_box)
        }
        "turned" => {
            options.input = Some(here.join("tests/walks/turn.json"));
            options.trials = vec![hide];
            file("box.glb", write_box)
        }
        "its camera" => {
            options.trials = vec![hide, (1, Trial::Act(Action::NextCamera))];
            file("box.glb", write_box)
        }
        "dropped" => {
            options.trials = vec![hide, (2, Trial::Drop(file("box.glb", write_box)))];
            file("room.glb", write_room)
        }
        DROPPED_OVER_X11 => {
            options.trials = vec![hide];
            options.quit_after = Some(FRAMES_FOR_A_DROP);
            file("room.glb", write_room)
        }
        "dropped and broken" => {
            let broken = file("broken.glb", |path| std::fs::write(path, "glTF?").expect("there is room"));
            options.trials = vec![hide, (2, Trial::Drop(broken))];
            file("box.glb", write_box)
        }
        "not baked" => {
            options.trials = vec![hide];
            file("room.glb", write_room)
        }
        "baked" => {
            options.trials = vec![hide, (2, Trial::Act(Action::ToggleBake))];
            file("room.glb", write_room)
        }
        "baked at once" => {
            options.bake = true;
            options.trials = vec![hide];
            file("room.glb", write_room)
        }
        "bake cancelled" => {
            options.trials = vec![hide, (2, Trial::Act(Action::ToggleBake)), (3, Trial::Escape)];
            file("room.glb", write_room)
        }
        "bake of nothing that shines" => {
            options.trials = vec![hide, (2, Trial::Act(Action::ToggleBake))];
            file("box.glb", write_box)
        }
        "adapted" => {
            options.trials = vec![hide];
            file("bright.gltf", write_bright)
        }
        "beside its reference" => {
            options.size = SIZE_OF_TWO;
            options.trials = vec![hide, (0, Trial::Act(Action::ToggleReference))];
            file("wall.glb", write_coarse_wall)
        }
        "reference on a new device" => {
            options.size = SIZE_OF_TWO;
            options.trials = vec![hide, (0, Trial::Act(Action::ToggleReference)), (4, Trial::LoseDevice)];
            file("wall.glb", write_coarse_wall)
        }
        "better settings" => {
            options.size = SIZE_OF_TWO;
            options.input = Some(here.join("tests/walks/better_settings.json"));
            options.quit_after = None;
            file("wall.glb", write_coarse_wall)
        }
        _ => level,
    };
    match scenario {
        "no overlay" => options.input = Some(here.join("tests/walks/no_overlay.json")),
        "recorded input" => options.input = Some(here.join("tests/walks/hall_to_corridor.json")),
        "resize" => {
            options.trials =
                vec![(2, Trial::Resize(500, 300)), (4, Trial::Vanish), (4, Trial::Resize(420, 300))]
        }
        "lost device" => options.trials = vec![(3, Trial::LoseDevice), (5, Trial::LoseDevice)],
        _ => {}
    }
    let is_kept = options.bake;
    lumbre_demo::run(&level, options)?;
    let baked = folder.path().join("room.baked.glb");
    ensure!(baked.exists() == is_kept, "{} is written where that was asked for only", baked.display());
    Ok(())
}

/// A box with a red front and a green right side, without a light, and a camera that sees it from far above.
fn write_box(path: &Path) {
    let mut world = World::new();
    let matt = |color| Material { double_sided: false, ..Material::matt(color) };
    let part = |size: Vec3| (Mesh(cuboid(size, 1).into()), StaticObject);
    let red = matt(Vec3::new(0.8, 0.02, 0.02));
    world.spawn((Name::new("red"), part(Vec3::new(2.0, 2.0, 1.9)), red));
    let green = (part(Vec3::new(0.1, 1.9, 1.8)), matt(Vec3::new(0.02, 0.8, 0.02)));
    world.spawn((Name::new("green"), green, Transform::from_xyz(1.0, 0.0, 0.0)));
    let above = Transform::from_xyz(0.0, 30.0, 0.1).looking_at(DVec3::ZERO, DVec3::Y);
    world.spawn((Name::new("above"), Camera::default(), above));
    save(&mut world, path).expect("the folder takes it");
}

/// A room with an open front, lit only by an emissive panel that needs a bake, and with one moving object.
fn write_room(path: &Path) {
    let mut world = World::new();
    let grey = || Material { double_sided: true, ..Material::matt(Vec3::splat(0.6)) };
    let wall = |size: Vec3| (Mesh(cuboid(size, 1).into()), grey(), StaticObject);
    for (name, size, place) in [
        ("floor", Vec3::new(4.0, 0.2, 4.0), (0.0, -0.1, 0.0)),
        ("ceiling", Vec3::new(4.0, 0.2, 4.0), (0.0, 3.1, 0.0)),
        ("back", Vec3::new(4.0, 3.0, 0.2), (0.0, 1.5, -2.1)),
        ("left", Vec3::new(0.2, 3.0, 4.0), (-2.1, 1.5, 0.0)),
        ("right", Vec3::new(0.2, 3.0, 4.0), (2.1, 1.5, 0.0)),
    ] {
        world.spawn((Name::new(name), wall(size), Transform::from_xyz(place.0, place.1, place.2)));
    }
    let glow = Surface { emission: Vec3::new(6.0, 5.0, 4.0), ..Surface::default() };
    let panel = (Mesh(cuboid(Vec3::new(1.0, 0.05, 1.0), 1).into()), StaticObject);
    let panel = (panel, Material { front: glow, ..Material::default() }, Transform::from_xyz(0.0, 2.9, 0.0));
    world.spawn((Name::new("panel"), panel));
    let ball = (Mesh(cuboid(Vec3::splat(0.4), 1).into()), grey(), DynamicObject);
    world.spawn((Name::new("moves"), ball, Transform::from_xyz(1.2, 0.4, 0.5)));
    // So weak that the frame is nearly black, but enough that no default light is added.
    let weak = Light { bake: lumbre_optics::BakeMode::Dynamic, ..Light::point(Vec3::splat(1e-3)) };
    world.spawn((Name::new("weak"), weak, Transform::from_xyz(0.0, 1.5, 1.0)));
    save(&mut world, path).expect("the folder takes it");
}

/// A white wall under a sun in lux, which is overexposed without metering.
fn write_bright(path: &Path) {
    let mut world = World::new();
    let floor = (Mesh(cuboid(Vec3::new(4.0, 4.0, 0.1), 1).into()), Material::matt(Vec3::splat(0.5)));
    world.spawn((Name::new("wall"), floor, StaticObject));
    world.spawn((Name::new("sun"), Light::directional(Vec3::ONE), Transform::IDENTITY));
    save(&mut world, path).expect("the folder takes it");
    let text = std::fs::read_to_string(path).expect("a .gltf is text");
    let mut json: serde_json::Value = serde_json::from_str(&text).expect("it is JSON");
    // As other programs write it: in lux, and without extensions of this project.
    json["extensions"]["KHR_lights_punctual"]["lights"][0] =
        serde_json::json!({"type": "directional", "intensity": 50_000.0});
    std::fs::write(path, json.to_string()).expect("the folder takes it");
}

/// A wall of two triangles with a lamp in front of its centre, under Gouraud shading: dark, where Phong
/// shading would make it bright.
fn write_coarse_wall(path: &Path) {
    let mut world = World::new();
    world.insert_resource(SceneSettings { shading: Shading::Gouraud, ..SceneSettings::default() });
    let wall = (Mesh(cuboid(Vec3::new(8.0, 5.0, 0.2), 1).into()), Material::matt(Vec3::splat(0.7)));
    world.spawn((Name::new("wall"), wall, StaticObject));
    let lamp = Light { bake: lumbre_optics::BakeMode::Dynamic, ..Light::point(Vec3::splat(1.2)) };
    world.spawn((Name::new("lamp"), lamp, Transform::from_xyz(0.0, 0.0, 1.0)));
    let eye = Transform::from_xyz(0.0, 0.0, 5.0).looking_at(DVec3::ZERO, DVec3::Y);
    world.spawn((Name::new("start"), Camera::default(), eye));
    update_transforms(&mut world);
    save(&mut world, path).expect("the folder takes it");
}

fn open(path: &Path) -> image::RgbImage {
    image::open(path).expect("a picture").to_rgb8()
}

/// Counts bright pixels on the dark panel in the upper left, where the overlay has its text.
fn letters(picture: &image::RgbImage) -> usize {
    let corner = picture.enumerate_pixels().filter(|(x, y, _)| *x < 330 && *y < 250);
    corner.filter(|(_, _, p)| p.0.iter().all(|&c| c > 120) && p.0.iter().max() == p.0.iter().min()).count()
}

/// Checks that the part of a picture that no overlay covers is neither black nor of one colour.
fn shows_the_level(picture: &image::RgbImage) {
    let right: Vec<u8> = picture
        .enumerate_pixels()
        .filter(|(x, _, _)| *x > picture.width() * 4 / 5)
        .map(|(_, _, p)| p.0[1])
        .collect();
    let (least, most) = (right.iter().min().expect("texels"), right.iter().max().expect("texels"));
    assert!(most - least > 30, "from {least} to {most}");
}

fn picture_with_overlay(path: &Path) {
    let picture = open(path);
    assert_eq!(picture.dimensions(), SIZE);
    shows_the_level(&picture);
    // A few hundred letters of some twenty grey pixels each.
    assert!(letters(&picture) > 1000, "{} texels of letters", letters(&picture));
}

fn picture_without_overlay(path: &Path) {
    let picture = open(path);
    shows_the_level(&picture);
    assert!(letters(&picture) < 400, "{} texels of letters", letters(&picture));
}

fn picture_of_other_size(path: &Path) {
    let picture = open(path);
    assert_eq!(picture.dimensions(), (420, 300));
}

/// Returns the mean colour of the centre of a picture, 0 to 255.
fn middle(path: &Path) -> [f64; 3] {
    let picture = open(path);
    assert_eq!(picture.dimensions(), SIZE);
    let pixels: Vec<_> = picture
        .enumerate_pixels()
        .filter(|(x, y, _)| x.abs_diff(SIZE.0 / 2) < 30 && y.abs_diff(SIZE.1 / 2) < 30)
        .map(|(_, _, p)| p.0)
        .collect();
    [0, 1, 2].map(|c| pixels.iter().map(|p| f64::from(p[c])).sum::<f64>() / pixels.len() as f64)
}

/// Returns the fraction of pixels that are not black.
fn shown(path: &Path) -> f64 {
    let picture = open(path);
    let lit = picture.pixels().filter(|p| p.0.iter().any(|&c| c > 12)).count();
    lit as f64 / f64::from(SIZE.0 * SIZE.1)
}

/// The file has no light, so the default light from the camera shows the box, which fills the window's
/// height.
fn picture_of_the_red_box(path: &Path) {
    let [red, green, _] = middle(path);
    assert!(red > 100.0 && green < 0.4 * red, "{red} {green}");
    let part = shown(path);
    assert!((0.3..0.7).contains(&part), "{part} of the window shows it");
}

fn picture_of_the_green_side(path: &Path) {
    let [red, green, _] = middle(path);
    assert!(green > 100.0 && red < 0.4 * green, "{red} {green}");
}

fn picture_from_its_camera(path: &Path) {
    let [red, green, _] = middle(path);
    assert!(red > 30.0 && green < red, "{red} {green}");
    let part = shown(path);
    assert!(part > 1e-3 && part < 0.05, "{part} of the window shows it");
}

/// The previous file stays, and the error is shown at the foot of the window.
fn picture_of_the_red_box_and_an_error(path: &Path) {
    let [red, green, _] = middle(path);
    assert!(red > 100.0 && green < 0.4 * red, "{red} {green}");
    let picture = open(path);
    let foot = picture.enumerate_pixels().filter(|(_, y, _)| *y > SIZE.1 - 80);
    // Pixels in the colour of errors that a letter covers fully.
    let letters =
        foot.filter(|(_, _, p)| p.0[0] > 200 && p.0[1].abs_diff(p.0[2]) < 40 && p.0[1] > 80).count();
    assert!(letters > 100, "{letters} texels of letters");
}

fn picture_without_baked_light(path: &Path) {
    let picture = middle(path);
    assert!(picture.iter().all(|&channel| channel < 20.0), "{picture:?}");
}

fn picture_with_baked_light(path: &Path) {
    let picture = middle(path);
    assert!(picture.iter().all(|&channel| channel > 60.0), "{picture:?}");
    assert!(picture[0] > picture[2] + 5.0, "the panel is warm: {picture:?}");
}

/// Red under a white sky, evenly lit by its lightmap and no longer by lights at the camera.
fn picture_under_a_sky(path: &Path) {
    let [red, green, blue] = middle(path);
    assert!(red > 100.0 && green < 0.4 * red && blue < 0.4 * red, "{red} {green} {blue}");
    let picture = open(path);
    let at = |x: u32| f64::from(picture.get_pixel(x, SIZE.1 / 2).0[0]);
    let (left, right) = (at(SIZE.0 / 2 - 40), at(SIZE.0 / 2 + 40));
    assert!((left - right).abs() < 4.0, "{left} and {right}: no light comes from the left any more");
}

/// Middle grey, after the tone curve.
fn picture_with_an_exposure(path: &Path) {
    let picture = middle(path);
    assert!(picture.iter().all(|&channel| (90.0..150.0).contains(&channel)), "{picture:?}");
}

/// Returns the mean brightness left and right of the centre of a window with two pictures, 0 to 255, where no
/// panel is.
fn left_and_right(path: &Path) -> [f64; 2] {
    let picture = open(path);
    assert_eq!(picture.dimensions(), SIZE_OF_TWO);
    let (middle, height) = (SIZE_OF_TWO.0 / 2, SIZE_OF_TWO.1 / 2);
    [middle - 70..middle - 10, middle + 10..middle + 70].map(|columns| {
        let inside = |x: &u32, y: &u32| columns.contains(x) && y.abs_diff(height) < 30;
        let pixels: Vec<f64> = picture
            .enumerate_pixels()
            .filter(|(x, y, _)| inside(x, y))
            .map(|(_, _, pixel)| f64::from(pixel.0[1]))
            .collect();
        pixels.iter().sum::<f64>() / pixels.len() as f64
    })
}

/// The frame on the left is dark, and the reference on the right is bright.
fn picture_of_the_dark_and_the_bright_wall(path: &Path) {
    let [frame, reference] = left_and_right(path);
    assert!(frame < 90.0 && reference > 140.0, "{frame} and {reference}");
}

/// The better settings, as measured, look like the reference.
fn picture_of_two_bright_walls(path: &Path) {
    let [frame, reference] = left_and_right(path);
    assert!(frame > 140.0 && (frame - reference).abs() < 4.0, "{frame} and {reference}");
}

/// A virtual X server, which ends when this value is dropped.
struct Server {
    process: Child,
    display: String,
}

impl Server {
    fn start() -> Option<Self> {
        // Xvfb chooses a free display itself and writes its number.
        let mut process = Command::new("Xvfb")
            .args(["-displayfd", "1", "-screen", "0", "1280x1024x24", "-nolisten", "tcp"])
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .ok()?;
        let mut number = String::new();
        let mut output = process.stdout.take()?;
        let mut byte = [0];
        while output.read(&mut byte).ok()? == 1 && byte != *b"\n" {
            number.push(char::from(byte[0]));
        }
        Some(Self { process, display: format!(":{number}") })
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        // It may already have ended.
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}
