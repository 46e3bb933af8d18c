//! What lies beside a baked level: of which scene and options it is, which files belong to it, how good it is. By it an unchanged
//! level is not baked again. Not the baking.

use std::ffi::OsString;
use std::fs::OpenOptions;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use anyhow::Context;
use lumbre::bake::{BakeReport, Ended};
use serde::{Deserialize, Serialize};

use crate::lightmap_report::FileLine;

/// The version of this file; another is not read.
const VERSION: u32 = 1;

/// A finished bake.
#[derive(Debug, Serialize, Deserialize)]
pub struct BakeRecord {
    version: u32,
    /// The hash of everything that the light depends on.
    content: String,
    /// BLAKE3 of the input, with what the light does not depend on.
    input: String,
    /// Seconds that it was allowed to take.
    time: Option<f64>,
    /// How the lightmaps were to be written.
    encodings: String,
    /// What was written, beside this.
    files: Vec<FileRecord>,
    /// What the lightmaps among them hold.
    pub lightmaps: Vec<FileLine>,
    /// How it went.
    pub report: BakeReport,
}

/// A file that was written.
#[derive(Debug, Serialize, Deserialize)]
struct FileRecord {
    name: String,
    bytes: u64,
    blake3: String,
}

/// What is asked for, to be compared with what is there.
pub struct Asked {
    /// The hash of everything that the light depends on.
    pub content: String,
    /// How the lightmaps are to be written.
    pub files: String,
    /// BLAKE3 of the input.
    pub input: String,
    /// Seconds that the bake may take.
    pub time: Option<f64>,
}

/// BLAKE3 of the bytes of several files.
pub fn hash_of_files<'a>(paths: impl IntoIterator<Item = &'a PathBuf>) -> io::Result<String> {
    let mut hasher = blake3::Hasher::new();
    for path in paths {
        let bytes = std::fs::read(path)?;
        hasher.update(&(bytes.len() as u64).to_le_bytes());
        hasher.update(&bytes);
    }
    Ok(hasher.finalize().to_hex().to_string())
}

/// `room.baked.glb` has what the next bake of it starts from in the folder `room.baked.bake`, which may be deleted.
pub fn folder_of_bake(output: &Path) -> PathBuf {
    output.with_extension("bake")
}

fn place(output: &Path) -> PathBuf {
    folder_of_bake(output).join("record.json")
}

impl BakeRecord {
    /// The record of a level that is just what is asked for, with all its files whole.
    pub fn unchanged(output: &Path, asked: &Asked) -> Option<Self> {
        let record: Self = serde_json::from_slice(&std::fs::read(place(output)).ok()?).ok()?;
        let same = record.version == VERSION
            && record.content == asked.content
            && record.encodings == asked.files
            && record.input == asked.input;
        // A bake for which the time ran out is only as good as one that has no more of it.
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

    /// Writes the record of what was just written.
    ///
    /// What the bake before wrote into the folder of the lightmaps and this one did not goes.
    pub fn write(
        output: &Path,
        asked: Asked,
        written: &[PathBuf],
        lightmaps: &[FileLine],
        report: &BakeReport,
    ) -> anyhow::Result<()> {
        let mut files = Vec::with_capacity(written.len());
        for path in written {
            // Copies of textures lie in folders of their own.
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

/// Removes the lightmaps of the bake whose record is there, if it is of this output, that are not among the new files. Those that are no more
/// as they were written are somebody else's.
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
            // One picture too many does no harm.
            let _ = std::fs::remove_file(path);
        }
    }
}

/// Writes a file beside its name and renames it. The name beside is always the same: what a killed process left is used again.
fn replace(path: &Path, content: &[u8]) -> io::Result<()> {
    let mut name = OsString::from(".");
    name.push(path.file_name().unwrap_or_default());
    name.push(".partial");
    let beside = path.with_file_name(name);
    let written = (|| {
        let mut file = OpenOptions::new().write(true).create(true).truncate(false).open(&beside)?;
        // Whoever else writes it is done in a moment; some network folders know no locks.
        let _ = file.lock();
        file.set_len(0)?;
        file.write_all(content)?;
        file.sync_all()?;
        std::fs::rename(&beside, path)
    })();
    if written.is_err() {
        // Half-written; if it cannot be removed either, the first error is the one to tell.
        let _ = std::fs::remove_file(&beside);
    }
    written
}
