//! Loads and draws every glTF file below a folder, and prints for each the outcome, the time, the notes, and
//! whether its picture shows anything.
//!
//! ```sh
//! cargo run --release -p lumbre --example corpus -- DIR [PICTURES] [--bare] [--strict] [--notes]
//! ```
//!
//! `--bare` draws without a default light and without a metered exposure, for comparison.

#![allow(clippy::print_stdout, reason = "what it says is what it is for")]

use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::Context;
use bevy_ecs::entity::Entity;
use bevy_ecs::query::{Has, With};
use bevy_ecs::world::World;
use lumbre::render::{FrameOptions, Gpu, Offscreen, OffscreenFormat, Renderer, meter};
use lumbre::scene::{
    ActiveCamera, Camera, LoadOptions, add_default_light, default_camera, is_without_light, load_with,
    update_transforms,
};

/// Width and height of the pictures in pixels.
const SIZE: (u32, u32) = (384, 216);
/// A picture with at least this many black pixels in a thousand, and nearly no others, counts as black.
const ALIKE: usize = 995;

/// The options of the program.
struct Asked {
    bare: bool,
    strict: bool,
    notes: bool,
    pictures: Option<PathBuf>,
}

fn main() -> anyhow::Result<()> {
    let (options, places): (Vec<String>, Vec<String>) =
        std::env::args().skip(1).partition(|argument| argument.starts_with("--"));
    let has = |name: &str| options.iter().any(|option| option == name);
    let folder = places.first().context("name a folder: corpus DIR [PICTURES]")?;
    let asked = Asked {
        bare: has("--bare"),
        strict: has("--strict"),
        notes: has("--notes"),
        pictures: places.get(1).map(PathBuf::from),
    };
    if let Some(pictures) = &asked.pictures {
        std::fs::create_dir_all(pictures)?;
    }
    let mut files = Vec::new();
    find(Path::new(folder), &mut files)?;
    files.sort();
    let gpu = Gpu::headless()?;
    let mut counts = std::collections::BTreeMap::new();
    for file in &files {
        let start = Instant::now();
        let (outcome, said) = match draw(&gpu, file, Path::new(folder), &asked) {
            Ok((outcome, notes)) => (outcome, notes),
            Err(error) => ("refused", vec![format!("{error:#}")]),
        };
        *counts.entry(outcome).or_insert(0) += 1;
        let name = file.strip_prefix(folder).unwrap_or(file).display();
        println!("{outcome:8} {:7.2} s  {:2} notes  {name}", start.elapsed().as_secs_f64(), said.len());
        for line in said.iter().filter(|_| asked.notes || outcome == "refused") {
            println!("           {line}");
        }
    }
    let counts: Vec<String> = counts.iter().map(|(outcome, count)| format!("{count} {outcome}")).collect();
    println!("{} files: {}", files.len(), counts.join(", "));
    Ok(())
}

fn find(folder: &Path, files: &mut Vec<PathBuf>) -> anyhow::Result<()> {
    for entry in std::fs::read_dir(folder).with_context(|| folder.display().to_string())? {
        let path = entry?.path();
        let extension =
            path.extension().and_then(|extension| extension.to_str()).map(str::to_ascii_lowercase);
        if path.is_dir() {
            find(&path, files)?;
        } else if matches!(extension.as_deref(), Some("glb" | "gltf")) {
            files.push(path);
        }
    }
    Ok(())
}

/// Draws a file and returns what its picture shows, and the notes.
fn draw(gpu: &Gpu, file: &Path, folder: &Path, asked: &Asked) -> anyhow::Result<(&'static str, Vec<String>)> {
    let mut world = World::new();
    let root = (!asked.strict).then(|| folder.to_owned());
    let options = LoadOptions { lenient: !asked.strict, root, ..LoadOptions::default() };
    let report = load_with(&mut world, file, &options)?;
    let mut notes: Vec<String> = report.notes.iter().map(ToString::to_string).collect();
    let aspect = f64::from(SIZE.0) / f64::from(SIZE.1);
    let mut cameras = world.query_filtered::<(Entity, Has<ActiveCamera>), With<Camera>>();
    let camera = cameras.iter(&world).max_by_key(|(entity, active)| (*active, std::cmp::Reverse(*entity)));
    let camera = match camera.map(|(entity, _)| entity) {
        Some(camera) => camera,
        None => {
            let made = default_camera(&mut world, aspect);
            let camera = world.spawn(made).id();
            update_transforms(&mut world);
            camera
        }
    };
    let mut frame = FrameOptions { camera: Some(camera), ..FrameOptions::default() };
    if !asked.bare {
        if is_without_light(&mut world) {
            add_default_light(&mut world, camera);
            notes.push("default light".to_owned());
        }
        if report.photometric_lights > 0
            && !report.states_exposure
            && let Some(found) = meter(gpu, &mut world, &frame, aspect)?.filter(|found| found.clipped > 0.02)
        {
            frame.exposure = Some(found.exposure);
            notes.push(format!("exposure {:.3e}, metered", found.exposure));
        }
    }
    let target = Offscreen::new(gpu, SIZE.0, SIZE.1, OffscreenFormat::Rgba8)?;
    Renderer::new(gpu).render(&mut world, &target.target(), &frame)?;
    let mut pixels = target.read_rgba8(gpu)?;
    pixels.chunks_exact_mut(4).for_each(|pixel| pixel[3] = 255);
    let outcome = judged(&pixels, report.triangles);
    if let Some(pictures) = &asked.pictures {
        let name = file.strip_prefix(folder).unwrap_or(file).to_string_lossy().replace(['/', '\\'], "_");
        image::save_buffer(
            pictures.join(format!("{name}.png")),
            &pixels,
            SIZE.0,
            SIZE.1,
            image::ColorType::Rgba8,
        )?;
    }
    Ok((outcome, notes))
}

/// Classifies a picture as empty, black, white, or a picture. Pixels of the black background are ignored when
/// it is tested for white.
fn judged(pixels: &[u8], triangles: usize) -> &'static str {
    let pixels: Vec<&[u8]> = pixels.chunks_exact(4).collect();
    let is_dark = |pixel: &[u8]| pixel[..3].iter().all(|&channel| channel < 8);
    let is_white = |pixel: &[u8]| pixel[..3].iter().all(|&channel| channel > 247);
    let shown: Vec<&[u8]> = pixels.iter().copied().filter(|pixel| !is_dark(pixel)).collect();
    let black = pixels.len() - shown.len();
    if triangles == 0 {
        "empty"
    } else if black == pixels.len() || black * 1000 >= ALIKE * pixels.len() && shown.len() < 60 {
        "black"
    } else if shown.iter().filter(|pixel| is_white(pixel)).count() * 10 >= shown.len() * 9 {
        "white"
    } else {
        "picture"
    }
}
