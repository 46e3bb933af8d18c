//! Writes files so that no partial file is left under the final name.

use std::path::Path;

use anyhow::Context;

/// Writes a file under a temporary name beside its final one, and renames it.
pub fn write_file(path: &Path, write: impl FnOnce(&Path) -> anyhow::Result<()>) -> anyhow::Result<()> {
    let name = path
        .file_name()
        .and_then(|name| name.to_str())
        .with_context(|| format!("{}: this names no file", path.display()))?;
    // The extension stays last, because encoders choose the format by it.
    let beside = path.with_file_name(format!(".{}.{name}", std::process::id()));
    let written = write(&beside).and_then(|()| Ok(std::fs::rename(&beside, path)?));
    if written.is_err() {
        // The file is partial. If it cannot be removed either, the first error is the one to report.
        let _ = std::fs::remove_file(&beside);
    }
    written.with_context(|| format!("{} could not be written", path.display()))
}
