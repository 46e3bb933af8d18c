//! A KTX2 texture of packed colours, and what can be wrong with one. Not its reading or writing.

use glam::Vec3;

use super::PackedFormat;

/// The first twelve bytes of every KTX2 file.
pub(crate) const IDENTIFIER: [u8; 12] =
    [0xab, 0x4b, 0x54, 0x58, 0x20, 0x32, 0x30, 0xbb, 0x0d, 0x0a, 0x1a, 0x0a];
/// Bytes of the header with its index, before the level index.
pub(crate) const HEADER_BYTES: usize = 80;
/// Bytes of an entry of the level index.
pub(crate) const LEVEL_BYTES: usize = 24;
/// The metadata that says which way rows go.
pub(crate) const ORIENTATION_KEY: &str = "KTXorientation";

/// How the texels of a KTX2 file are compressed as a whole.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Supercompression {
    /// As they are: readers need no decoder.
    None,
    /// As a Zstandard frame, without loss.
    #[default]
    Zstandard,
}

impl Supercompression {
    /// The number that a file has for it.
    pub(crate) fn scheme(self) -> u32 {
        match self {
            Self::None => 0,
            Self::Zstandard => 2,
        }
    }
}

/// A 2D or 3D texture of one level, without layers.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Ktx2Texture {
    /// How a texel packs its colour.
    pub format: PackedFormat,
    /// Texels along a row.
    pub width: u32,
    /// Rows of a slice. Bevy takes a picture of a single row for a 1D texture.
    pub height: u32,
    /// Slices of a 3D texture; `None` for a 2D texture.
    pub depth: Option<u32>,
    /// Row by row from the top, slice by slice from the front.
    pub texels: Vec<u32>,
}

impl Ktx2Texture {
    /// The colours of the texels, in their order.
    pub fn colors(&self) -> impl Iterator<Item = Vec3> {
        self.texels.iter().map(|&texel| self.format.decode(texel))
    }
}

/// Why a KTX2 file cannot be read or written. Only files of the kind that this crate writes are read.
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
        /// The part.
        what: &'static str,
        /// Where it should end.
        needed: u64,
        /// Bytes of the file.
        found: u64,
    },
    /// The texels are of another format.
    #[error(
        "has VkFormat {found}; only 123 (E5B9G9R9) and 122 (B10G11R11) are read, write it as one of them"
    )]
    Format {
        /// The number in the file.
        found: u32,
    },
    /// A field has a value that is not read.
    #[error("its {field} is {found}, but {expected} is wanted; write it again")]
    Field {
        /// The name that the specification has for it.
        field: &'static str,
        /// What it holds.
        found: u64,
        /// What would be right.
        expected: String,
    },
    /// Rows go another way.
    #[error("has the orientation {found:?}; only {expected:?} is read, flip and write it again")]
    Orientation {
        /// What it says.
        found: String,
        /// What would be right.
        expected: &'static str,
    },
    /// The sizes do not fit the texels that are to be written.
    #[error("{texels} texels are not {size}")]
    Size {
        /// How many there are.
        texels: usize,
        /// Width, height and depth.
        size: String,
    },
    /// The compressed texels cannot be packed or unpacked.
    #[error("its Zstandard data is not good: {problem}; write it again")]
    Zstandard {
        /// What is wrong with them.
        problem: String,
    },
}

/// The little-endian word at an offset that is known to be inside.
pub(crate) fn word(bytes: &[u8], offset: usize) -> u32 {
    bytes[offset..].iter().take(4).rev().fold(0, |word, &byte| word << 8 | u32::from(byte))
}

/// Bytes of a file from an offset, checked against those that exist.
pub(crate) fn part<'a>(
    bytes: &'a [u8],
    what: &'static str,
    start: u64,
    length: u64,
) -> Result<&'a [u8], Ktx2Error> {
    let needed = start.saturating_add(length);
    let found = bytes.len() as u64;
    // Both are at most the length of a slice, or refused.
    if needed > found {
        return Err(Ktx2Error::Truncated { what, needed, found });
    }
    Ok(&bytes[start as usize..needed as usize])
}
