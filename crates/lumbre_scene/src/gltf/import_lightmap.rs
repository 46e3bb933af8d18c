//! Imports LUMBRE_lightmap with its OpenEXR or KTX2 image.

use std::collections::HashMap;
use std::io::Cursor;
use std::sync::Arc;

use glam::Vec3;
use image::{ImageDecoder, codecs::openexr::OpenExrDecoder};

use super::document::shortened;
use super::error::LoadProblem;
use super::extensions::LightmapExtension;
use super::limits::{Budget, LoadLimits};
use super::uri::{self, Base};
use crate::lightmap_files::{Ktx2Error, Ktx2Header};
use crate::{Lightmap, LightmapEncoding, LightmapImage};

/// Most texels per byte of an OpenEXR file: zlib expands at most 1032 times, and a texel of three halves has
/// six bytes.
const MAX_TEXELS_PER_BYTE: u64 = 1032 / 6;

/// The lightmaps of a file; each image is read once.
#[derive(Default)]
pub(crate) struct Lightmaps {
    read: HashMap<(String, LightmapEncoding), Arc<LightmapImage>>,
}

impl Lightmaps {
    /// The lightmap of a node.
    pub(crate) fn lightmap(
        &mut self,
        source: &LightmapExtension,
        place: &str,
        base: Base<'_>,
        limits: &LoadLimits,
        budget: &mut Budget,
    ) -> Result<Lightmap, LoadProblem> {
        let wrong = |field: &str, value: String, expected: &str| LoadProblem::Value {
            place: place.to_owned(),
            field: format!("LUMBRE_lightmap.{field}"),
            value,
            expected: expected.to_owned(),
        };
        if let Some(tex_coord) = source.tex_coord.filter(|&tex_coord| tex_coord != 1) {
            return Err(wrong("texCoord", tex_coord.to_string(), "only 1 is supported; bake the file again"));
        }
        let encoding = match source.encoding.as_deref() {
            Some(name) => LightmapEncoding::from_name(name).ok_or_else(|| {
                wrong("encoding", format!("{:?}", shortened(name)), "use rgb32f, rgb16f or rgb9e5")
            })?,
            None => LightmapEncoding::default(),
        };
        let key = (source.image.clone(), encoding);
        if let Some(image) = self.read.get(&key) {
            return Ok(Lightmap { image: image.clone() });
        }
        let place = format!("{place}: lightmap {}", shortened(&source.image));
        let bytes = uri::fetch(&source.image, base, &place)?;
        let name =
            uri::relative(&source.image).map(|path| path.to_string_lossy().into_owned()).unwrap_or_default();
        // The format is recognized by the first bytes, not by the name.
        let decode = if Ktx2Header::recognizes(&bytes) { decode_ktx2 } else { decode_open_exr };
        let (width, height, texels) = decode(&bytes, &place, limits, budget)?;
        if let Some(at) = texels.iter().position(|texel| !texel.is_finite()) {
            let (column, row) = (at as u32 % width, at as u32 / width);
            let problem = format!("texel {column} of row {row} is NaN or infinite; bake again");
            return Err(LoadProblem::Image { place, problem });
        }
        let image = Arc::new(LightmapImage { name, width, height, texels, encoding });
        self.read.insert(key, image.clone());
        Ok(Lightmap { image })
    }
}

/// Width, height and texels of an image.
type Decoded = (u32, u32, Vec<Vec3>);

fn decode_ktx2(
    bytes: &[u8],
    place: &str,
    limits: &LoadLimits,
    budget: &mut Budget,
) -> Result<Decoded, LoadProblem> {
    let refused = |problem: String| LoadProblem::Image { place: place.to_owned(), problem };
    let unreadable = |error: Ktx2Error| refused(error.to_string());
    let header = Ktx2Header::read(bytes).map_err(unreadable)?;
    let (width, height) = (header.width, header.height);
    if header.depth.is_some() || width.max(height) > limits.image_side {
        let (depth, side) = (header.depth.unwrap_or(1), limits.image_side);
        return Err(refused(format!(
            "claims {width} x {height} x {depth} texels; a lightmap has one slice, and at most {side} per side are allowed"
        )));
    }
    // Each texel is held as bytes, as a packed texel and as a colour.
    budget.charge(header.texels, 4 + 4 + 12, || place.to_owned())?;
    let texture = header.texture().map_err(unreadable)?;
    Ok((width, height, texture.colors().collect()))
}

fn decode_open_exr(
    bytes: &[u8],
    place: &str,
    limits: &LoadLimits,
    budget: &mut Budget,
) -> Result<Decoded, LoadProblem> {
    let refused = |problem: String| LoadProblem::Image { place: place.to_owned(), problem };
    let undecodable =
        |error: image::ImageError| refused(format!("cannot be decoded as OpenEXR: {error}; bake again"));
    let decoder =
        OpenExrDecoder::with_alpha_preference(Cursor::new(bytes), Some(false)).map_err(undecodable)?;
    let (width, height) = decoder.dimensions();
    let texels = u64::from(width) * u64::from(height);
    let possible = MAX_TEXELS_PER_BYTE.saturating_mul(bytes.len() as u64);
    if texels == 0 || texels > possible || width.max(height) > limits.image_side {
        let (side, length) = (limits.image_side, bytes.len());
        return Err(refused(format!(
            "claims {width} x {height} texels in {length} bytes; at most {side} per side are allowed, and what the bytes can hold"
        )));
    }
    // Each texel is held twice, as bytes and as a colour.
    budget.charge(texels, 24, || place.to_owned())?;
    let mut buffer = vec![0; texels as usize * 12];
    decoder.read_image(&mut buffer).map_err(undecodable)?;
    let float = |bytes: &[u8]| f32::from_ne_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]);
    let texels: Vec<Vec3> = buffer
        .chunks_exact(12)
        .map(|texel| Vec3::new(float(&texel[..4]), float(&texel[4..8]), float(&texel[8..])))
        .collect();
    Ok((width, height, texels))
}
