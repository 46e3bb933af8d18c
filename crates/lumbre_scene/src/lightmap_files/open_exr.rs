//! Writes OpenEXR files with three channels and ZIP compression. The `image` crate reads them.

use exr::prelude::{
    Blocks, Compression, Encoding, Image, IntoSample, Layer, LayerAttributes, LineOrder, SpecificChannels,
    Vec2, WritableImage,
};
use glam::Vec3;
use half::f16;

use super::{EncodingError, LightmapFileError};
use crate::LightmapImage;

/// Encodes an image as half floats, rounded to nearest with ties to even and clamped to ±65504.
///
/// The error of a channel c within that range is at most max(2^-11 |c|, 2^-25).
pub(crate) fn as_halves(image: &LightmapImage) -> Result<(Vec<u8>, EncodingError), LightmapFileError> {
    let halves: Vec<[f16; 3]> = image
        .texels
        .iter()
        .map(|texel| texel.clamp(Vec3::splat(-LARGEST_HALF), Vec3::splat(LARGEST_HALF)))
        .map(|texel| texel.to_array().map(f16::from_f32))
        .collect();
    let decoded = halves.iter().map(|half| Vec3::from_array(half.map(f16::to_f32)));
    let range = [Vec3::splat(-LARGEST_HALF), Vec3::splat(LARGEST_HALF)];
    let error = EncodingError::between(&image.texels, decoded, range);
    Ok((file(image, |at| halves[at].into())?, error))
}

/// Encodes an image as 32-bit floats, without error.
pub(crate) fn as_floats(image: &LightmapImage) -> Result<(Vec<u8>, EncodingError), LightmapFileError> {
    Ok((file(image, |at| image.texels[at].into())?, EncodingError::default()))
}

const LARGEST_HALF: f32 = 65_504.0;

/// Writes scan lines in blocks of 16, in order and on one thread, so that equal images give equal bytes.
fn file<T: IntoSample + Sync>(
    image: &LightmapImage,
    texel: impl Fn(usize) -> (T, T, T) + Sync,
) -> Result<Vec<u8>, LightmapFileError> {
    let size = Vec2(image.width as usize, image.height as usize);
    let channels = SpecificChannels::rgb(|at: Vec2<usize>| texel(at.y() * size.width() + at.x()));
    let encoding = Encoding {
        compression: Compression::ZIP16,
        blocks: Blocks::ScanLines,
        line_order: LineOrder::Increasing,
    };
    let layer = Layer::new(size, LayerAttributes::default(), encoding, channels);
    let mut file = std::io::Cursor::new(Vec::new());
    Image::from_layer(layer)
        .write()
        .non_parallel()
        .to_buffered(&mut file)
        .map_err(|error| LightmapFileError::OpenExr { problem: error.to_string() })?;
    Ok(file.into_inner())
}
