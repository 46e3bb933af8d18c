//! `lumbre play`: the demo level, or any other. Without a display, a tour of it in PNG frames.

use std::io::Write;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use anyhow::Context;
use lumbre::bake::{BakeOptions, Probes, bake};
use lumbre::demo::{self, Game};
use lumbre::render::{FrameOptions, Gpu};
use lumbre::scene::{self, Camera};

use crate::arguments::{Exposure, Play, Reading};
use crate::loading::{Loaded, exposure, light_by_default, load, load_source};
use crate::progress::Shown;

/// Runs the command.
pub fn run(asked: &Play) -> anyhow::Result<()> {
    let level = match &asked.level {
        Some(level) => level.clone(),
        None => demo_level()?,
    };
    let game = game(&level, asked)?;
    if asked.headless || !demo::has_display() {
        let paths = demo::tour_of(game, &asked.frames_dir, asked.frames, asked.size)?;
        let mut out = std::io::stdout().lock();
        for path in paths {
            writeln!(out, "{}", path.display())?;
        }
        return Ok(());
    }
    let options = demo::PlayOptions {
        title: format!("Lumbre: {}", level.file_stem().unwrap_or_default().to_string_lossy()),
        input: asked.input.clone(),
        record: asked.record.clone(),
        screenshot: asked.screenshot.clone(),
        quit_after: asked.quit_after,
        ..demo::PlayOptions::default()
    };
    demo::run_game(game, options)
}

/// The level with the player in it, lit and exposed so that something can be seen.
fn game(level: &Path, asked: &Play) -> anyhow::Result<Game> {
    let Loaded { world, report } = load(level, &asked.reading)?;
    let mut game = Game::new(world).with_context(|| level.display().to_string())?;
    let camera = game.camera();
    if !asked.no_default_light {
        light_by_default(&mut game.world, camera, level);
    }
    let physical = report.photometric_lights > 0 && !report.states_exposure;
    let exposure = match asked.exposure {
        Some(Exposure::Factor(factor)) => Some(factor),
        None if !physical => None,
        _ => {
            let aspect = f64::from(asked.size.0) / f64::from(asked.size.1);
            let mut seen = Loaded { world: std::mem::take(&mut game.world), report };
            let metered = exposure(
                asked.exposure,
                &mut seen,
                &Gpu::headless()?,
                &FrameOptions::default(),
                aspect,
                level,
            );
            game.world = seen.world;
            metered?
        }
    };
    if let (Some(exposure), Some(mut lens)) = (exposure, game.world.get_mut::<Camera>(camera)) {
        lens.exposure = exposure;
    }
    Ok(game)
}

/// The baked demo level; baked now if it is not there or older than the level.
fn demo_level() -> anyhow::Result<PathBuf> {
    let source = demo_source()?;
    let baked = source.with_file_name("demo.baked.glb");
    let time = |path: &Path| std::fs::metadata(path).and_then(|data| data.modified()).ok();
    if time(&baked).is_some_and(|baked| time(&source).is_none_or(|source| source <= baked)) {
        return Ok(baked);
    }
    eprintln!("lumbre: baking {} (once)", source.display());
    let (file, Loaded { mut world, .. }) = load_source(&source, &Reading::default())?;
    let mut shown = Shown::new(false);
    // Frames do not read probes.
    let options = BakeOptions { error: 0.02, probes: Probes::Never, ..BakeOptions::default() };
    bake(&mut world, &options, &mut |progress| {
        shown.update(progress);
        ControlFlow::Continue(())
    })?;
    shown.finish();
    scene::save_baked(&mut world, &file, &baked, &scene::SaveOptions::default())?;
    Ok(baked)
}

/// `assets/demo.glb` under the working folder, beside the program, or in the source tree it was built from.
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
