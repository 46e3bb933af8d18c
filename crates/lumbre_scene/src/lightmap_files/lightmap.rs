//! Encodes lightmaps as OpenEXR or KTX2 files. The formats themselves are in `open_exr` and `ktx2_writer`.

use glam::Vec3;

use super::{EncodingError, Ktx2Error, Ktx2Texture, PackedFormat, Supercompression, open_exr};
use crate::{LightmapEncoding, LightmapImage};

/// Why baked light cannot be written to a file.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum LightmapFileError {
    /// The number of texels is 0 or does not match the size.
    #[error("{texels} texels are not {width} x {height}")]
    Size {
        /// Number of texels.
        texels: usize,
        /// Width in texels.
        width: u32,
        /// Height in texels.
        height: u32,
    },
    /// A texel is infinite or NaN.
    #[error("texel {column} of row {row} is NaN or infinite")]
    NotFinite {
        /// Column, counted from 0 at the left.
        column: usize,
        /// Row, counted from 0 at the top.
        row: usize,
    },
    /// The OpenEXR file cannot be written.
    #[error("OpenEXR: {problem}")]
    OpenExr {
        /// What the OpenEXR writer reports.
        problem: String,
    },
    /// The KTX2 file cannot be written.
    #[error("KTX2: it {source}")]
    Ktx2 {
        /// What is wrong.
        #[from]
        source: Ktx2Error,
    },
}

/// Encodes a lightmap as an OpenEXR file and returns the encoding error: half floats for
/// [`LightmapEncoding::Rgb16Float`], 32-bit floats for the other encodings, which can be made from these
/// later. The image's own `encoding` is ignored.
///
/// # Errors
/// [`LightmapFileError`] if the image is empty, its texels do not match its size, or a texel is not finite.
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

/// Encodes a lightmap as a KTX2 file with one level and returns the encoding error. The image's own
/// `encoding` is ignored.
///
/// Bevy's `Lightmap` can show the file without conversion: texel · exposure · diffuse colour is the reflected
/// radiance ρ E/π.
///
/// # Errors
/// [`LightmapFileError`] if the image is empty, its texels do not match its size, or a texel is not finite.
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
