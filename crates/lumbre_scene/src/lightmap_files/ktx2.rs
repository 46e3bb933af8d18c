//! A KTX2 texture with packed colours, its errors, and constants of the format. Reading and writing are in
//! `ktx2_reader` and `ktx2_writer`.

use glam::Vec3;

use super::PackedFormat;

/// The first twelve bytes of every KTX2 file.
pub(crate) const IDENTIFIER: [u8; 12] =
    [0xab, 0x4b, 0x54, 0x58, 0x20, 0x32, 0x30, 0xbb, 0x0d, 0x0a, 0x1a, 0x0a];
/// Size in bytes of the header with its index, before the level index.
pub(crate) const HEADER_BYTES: usize = 80;
/// Size in bytes of an entry of the level index.
pub(crate) const LEVEL_BYTES: usize = 24;
/// The metadata key for the directions of rows and slices.
pub(crate) const ORIENTATION_KEY: &str = "KTXorientation";

/// Compression of the texel data of a KTX2 file as a whole.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Supercompression {
    /// Uncompressed: readers need no decoder.
    None,
    /// One Zstandard frame (lossless).
    #[default]
    Zstandard,
}

impl Supercompression {
    /// The value of the `supercompressionScheme` field.
    pub(crate) fn scheme(self) -> u32 {
        match self {
            Self::None => 0,
            Self::Zstandard => 2,
        }
    }
}

/// A 2D or 3D texture with one mip level and no layers.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Ktx2Texture {
    /// Format of the texels.
    pub format: PackedFormat,
    /// Texels per row.
    pub width: u32,
    /// Rows per slice. Bevy reads a texture of a single row as a 1D texture.
    pub height: u32,
    /// Slices of a 3D texture; `None` for a 2D texture.
    pub depth: Option<u32>,
    /// Packed texels: row by row from the top, slice by slice from the front.
    pub texels: Vec<u32>,
}

impl Ktx2Texture {
    /// The decoded colours of the texels, in the same order.
    pub fn colors(&self) -> impl Iterator<Item = Vec3> {
        self.texels.iter().map(|&texel| self.format.decode(texel))
    }
}

/// Why a KTX2 file cannot be read or written. The reader supports only the kind of files that this crate
/// writes.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Ktx2Error {
    /// The first bytes are not those of a KTX2 file.
    #[error("does not start as a KTX2 file; write it again")]
    Identifier,
    /// The file ends before something that it refers to.
    #[error(
        "its {what} ends at byte {needed}, but the file at {found}; it is truncated, copy or write it again"
    )]
    Truncated {
        /// The part of the file.
        what: &'static str,
        /// Offset at which the part should end.
        needed: u64,
        /// Size of the file in bytes.
        found: u64,
    },
    /// The texels have an unsupported format.
    #[error(
        "has VkFormat {found}; only 123 (E5B9G9R9) and 122 (B10G11R11) are read, write it as one of them"
    )]
    Format {
        /// The `VkFormat` in the file.
        found: u32,
    },
    /// A field has an unsupported value.
    #[error("its {field} is {found}, but {expected} is wanted; write it again")]
    Field {
        /// The field's name in the specification.
        field: &'static str,
        /// The value found.
        found: u64,
        /// The values that are supported.
        expected: String,
    },
    /// The rows or slices run in an unsupported direction.
    #[error("has the orientation {found:?}; only {expected:?} is read, flip and write it again")]
    Orientation {
        /// The orientation found.
        found: String,
        /// The orientation that is supported.
        expected: &'static str,
    },
    /// The number of texels to be written does not match the size.
    #[error("{texels} texels are not {size}")]
    Size {
        /// Number of texels.
        texels: usize,
        /// Width, height and depth.
        size: String,
    },
    /// The texels cannot be compressed or decompressed.
    #[error("its Zstandard data is not good: {problem}; write it again")]
    Zstandard {
        /// What the codec reports.
        problem: String,
    },
}

/// The little-endian 32-bit word at an offset, which must be within the bytes.
pub(crate) fn word(bytes: &[u8], offset: usize) -> u32 {
    bytes[offset..].iter().take(4).rev().fold(0, |word, &byte| word << 8 | u32::from(byte))
}

/// The bytes of a part of a file, or [`Ktx2Error::Truncated`] if the file ends before the part does.
pub(crate) fn part<'a>(
    bytes: &'a [u8],
    what: &'static str,
    start: u64,
    length: u64,
) -> Result<&'a [u8], Ktx2Error> {
    let needed = start.saturating_add(length);
    let found = bytes.len() as u64;
    // The casts are lossless: both numbers are at most the length of the slice.
    if needed > found {
        return Err(Ktx2Error::Truncated { what, needed, found });
    }
    Ok(&bytes[start as usize..needed as usize])
}
