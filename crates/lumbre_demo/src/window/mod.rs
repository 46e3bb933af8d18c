//! The game in a window: events in, frames out. Not its rules: those know no window.

mod app;
mod keys;
mod mouse;
mod overlay;
mod overlay_painter;
mod stage;

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use winit::event_loop::EventLoop;

use crate::{Game, Recording};

/// How a level is played.
#[derive(Clone, Debug)]
pub struct PlayOptions {
    /// Width and height of the window in points.
    pub size: (u32, u32),
    /// The window's title.
    pub title: String,
    /// Plays this recording instead of listening to the keyboard; the window closes at its end.
    pub input: Option<PathBuf>,
    /// Records what is played to this file.
    pub record: Option<PathBuf>,
    /// Writes the last frame, with its overlay, to a PNG.
    pub screenshot: Option<PathBuf>,
    /// Closes the window after so many frames.
    pub quit_after: Option<u32>,
    /// What befalls the window after so many frames, to see whether the game survives it.
    pub trials: Vec<(u64, Trial)>,
}

/// A mishap, for tests.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Trial {
    /// The device is destroyed, as if the driver had reset it.
    LoseDevice,
    /// The window gets another size, in points.
    Resize(u32, u32),
    /// The surface has no size for a frame, as a minimised window's on some systems.
    Vanish,
}

impl Default for PlayOptions {
    fn default() -> Self {
        Self {
            size: (1280, 720),
            title: "Lumbre".to_owned(),
            input: None,
            record: None,
            screenshot: None,
            quit_after: None,
            trials: Vec::new(),
        }
    }
}

/// Whether there is a display to open a window on.
pub fn has_display() -> bool {
    let set = |name: &str| std::env::var_os(name).is_some_and(|value| !value.is_empty());
    // On other systems there always is one, as far as a program can tell.
    !cfg!(all(unix, not(target_os = "macos")))
        || set("WAYLAND_DISPLAY")
        || set("WAYLAND_SOCKET")
        || set("DISPLAY")
}

/// Plays a level in a window until the player quits.
///
/// # Errors
/// The level or the recording cannot be loaded, there is no display or no device, or drawing fails; the message says what to do.
pub fn run(level: &Path, options: PlayOptions) -> Result<()> {
    run_game(Game::load(level)?, options)
}

/// [`run`] of a level that is loaded already.
///
/// # Errors
/// As [`run`], the level aside.
pub fn run_game(mut game: Game, options: PlayOptions) -> Result<()> {
    let recording = options.input.as_deref().map(Recording::load).transpose()?;
    if options.record.is_some() {
        game.record();
    }
    let event_loop =
        EventLoop::new().context("no display: set DISPLAY or WAYLAND_DISPLAY, or render without a window")?;
    let record = options.record.clone();
    let mut app = app::App::new(game, options, recording.as_ref());
    event_loop.run_app(&mut app)?;
    if let (Some(path), Some(recording)) = (record, app.take_recording()) {
        recording.save(&path)?;
    }
    app.outcome
}
