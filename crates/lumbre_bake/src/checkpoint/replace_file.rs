//! Replaces a file as a whole: it is written under a temporary name beside its own and then renamed. Not what is in it.

use std::ffi::OsString;
use std::io;
use std::path::{Path, PathBuf};

/// Replaces the file at `path` by one that `write` has written to the path that it is given. Returns what `write`
/// returns: the file, if it is to stay open and locked until it has its name.
///
/// # Errors
/// Those of `write`, and of renaming; what was at `path` is then as it was.
pub(crate) fn replace_file<T>(path: &Path, write: impl FnOnce(&Path) -> io::Result<T>) -> io::Result<T> {
    let temporary = temporary_path(path);
    let replaced = write(&temporary).and_then(|written| {
        std::fs::rename(&temporary, path)?;
        Ok(written)
    });
    if replaced.is_err() {
        // If the half-written file cannot be removed either, the first error is still the one to report.
        let _ = remove_if_there(&temporary);
    }
    replaced
}

/// The temporary name beside a file's own under which it is written.
pub(crate) fn temporary_path(path: &Path) -> PathBuf {
    let mut name = OsString::from(path.file_name().unwrap_or_default());
    name.push(".partial");
    path.with_file_name(name)
}

/// Removes a file; that there is none is no error.
pub(crate) fn remove_if_there(path: &Path) -> io::Result<()> {
    match std::fs::remove_file(path) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(error),
        _ => Ok(()),
    }
}
