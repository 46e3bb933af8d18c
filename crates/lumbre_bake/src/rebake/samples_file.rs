//! Samples in a file, between two bakes. Not what they are for.
//!
//! ```text
//!   magic      8 bytes   "LUMBRESA"
//!   version    u32       VERSION; everything is little endian
//!   checksum  32 bytes   BLAKE3 of all that follows
//!   length     u64       bytes of what the rest holds, which is a Zstandard frame: two thirds of it, as most of its digits are noise
//!   content, identity, sampling, lights (32 bytes each), sky, centre, scale, density
//!   objects, each: hash, name, box, emission, exitance, layout, texels, each some 160 bytes
//! ```
//!
//! Nothing is allocated by a count that the bytes do not hold, nor more than the length; a file that is cut short or damaged is named so.

use std::fs::{File, OpenOptions};
use std::io::{self, Read, Write};
use std::path::Path;

use glam::{DVec3, Vec2, Vec3};

use super::samples::{Content, ObjectSamples, Samples, TexelSamples};
use crate::checkpoint::record::{Cursor, fields};
use crate::checkpoint::{Record, tape};
use crate::content_hash::ContentHash;
use crate::scene::Canonical;
use crate::texels::gather::{Gathered, REPLICATES, Weights};
use crate::transport::direct::Direct;

const MAGIC: &[u8; 8] = b"LUMBRESA";
/// The version of the format: another is not read.
const VERSION: u32 = 4;
const CHECKSUM: usize = 32;
/// Of Zstandard: higher ones take longer and save no more.
const LEVEL: i32 = 1;

/// Why samples cannot be read or written. A bake can do without them.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SamplesError {
    /// The file cannot be read or written.
    #[error(transparent)]
    Io(#[from] io::Error),
    /// Something else has the name.
    #[error("the file holds no samples of Lumbre")]
    Foreign,
    /// Of another version.
    #[error("its format is version {found}, this baker reads {VERSION}")]
    Version {
        /// That version.
        found: u32,
    },
    /// Not what was written.
    #[error("it is damaged or cut short")]
    Damaged,
}

/// What a texel has gathered, weights apart: those of settled samples follow from the rest.
struct Settled {
    sums: [Vec3; REPLICATES],
    patch_errors: Vec2,
    texel_variances: f32,
    texel_reads: u32,
    checks: u32,
    differences: Vec3,
    squared_differences: f32,
    inverse_distances: f32,
    samples: u32,
}

fields!(Settled {
    sums: [Vec3; REPLICATES],
    patch_errors: Vec2,
    texel_variances: f32,
    texel_reads: u32,
    checks: u32,
    differences: Vec3,
    squared_differences: f32,
    inverse_distances: f32,
    samples: u32,
});

impl From<&Gathered> for Settled {
    fn from(own: &Gathered) -> Self {
        let Gathered {
            sums,
            weights: _,
            patch_errors,
            texel_variances,
            texel_reads,
            checks,
            differences,
            squared_differences,
            inverse_distances,
            samples,
            rays: _,
        } = *own;
        Self {
            sums,
            patch_errors,
            texel_variances,
            texel_reads,
            checks,
            differences,
            squared_differences,
            inverse_distances,
            samples,
        }
    }
}

impl From<Settled> for Gathered {
    fn from(own: Settled) -> Self {
        let Settled {
            sums,
            patch_errors,
            texel_variances,
            texel_reads,
            checks,
            differences,
            squared_differences,
            inverse_distances,
            samples,
        } = own;
        let weights = sums.map(|sum| Weights::of_equal(sum, samples));
        Self {
            sums,
            weights,
            patch_errors,
            texel_variances,
            texel_reads,
            checks,
            differences,
            squared_differences,
            inverse_distances,
            samples,
            rays: 0,
        }
    }
}

impl Record for TexelSamples {
    const LEAST: usize = 4 + 4 + Direct::LEAST + Settled::LEAST + 12 + 4;

    fn write(&self, out: &mut Vec<u8>) {
        let Self { cell, footprint, direct, gathered, bounced, neglected } = self;
        (*cell, *footprint).write(out);
        direct.write(out);
        Settled::from(gathered).write(out);
        bounced.write(out);
        neglected.write(out);
    }

    fn read(from: &mut Cursor<'_>) -> Option<Self> {
        let (cell, footprint) = Record::read(from)?;
        let direct = Direct::read(from)?;
        let gathered: Gathered = Settled::read(from)?.into();
        let (bounced, neglected): (Vec3, f32) = Record::read(from)?;
        let own = Self { cell, footprint, direct, gathered, bounced, neglected };
        // No bake writes what is not a number; a map of it could not be mended.
        own.is_sound().then_some(own)
    }
}

fields!(ObjectSamples {
    hash: ContentHash,
    name: String,
    low: Vec3,
    high: Vec3,
    emission: u32,
    exitance: [Vec3; 2],
    layout: u32,
    texels: Vec<TexelSamples>,
});

fields!(Content {
    content: ContentHash,
    identity: ContentHash,
    sampling: ContentHash,
    lights: ContentHash,
    sky: Vec3,
    space: Canonical,
    density: f64,
    objects: Vec<ObjectSamples>,
});

fields!(Canonical { center: DVec3, scale: f64 });

impl Record for DVec3 {
    const LEAST: usize = 24;

    fn write(&self, out: &mut Vec<u8>) {
        self.to_array().write(out);
    }

    fn read(from: &mut Cursor<'_>) -> Option<Self> {
        Record::read(from).map(Self::from_array)
    }
}

impl Record for ContentHash {
    const LEAST: usize = 32;

    fn write(&self, out: &mut Vec<u8>) {
        self.bytes().write(out);
    }

    fn read(from: &mut Cursor<'_>) -> Option<Self> {
        Record::read(from).map(Self::of_bytes)
    }
}

impl Record for String {
    const LEAST: usize = 8;

    fn write(&self, out: &mut Vec<u8>) {
        (self.len() as u64).write(out);
        out.extend_from_slice(self.as_bytes());
    }

    fn read(from: &mut Cursor<'_>) -> Option<Self> {
        String::from_utf8(Record::read(from)?).ok()
    }
}

impl Samples {
    /// Reads what [`Samples::write`] wrote.
    ///
    /// # Errors
    /// [`SamplesError`]: it is not there, not of this kind or version, or damaged.
    pub fn read(path: &Path) -> Result<Self, SamplesError> {
        // Opening a pipe would wait for ever.
        if !std::fs::metadata(path)?.is_file() {
            return Err(SamplesError::Foreign);
        }
        let bytes = std::fs::read(path)?;
        let rest = bytes.strip_prefix(MAGIC).ok_or(SamplesError::Foreign)?;
        let (version, rest) = rest.split_first_chunk::<4>().ok_or(SamplesError::Damaged)?;
        let found = u32::from_le_bytes(*version);
        if found != VERSION {
            return Err(SamplesError::Version { found });
        }
        let (checksum, rest) = rest.split_first_chunk::<CHECKSUM>().ok_or(SamplesError::Damaged)?;
        if blake3::hash(rest).as_bytes() != checksum {
            return Err(SamplesError::Damaged);
        }
        let (length, frame) = rest.split_first_chunk::<8>().ok_or(SamplesError::Damaged)?;
        let unpacked = unpacked(frame, u64::from_le_bytes(*length)).ok_or(SamplesError::Damaged)?;
        let mut cursor = Cursor(&unpacked);
        let content = Content::read(&mut cursor).filter(|_| cursor.0.is_empty());
        let content = content.filter(|content| {
            let Canonical { center, scale } = content.space;
            let positive = |number: f64| number.is_finite() && number > 0.0;
            positive(content.density) && positive(scale) && center.is_finite() && content.sky.is_finite()
        });
        content.map(Self).ok_or(SamplesError::Damaged)
    }

    /// Writes a file, whole under its name at once.
    ///
    /// # Errors
    /// [`SamplesError::Io`]; what was there is then as it was.
    pub fn write(&self, path: &Path) -> Result<(), SamplesError> {
        let mut content = Vec::new();
        self.0.write(&mut content);
        let content = packed(&content)?;
        let beside = tape::temporary(path);
        let written = (|| {
            let mut file = loop {
                // Not truncated before it is ours: another process may be writing it.
                let file = OpenOptions::new().write(true).create(true).truncate(false).open(&beside)?;
                lock(&file)?;
                // Whoever had it has renamed it meanwhile: then it is the finished file.
                if is_at(&file, &beside)? {
                    break file;
                }
            };
            file.set_len(0)?;
            file.write_all(MAGIC)?;
            file.write_all(&VERSION.to_le_bytes())?;
            file.write_all(blake3::hash(&content).as_bytes())?;
            file.write_all(&content)?;
            file.sync_all()?;
            std::fs::rename(&beside, path)
        })();
        if written.is_err() {
            // Half-written; if it cannot be removed either, the first error is the one to tell.
            let _ = tape::remove_if_there(&beside);
        }
        Ok(written?)
    }
}

/// A length and what is of that length, compressed.
fn packed(content: &[u8]) -> io::Result<Vec<u8>> {
    let mut packed = (content.len() as u64).to_le_bytes().to_vec();
    packed.extend(zstd::bulk::compress(content, LEVEL)?);
    Ok(packed)
}

/// What a frame holds, if that is as long as it should be.
fn unpacked(frame: &[u8], length: u64) -> Option<Vec<u8>> {
    let mut unpacked = Vec::new();
    zstd::stream::read::Decoder::new(frame)
        .ok()?
        .take(length.saturating_add(1))
        .read_to_end(&mut unpacked)
        .ok()?;
    (unpacked.len() as u64 == length).then_some(unpacked)
}

/// Whether a path still leads to an open file.
fn is_at(file: &File, path: &Path) -> io::Result<bool> {
    let there = match std::fs::metadata(path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(false),
        other => other?,
    };
    #[cfg(unix)]
    {
        use std::os::unix::fs::MetadataExt;
        let own = file.metadata()?;
        Ok((own.dev(), own.ino()) == (there.dev(), there.ino()))
    }
    #[cfg(not(unix))]
    {
        // Elsewhere a file that is open is not renamed.
        let _ = (file, there);
        Ok(true)
    }
}

/// Waits for whoever writes it; some network folders know no locks.
fn lock(file: &File) -> io::Result<()> {
    match file.lock() {
        Err(error) if error.kind() == io::ErrorKind::Unsupported => Ok(()),
        other => other,
    }
}
