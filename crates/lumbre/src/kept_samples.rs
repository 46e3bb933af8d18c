//! The samples of a traced picture in a file beside it, for a run that goes on with them. Not what is in it.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

use anyhow::Context;

use crate::output::write_file;

/// The file, and whether this run has written it.
pub struct KeptSamples {
    pub path: PathBuf,
    written: AtomicBool,
    failed: AtomicBool,
}

impl KeptSamples {
    /// `room.exr` has its samples in `room.exr.samples`.
    pub fn beside(output: &Path) -> Self {
        let mut name = OsString::from(output);
        name.push(".samples");
        Self { path: name.into(), written: AtomicBool::new(false), failed: AtomicBool::new(false) }
    }

    /// What is there; nothing if there is no file.
    pub fn read(&self) -> anyhow::Result<Option<Vec<u8>>> {
        match std::fs::read(&self.path) {
            Ok(bytes) => Ok(Some(bytes)),
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(None),
            Err(error) => {
                Err(error).with_context(|| format!("{}: the samples cannot be read", self.path.display()))
            }
        }
    }

    /// Writes them, whole or not at all. Where that cannot be, the picture is worth going on with all the same, and a warning says so once.
    pub fn write(&self, bytes: &[u8]) {
        match write_file(&self.path, |path| Ok(std::fs::write(path, bytes)?)) {
            Ok(()) => self.written.store(true, Ordering::Relaxed),
            Err(error) if !self.failed.swap(true, Ordering::Relaxed) => {
                eprintln!("lumbre: warning: the samples are not kept: {error:#}");
            }
            Err(_) => {}
        }
    }

    /// Whether this run has kept any.
    pub fn are_kept(&self) -> bool {
        self.written.load(Ordering::Relaxed)
    }

    /// Removes them if this run has written them: nobody has asked for them.
    pub fn remove(&self) -> anyhow::Result<()> {
        if !self.are_kept() {
            return Ok(());
        }
        std::fs::remove_file(&self.path).with_context(|| format!("{} cannot be removed", self.path.display()))
    }
}
