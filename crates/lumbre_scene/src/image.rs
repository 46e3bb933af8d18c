//! Images in CPU memory: material textures, lightmaps and how textures are sampled. GPU copies are made
//! elsewhere.

use std::sync::Arc;

use glam::{Vec2, Vec3};

use crate::LightmapEncoding;

/// A decoded RGBA image with the top row first.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Image {
    /// Name or file name, for messages and export.
    pub name: String,
    /// Width in texels, at least 1.
    pub width: u32,
    /// Height in texels, at least 1.
    pub height: u32,
    /// `4 * width * height` bytes. Colours are sRGB-encoded for the slots that glTF defines so; 16-bit
    /// sources are rounded.
    pub rgba: Vec<u8>,
}

/// A lightmap: E/π per texel, linear RGB, top row first (v = 0 is the top row, as in glTF).
#[derive(Clone, Debug, PartialEq)]
pub struct LightmapImage {
    /// File name given by the baker, or the path relative to the glTF file that the image was loaded from. Used
    /// in messages, and to keep the names of atlases on export.
    pub name: String,
    /// Width in texels.
    pub width: u32,
    /// Height in texels.
    pub height: u32,
    /// `width * height` texels.
    pub texels: Vec<Vec3>,
    /// How it is stored in its file. On the GPU it is stored as `FrameSettings::lightmap_format` says.
    pub encoding: LightmapEncoding,
}

/// How texture coordinates outside [0, 1] are mapped.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub enum Wrap {
    /// The image repeats.
    #[default]
    Repeat,
    /// The image repeats, mirrored every other time.
    MirroredRepeat,
    /// The edge texels are extended.
    ClampToEdge,
}

/// Filtering and wrapping of a texture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Sampler {
    /// Wrap mode along u.
    pub wrap_u: Wrap,
    /// Wrap mode along v.
    pub wrap_v: Wrap,
    /// Bilinear magnification (otherwise nearest).
    pub magnify_linear: bool,
    /// Bilinear minification (otherwise nearest).
    pub minify_linear: bool,
    /// How mip levels are used.
    pub mipmap: Mipmap,
}

/// Use of mip levels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub enum Mipmap {
    /// Only the full-resolution level.
    None,
    /// The nearest mip level.
    Nearest,
    /// Linear interpolation between two mip levels.
    #[default]
    Linear,
}

impl Default for Sampler {
    fn default() -> Self {
        Self {
            wrap_u: Wrap::Repeat,
            wrap_v: Wrap::Repeat,
            magnify_linear: true,
            minify_linear: true,
            mipmap: Mipmap::Linear,
        }
    }
}

/// A texture as a material refers to it: image, sampler, set of coordinates and their transform
/// (KHR_texture_transform).
#[derive(Clone, Debug, PartialEq)]
pub struct TextureReference {
    /// The pixels.
    pub image: Arc<Image>,
    /// Filtering and wrapping.
    pub sampler: Sampler,
    /// The set of coordinates: 0 for `uv0`, 1 for `uv1`.
    pub tex_coord: u32,
    /// Translation, applied after scale and rotation.
    pub offset: Vec2,
    /// Counter-clockwise rotation in radians about the origin.
    pub rotation: f32,
    /// Scale factor per axis, applied first.
    pub scale: Vec2,
}

impl TextureReference {
    /// Refers to an image by the first set of coordinates as they are, with the default sampler.
    pub fn new(image: Arc<Image>) -> Self {
        Self {
            image,
            sampler: Sampler::default(),
            tex_coord: 0,
            offset: Vec2::ZERO,
            rotation: 0.0,
            scale: Vec2::ONE,
        }
    }

    /// The rows of the 2x3 coordinate transform: u' = row · (u, v, 1). As in `KHR_texture_transform`,
    /// coordinates are scaled, then rotated, then translated. v points down, so the rotation matrix looks
    /// clockwise.
    pub fn transform(&self) -> [Vec3; 2] {
        // Skip the trigonometry for the common case: a bake evaluates this for each of its rays.
        let (sine, cosine) = if self.rotation == 0.0 { (0.0, 1.0) } else { self.rotation.sin_cos() };
        let Self { scale, offset, .. } = self;
        [
            Vec3::new(cosine * scale.x, sine * scale.y, offset.x),
            Vec3::new(-sine * scale.x, cosine * scale.y, offset.y),
        ]
    }

    /// The transformed coordinates at which the texture is sampled.
    pub fn transformed(&self, uv: Vec2) -> Vec2 {
        let [u, v] = self.transform();
        Vec2::new(u.dot(uv.extend(1.0)), v.dot(uv.extend(1.0)))
    }
}
