//! Samples in a file, between two bakes. Not what they are for.
//!
//! ```text
//!   magic      8 bytes   "LUMBRESA"
//!   version    u32       VERSION; everything is little endian
//!   checksum  32 bytes   BLAKE3 of all that follows
//!   length     u64       bytes of what the rest holds, which is a Zstandard frame: two thirds of it, as most of its digits are noise
//!   `Content`, field by field, in the format of postcard; a texel takes some 150 bytes
//! ```
//!
//! Nothing is allocated by a count that the bytes do not hold, nor more than the length; a file that is cut short or damaged is named so.

use std::fs::{File, OpenOptions};
use std::io::{self, Read, Write};
use std::path::Path;

use super::samples::{Content, Samples, TexelSamples};
use crate::checkpoint::record;
use crate::checkpoint::replace_file::replace_file;
use crate::scene::Canonical;

const MAGIC: &[u8; 8] = b"LUMBRESA";
/// The version of the format: another is not read.
const VERSION: u32 = 5;
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
        let content = record::read::<Content>(&unpacked).filter(|content| {
            let Canonical { center, scale } = content.space;
            let positive = |number: f64| number.is_finite() && number > 0.0;
            let space = positive(content.density) && positive(scale) && center.is_finite();
            // No bake writes what is not a number; a map of it could not be mended.
            let mut texels = content.objects.iter().flat_map(|object| &object.texels);
            space && content.sky.is_finite() && texels.all(TexelSamples::is_sound)
        });
        content.map(Self).ok_or(SamplesError::Damaged)
    }

    /// Writes a file, whole under its name at once.
    ///
    /// # Errors
    /// [`SamplesError::Io`]; what was there is then as it was.
    pub fn write(&self, path: &Path) -> Result<(), SamplesError> {
        let content = packed(&record::written(&self.0).map_err(io::Error::other)?)?;
        replace_file(path, |temporary| {
            let mut file = loop {
                // Not truncated before it is ours: another process may be writing it.
                let file = OpenOptions::new().write(true).create(true).truncate(false).open(temporary)?;
                lock(&file)?;
                // Whoever had it has renamed it meanwhile: then it is the finished file.
                if is_at(&file, temporary)? {
                    break file;
                }
            };
            file.set_len(0)?;
            file.write_all(MAGIC)?;
            file.write_all(&VERSION.to_le_bytes())?;
            file.write_all(blake3::hash(&content).as_bytes())?;
            file.write_all(&content)?;
            file.sync_all()?;
            Ok(file)
        })?;
        Ok(())
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
