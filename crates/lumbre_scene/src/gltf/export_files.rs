//! Writes several files so that each appears under its final name only when it is complete.
//!
//! In each folder, a process keeps a lock on one of the `.partial` files it is writing. If none of a process's
//! `.partial` files in a folder is locked, the process was killed, and the files are removed.

use std::collections::{BTreeMap, HashMap, HashSet};
use std::ffi::OsString;
use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::Write;
use std::path::{Path, PathBuf};

use super::export::SaveError;

/// Files written under temporary names. Dropping this removes everything that was not committed.
#[derive(Default)]
pub(crate) struct Files {
    /// (temporary path, final path)
    waiting: Vec<(PathBuf, PathBuf)>,
    /// One temporary file of each folder, locked so that other processes do not remove the folder's.
    held: HashMap<PathBuf, File>,
    /// Folders already searched for leftover temporary files.
    tidied: HashSet<PathBuf>,
    /// Folders that were created.
    made: Vec<PathBuf>,
}

/// The process id in the name of a temporary file of [`Files`], `.NAME.PROCESS-ATTEMPT.partial`; `None` for
/// other names.
fn writer(name: &str) -> Option<&str> {
    let own = name.strip_prefix('.')?.strip_suffix(".partial")?;
    let (process, attempt) = own.rsplit_once('.')?.1.split_once('-')?;
    let number = |text: &str| !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit());
    (number(process) && number(attempt)).then_some(process)
}

/// Removes temporary files that killed processes left in a folder. Failures are ignored, as they do not
/// prevent writing.
fn tidy(folder: &Path) {
    let Ok(entries) = fs::read_dir(folder) else { return };
    let mut by_process: BTreeMap<String, Vec<PathBuf>> = BTreeMap::new();
    for entry in entries.flatten() {
        // Skip links and pipes: this module never creates any, and opening a pipe might block for ever.
        if entry.file_type().is_ok_and(|kind| kind.is_file())
            && let Some(process) = entry.file_name().to_str().and_then(writer)
        {
            by_process.entry(process.to_owned()).or_default().push(entry.path());
        }
    }
    let free =
        |path: &PathBuf| OpenOptions::new().write(true).open(path).is_ok_and(|file| file.try_lock().is_ok());
    for left in by_process.into_values().filter(|paths| paths.iter().all(free)) {
        for path in left {
            let _ = fs::remove_file(path);
        }
    }
}

/// The folder that a file lies in.
fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}

impl Files {
    /// Creates a folder in an existing one. Failures are ignored here; writing into the folder reports them.
    pub(crate) fn make_folder(&mut self, folder: &Path) {
        if fs::create_dir(folder).is_ok() {
            self.made.push(folder.to_owned());
        }
    }

    /// Writes a file under a temporary name beside `path`.
    pub(crate) fn write(&mut self, path: &Path, bytes: &[u8]) -> Result<(), SaveError> {
        let failed = |source| SaveError::Write { path: path.to_owned(), source };
        let Some(name) = path.file_name() else {
            return Err(failed(std::io::Error::new(
                std::io::ErrorKind::InvalidInput,
                "the path names no file",
            )));
        };
        let folder = folder_of(path);
        if self.tidied.insert(folder.to_owned()) {
            tidy(folder);
        }
        for attempt in 0..100 {
            let mut hidden = OsString::from(".");
            hidden.push(name);
            hidden.push(format!(".{}-{attempt}.partial", std::process::id()));
            let temporary = path.with_file_name(hidden);
            match OpenOptions::new().write(true).create_new(true).open(&temporary) {
                Ok(mut file) => {
                    // Another process may have removed the file before it was locked. Without support for
                    // locks nothing is removed.
                    if !self.held.contains_key(folder)
                        && (matches!(file.try_lock(), Err(TryLockError::WouldBlock)) || !temporary.exists())
                    {
                        let _ = fs::remove_file(&temporary);
                        continue;
                    }
                    self.waiting.push((temporary, path.to_owned()));
                    let written = file.write_all(bytes).and_then(|()| file.sync_all()).map_err(failed);
                    self.held.entry(folder.to_owned()).or_insert(file);
                    return written;
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

    /// Renames all files to their final names, in the order in which they were written.
    pub(crate) fn commit(mut self) -> Result<Vec<PathBuf>, SaveError> {
        let mut done = Vec::new();
        // Renaming a folder's first file ends the protection by its lock, so its last one is locked as well.
        let last: BTreeMap<_, _> = self.waiting.iter().map(|(file, _)| (folder_of(file), file)).collect();
        let opened: Vec<_> = last.into_values().filter_map(|temporary| File::open(temporary).ok()).collect();
        for file in &opened {
            let _ = file.try_lock();
        }
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
            // A failure is ignored, since nothing more can be done.
            let _ = fs::remove_file(temporary);
        }
        for folder in &self.made {
            // Fails, as it should, if the folder is not empty.
            let _ = fs::remove_dir(folder);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_killed_process_left_goes_and_what_is_being_written_stays() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        for left in [".room.glb.12-0.partial", ".floor.lightmap.exr.9-3.partial"] {
            fs::write(at(left), "half").unwrap();
        }
        let kept = ["notes.partial", ".mine.partial", ".a.x-1.partial", ".b.7-.partial", "room.glb"];
        for name in kept {
            fs::write(at(name), name).unwrap();
        }
        let mut other = Files::default();
        other.write(&at("other.glb"), b"other").unwrap();
        let mut files = Files::default();
        files.write(&at("room.glb"), b"new").unwrap();
        assert!(!at(".room.glb.12-0.partial").exists() && !at(".floor.lightmap.exr.9-3.partial").exists());
        for name in kept {
            assert_eq!(fs::read_to_string(at(name)).unwrap(), name);
        }
        other.commit().unwrap();
        files.commit().unwrap();
        assert_eq!(fs::read(at("other.glb")).unwrap(), b"other");
        assert_eq!(fs::read(at("room.glb")).unwrap(), b"new");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), kept.len() + 1);
    }

    #[test]
    fn what_is_being_written_stays_in_every_folder() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        let names = ["room.glb", "walls/floor.exr", "walls/roof.exr", "textures/wood.png"];
        let mut other = Files::default();
        for sub in ["walls", "textures"] {
            other.make_folder(&at(sub));
        }
        for name in names {
            other.write(&at(name), name.as_bytes()).unwrap();
        }
        let mut files = Files::default();
        for name in ["hall.glb", "walls/hall.exr", "textures/hall.png"] {
            files.write(&at(name), b"new").unwrap();
        }
        other.commit().unwrap();
        for name in names {
            assert_eq!(fs::read_to_string(at(name)).unwrap(), name);
        }
    }

    #[test]
    fn what_is_not_committed_goes() {
        let folder = tempfile::tempdir().unwrap();
        let mut files = Files::default();
        files.write(&folder.path().join("room.glb"), b"new").unwrap();
        files.make_folder(&folder.path().join("room.lightmaps"));
        files.write(&folder.path().join("room.lightmaps/floor.exr"), b"new").unwrap();
        drop(files);
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
    }
}
