//! Writing several files so that each is under its final name whole or not at all. Not what is in them.

use std::ffi::OsString;
use std::fs::{self, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};

use super::export::SaveError;

/// Files written beside their final names; dropping it removes what was not committed.
#[derive(Default)]
pub(crate) struct Files {
    /// (temporary, final)
    waiting: Vec<(PathBuf, PathBuf)>,
}

impl Files {
    /// Writes a file beside `path`.
    pub(crate) fn write(&mut self, path: &Path, bytes: &[u8]) -> Result<(), SaveError> {
        let failed = |source| SaveError::Write { path: path.to_owned(), source };
        let Some(name) = path.file_name() else {
            return Err(failed(std::io::Error::new(
                std::io::ErrorKind::InvalidInput,
                "the path names no file",
            )));
        };
        for attempt in 0..100 {
            let mut hidden = OsString::from(".");
            hidden.push(name);
            hidden.push(format!(".{}-{attempt}.partial", std::process::id()));
            let temporary = path.with_file_name(hidden);
            match OpenOptions::new().write(true).create_new(true).open(&temporary) {
                Ok(mut file) => {
                    self.waiting.push((temporary, path.to_owned()));
                    return file.write_all(bytes).and_then(|()| file.sync_all()).map_err(failed);
                }
                Err(error) if error.kind() == std::io::ErrorKind::AlreadyExists => {}
                Err(error) => return Err(failed(error)),
            }
        }
        Err(failed(std::io::Error::new(
            std::io::ErrorKind::AlreadyExists,
            "too many .partial files beside it; remove them",
        )))
    }

    /// Gives every file its final name, in the order they were written.
    pub(crate) fn commit(mut self) -> Result<Vec<PathBuf>, SaveError> {
        let mut done = Vec::new();
        while !self.waiting.is_empty() {
            let (temporary, path) = &self.waiting[0];
            fs::rename(temporary, path).map_err(|source| SaveError::Write { path: path.clone(), source })?;
            done.push(self.waiting.remove(0).1);
        }
        Ok(done)
    }
}

impl Drop for Files {
    fn drop(&mut self) {
        for (temporary, _) in &self.waiting {
            // Nothing more can be done about a file that cannot be removed either.
            let _ = fs::remove_file(temporary);
        }
    }
}
