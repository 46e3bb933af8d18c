//! Reads KTX2 files of the kind that this crate writes, from untrusted bytes. Other kinds are refused.

use super::ktx2::{HEADER_BYTES, IDENTIFIER, LEVEL_BYTES, ORIENTATION_KEY, part, word};
use super::{Ktx2Error, Ktx2Texture, PackedFormat, Supercompression, zstandard};

/// Most texels per byte of a Zstandard frame: a block of four bytes can expand to 128 KiB.
const MAX_TEXELS_PER_BYTE: u64 = (128 << 10) / 4 / 4;

/// The validated header of a file, available before any texel is decompressed.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Header<'a> {
    pub format: PackedFormat,
    pub width: u32,
    pub height: u32,
    pub depth: Option<u32>,
    /// Number of texels. Their size in bytes fits `usize`, and the compressed level is long enough to hold
    /// them.
    pub texels: u64,
    supercompression: Supercompression,
    level: &'a [u8],
}

impl<'a> Header<'a> {
    /// Returns true if the bytes start with the KTX2 identifier.
    pub(crate) fn recognizes(bytes: &[u8]) -> bool {
        bytes.starts_with(&IDENTIFIER)
    }

    /// Checks everything except the texels.
    pub(crate) fn read(bytes: &'a [u8]) -> Result<Self, Ktx2Error> {
        if !Self::recognizes(bytes) {
            return Err(Ktx2Error::Identifier);
        }
        part(bytes, "header with its level index", 0, (HEADER_BYTES + LEVEL_BYTES) as u64)?;
        let field = |index: usize| word(bytes, IDENTIFIER.len() + 4 * index);
        let found = field(0);
        let format = PackedFormat::ALL
            .into_iter()
            .find(|format| format.vulkan_format() == found)
            .ok_or(Ktx2Error::Format { found })?;
        let [width, height, depth] = [2, 3, 4].map(field);
        let only = |field: &'static str, found: u32, expected: &[u32]| {
            if expected.contains(&found) {
                return Ok(());
            }
            let expected: Vec<_> = expected.iter().map(u32::to_string).collect();
            Err(Ktx2Error::Field { field, found: found.into(), expected: expected.join(" or ") })
        };
        only("typeSize", field(1), &[4])?;
        only("layerCount", field(5), &[0])?;
        only("faceCount", field(6), &[1])?;
        only("levelCount", field(7), &[0, 1])?;
        only("supercompressionScheme", field(8), &[0, 2])?;
        let supercompression =
            if field(8) == 0 { Supercompression::None } else { Supercompression::Zstandard };
        for (name, found) in [("pixelWidth", width), ("pixelHeight", height)] {
            if found == 0 {
                return Err(Ktx2Error::Field { field: name, found: 0, expected: "1 or more".to_owned() });
            }
        }
        let depth = (depth > 0).then_some(depth);
        orientation(
            part(bytes, "key/value data", field(11).into(), field(12).into())?,
            if depth.is_some() { "rdi" } else { "rd" },
        )?;

        let long = |offset: usize| u64::from(word(bytes, offset)) | u64::from(word(bytes, offset + 4)) << 32;
        let [start, length, unpacked] = [0, 8, 16].map(|offset| long(HEADER_BYTES + offset));
        let level = part(bytes, "level 0", start, length)?;
        // Three 32-bit sizes need up to 96 bits.
        let texels = u128::from(width) * u128::from(height) * u128::from(depth.unwrap_or(1));
        let wrong = |field, found, expected: String| Err(Ktx2Error::Field { field, found, expected });
        if u128::from(unpacked) != 4 * texels {
            return wrong("uncompressedByteLength", unpacked, format!("{} (4 a texel)", 4 * texels));
        }
        // The count fits u64, since the 64-bit field holds four times as much.
        let texels = unpacked / 4;
        let possible = match supercompression {
            Supercompression::None if length != unpacked => {
                return wrong("byteLength", length, unpacked.to_string());
            }
            Supercompression::None => texels,
            Supercompression::Zstandard => length.saturating_mul(MAX_TEXELS_PER_BYTE),
        };
        if texels > possible || usize::try_from(unpacked).is_err() {
            return wrong("byteLength", length, format!("enough for {texels} texels"));
        }
        Ok(Self { format, width, height, depth, texels, supercompression, level })
    }

    /// Decompresses the texels. This takes four bytes per texel, and another four for the texture.
    pub(crate) fn texture(self) -> Result<Ktx2Texture, Ktx2Error> {
        let unpacked;
        let bytes = match self.supercompression {
            Supercompression::None => self.level,
            Supercompression::Zstandard => {
                unpacked = zstandard::decompress(self.level, 4 * self.texels as usize)?;
                &unpacked
            }
        };
        let texels = bytes.chunks_exact(4).map(|texel| word(texel, 0)).collect();
        let Self { format, width, height, depth, .. } = self;
        Ok(Ktx2Texture { format, width, height, depth, texels })
    }
}

impl Ktx2Texture {
    /// Reads a file of RGB9E5 or B10G11R11 texels with one level and no layers, with or without Zstandard
    /// compression.
    ///
    /// At most `most_texels` texels are decompressed, which takes eight bytes each.
    ///
    /// # Errors
    /// [`Ktx2Error`] with the field and the values that are supported.
    pub fn from_bytes(bytes: &[u8], most_texels: u64) -> Result<Self, Ktx2Error> {
        let header = Header::read(bytes)?;
        if header.texels > most_texels {
            let expected = format!("at most {}", most_texels.saturating_mul(4));
            let found = header.texels.saturating_mul(4);
            return Err(Ktx2Error::Field { field: "uncompressedByteLength", found, expected });
        }
        header.texture()
    }
}

/// Refuses a stated orientation other than `expected`. A damaged entry ends the search without an error,
/// since no other metadata is needed.
fn orientation(mut entries: &[u8], expected: &'static str) -> Result<(), Ktx2Error> {
    while entries.len() > 4 {
        let length = word(entries, 0) as usize;
        let Some(entry) = entries[4..].get(..length) else { return Ok(()) };
        let mut halves = entry.splitn(2, |&byte| byte == 0);
        if halves.next() == Some(ORIENTATION_KEY.as_bytes()) {
            let value = halves.next().unwrap_or_default();
            let value = value.strip_suffix(&[0]).unwrap_or(value);
            if value != expected.as_bytes() {
                let found = String::from_utf8_lossy(value).chars().take(16).collect();
                return Err(Ktx2Error::Orientation { found, expected });
            }
        }
        entries = entries.get(4 + length.next_multiple_of(4)..).unwrap_or_default();
    }
    Ok(())
}
