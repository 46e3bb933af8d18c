//! The file format of samples. What they are for is described in the parent module.
//!
//! ```text
//!   magic      8 bytes   "LUMBRESA"
//!   version    u32       VERSION; everything is little endian
//!   checksum  32 bytes   BLAKE3 of all that follows
//!   length     u64       of the uncompressed rest, in bytes
//!   content              a Zstandard frame, about half of that length, as most digits are noise: `Content`, field by
//!                        field, in the format of postcard; a texel takes some 230 bytes
//! ```
//!
//! Reading never allocates more than the file's bytes can hold or the length states; a file that is cut short or
//! damaged gives an error that says so.

use std::io::{self, Read, Write};
use std::path::Path;

use super::samples::{Content, Samples, TexelSamples};
use crate::checkpoint::record;
use crate::checkpoint::replace_file::{WhenBusy, replace_file};
use crate::scene::Canonical;

const MAGIC: &[u8; 8] = b"LUMBRESA";
/// The version of the format. Files of other versions are not read.
const VERSION: u32 = 8;
const CHECKSUM: usize = 32;
/// Compression level of Zstandard: higher ones take longer and save no more.
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
    /// Reads a file that [`Samples::write`] wrote.
    ///
    /// # Errors
    /// [`SamplesError`] if the file cannot be read, is not of this format or version, or is damaged.
    pub fn read(path: &Path) -> Result<Self, SamplesError> {
        // Opening a pipe could block forever.
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
            // No bake writes NaN or infinities, and a bake that read them would spread them over its maps.
            let mut texels = content.objects.iter().flat_map(|object| &object.texels);
            space && content.sky.is_finite() && texels.all(TexelSamples::is_sound)
        });
        content.map(Self).ok_or(SamplesError::Damaged)
    }

    /// Writes a file atomically: under its name there is never an incomplete file.
    ///
    /// # Errors
    /// [`SamplesError::Io`]; a file that was there before is then unchanged.
    pub fn write(&self, path: &Path) -> Result<(), SamplesError> {
        self.packed()?.write(path)
    }

    /// Compresses the samples as their file holds them. This takes longer than writing the file; a program that has
    /// other files to write can do both at once.
    ///
    /// # Errors
    /// [`SamplesError::Io`] if they cannot be compressed.
    pub fn packed(&self) -> Result<PackedSamples, SamplesError> {
        let content = packed(&record::written(&self.0).map_err(io::Error::other)?)?;
        Ok(PackedSamples { checksum: blake3::hash(&content), content })
    }
}

/// Samples as their file holds them, from [`Samples::packed`].
#[derive(Clone)]
pub struct PackedSamples {
    checksum: blake3::Hash,
    content: Vec<u8>,
}

impl std::fmt::Debug for PackedSamples {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("PackedSamples").field("bytes", &self.content.len()).finish_non_exhaustive()
    }
}

impl PackedSamples {
    /// As [`Samples::write`].
    ///
    /// # Errors
    /// [`SamplesError::Io`]; a file that was there before is then unchanged.
    pub fn write(&self, path: &Path) -> Result<(), SamplesError> {
        replace_file(path, WhenBusy::Wait, |file| {
            file.write_all(MAGIC)?;
            file.write_all(&VERSION.to_le_bytes())?;
            file.write_all(self.checksum.as_bytes())?;
            file.write_all(&self.content)?;
            file.sync_all()
        })?;
        Ok(())
    }
}

/// The length of the content, and the content compressed.
fn packed(content: &[u8]) -> io::Result<Vec<u8>> {
    let mut packed = (content.len() as u64).to_le_bytes().to_vec();
    packed.extend(zstd::bulk::compress(content, LEVEL)?);
    Ok(packed)
}

/// The content of a Zstandard frame; `None` if it does not have the given length.
fn unpacked(frame: &[u8], length: u64) -> Option<Vec<u8>> {
    let mut unpacked = Vec::new();
    zstd::stream::read::Decoder::new(frame)
        .ok()?
        .take(length.saturating_add(1))
        .read_to_end(&mut unpacked)
        .ok()?;
    (unpacked.len() as u64 == length).then_some(unpacked)
}
