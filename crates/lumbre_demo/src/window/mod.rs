//! Shows a level or any other glTF file in a window: receives events and draws frames. The rules of the game
//! are in `game` and do not depend on it.

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
pub use keys::key_help;
use winit::event_loop::EventLoop;

use crate::{Action, OpenOptions, Opened, Recording};

/// Options of the window and of what is played in it.
#[derive(Clone, Debug)]
pub struct PlayOptions {
    /// Width and height of the window in logical pixels.
    pub size: (u32, u32),
    /// How the file, and files that are dropped on the window, are opened.
    pub open: OpenOptions,
    /// Whether the file is baked in the background from the start, and written when the bake is complete.
    pub bake: bool,
    /// A recording to play instead of keyboard and mouse input; the window closes at its end.
    pub input: Option<PathBuf>,
    /// A file to record the input to.
    pub record: Option<PathBuf>,
    /// A PNG file for the last frame, with its overlay.
    pub screenshot: Option<PathBuf>,
    /// Number of frames after which the window closes.
    pub quit_after: Option<u32>,
    /// Whether the window closes only once nothing is being opened, baked, written or measured any more and
    /// the overlay shows the result.
    pub wait_for_work: bool,
    /// Events to simulate, each after a number of frames, for tests.
    pub trials: Vec<(u64, Trial)>,
}

/// A simulated failure or user action, for tests.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Trial {
    /// Destroys the device, as if the driver had reset it.
    LoseDevice,
    /// Resizes the window, in logical pixels.
    Resize(u32, u32),
    /// Gives the surface no size, as for a minimised window on some systems.
    Vanish,
    /// Drops a file on the window.
    Drop(PathBuf),
    /// Presses the key of a command.
    Act(Action),
    /// Presses Esc.
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

/// Returns true if there is a display to open a window on.
pub fn has_display() -> bool {
    let set = |name: &str| std::env::var_os(name).is_some_and(|value| !value.is_empty());
    // On other systems a program has to assume that there is one.
    !cfg!(all(unix, not(target_os = "macos")))
        || set("WAYLAND_DISPLAY")
        || set("WAYLAND_SOCKET")
        || set("DISPLAY")
}

/// Plays a level, or shows any other glTF file, in a window until it is closed.
///
/// # Errors
/// The file or the recording cannot be loaded, there is no display or no device, or drawing fails; the
/// message says what to do.
pub fn run(file: &Path, options: PlayOptions) -> Result<()> {
    run_opened(Opened::open(file, &options.open)?, options)
}

/// Does what [`run`] does for a file that is already open.
///
/// # Errors
/// As [`run`], except for opening the file.
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
