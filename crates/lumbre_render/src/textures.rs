//! GPU copies of images: material textures with mip levels, and lightmaps. Which material uses which is
//! decided in `extract`.

use std::collections::HashMap;
use std::sync::Arc;

use lumbre_optics::{decode_srgb_byte, encode_srgb};
use lumbre_scene::{Image, LightmapEncoding, LightmapImage, Mipmap, Sampler, Wrap};

use crate::lightmap_texels::{LightmapMemory, encode, filterable, texel_bytes, texture_format};
use crate::mip_level::{MipLevel, box_filter_2d};
use crate::normal_map::normal_levels;
use crate::{Gpu, RenderError};

/// How the bytes of an image are interpreted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Texels {
    /// sRGB-encoded colours.
    Colors,
    /// Linear values.
    Numbers,
    /// Vectors of a normal map.
    Normals,
}

/// Textures and samplers in use, by the address of the shared image.
#[derive(Debug, Default)]
pub(crate) struct Textures {
    images: HashMap<(usize, Texels), (Arc<Image>, wgpu::TextureView)>,
    lightmaps: HashMap<(usize, LightmapEncoding), (Arc<LightmapImage>, wgpu::TextureView)>,
    samplers: HashMap<Sampler, wgpu::Sampler>,
    /// Bytes of textures and of lightmaps that were uploaded since `take_uploaded` was last called.
    uploaded: u64,
    uploaded_lightmaps: u64,
}

impl Textures {
    /// Returns the view of an image.
    pub fn image(
        &mut self,
        gpu: &Gpu,
        image: &Arc<Image>,
        texels: Texels,
    ) -> Result<wgpu::TextureView, RenderError> {
        check(&image.name, image.width, image.height, image.rgba.len(), 4)?;
        let key = (Arc::as_ptr(image) as usize, texels);
        let entry = self.images.entry(key);
        let new = || {
            let (view, bytes) = upload(gpu, image, texels);
            self.uploaded += bytes;
            (Arc::clone(image), view)
        };
        Ok(entry.or_insert_with(new).1.clone())
    }

    /// Returns the view of a lightmap, which stores E/π in this format, or in half floats if the device cannot
    /// filter that.
    pub fn lightmap(
        &mut self,
        gpu: &Gpu,
        image: &Arc<LightmapImage>,
        format: LightmapEncoding,
    ) -> Result<wgpu::TextureView, RenderError> {
        check(&image.name, image.width, image.height, image.texels.len(), 1)?;
        let limit = gpu.device.limits().max_texture_dimension_2d;
        if image.width > limit || image.height > limit {
            return Err(RenderError::TargetTooLarge { width: image.width, height: image.height, limit });
        }
        let format = filterable(gpu.device.features(), format);
        let entry = self.lightmaps.entry((Arc::as_ptr(image) as usize, format));
        let new = || {
            let (view, bytes) = upload_lightmap(gpu, image, format);
            self.uploaded_lightmaps += bytes;
            (Arc::clone(image), view)
        };
        Ok(entry.or_insert_with(new).1.clone())
    }

    /// Returns a sampler.
    pub fn sampler(&mut self, gpu: &Gpu, sampler: &Sampler) -> wgpu::Sampler {
        self.samplers.entry(*sampler).or_insert_with(|| make_sampler(gpu, sampler)).clone()
    }

    /// Returns the bytes of textures and of lightmaps that were uploaded since the last call.
    pub fn take_uploaded(&mut self) -> [u64; 2] {
        [std::mem::take(&mut self.uploaded), std::mem::take(&mut self.uploaded_lightmaps)]
    }

    /// Drops images that nothing else uses, and lightmaps in another format than this.
    pub fn sweep(&mut self, gpu: &Gpu, format: LightmapEncoding) {
        let format = filterable(gpu.device.features(), format);
        self.images.retain(|_, (image, _)| Arc::strong_count(image) > 1);
        self.lightmaps.retain(|(_, own), (image, _)| *own == format && Arc::strong_count(image) > 1);
    }

    /// Returns the memory of the lightmaps. All of them have the same format, except within a frame that
    /// changes it.
    pub fn lightmap_memory(&self) -> LightmapMemory {
        let format = self.lightmaps.keys().next().map_or_else(Default::default, |(_, format)| *format);
        LightmapMemory::of(format, self.lightmaps.values().map(|(image, _)| [image.width, image.height]))
    }
}

/// Checks that the data of an image that was created in code matches its size.
fn check(name: &str, width: u32, height: u32, found: usize, per_texel: u64) -> Result<(), RenderError> {
    let expected = u64::from(width) * u64::from(height) * per_texel;
    if expected == 0 || found as u64 != expected {
        return Err(RenderError::BadImage { name: name.to_owned(), width, height, found, expected });
    }
    Ok(())
}

fn make_sampler(gpu: &Gpu, sampler: &Sampler) -> wgpu::Sampler {
    let wrap = |wrap: Wrap| match wrap {
        Wrap::Repeat => wgpu::AddressMode::Repeat,
        Wrap::MirroredRepeat => wgpu::AddressMode::MirrorRepeat,
        Wrap::ClampToEdge => wgpu::AddressMode::ClampToEdge,
    };
    let filter = |linear| if linear { wgpu::FilterMode::Linear } else { wgpu::FilterMode::Nearest };
    gpu.device.create_sampler(&wgpu::SamplerDescriptor {
        label: Some("material"),
        address_mode_u: wrap(sampler.wrap_u),
        address_mode_v: wrap(sampler.wrap_v),
        mag_filter: filter(sampler.magnify_linear),
        min_filter: filter(sampler.minify_linear),
        mipmap_filter: match sampler.mipmap {
            Mipmap::Linear => wgpu::MipmapFilterMode::Linear,
            Mipmap::None | Mipmap::Nearest => wgpu::MipmapFilterMode::Nearest,
        },
        // Without mip levels, a clamp at level 0 would always select the magnification filter. The clamp is a
        // little higher, where the nearest level is still the first one. The Vulkan specification describes
        // this way to emulate OpenGL's filters without mip levels.
        lod_max_clamp: if sampler.mipmap == Mipmap::None { 0.25 } else { 32.0 },
        ..Default::default()
    })
}

/// Returns the view of an image's copy, and the bytes of its levels.
fn upload(gpu: &Gpu, image: &Image, texels: Texels) -> (wgpu::TextureView, u64) {
    let mut levels = match texels {
        Texels::Colors => color_levels(image, true),
        Texels::Numbers => color_levels(image, false),
        Texels::Normals => normal_levels(image),
    };
    let limit = gpu.device.limits().max_texture_dimension_2d;
    // If the image exceeds the device's limit, the largest mip level that fits becomes the first.
    levels.retain(|level| level.width <= limit && level.height <= limit);
    let format = match texels {
        Texels::Colors => wgpu::TextureFormat::Rgba8UnormSrgb,
        Texels::Numbers | Texels::Normals => wgpu::TextureFormat::Rgba8Unorm,
    };
    let (width, height) = levels.first().map_or((1, 1), |level| (level.width, level.height));
    let texture = texture_2d(gpu, width, height, levels.len().max(1) as u32, format);
    for (mip, level) in (0..).zip(&levels) {
        write(gpu, &texture, mip, level.width, level.height, 4, &level.rgba);
    }
    let bytes: usize = levels.iter().map(|level| level.rgba.len()).sum();
    (texture.create_view(&Default::default()), bytes as u64)
}

/// Returns the view of a lightmap's copy, and its bytes.
fn upload_lightmap(gpu: &Gpu, image: &LightmapImage, format: LightmapEncoding) -> (wgpu::TextureView, u64) {
    let texels = encode(image, format);
    let texture = texture_2d(gpu, image.width, image.height, 1, texture_format(format));
    write(gpu, &texture, 0, image.width, image.height, texel_bytes(format), &texels);
    (texture.create_view(&Default::default()), texels.len() as u64)
}

fn texture_2d(
    gpu: &Gpu,
    width: u32,
    height: u32,
    mip_level_count: u32,
    format: wgpu::TextureFormat,
) -> wgpu::Texture {
    gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: Some("image"),
        size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
        mip_level_count,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    })
}

fn write(
    gpu: &Gpu,
    texture: &wgpu::Texture,
    mip_level: u32,
    width: u32,
    height: u32,
    texel: u32,
    bytes: &[u8],
) {
    gpu.queue.write_texture(
        wgpu::TexelCopyTextureInfo { mip_level, ..texture.as_image_copy() },
        bytes,
        wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(width * texel), rows_per_image: None },
        wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
    );
}

/// Returns the mip levels of an image of colours or of values. The first one is the image itself.
fn color_levels(image: &Image, srgb: bool) -> Vec<MipLevel> {
    let first = MipLevel { width: image.width, height: image.height, rgba: image.rgba.clone() };
    let count = 32 - image.width.max(image.height).leading_zeros();
    let next = |level: &MipLevel| Some(halved(level, srgb));
    std::iter::successors(Some(first), next).take(count as usize).collect()
}

/// Computes the next mip level with a box filter in linear light, so that a minified wall keeps its
/// brightness.
fn halved(level: &MipLevel, srgb: bool) -> MipLevel {
    let MipLevel { width, height, rgba: texels } = level;
    let (half_width, half_height) = ((width / 2).max(1), (height / 2).max(1));
    let decode = |byte: u8, channel: usize| {
        if srgb && channel < 3 { decode_srgb_byte(byte) as f32 } else { f32::from(byte) / 255.0 }
    };
    let encode = |value: f32, channel: usize| {
        let value = if srgb && channel < 3 { encode_srgb(f64::from(value)) as f32 } else { value };
        (value * 255.0).round() as u8
    };
    let mut result = Vec::with_capacity(4 * half_width as usize * half_height as usize);
    for y in 0..half_height {
        for x in 0..half_width {
            for channel in 0..4 {
                let mut mean = 0.0;
                for ([column, row], part) in box_filter_2d([*width, *height], [x, y]) {
                    let texel = 4 * (row as usize * *width as usize + column as usize);
                    mean += part * decode(texels[texel + channel], channel);
                }
                result.push(encode(mean, channel));
            }
        }
    }
    MipLevel { width: half_width, height: half_height, rgba: result }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn minifying_averages_light_and_not_codes() {
        let rgba = vec![0, 0, 0, 255, 255, 255, 255, 255];
        let checker = MipLevel { width: 2, height: 1, rgba };
        let MipLevel { width, height, rgba: texels } = halved(&checker, true);
        assert_eq!((width, height), (1, 1));
        // Half the light is sRGB code 188 (0.7354); half the code would be 128.
        assert_eq!(texels, [188, 188, 188, 255]);
        assert_eq!(halved(&checker, false).rgba, [128, 128, 128, 255]);
    }
}
