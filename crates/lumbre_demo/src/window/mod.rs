//! A level or any other glTF file in a window: events in, frames out. Not the rules of the game: those know no window.

mod accuracy;
mod app;
mod keys;
mod mouse;
mod overlay;
mod overlay_accounting;
mod overlay_accuracy;
mod overlay_file;
mod overlay_painter;
mod stage;
mod viewing;

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use winit::event_loop::EventLoop;

use crate::{Action, OpenOptions, Opened, Recording};

/// How a level is played.
#[derive(Clone, Debug)]
pub struct PlayOptions {
    /// Width and height of the window in points.
    pub size: (u32, u32),
    /// How the file, and those that are dropped on the window, are opened.
    pub open: OpenOptions,
    /// Bakes the file at once, beside the frames, and writes the baked file when that has ended.
    pub bake: bool,
    /// Plays this recording instead of listening to the keyboard; the window closes at its end.
    pub input: Option<PathBuf>,
    /// Records what is played to this file.
    pub record: Option<PathBuf>,
    /// Writes the last frame, with its overlay, to a PNG.
    pub screenshot: Option<PathBuf>,
    /// Closes the window after so many frames.
    pub quit_after: Option<u32>,
    /// Closes it only when nothing is being opened, baked or written any more, and what there is to say of it is shown.
    pub wait_for_work: bool,
    /// What befalls the window after so many frames, to see whether the game survives it.
    pub trials: Vec<(u64, Trial)>,
}

/// A mishap, or what a hand would do, for tests.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Trial {
    /// The device is destroyed, as if the driver had reset it.
    LoseDevice,
    /// The window gets another size, in points.
    Resize(u32, u32),
    /// The surface has no size for a frame, as a minimised window's on some systems.
    Vanish,
    /// A file is dropped on it.
    Drop(PathBuf),
    /// The key of a command is pressed.
    Act(Action),
    /// The key Esc is pressed.
    Escape,
}

impl Default for PlayOptions {
    fn default() -> Self {
        Self {
            size: (1280, 720),
            open: OpenOptions::default(),
            bake: false,
            input: None,
            record: None,
            screenshot: None,
            quit_after: None,
            wait_for_work: false,
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

/// Plays a level, or shows any other glTF file, in a window until it is closed.
///
/// # Errors
/// The file or the recording cannot be loaded, there is no display or no device, or drawing fails; the message says what to do.
pub fn run(file: &Path, options: PlayOptions) -> Result<()> {
    run_opened(Opened::open(file, &options.open)?, options)
}

/// [`run`] of a file that is open already.
///
/// # Errors
/// As [`run`], the file aside.
pub fn run_opened(mut opened: Opened, options: PlayOptions) -> Result<()> {
    let recording = options.input.as_deref().map(Recording::load).transpose()?;
    if options.record.is_some() {
        opened.game.record();
    }
    let event_loop =
        EventLoop::new().context("no display: set DISPLAY or WAYLAND_DISPLAY, or render without a window")?;
    let record = options.record.clone();
    let mut app = app::App::new(opened, options, recording.as_ref());
    event_loop.run_app(&mut app)?;
    if let (Some(path), Some(recording)) = (record, app.take_recording()) {
        recording.save(&path)?;
    }
    app.outcome
}
