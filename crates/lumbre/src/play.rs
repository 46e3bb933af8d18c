//! `lumbre play` and `lumbre FILE.glb`: opens the demo level or another file in a window, or without a
//! display writes a tour of it to PNG files.

use std::io::Write;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use anyhow::Context;
use lumbre::bake::{Bake, BakeOptions};
use lumbre::demo::{self, Opened};
use lumbre::render::{FrameOptions, Gpu};
use lumbre::scene;

use crate::arguments::{Exposure, Play, Reading};
use crate::loading::{Loaded, exposure, load_options, load_source};
use crate::progress::Shown;

/// Runs the command.
pub fn run(asked: &Play) -> anyhow::Result<()> {
    let is_headless = asked.headless || !demo::has_display();
    let level = match &asked.level {
        Some(level) => Level { path: level.clone(), is_baked_beside_frames: false },
        // Pictures that are kept and walks that are compared need the final light from the start.
        None => demo_level(is_headless || asked.screenshot.is_some() || asked.input.is_some())?,
    };
    let Level { path: level, is_baked_beside_frames } = level;
    let options = open_options(asked);
    let mut opened = Opened::open(&level, &options)?;
    for note in &opened.notes {
        eprintln!("lumbre: note: {}: {note}", level.display());
    }
    if is_headless {
        let exposure = exposure_of_tour(&mut opened, asked)?;
        let paths = demo::tour_of(opened.game, &asked.frames_dir, asked.frames, asked.size, exposure)?;
        let mut out = std::io::stdout().lock();
        for path in paths {
            writeln!(out, "{}", path.display())?;
        }
        return Ok(());
    }
    let options = demo::PlayOptions {
        open: options,
        bake: is_baked_beside_frames,
        input: asked.input.clone(),
        record: asked.record.clone(),
        screenshot: asked.screenshot.clone(),
        quit_after: asked.quit_after,
        ..demo::PlayOptions::default()
    };
    demo::run_opened(opened, options)
}

fn open_options(asked: &Play) -> demo::OpenOptions {
    let exposure = match asked.exposure {
        None => demo::Exposure::AsNeeded,
        Some(Exposure::Auto) => demo::Exposure::Auto,
        Some(Exposure::Factor(factor)) => demo::Exposure::Factor(factor),
    };
    let load = load_options(&asked.reading);
    demo::OpenOptions { load, default_light: !asked.no_default_light, exposure, ..Default::default() }
}

/// Returns one exposure for all pictures of a tour, metered at its start if needed.
fn exposure_of_tour(opened: &mut Opened, asked: &Play) -> anyhow::Result<Option<f32>> {
    let aspect = f64::from(asked.size.0) / f64::from(asked.size.1);
    let (options, photometric) = (FrameOptions::default(), opened.is_photometric);
    let is_metered = match asked.exposure {
        Some(Exposure::Factor(factor)) => return Ok(Some(factor)),
        Some(Exposure::Auto) => true,
        None => photometric,
    };
    if !is_metered {
        return Ok(None);
    }
    let gpu = Gpu::headless()?;
    exposure(asked.exposure, photometric, &mut opened.game.world, &gpu, &options, aspect, &opened.path)
}

/// A file to play.
struct Level {
    path: PathBuf,
    /// Whether the window bakes it in the background.
    is_baked_beside_frames: bool,
}

/// Returns the demo level, baked. If the baked file is missing or older than the level, it is baked now if
/// light is needed from the first frame on, and otherwise in the window.
fn demo_level(needs_light: bool) -> anyhow::Result<Level> {
    let source = demo_source()?;
    let baked = source.with_file_name("demo.baked.glb");
    let time = |path: &Path| std::fs::metadata(path).and_then(|data| data.modified()).ok();
    if time(&baked).is_some_and(|baked| time(&source).is_none_or(|source| source <= baked)) {
        return Ok(Level { path: baked, is_baked_beside_frames: false });
    }
    if !needs_light {
        eprintln!("lumbre: {} is baked while it is played (once)", source.display());
        return Ok(Level { path: source, is_baked_beside_frames: true });
    }
    bake_demo_level(&source, &baked)?;
    Ok(Level { path: baked, is_baked_beside_frames: false })
}

fn bake_demo_level(source: &Path, baked: &Path) -> anyhow::Result<()> {
    eprintln!("lumbre: baking {} (once)", source.display());
    let (file, Loaded { mut world, .. }) = load_source(source, &Reading::default())?;
    let mut shown = Shown::new(false);
    let options = BakeOptions { error: 0.02, ..BakeOptions::default() };
    let progress = |progress| {
        shown.update(progress);
        ControlFlow::Continue(())
    };
    Bake::new(&options).progress(progress).run(&mut world)?;
    shown.finish();
    scene::save_baked(&mut world, &file, baked, &scene::SaveOptions::default())?;
    Ok(())
}

/// Finds `assets/demo.glb` in the working folder, beside the program, or in the source tree that it was built
/// from.
fn demo_source() -> anyhow::Result<PathBuf> {
    let mut places = vec![PathBuf::from("assets")];
    if let Some(folder) = std::env::current_exe().ok().and_then(|path| Some(path.parent()?.to_owned())) {
        places.push(folder.join("assets"));
    }
    places.push(PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../assets")));
    places.iter().map(|place| place.join("demo.glb")).find(|path| path.exists()).context(
        "the demo level assets/demo.glb is not found: run this in the project's folder, or name a level",
    )
}
