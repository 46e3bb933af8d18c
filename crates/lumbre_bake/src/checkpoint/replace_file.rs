//! Replaces a file as a whole: it is written under a temporary name beside its own and then renamed. Not what is in it.

use std::ffi::OsString;
use std::fs::{File, OpenOptions, TryLockError};
use std::io;
use std::path::{Path, PathBuf};

/// What to do if another process is writing the same file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum WhenBusy {
    /// Wait until it has finished.
    Wait,
    /// Fail with [`io::ErrorKind::ResourceBusy`].
    Fail,
}

/// Replaces the file at `path` by what `write` writes to the empty file that it is given. Returns the file, still locked.
///
/// # Errors
/// Those of `write`, of locking and of renaming; what was at `path` is then as it was.
pub(crate) fn replace_file(
    path: &Path,
    when_busy: WhenBusy,
    write: impl FnOnce(&mut File) -> io::Result<()>,
) -> io::Result<File> {
    let temporary = temporary_path(path);
    let mut file = open_locked(&temporary, when_busy)?;
    let replaced = file.set_len(0).and_then(|()| write(&mut file));
    match replaced.and_then(|()| std::fs::rename(&temporary, path)) {
        Ok(()) => Ok(file),
        Err(error) => {
            // If the half-written file cannot be removed either, the first error is still the one to report.
            let _ = remove_if_there(&temporary);
            Err(error)
        }
    }
}

/// Opens a file, or creates it, and locks it. It is not truncated, since another process may be writing it until it is locked.
fn open_locked(path: &Path, when_busy: WhenBusy) -> io::Result<File> {
    loop {
        let file = OpenOptions::new().read(true).write(true).create(true).truncate(false).open(path)?;
        match when_busy {
            WhenBusy::Wait => lock(&file)?,
            // Some network file systems have no locks; there nothing tells that another process writes it.
            WhenBusy::Fail => {
                if let Err(TryLockError::WouldBlock) = file.try_lock() {
                    return Err(io::Error::new(io::ErrorKind::ResourceBusy, "another process is writing it"));
                }
            }
        }
        // If the process that held the lock has renamed the file meanwhile, this is its finished file: try again.
        if is_at(&file, path)? {
            return Ok(file);
        }
    }
}

/// Whether a path still refers to an open file.
fn is_at(file: &File, path: &Path) -> io::Result<bool> {
    let at_path = match std::fs::metadata(path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(false),
        other => other?,
    };
    #[cfg(unix)]
    {
        use std::os::unix::fs::MetadataExt;
        let open = file.metadata()?;
        Ok((open.dev(), open.ino()) == (at_path.dev(), at_path.ino()))
    }
    #[cfg(not(unix))]
    {
        // On other systems an open file cannot be renamed.
        let _ = (file, at_path);
        Ok(true)
    }
}

/// Locks a file, waiting for any other process that writes it. Some network file systems do not support locks; there it
/// does nothing.
fn lock(file: &File) -> io::Result<()> {
    match file.lock() {
        Err(error) if error.kind() == io::ErrorKind::Unsupported => Ok(()),
        other => other,
    }
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

#[cfg(test)]
mod tests {
    use std::io::Write;

    use super::*;

    #[test]
    fn a_file_that_is_being_written_is_neither_truncated_nor_removed() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("samples");
        let temporary = temporary_path(&path);
        let mut busy = open_locked(&temporary, WhenBusy::Fail).unwrap();
        busy.write_all(b"half").unwrap();
        let refused = replace_file(&path, WhenBusy::Fail, |file| file.write_all(b"other"));
        assert_eq!(refused.unwrap_err().kind(), io::ErrorKind::ResourceBusy);
        assert_eq!(std::fs::read(&temporary).unwrap(), b"half");
        assert!(!path.exists());
        drop(busy);
        replace_file(&path, WhenBusy::Wait, |file| file.write_all(b"whole")).unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), b"whole");
        assert!(!temporary.exists());
    }

    #[test]
    fn what_was_there_stays_where_writing_fails() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("samples");
        std::fs::write(&path, b"old").unwrap();
        let failed = replace_file(&path, WhenBusy::Fail, |file| {
            file.write_all(b"half")?;
            Err(io::Error::other("no space"))
        });
        assert!(failed.is_err());
        assert_eq!(std::fs::read(&path).unwrap(), b"old");
        assert!(!temporary_path(&path).exists());
    }
}
