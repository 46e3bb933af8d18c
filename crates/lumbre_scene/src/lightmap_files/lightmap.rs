//! Lightmaps as bytes of files. Not the formats themselves.

use glam::Vec3;

use super::{EncodingError, Ktx2Error, Ktx2Texture, PackedFormat, Supercompression, open_exr};
use crate::{LightmapEncoding, LightmapImage};

/// Why light cannot be written to a file.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum LightmapFileError {
    /// The sizes and the texels do not fit.
    #[error("{texels} texels are not {width} x {height}")]
    Size {
        /// How many there are.
        texels: usize,
        /// Texels of a row.
        width: u32,
        /// Rows.
        height: u32,
    },
    /// A texel is not finite.
    #[error("texel {column} of row {row} is NaN or infinite")]
    NotFinite {
        /// Counted from the left, from 0.
        column: usize,
        /// Counted from the top, from 0.
        row: usize,
    },
    /// OpenEXR cannot hold it.
    #[error("OpenEXR: {problem}")]
    OpenExr {
        /// What its writer said.
        problem: String,
    },
    /// KTX2 cannot hold it.
    #[error("KTX2: it {source}")]
    Ktx2 {
        /// What is wrong.
        #[from]
        source: Ktx2Error,
    },
}

/// A lightmap as an OpenEXR file and what that costs: half floats for [`LightmapEncoding::Rgb16Float`], else 32-bit floats, from which
/// other encodings can be made. The image's own encoding is not asked.
///
/// # Errors
/// [`LightmapFileError`] if it is empty, of another size than it says, or not finite.
pub fn lightmap_to_open_exr(
    image: &LightmapImage,
    encoding: LightmapEncoding,
) -> Result<(Vec<u8>, EncodingError), LightmapFileError> {
    check(image)?;
    match encoding {
        LightmapEncoding::Rgb16Float => open_exr::as_halves(image),
        LightmapEncoding::Rgb32Float | LightmapEncoding::Rgb9E5 => open_exr::as_floats(image),
    }
}

/// A lightmap as a KTX2 file of one level, whatever its own encoding, and what that costs.
///
/// Bevy's `Lightmap` shows it as it is: texel · exposure · diffuse colour, which is the reflected radiance ρ E/π.
///
/// # Errors
/// [`LightmapFileError`] if it is empty, of another size than it says, or not finite.
pub fn lightmap_to_ktx2(
    image: &LightmapImage,
    format: PackedFormat,
    supercompression: Supercompression,
) -> Result<(Vec<u8>, EncodingError), LightmapFileError> {
    check(image)?;
    let texels = image.texels.iter().filter_map(|&texel| format.encode(texel)).collect();
    let texture = Ktx2Texture { format, width: image.width, height: image.height, depth: None, texels };
    let error = EncodingError::between(&image.texels, texture.colors(), [Vec3::ZERO, format.largest()]);
    Ok((texture.to_bytes(supercompression)?, error))
}

fn check(image: &LightmapImage) -> Result<(), LightmapFileError> {
    let (width, height, texels) = (image.width, image.height, image.texels.len());
    if texels == 0 || u64::from(width) * u64::from(height) != texels as u64 {
        return Err(LightmapFileError::Size { texels, width, height });
    }
    match image.texels.iter().position(|texel| !texel.is_finite()) {
        Some(at) => {
            let (column, row) = (at % width as usize, at / width as usize);
            Err(LightmapFileError::NotFinite { column, row })
        }
        None => Ok(()),
    }
}
