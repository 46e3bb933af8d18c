//! The record beside a baked level: its scene and options, the files that belong to it, and its quality. By
//! this record an unchanged level is not baked again.

use std::ffi::OsString;
use std::fs::OpenOptions;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use anyhow::Context;
use lumbre::bake::{BakeReport, Ended};
use serde::{Deserialize, Serialize};

use crate::lightmap_report::FileLine;

/// Version of the format; records of other versions are ignored.
const VERSION: u32 = 1;

/// The record of a finished bake.
#[derive(Debug, Serialize, Deserialize)]
pub struct BakeRecord {
    version: u32,
    /// Hash of everything that the light depends on.
    content: String,
    /// BLAKE3 of the input, including what the light does not depend on.
    input: String,
    /// Time limit in seconds.
    time: Option<f64>,
    /// The options by which the lightmaps were written.
    encodings: String,
    /// The files that were written, by their paths relative to the output's folder.
    files: Vec<FileRecord>,
    /// The lightmaps among them.
    pub lightmaps: Vec<FileLine>,
    /// The baker's report.
    pub report: BakeReport,
}

/// A file that was written.
#[derive(Debug, Serialize, Deserialize)]
struct FileRecord {
    name: String,
    bytes: u64,
    blake3: String,
}

/// A requested bake, to be compared with the record.
pub struct Asked {
    /// Hash of everything that the light depends on.
    pub content: String,
    /// The options by which the lightmaps are to be written.
    pub files: String,
    /// BLAKE3 of the input.
    pub input: String,
    /// Time limit in seconds.
    pub time: Option<f64>,
}

/// Returns the BLAKE3 hash of the contents of several files, with their lengths.
pub fn hash_of_files<'a>(paths: impl IntoIterator<Item = &'a PathBuf>) -> io::Result<String> {
    let mut hasher = blake3::Hasher::new();
    for path in paths {
        let bytes = std::fs::read(path)?;
        hasher.update(&(bytes.len() as u64).to_le_bytes());
        hasher.update(&bytes);
    }
    Ok(hasher.finalize().to_hex().to_string())
}

/// Returns the folder with the data for the next bake of an output: `room.baked.bake` for `room.baked.glb`.
/// It may be deleted.
pub fn folder_of_bake(output: &Path) -> PathBuf {
    output.with_extension("bake")
}

fn place(output: &Path) -> PathBuf {
    folder_of_bake(output).join("record.json")
}

impl BakeRecord {
    /// Returns the record of an output that is exactly what is requested, with all its files complete.
    pub fn unchanged(output: &Path, asked: &Asked) -> Option<Self> {
        let record: Self = serde_json::from_slice(&std::fs::read(place(output)).ok()?).ok()?;
        let same = record.version == VERSION
            && record.content == asked.content
            && record.encodings == asked.files
            && record.input == asked.input;
        // A bake that ran out of time is good enough only for a request with the same time limit or a lower
        // one.
        let enough = record.report.ended != Ended::Time
            || asked.time.is_some_and(|asked| record.time.is_some_and(|time| asked <= time));
        let named =
            record.files.iter().any(|file| output.file_name().is_some_and(|name| *name == *file.name));
        let whole = |file: &FileRecord| {
            let path = output.with_file_name(&file.name);
            let about = std::fs::metadata(&path);
            about.is_ok_and(|about| about.is_file() && about.len() == file.bytes)
                && hash_of_files([&path]).is_ok_and(|hash| hash == file.blake3)
        };
        (same && enough && named && record.files.iter().all(whole)).then_some(record)
    }

    /// Writes the record of the files that were just written.
    ///
    /// Removes lightmaps that the previous bake wrote into the lightmap folder and this one did not.
    pub fn write(
        output: &Path,
        asked: Asked,
        written: &[PathBuf],
        lightmaps: &[FileLine],
        report: &BakeReport,
    ) -> anyhow::Result<()> {
        let mut files = Vec::with_capacity(written.len());
        for path in written {
            // Copies of textures are in folders of their own.
            let own = output.parent().and_then(|folder| path.strip_prefix(folder).ok());
            let name = own.unwrap_or(path).to_string_lossy().into_owned();
            files.push(FileRecord {
                name,
                bytes: std::fs::metadata(path)?.len(),
                blake3: hash_of_files([path])?,
            });
        }
        let Asked { content, files: encodings, input, time } = asked;
        let (lightmaps, report) = (lightmaps.to_vec(), report.clone());
        let record = Self { version: VERSION, content, input, time, encodings, files, lightmaps, report };
        let mut text = serde_json::to_vec_pretty(&record)?;
        text.push(b'\n');
        let path = place(output);
        remove_former_lightmaps(&path, output, &record.files);
        std::fs::create_dir_all(folder_of_bake(output))
            .and_then(|()| replace(&path, &text))
            .with_context(|| format!("{} could not be written", path.display()))
    }
}

/// Removes the lightmaps of the previous record, if it belongs to this output, that are not among the new
/// files. Files that have changed since they were written are left alone, since they belong to somebody else.
fn remove_former_lightmaps(record: &Path, output: &Path, files: &[FileRecord]) {
    let former = std::fs::read(record).ok().and_then(|text| serde_json::from_slice::<BakeRecord>(&text).ok());
    let folder = output.with_extension("lightmaps");
    let is_of_output = |former: &BakeRecord| {
        former.files.iter().any(|file| output.file_name().is_some_and(|name| *name == *file.name))
    };
    for file in former.filter(is_of_output).into_iter().flat_map(|former| former.files) {
        let path = output.with_file_name(&file.name);
        let new = files.iter().any(|new| new.name == file.name);
        if !new
            && path.parent() == Some(&folder)
            && hash_of_files([&path]).is_ok_and(|hash| hash == file.blake3)
        {
            // If this fails, a superfluous image is left, which does no harm.
            let _ = std::fs::remove_file(path);
        }
    }
}

/// Writes a file under a temporary name beside it and renames it. The temporary name is always the same, so
/// that what a killed process left is overwritten.
fn replace(path: &Path, content: &[u8]) -> io::Result<()> {
    let mut name = OsString::from(".");
    name.push(path.file_name().unwrap_or_default());
    name.push(".partial");
    let beside = path.with_file_name(name);
    let written = (|| {
        let mut file = OpenOptions::new().write(true).create(true).truncate(false).open(&beside)?;
        // Another writer holds the lock only briefly. Some network folders do not support locks, so a failure
        // is ignored.
        let _ = file.lock();
        file.set_len(0)?;
        file.write_all(content)?;
        file.sync_all()?;
        std::fs::rename(&beside, path)
    })();
    if written.is_err() {
        // The file is partial. If it cannot be removed either, the first error is the one to report.
        let _ = std::fs::remove_file(&beside);
    }
    written
}
