//! Pixels in memory: material textures and lightmaps. Not their GPU copies.

use std::sync::Arc;

use glam::{Vec2, Vec3};

/// A decoded texture image, RGBA, top row first.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Image {
    /// Name or file name, for messages and export.
    pub name: String,
    /// Width in texels, at least 1.
    pub width: u32,
    /// Height in texels, at least 1.
    pub height: u32,
    /// `4 * width * height` bytes. Colours are sRGB-encoded where the slot says so; 16-bit sources are rounded.
    pub rgba: Vec<u8>,
}

/// A lightmap: E/π per texel, linear RGB, top row first (v = 0 is the top row, as glTF has it).
#[derive(Clone, Debug, PartialEq)]
pub struct LightmapImage {
    /// File name of the OpenEXR image beside the glTF file.
    pub name: String,
    /// Width in texels.
    pub width: u32,
    /// Height in texels.
    pub height: u32,
    /// `width * height` values.
    pub texels: Vec<Vec3>,
    /// How it is stored on disk and on the GPU.
    pub encoding: LightmapEncoding,
}

/// Storage of a lightmap.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub enum LightmapEncoding {
    /// f32 per channel.
    Rgb32Float,
    /// f16 per channel.
    #[default]
    Rgb16Float,
    /// Shared exponent, 9 bits each.
    Rgb9E5,
}

/// How a texture repeats outside [0, 1].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub enum Wrap {
    /// Tiles.
    #[default]
    Repeat,
    /// Tiles, every other one mirrored.
    MirroredRepeat,
    /// The border goes on.
    ClampToEdge,
}

/// Texture filtering.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Sampler {
    /// Along u.
    pub wrap_u: Wrap,
    /// Along v.
    pub wrap_v: Wrap,
    /// Bilinear when magnified (else nearest).
    pub magnify_linear: bool,
    /// Bilinear when minified (else nearest).
    pub minify_linear: bool,
    /// Mip levels: none, the nearest one, or blended.
    pub mipmap: Mipmap,
}

/// Use of mip levels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub enum Mipmap {
    /// Only the full image.
    None,
    /// The nearest level.
    Nearest,
    /// Two levels blended.
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

/// A texture as a material uses it: image, sampler, coordinates (KHR_texture_transform).
#[derive(Clone, Debug, PartialEq)]
pub struct TextureReference {
    /// The pixels.
    pub image: Arc<Image>,
    /// Filtering.
    pub sampler: Sampler,
    /// 0 for `uv0`, 1 for `uv1`.
    pub tex_coord: u32,
    /// Added after scale and rotation.
    pub offset: Vec2,
    /// Counter-clockwise rotation in radians about the origin.
    pub rotation: f32,
    /// Factor per axis.
    pub scale: Vec2,
}

impl TextureReference {
    /// The rows of its transform: u' = row · (u, v, 1). `KHR_texture_transform`: scaled, then rotated, then moved; v runs down, so that the rotation's matrix
    /// looks clockwise.
    pub fn transform(&self) -> [Vec3; 2] {
        // Most are not turned, and a bake asks for each of its rays.
        let (sine, cosine) = if self.rotation == 0.0 { (0.0, 1.0) } else { self.rotation.sin_cos() };
        let Self { scale, offset, .. } = self;
        [
            Vec3::new(cosine * scale.x, sine * scale.y, offset.x),
            Vec3::new(-sine * scale.x, cosine * scale.y, offset.y),
        ]
    }

    /// Where it reads for these coordinates of a mesh.
    pub fn transformed(&self, uv: Vec2) -> Vec2 {
        let [u, v] = self.transform();
        Vec2::new(u.dot(uv.extend(1.0)), v.dot(uv.extend(1.0)))
    }
}
