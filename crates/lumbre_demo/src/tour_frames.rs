//! Draws the tour of a level into PNG files, for machines without a display.

use std::path::{Path, PathBuf};
use std::time::Duration;

use anyhow::{Context, Result};
use lumbre_render::{FrameOptions, Gpu, Offscreen, OffscreenFormat, Renderer};

use crate::picture::write_png;
use crate::{Game, Input, Tour};

/// Game time between two frames.
const BETWEEN: Duration = Duration::from_millis(200);

/// Flies through a level and writes `frames` pictures of `size` pixels (width, height) into `out_dir`, which
/// is created if needed. Lights and props move as they do in the game. Returns the paths of the pictures, in
/// order.
///
/// # Errors
/// The level cannot be loaded, there is no device, or a picture cannot be drawn or written.
/// The level cannot be loaded, there is no device, or a picture cannot be drawn or written.
pub fn tour(level: &Path, out_dir: &Path, frames: u32, size: (u32, u32)) -> Result<Vec<PathBuf>> {
    tour_of(Game::load(level)?, out_dir, frames, size, None)
}

/// Does what [`tour`] does for a level that is already loaded, with an exposure that replaces the camera's if
/// it is given.
///
/// # Errors
/// There is no device, or a picture cannot be drawn or written.
pub fn tour_of(
    mut game: Game,
    out_dir: &Path,
    frames: u32,
    size: (u32, u32),
    exposure: Option<f32>,
) -> Result<Vec<PathBuf>> {
    std::fs::create_dir_all(out_dir)
        .with_context(|| format!("cannot make the folder {}", out_dir.display()))?;
    let bounds = game.level().bounds();
    let tour = Tour::of(&mut game.world, bounds);
    let gpu = Gpu::headless()?;
    let mut renderer = Renderer::new(&gpu);
    let picture = Offscreen::new(&gpu, size.0, size.1, OffscreenFormat::Rgba8)?;
    let options = FrameOptions { multisample: Some(true), exposure, ..FrameOptions::default() };
    let mut paths = Vec::new();
    for frame in 0..frames {
        let part = f64::from(frame) / f64::from(frames.saturating_sub(1).max(1));
        game.step(BETWEEN, &Input::default());
        game.look_from(&tour.view(part));
        renderer.render(&mut game.world, &picture.target(), &options)?;
        let path = out_dir.join(format!("tour-{:03}.png", frame + 1));
        write_png(&path, size.0, size.1, &picture.read_rgba8(&gpu)?)?;
        paths.push(path);
    }
    Ok(paths)
}
