//! Files: nothing half-written under a final name.

use std::path::Path;

use anyhow::Context;

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
