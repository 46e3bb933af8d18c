//! Stores the samples of a traced picture in a file beside it, so that a later run can go on with them. Their
//! format is `lumbre_trace`'s.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

use anyhow::Context;

use crate::output::write_file;

/// The file with the samples, and whether this run has written it.
pub struct KeptSamples {
    pub path: PathBuf,
    written: AtomicBool,
    failed: AtomicBool,
}

impl KeptSamples {
    /// Returns the samples file of a picture: `room.exr.samples` for `room.exr`.
    pub fn beside(output: &Path) -> Self {
        let mut name = OsString::from(output);
        name.push(".samples");
        Self { path: name.into(), written: AtomicBool::new(false), failed: AtomicBool::new(false) }
    }

    /// Reads the samples; `None` if there is no file.
    pub fn read(&self) -> anyhow::Result<Option<Vec<u8>>> {
        match std::fs::read(&self.path) {
            Ok(bytes) => Ok(Some(bytes)),
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(None),
            Err(error) => {
                Err(error).with_context(|| format!("{}: the samples cannot be read", self.path.display()))
            }
        }
    }

    /// Writes the samples, through a temporary file, so that no partial file is left. A failure does not stop
    /// the picture; it is reported once as a warning.
    pub fn write(&self, bytes: &[u8]) {
        match write_file(&self.path, |path| Ok(std::fs::write(path, bytes)?)) {
            Ok(()) => self.written.store(true, Ordering::Relaxed),
            Err(error) if !self.failed.swap(true, Ordering::Relaxed) => {
                eprintln!("lumbre: warning: the samples are not kept: {error:#}");
            }
            Err(_) => {}
        }
    }

    /// Returns true if this run has written samples.
    pub fn are_kept(&self) -> bool {
        self.written.load(Ordering::Relaxed)
    }

    /// Removes the samples if this run has written them, because they were not requested.
    pub fn remove(&self) -> anyhow::Result<()> {
        if !self.are_kept() {
            return Ok(());
        }
        std::fs::remove_file(&self.path).with_context(|| format!("{} cannot be removed", self.path.display()))
    }
}
