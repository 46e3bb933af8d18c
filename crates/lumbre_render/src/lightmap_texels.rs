//! Lightmaps as textures of the device: the formats, and the bytes of their texels.

use bevy_ecs::world::World;
use bytemuck::Pod;
use glam::Vec3;
use half::f16;
use lumbre_scene::{LightmapEncoding, LightmapImage, PackedFormat, shown_lightmaps};

/// The memory of a World's lightmaps on the device, each image counted once.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct LightmapMemory {
    /// The format: `rgb32f`, `rgb16f` or `rgb9e5`. Empty if there are no lightmaps.
    pub format: &'static str,
    /// Number of textures.
    pub textures: usize,
    /// Number of their texels.
    pub texels: u64,
    /// Their bytes.
    pub bytes: u64,
}

impl LightmapMemory {
    /// Returns the memory of lightmaps of these widths and heights in texels.
    pub fn of(format: LightmapEncoding, sizes: impl IntoIterator<Item = [u32; 2]>) -> Self {
        let mut memory = Self::default();
        for [width, height] in sizes {
            memory.format = format.name();
            memory.textures += 1;
            memory.texels += u64::from(width) * u64::from(height);
        }
        memory.bytes = memory.texels * u64::from(texel_bytes(format));
        memory
    }
}

impl std::fmt::Display for LightmapMemory {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { format, textures, texels, bytes } = self;
        let textures = if *textures == 1 { "1 texture".to_owned() } else { format!("{textures} textures") };
        write!(out, "{textures} of {texels} texels as {format}, {:.3} MB", *bytes as f64 / 1e6)
    }
}

/// Returns the bytes of a texel on the device. Core wgpu has no texture of three floats, so that floats have an
/// alpha channel, too.
pub(crate) fn texel_bytes(format: LightmapEncoding) -> u32 {
    match format {
        LightmapEncoding::Rgb32Float => 16,
        LightmapEncoding::Rgb16Float => 8,
        LightmapEncoding::Rgb9E5 => 4,
    }
}

/// Returns the format of the texture.
pub(crate) fn texture_format(format: LightmapEncoding) -> wgpu::TextureFormat {
    match format {
        LightmapEncoding::Rgb32Float => wgpu::TextureFormat::Rgba32Float,
        LightmapEncoding::Rgb16Float => wgpu::TextureFormat::Rgba16Float,
        LightmapEncoding::Rgb9E5 => wgpu::TextureFormat::Rgb9e5Ufloat,
    }
}

/// Returns the format that a device with these features can filter: half floats in place of 32-bit floats where
/// it has no `FLOAT32_FILTERABLE`.
pub(crate) fn filterable(features: wgpu::Features, asked: LightmapEncoding) -> LightmapEncoding {
    match asked {
        LightmapEncoding::Rgb32Float if !features.contains(wgpu::Features::FLOAT32_FILTERABLE) => {
            LightmapEncoding::Rgb16Float
        }
        asked => asked,
    }
}

/// Returns the lightmaps that a World shows, as a device with these features stores them.
pub(crate) fn lightmaps_of(
    world: &mut World,
    features: wgpu::Features,
    asked: LightmapEncoding,
) -> LightmapMemory {
    let sizes = shown_lightmaps(world).into_iter().map(|image| [image.width, image.height]);
    LightmapMemory::of(filterable(features, asked), sizes)
}

/// Returns the bytes of a lightmap's texels in this format, row by row. Values out of range are clamped by
/// [`LightmapEncoding::clamped`]; those within are off by [`LightmapEncoding::largest_error`] at most.
pub(crate) fn encode(image: &LightmapImage, format: LightmapEncoding) -> Vec<u8> {
    let texels = image.texels.iter().map(|texel| format.clamped(*texel));
    match format {
        LightmapEncoding::Rgb32Float => bytes(texels.map(|texel| texel.extend(1.0).to_array())),
        LightmapEncoding::Rgb16Float => {
            let half = |value: f32| f16::from_f32(value).to_bits();
            bytes(texels.map(|Vec3 { x, y, z }| [half(x), half(y), half(z), half(1.0)]))
        }
        // Clamped colours are finite, so that each has a code.
        LightmapEncoding::Rgb9E5 => {
            bytes(texels.map(|texel| PackedFormat::Rgb9E5.encode(texel).unwrap_or_default()))
        }
    }
}

fn bytes<T: Pod>(texels: impl Iterator<Item = T>) -> Vec<u8> {
    let texels: Vec<T> = texels.collect();
    bytemuck::cast_slice(&texels).to_vec()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image(texels: Vec<Vec3>) -> LightmapImage {
        let (width, encoding) = (texels.len() as u32, LightmapEncoding::default());
        LightmapImage { name: String::new(), width, height: 1, texels, encoding }
    }

    /// Decodes texels by the definitions of the formats.
    fn decoded(bytes: &[u8], format: LightmapEncoding) -> Vec<Vec3> {
        let texels = bytes.chunks_exact(texel_bytes(format) as usize);
        texels
            .map(|texel| match format {
                LightmapEncoding::Rgb32Float => {
                    let [x, y, z, w]: [f32; 4] = bytemuck::pod_read_unaligned(texel);
                    assert_eq!(w, 1.0);
                    Vec3::new(x, y, z)
                }
                LightmapEncoding::Rgb16Float => {
                    let halves: [u16; 4] = bytemuck::pod_read_unaligned(texel);
                    let [x, y, z, w] = halves.map(|bits| f16::from_bits(bits).to_f32());
                    assert_eq!(w, 1.0);
                    Vec3::new(x, y, z)
                }
                // EXT_texture_shared_exponent: a channel is its mantissa times 2^(exponent - 15 - 9).
                LightmapEncoding::Rgb9E5 => {
                    let code: u32 = bytemuck::pod_read_unaligned(texel);
                    let unit = 2f32.powi((code >> 27) as i32 - 24);
                    Vec3::from_array([0, 9, 18].map(|at| (code >> at & 0x1ff) as f32 * unit))
                }
            })
            .collect()
    }

    #[test]
    fn texels_are_off_by_the_formats_bound_at_most() {
        let hard = [0.0, 1e-45, 1e-8, 2f32.powi(-25), 6e-5, 0.3, 1.0, 511.5, 1e3, 65_400.0, 65_408.0];
        let mut texels = Vec::new();
        for red in hard {
            // One channel dominates the others, or all are alike.
            texels.extend([Vec3::splat(red), Vec3::new(red, red * 1e-3, 0.0), Vec3::new(1e-6, red, 0.7)]);
        }
        let original = image(texels);
        for &format in LightmapEncoding::ALL {
            let found = decoded(&encode(&original, format), format);
            let mut worst = 0.0f32;
            for (texel, found) in original.texels.iter().zip(&found) {
                let (apart, bound) = ((*texel - *found).abs(), format.largest_error(*texel));
                assert!(apart.cmple(bound).all(), "{format:?}: {texel} became {found}, bound {bound}");
                worst = worst.max((apart / bound.max(Vec3::splat(f32::MIN_POSITIVE))).max_element());
            }
            // The bound is not too wide: some texel reaches most of it.
            assert!(format == LightmapEncoding::Rgb32Float || worst > 0.9, "{format:?}: {worst}");
        }
    }

    #[test]
    fn no_texel_is_negative_infinite_or_nan() {
        let odd = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -1.0, 65_500.0, 65_520.0, 1e9, f32::MAX];
        let original = image(odd.iter().map(|value| Vec3::new(*value, 0.5, *value)).collect());
        for &format in LightmapEncoding::ALL {
            for (texel, found) in original.texels.iter().zip(decoded(&encode(&original, format), format)) {
                let wanted = format.clamped(*texel);
                let bound = format.largest_error(wanted);
                assert!(found.is_finite(), "{format:?}: {texel} became {found}");
                assert!((found - wanted).abs().cmple(bound).all(), "{format:?}: {texel} became {found}");
            }
        }
    }

    #[test]
    fn a_device_that_cannot_filter_floats_gets_half_floats() {
        let (none, filters) = (wgpu::Features::empty(), wgpu::Features::FLOAT32_FILTERABLE);
        assert_eq!(filterable(none, LightmapEncoding::Rgb32Float), LightmapEncoding::Rgb16Float);
        for &format in LightmapEncoding::ALL {
            assert_eq!(filterable(filters, format), format);
        }
        assert_eq!(filterable(none, LightmapEncoding::Rgb9E5), LightmapEncoding::Rgb9E5);
    }

    #[test]
    fn memory_is_counted_by_texels_and_format() {
        let sizes = [[4, 4], [3, 2]];
        let bytes = |format| LightmapMemory::of(format, sizes).bytes;
        assert_eq!(bytes(LightmapEncoding::Rgb32Float), 352);
        assert_eq!(bytes(LightmapEncoding::Rgb16Float), 176);
        assert_eq!(bytes(LightmapEncoding::Rgb9E5), 88);
        let memory = LightmapMemory::of(LightmapEncoding::Rgb9E5, sizes);
        assert_eq!(memory.to_string(), "2 textures of 22 texels as rgb9e5, 0.000 MB");
        assert_eq!(LightmapMemory::of(LightmapEncoding::Rgb9E5, []), LightmapMemory::default());
    }
}
