//! Imports textures: decodes images within limits, and converts samplers and texture references.

use std::io::Cursor;
use std::sync::Arc;

use glam::Vec2;
use gltf::json;
use gltf::json::texture::{MagFilter, MinFilter, WrappingMode};
use gltf::json::validation::Checked;
use image::{ImageFormat, ImageReader};

use super::accessor::Buffers;
use super::decoders;
use super::document::{Texture, TextureInfo, element, extension, shortened};
use super::error::{LoadProblem, Notes};
use super::extensions::{TextureSource, TextureTransform};
use super::guarded::guarded;
use super::limits::{Budget, LoadLimits};
use super::texture_ktx2::Ktx2Picture;
use super::uri::{self, Base};
use super::value::number;
use crate::{Image, Mipmap, Sampler, TextureReference, Wrap};

/// Most texels that one byte of a PNG or JPEG can represent: deflate expands at most 1032 times, and a texel
/// has at least one bit. A JPEG block of 64 texels takes at least one bit.
const MAX_TEXELS_PER_BYTE: u64 = 8 * 1032;

/// Number of texels that an image may claim whatever its size in bytes: an image of a single colour takes
/// next to no bytes as WebP or ETC1S.
const TEXELS_OF_ANY_IMAGE: u64 = 4096 * 4096;

/// Texture extensions that refer to an alternative image, in order of preference.
const TEXTURE_EXTENSIONS: [&str; 2] = ["KHR_texture_basisu", "EXT_texture_webp"];

/// The images of a file, decoded on first use.
pub(crate) struct Images<'a> {
    pub buffers: &'a Buffers<'a>,
    pub base: Base<'a>,
    pub limits: LoadLimits,
    pub budget: Budget,
    pub decoded: Vec<Option<Arc<Image>>>,
    /// Replaces images that cannot be read.
    pub stand_in: Arc<Image>,
}

impl Images<'_> {
    /// The texture for a slot of a material. Returns `None`, with a note, if it is of an unsupported kind.
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
        let sources = sources(texture, &format!("textures[{}]", info.index), notes)?;
        if sources.is_empty() {
            return Ok(None);
        }
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
        let image = self.image(&sources, &format!("textures[{}].source", info.index), notes)?;
        Ok(Some(TextureReference { image, sampler, tex_coord, offset, rotation, scale }))
    }

    /// As [`texture`](Self::texture), for slots in which white has a meaning, such as normals: if the image
    /// cannot be read, the texture is left out.
    pub(crate) fn texture_without_stand_in(
        &mut self,
        info: &TextureInfo,
        place: &str,
        notes: &mut Notes,
    ) -> Result<Option<TextureReference>, LoadProblem> {
        let texture = self.texture(info, place, notes)?;
        Ok(texture.filter(|texture| !Arc::ptr_eq(&texture.image, &self.stand_in)))
    }

    /// The first of a texture's images that can be read; each is decoded once. If none can be and repairs are
    /// allowed, the result is white.
    fn image(
        &mut self,
        sources: &[usize],
        used_by: &str,
        notes: &mut Notes,
    ) -> Result<Arc<Image>, LoadProblem> {
        for (number, &index) in sources.iter().enumerate() {
            let next = sources.get(number + 1);
            let image = match self.decoded.get(index) {
                Some(Some(image)) => Arc::clone(image),
                _ => self.decode_once(index, used_by, next, notes)?,
            };
            if next.is_none() || !Arc::ptr_eq(&image, &self.stand_in) {
                return Ok(image);
            }
        }
        Ok(Arc::clone(&self.stand_in))
    }

    /// Decodes an image and stores it. If that fails and repairs are allowed, the result is white, and a note
    /// says whether the image `next` is tried instead.
    fn decode_once(
        &mut self,
        index: usize,
        used_by: &str,
        next: Option<&usize>,
        notes: &mut Notes,
    ) -> Result<Arc<Image>, LoadProblem> {
        let name = self.buffers.document.images.get(index).and_then(|image| image.name.as_deref());
        let place = match name {
            Some(name) => format!("images[{index}] ({})", shortened(name)),
            None => format!("images[{index}]"),
        };
        let image = match self.read(index, used_by, &place) {
            Ok(image) => Arc::new(image),
            // Exceeding the memory limit must not be repaired.
            Err(problem @ LoadProblem::TooLarge { .. }) => return Err(problem),
            Err(problem) => {
                let remedy = match next {
                    Some(next) => format!("images[{next}], the texture's own source, stands in for it"),
                    None => "white stands in for it".to_owned(),
                };
                notes.repair(&place, problem, &remedy)?;
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
            (None, Some(view)) => {
                self.buffers.view(view.value(), || format!("images[{index}].bufferView"))?.0
            }
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

/// The images of a texture in the order in which they are tried: those of supported extensions, then its own
/// source. Empty, with a note, if there are none.
fn sources(texture: &Texture, place: &str, notes: &mut Notes) -> Result<Vec<usize>, LoadProblem> {
    let mut sources = Vec::new();
    for name in TEXTURE_EXTENSIONS {
        if decoders::missing(name).is_none()
            && let Some(TextureSource { source }) = extension(&texture.extensions, name, place)?
        {
            sources.push(source);
        }
    }
    sources.extend(texture.source);
    if sources.is_empty() {
        let reasons = texture.extensions.keys().map(|name| match decoders::missing(name) {
            Some(decoder) => format!(
                "{name}: built without the feature `{}`; convert it with {}",
                decoder.feature, decoder.remedy
            ),
            None => shortened(name).to_owned(),
        });
        let reasons: Vec<_> = reasons.collect();
        notes.add(place, format!("no image that is read ({}); left out", reasons.join(", ")));
    }
    Ok(sources)
}

/// An image of one white texel.
pub(crate) fn white() -> Image {
    Image { name: "white".into(), width: 1, height: 1, rgba: vec![255; 4] }
}

/// Decodes an image, whose format is recognized by its first bytes.
fn decode(
    bytes: &[u8],
    name: String,
    place: &str,
    limits: &LoadLimits,
    budget: &mut Budget,
) -> Result<Image, LoadProblem> {
    if Ktx2Picture::recognizes(bytes) {
        decode_ktx2(bytes, name, place, limits, budget)
    } else {
        decode_common(bytes, name, place, limits, budget)
    }
}

/// Decodes a KTX2 image.
fn decode_ktx2(
    bytes: &[u8],
    name: String,
    place: &str,
    limits: &LoadLimits,
    budget: &mut Budget,
) -> Result<Image, LoadProblem> {
    let refused = |problem: String| LoadProblem::Image { place: place.to_owned(), problem };
    let undecodable =
        |problem: String| refused(format!("cannot be decoded as KTX2: {problem}; save it again as PNG"));
    let picture = Ktx2Picture::read(bytes).map_err(|error| undecodable(error.to_string()))?;
    let (width, height) = (picture.width, picture.height);
    check_size((width, height), picture.most_texels(), bytes.len(), limits).map_err(refused)?;
    budget.charge(u64::from(width) * u64::from(height), 4, || place.to_owned())?;
    Ok(Image { name, width, height, rgba: picture.texels().map_err(undecodable)? })
}

/// Decodes a PNG, JPEG or WebP image.
fn decode_common(
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
        match reader.format() {
            Some(ImageFormat::Png | ImageFormat::Jpeg) => {}
            Some(ImageFormat::WebP) => {
                if let Some(decoder) = decoders::missing("EXT_texture_webp") {
                    return Err(refused(format!(
                        "is WebP, whose decoder was left out of this program (feature `{}`); convert it: {}",
                        decoder.feature, decoder.remedy
                    )));
                }
            }
            _ => return Err(refused("is neither PNG nor JPEG, WebP or KTX2; convert it to PNG".to_owned())),
        }
        let mut bounds = image::Limits::default();
        bounds.max_image_width = Some(limits.image_side);
        bounds.max_image_height = Some(limits.image_side);
        // Eight bytes per texel for 16-bit RGBA, and as much again for the decoder's buffers.
        bounds.max_alloc =
            Some(u64::from(limits.image_side).pow(2).saturating_mul(16).min(limits.image_bytes));
        reader.limits(bounds);
        Ok(reader)
    };
    let undecodable = |error: String| refused(format!("cannot be decoded: {error}; save it again as PNG"));
    let first = reader()?;
    let is_webp = first.format() == Some(ImageFormat::WebP);
    let size = first.into_dimensions().map_err(|error| undecodable(error.to_string()))?;
    let mut most_texels = MAX_TEXELS_PER_BYTE.saturating_mul(bytes.len() as u64);
    if is_webp {
        most_texels = most_texels.max(TEXELS_OF_ANY_IMAGE);
    }
    check_size(size, most_texels, bytes.len(), limits).map_err(refused)?;
    budget.charge(u64::from(size.0) * u64::from(size.1), 4, || place.to_owned())?;
    let reader = reader()?;
    let decoded = guarded(|| reader.decode().map(image::DynamicImage::into_rgba8))
        .ok_or_else(|| undecodable("its decoder failed".to_owned()))?
        .map_err(|error| undecodable(error.to_string()))?;
    let (width, height) = decoded.dimensions();
    Ok(Image { name, width, height, rgba: decoded.into_raw() })
}

/// Checks that an image may have this size: within the limits, and with no more texels than its bytes can
/// represent.
fn check_size(
    (width, height): (u32, u32),
    most_texels: u64,
    length: usize,
    limits: &LoadLimits,
) -> Result<(), String> {
    let side = limits.image_side;
    if u64::from(width) * u64::from(height) > most_texels || width > side || height > side {
        return Err(format!(
            "claims {width} x {height} texels in {length} bytes; at most {side} per side are allowed, and what the bytes can hold"
        ));
    }
    Ok(())
}

fn sampler(source: &json::texture::Sampler) -> Sampler {
    // Values that are not in the glTF specification count as missing.
    let wrap = |value: Checked<WrappingMode>| match value {
        Checked::Valid(WrappingMode::ClampToEdge) => Wrap::ClampToEdge,
        Checked::Valid(WrappingMode::MirroredRepeat) => Wrap::MirroredRepeat,
        Checked::Valid(WrappingMode::Repeat) | Checked::Invalid => Wrap::Repeat,
    };
    let (minify_linear, mipmap) = match source.min_filter {
        Some(Checked::Valid(MinFilter::Nearest)) => (false, Mipmap::None),
        Some(Checked::Valid(MinFilter::Linear)) => (true, Mipmap::None),
        Some(Checked::Valid(MinFilter::NearestMipmapNearest)) => (false, Mipmap::Nearest),
        Some(Checked::Valid(MinFilter::LinearMipmapNearest)) => (true, Mipmap::Nearest),
        Some(Checked::Valid(MinFilter::NearestMipmapLinear)) => (false, Mipmap::Linear),
        Some(Checked::Valid(MinFilter::LinearMipmapLinear) | Checked::Invalid) | None => {
            (true, Mipmap::Linear)
        }
    };
    Sampler {
        wrap_u: wrap(source.wrap_s),
        wrap_v: wrap(source.wrap_t),
        magnify_linear: source.mag_filter != Some(Checked::Valid(MagFilter::Nearest)),
        minify_linear,
        mipmap,
    }
}
