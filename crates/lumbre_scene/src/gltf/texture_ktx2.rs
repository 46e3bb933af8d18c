//! Decodes KTX2 textures as used by KHR_texture_basisu: UASTC and ETC1S (BasisLZ), with or without Zstandard
//! supercompression, and uncompressed bytes. Only the largest level of a single 2D image is decoded. KTX2
//! lightmaps are read in `lightmap_files`.
//!
//! The transcoder is the crate `basisu`. It trusts the offsets in the container, so it never sees the file
//! itself, but a container with one level that is built here around bytes known to lie within the file.

use crate::lightmap_files::{Ktx2Error, ktx2, zstandard};

/// Indices of the header's 32-bit fields, counted from vkFormat.
mod field {
    pub(super) const FORMAT: usize = 0;
    pub(super) const WIDTH: usize = 2;
    pub(super) const HEIGHT: usize = 3;
    pub(super) const DEPTH: usize = 4;
    pub(super) const LAYERS: usize = 5;
    pub(super) const FACES: usize = 6;
    pub(super) const LEVELS: usize = 7;
    pub(super) const SUPERCOMPRESSION: usize = 8;
    pub(super) const DESCRIPTOR: usize = 9;
}

/// Colour models of the data format descriptor.
const ETC1S: u8 = 163;
const UASTC: u8 = 166;

/// Supercompression schemes.
const BASIS_LZ: u32 = 1;
const ZSTANDARD: u32 = 2;

/// Largest expansion factor of Zstandard: a block of four bytes can expand to 128 KiB.
const ZSTANDARD_EXPANSION: u64 = (128 << 10) / 4;

/// Number of texels that an image may claim whatever its size in bytes, if nothing else bounds it.
const TEXELS_OF_ANY_PICTURE: u64 = 4096 * 4096;

/// Size in bytes of a UASTC block of sixteen texels.
const UASTC_BLOCK: u64 = 16;

/// The validated header of a file, available before any texel is decoded.
pub(crate) struct Ktx2Picture<'a> {
    pub width: u32,
    pub height: u32,
    coding: Coding,
    /// The bytes of the largest level.
    level: &'a [u8],
    zstandard: bool,
    descriptor: &'a [u8],
    global_data: &'a [u8],
}

/// Coding of the texels.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Coding {
    Etc1s,
    Uastc,
    /// Uncompressed, with this number of channels of one byte each.
    Plain(usize),
}

impl<'a> Ktx2Picture<'a> {
    /// Returns true if the bytes start with the KTX2 identifier.
    pub(crate) fn recognizes(bytes: &[u8]) -> bool {
        bytes.starts_with(&ktx2::IDENTIFIER)
    }

    /// Checks everything except the texels. The file is then known to be large enough for the texels it
    /// claims.
    pub(crate) fn read(bytes: &'a [u8]) -> Result<Self, Ktx2Error> {
        ktx2::part(bytes, "header with its level index", 0, (ktx2::HEADER_BYTES + ktx2::LEVEL_BYTES) as u64)?;
        let word = |index: usize| ktx2::word(bytes, ktx2::IDENTIFIER.len() + 4 * index);
        let wrong = |field, found: u32, expected: &str| {
            Err(Ktx2Error::Field { field, found: found.into(), expected: expected.to_owned() })
        };
        let (width, height) = (word(field::WIDTH), word(field::HEIGHT));
        for (name, found) in [("pixelWidth", width), ("pixelHeight", height)] {
            if found == 0 {
                return wrong(name, found, "1 or more");
            }
        }
        for (name, index, most) in [
            ("pixelDepth", field::DEPTH, 0),
            ("layerCount", field::LAYERS, 1),
            ("faceCount", field::FACES, 1),
            ("levelCount", field::LEVELS, 16),
        ] {
            if word(index) > most {
                return wrong(
                    name,
                    word(index),
                    &format!("at most {most} (a picture, not an array or a cube)"),
                );
            }
        }
        let (offset, length) = (word(field::DESCRIPTOR), word(field::DESCRIPTOR + 1));
        let descriptor = ktx2::part(bytes, "data format descriptor", offset.into(), length.into())?;
        let model = descriptor.get(12).copied();
        let coding = match (word(field::FORMAT), model) {
            (0, Some(ETC1S)) => Coding::Etc1s,
            (0, Some(UASTC)) => Coding::Uastc,
            (0, _) => {
                return wrong("colorModel", model.unwrap_or_default().into(), "163 (ETC1S) or 166 (UASTC)");
            }
            // R8G8B8 and R8G8B8A8, linear and sRGB.
            (23 | 29, _) => Coding::Plain(3),
            (37 | 43, _) => Coding::Plain(4),
            (other, _) => {
                return wrong("vkFormat", other, "UASTC, ETC1S (0), R8G8B8 (23, 29) or R8G8B8A8 (37, 43)");
            }
        };
        let long = |offset: usize| {
            u64::from(ktx2::word(bytes, offset)) | u64::from(ktx2::word(bytes, offset + 4)) << 32
        };
        let [start, length, unpacked] = [0, 8, 16].map(|offset| long(ktx2::HEADER_BYTES + offset));
        let level = ktx2::part(bytes, "level 0", start, length)?;
        let scheme = word(field::SUPERCOMPRESSION);
        let right = match coding {
            Coding::Etc1s => scheme == BASIS_LZ,
            _ => matches!(scheme, 0 | ZSTANDARD),
        };
        if !right {
            return wrong("supercompressionScheme", scheme, "1 for ETC1S, otherwise 0 or 2");
        }
        let picture = Self {
            width,
            height,
            coding,
            level,
            zstandard: scheme == ZSTANDARD,
            descriptor,
            global_data: ktx2::part(bytes, "global data", long(64), long(72))?,
        };
        if let Some(needed) = picture.level_bytes()
            && (unpacked != needed || needed > picture.most_level_bytes())
        {
            let expected = format!("{needed} for {width} x {height} texels, and as many bytes as hold them");
            return Err(Ktx2Error::Field { field: "uncompressedByteLength", found: unpacked, expected });
        }
        Ok(picture)
    }

    /// Most texels that the bytes can represent.
    pub(crate) fn most_texels(&self) -> u64 {
        match self.coding {
            // A block of sixteen texels takes at least about one bit, except in runs of equal blocks, which
            // take none.
            Coding::Etc1s => TEXELS_OF_ANY_PICTURE.max((self.level.len() as u64).saturating_mul(8 * 16)),
            _ => u64::MAX,
        }
    }

    /// Size of the level in bytes after Zstandard decompression; `None` for ETC1S, whose blocks have no fixed
    /// size.
    fn level_bytes(&self) -> Option<u64> {
        // The number of blocks fits, as each side has at most 30 bits; UASTC takes one byte per texel.
        let blocks = || u64::from(self.width.div_ceil(4)).saturating_mul(self.height.div_ceil(4).into());
        match self.coding {
            Coding::Etc1s => None,
            Coding::Uastc => Some(blocks().saturating_mul(UASTC_BLOCK)),
            Coding::Plain(channels) => {
                Some(u64::from(self.width).saturating_mul(self.height.into()).saturating_mul(channels as u64))
            }
        }
    }

    fn most_level_bytes(&self) -> u64 {
        let length = self.level.len() as u64;
        if self.zstandard { length.saturating_mul(ZSTANDARD_EXPANSION) } else { length }
    }

    /// Decodes the texels to RGBA, row by row from the top. Needs at most twelve bytes per texel.
    pub(crate) fn texels(&self) -> Result<Vec<u8>, String> {
        let unpacked;
        let mut level = self.level;
        if let Some(length) = self.level_bytes() {
            let length = usize::try_from(length).map_err(|_| "is too large".to_owned())?;
            if self.zstandard {
                unpacked = zstandard::decompress(level, length).map_err(|error| error.to_string())?;
                level = &unpacked;
            }
            level = level.get(..length).ok_or("ends before its texels")?;
        }
        match self.coding {
            Coding::Plain(4) => Ok(level.to_vec()),
            Coding::Plain(channels) => Ok(level
                .chunks_exact(channels)
                .flat_map(|texel| texel.iter().copied().chain(std::iter::once(255)))
                .collect()),
            Coding::Etc1s | Coding::Uastc => self.transcoded(level),
        }
    }

    #[cfg(feature = "basisu")]
    fn transcoded(&self, level: &[u8]) -> Result<Vec<u8>, String> {
        use basisu::{DecodeFlags, TargetFormat, Transcoder};

        let file = self.with_one_level(level).ok_or("its global data end too early")?;
        let transcode = || {
            let transcoder = Transcoder::new(&file)?;
            transcoder.transcode(0, TargetFormat::Rgba32, DecodeFlags::NONE)
        };
        match super::guarded::guarded(transcode) {
            Some(Ok(texels)) => Ok(texels),
            Some(Err(error)) => Err(format!("its Basis Universal data cannot be decoded ({error:?})")),
            None => Err("its Basis Universal data make the decoder fail".to_owned()),
        }
    }

    #[cfg(not(feature = "basisu"))]
    fn transcoded(&self, _: &[u8]) -> Result<Vec<u8>, String> {
        let _ = (self.descriptor, self.global_data);
        Err("holds Basis Universal data, whose decoder was left out of this program; build it with the feature `basisu` of lumbre_scene"
            .to_owned())
    }

    /// Builds a KTX2 file that contains only the largest level, without Zstandard supercompression and with
    /// valid offsets.
    #[cfg(feature = "basisu")]
    fn with_one_level(&self, level: &[u8]) -> Option<Vec<u8>> {
        /// The BasisLZ global data starts with the sizes, followed by twenty bytes per image; only the first
        /// image is kept.
        const SIZES: usize = 20;
        const PICTURE: usize = 20;
        let mut global_data = Vec::new();
        if self.coding == Coding::Etc1s {
            let length = |at: usize| Some(ktx2::word(self.global_data.get(at..at + 4)?, 0) as usize);
            let codebooks = length(4)?.checked_add(length(8)?)?.checked_add(length(12)?)?;
            let start = self.global_data.len().checked_sub(codebooks)?;
            let pictures = start.checked_sub(SIZES)?;
            if pictures < PICTURE || pictures % PICTURE != 0 {
                return None;
            }
            global_data.extend_from_slice(self.global_data.get(..SIZES + PICTURE)?);
            global_data.extend_from_slice(self.global_data.get(start..)?);
        }
        let descriptor_start = ktx2::HEADER_BYTES + ktx2::LEVEL_BYTES;
        let global_start = (descriptor_start + self.descriptor.len()).next_multiple_of(8);
        let level_start = (global_start + global_data.len()).next_multiple_of(16);
        let scheme = if self.coding == Coding::Etc1s { BASIS_LZ } else { 0 };
        let unpacked = if self.coding == Coding::Etc1s { 0 } else { level.len() as u64 };

        let mut file = ktx2::IDENTIFIER.to_vec();
        let fields = [0, 1, self.width, self.height, 0, 0, 1, 1, scheme];
        let descriptor = [descriptor_start as u32, self.descriptor.len() as u32];
        let no_metadata = [0; 2];
        file.extend(fields.into_iter().chain(descriptor).chain(no_metadata).flat_map(u32::to_le_bytes));
        let global_start_if_any = if global_data.is_empty() { 0 } else { global_start as u64 };
        let global = [global_start_if_any, global_data.len() as u64];
        let index = [level_start as u64, level.len() as u64, unpacked];
        file.extend(global.into_iter().chain(index).flat_map(u64::to_le_bytes));
        file.extend_from_slice(self.descriptor);
        file.resize(global_start, 0);
        file.extend_from_slice(&global_data);
        file.resize(level_start, 0);
        file.extend_from_slice(level);
        Some(file)
    }
}
