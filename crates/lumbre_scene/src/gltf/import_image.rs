//! Textures: images decoded within limits, samplers, and how a material refers to both.

use std::io::Cursor;
use std::sync::Arc;

use glam::Vec2;
use image::{ImageFormat, ImageReader};

use super::accessor::Buffers;
use super::document::{TextureInfo, element, extension, shortened};
use super::error::{LoadProblem, Notes};
use super::extensions::TextureTransform;
use super::limits::{Budget, LoadLimits};
use super::uri::{self, Base};
use super::value::number;
use crate::{Image, Mipmap, Sampler, TextureReference, Wrap};

/// Most texels that one byte of a PNG or JPEG can stand for: deflate expands at most 1032 times, and a texel has at least one bit.
/// A JPEG block of 64 texels takes at least one bit.
const MOST_TEXELS_PER_BYTE: u64 = 8 * 1032;

/// Decodes images when they are first used.
pub(crate) struct Images<'a> {
    pub buffers: &'a Buffers<'a>,
    pub base: Base<'a>,
    pub limits: LoadLimits,
    pub budget: Budget,
    pub decoded: Vec<Option<Arc<Image>>>,
    /// What stands in for images that cannot be read.
    pub stand_in: Arc<Image>,
}

impl Images<'_> {
    /// The texture that a material's slot names. `None`, with a note, if it is of a kind that is not supported.
    pub(crate) fn texture(
        &mut self,
        info: &TextureInfo,
        place: &str,
        notes: &mut Notes,
    ) -> Result<Option<TextureReference>, LoadProblem> {
        let document = self.buffers.document;
        let texture = match element(&document.textures, "textures", info.index, || format!("{place}.index")) {
            Ok(texture) => texture,
            Err(problem) => {
                notes.repair(place, problem, "left out")?;
                return Ok(None);
            }
        };
        let Some(source) = texture.source else {
            let kinds: Vec<_> = texture.extensions.keys().map(|name| shortened(name)).collect();
            notes.add(
                format!("textures[{}]", info.index),
                format!("no PNG or JPEG image ({}); left out", kinds.join(", ")),
            );
            return Ok(None);
        };
        let sampler = match texture.sampler {
            Some(index) => {
                let place = format!("textures[{}].sampler", info.index);
                match element(&document.samplers, "samplers", index, || place.clone()) {
                    Ok(source) => sampler(source),
                    Err(problem) => {
                        notes.repair(&place, problem, "the usual sampler is used")?;
                        Sampler::default()
                    }
                }
            }
            None => Sampler::default(),
        };
        let transform = extension::<TextureTransform>(&info.extensions, "KHR_texture_transform", place)?
            .unwrap_or_default();
        let tex_coord = transform.tex_coord.unwrap_or(info.tex_coord);
        if tex_coord > 1 {
            notes.add(
                place,
                format!("texture coordinates {tex_coord} are not supported, only 0 and 1; texture left out"),
            );
            return Ok(None);
        }
        let vector =
            |value: Option<[f64; 2]>, default| value.map_or(default, |v| Vec2::new(v[0] as f32, v[1] as f32));
        let (offset, scale) = (vector(transform.offset, Vec2::ZERO), vector(transform.scale, Vec2::ONE));
        let rotation = number(transform.rotation, 0.0);
        if !(offset.is_finite() && scale.is_finite() && rotation.is_finite()) {
            return Err(LoadProblem::Value {
                place: place.to_owned(),
                field: "KHR_texture_transform".to_owned(),
                value: format!("offset {offset}, rotation {rotation}, scale {scale}"),
                expected: "use numbers that f32 can hold".to_owned(),
            });
        }
        let image = self.image(source, &format!("textures[{}].source", info.index), notes)?;
        Ok(Some(TextureReference { image, sampler, tex_coord, offset, rotation, scale }))
    }

    /// As [`texture`](Self::texture) for a slot in which white would mean something, such as a slope: an image that cannot be read is
    /// left out.
    pub(crate) fn texture_without_stand_in(
        &mut self,
        info: &TextureInfo,
        place: &str,
        notes: &mut Notes,
    ) -> Result<Option<TextureReference>, LoadProblem> {
        let texture = self.texture(info, place, notes)?;
        Ok(texture.filter(|texture| !Arc::ptr_eq(&texture.image, &self.stand_in)))
    }

    /// An image, decoded once. White stands in for one that cannot be read, where that may be.
    fn image(&mut self, index: usize, used_by: &str, notes: &mut Notes) -> Result<Arc<Image>, LoadProblem> {
        if let Some(Some(image)) = self.decoded.get(index) {
            return Ok(image.clone());
        }
        let name = self.buffers.document.images.get(index).and_then(|image| image.name.as_deref());
        let place = match name {
            Some(name) => format!("images[{index}] ({})", shortened(name)),
            None => format!("images[{index}]"),
        };
        let image = match self.read(index, used_by, &place) {
            Ok(image) => Arc::new(image),
            // What would fill the memory is no fault to be repaired.
            Err(problem @ LoadProblem::TooLarge { .. }) => return Err(problem),
            Err(problem) => {
                notes.repair(&place, problem, "white stands in for it")?;
                Arc::clone(&self.stand_in)
            }
        };
        if let Some(slot) = self.decoded.get_mut(index) {
            *slot = Some(image.clone());
        }
        Ok(image)
    }

    fn read(&mut self, index: usize, used_by: &str, place: &str) -> Result<Image, LoadProblem> {
        let document = self.buffers.document;
        let source = element(&document.images, "images", index, || used_by.to_owned())?;
        let fetched;
        let bytes = match (&source.uri, source.buffer_view) {
            (Some(uri), _) => {
                fetched = uri::fetch(uri, self.base, place)?;
                &fetched
            }
            (None, Some(view)) => self.buffers.view(view, || format!("images[{index}].bufferView"))?.0,
            (None, None) => {
                let problem = "has neither uri nor bufferView; export the file again".to_owned();
                return Err(LoadProblem::Image { place: place.to_owned(), problem });
            }
        };
        let name = match (&source.name, &source.uri) {
            (Some(name), _) => name.clone(),
            (None, Some(uri)) if !uri.starts_with("data:") => uri.clone(),
            _ => String::new(),
        };
        decode(bytes, name, place, &self.limits, &mut self.budget)
    }
}

/// One white texel.
pub(crate) fn white() -> Image {
    Image { name: "white".into(), width: 1, height: 1, rgba: vec![255; 4] }
}

/// Decodes a PNG or JPEG, told apart by their first bytes.
fn decode(
    bytes: &[u8],
    name: String,
    place: &str,
    limits: &LoadLimits,
    budget: &mut Budget,
) -> Result<Image, LoadProblem> {
    let refused = |problem: String| LoadProblem::Image { place: place.to_owned(), problem };
    let reader = || {
        let mut reader = ImageReader::new(Cursor::new(bytes))
            .with_guessed_format()
            .map_err(|error| refused(error.to_string()))?;
        if !matches!(reader.format(), Some(ImageFormat::Png | ImageFormat::Jpeg)) {
            return Err(refused("is neither PNG nor JPEG; convert it to PNG".to_owned()));
        }
        let mut bounds = image::Limits::default();
        bounds.max_image_width = Some(limits.image_side);
        bounds.max_image_height = Some(limits.image_side);
        // Eight bytes per texel, 16-bit RGBA, and as much again for the decoder's own rows.
        bounds.max_alloc =
            Some(u64::from(limits.image_side).pow(2).saturating_mul(16).min(limits.image_bytes));
        reader.limits(bounds);
        Ok(reader)
    };
    let undecodable =
        |error: image::ImageError| refused(format!("cannot be decoded: {error}; save it again as PNG"));
    let (width, height) = reader()?.into_dimensions().map_err(undecodable)?;
    let texels = u64::from(width) * u64::from(height);
    if texels > MOST_TEXELS_PER_BYTE.saturating_mul(bytes.len() as u64)
        || width > limits.image_side
        || height > limits.image_side
    {
        let (side, length) = (limits.image_side, bytes.len());
        return Err(refused(format!(
            "claims {width} x {height} texels in {length} bytes; at most {side} per side are allowed, and what the bytes can hold"
        )));
    }
    budget.charge(texels, 4, || place.to_owned())?;
    let decoded = reader()?.decode().map_err(undecodable)?;
    let decoded = decoded.into_rgba8();
    let (width, height) = decoded.dimensions();
    Ok(Image { name, width, height, rgba: decoded.into_raw() })
}

fn sampler(source: &super::document::Sampler) -> Sampler {
    let wrap = |value: Option<u32>| match value {
        Some(33071) => Wrap::ClampToEdge,
        Some(33648) => Wrap::MirroredRepeat,
        _ => Wrap::Repeat,
    };
    let (minify_linear, mipmap) = match source.min_filter {
        Some(9728) => (false, Mipmap::None),
        Some(9729) => (true, Mipmap::None),
        Some(9984) => (false, Mipmap::Nearest),
        Some(9985) => (true, Mipmap::Nearest),
        Some(9986) => (false, Mipmap::Linear),
        _ => (true, Mipmap::Linear),
    };
    Sampler {
        wrap_u: wrap(source.wrap_s),
        wrap_v: wrap(source.wrap_t),
        magnify_linear: source.mag_filter != Some(9728),
        minify_linear,
        mipmap,
    }
}
