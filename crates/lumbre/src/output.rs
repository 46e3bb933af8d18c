//! Files and progress: nothing half-written under a final name, a bar on a terminal, silence in a pipe.

use std::io::IsTerminal;
use std::path::Path;

use anyhow::Context;
use indicatif::{ProgressBar, ProgressStyle};

/// Writes a file beside its final name and renames it.
pub fn write_file(path: &Path, write: impl FnOnce(&Path) -> anyhow::Result<()>) -> anyhow::Result<()> {
    let name = path
        .file_name()
        .and_then(|name| name.to_str())
        .with_context(|| format!("{}: this names no file", path.display()))?;
    // The extension stays last: encoders choose the format by it.
    let beside = path.with_file_name(format!(".{}.{name}", std::process::id()));
    let written = write(&beside).and_then(|()| Ok(std::fs::rename(&beside, path)?));
    if written.is_err() {
        // Whatever is there is half-written; if it cannot be removed either, the first error is the one to tell.
        let _ = std::fs::remove_file(&beside);
    }
    written.with_context(|| format!("{} could not be written", path.display()))
}

/// A bar on standard error; hidden unless that is a terminal.
pub fn progress_bar() -> ProgressBar {
    if !std::io::stderr().is_terminal() {
        return ProgressBar::hidden();
    }
    let bar = ProgressBar::new(1000);
    if let Ok(style) = ProgressStyle::with_template("{msg:22} {wide_bar} {percent:>3} % {eta:>4} left") {
        bar.set_style(style);
    }
    bar
}
