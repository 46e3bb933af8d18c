//! Texture lookup in f64 on the finest mip level, with the magnification filter. Instead of reading coarser
//! levels, pixels take several samples.

use glam::{DVec2, DVec3, DVec4};
use lumbre_optics::decode_srgb_byte;
use lumbre_scene::{LightmapImage, TextureReference, Wrap};

/// Returns the four channels as stored, in [0, 1], at coordinates of the texture's own set.
pub(crate) fn sample_linear(texture: &TextureReference, uv: DVec2) -> DVec4 {
    sample(texture, uv, |byte| f64::from(byte) / 255.0)
}

/// Returns a colour, decoded from sRGB, with linear alpha.
pub(crate) fn sample_color(texture: &TextureReference, uv: DVec2) -> DVec4 {
    sample(texture, uv, decode_srgb_byte)
}

fn sample(texture: &TextureReference, uv: DVec2, decode: impl Fn(u8) -> f64) -> DVec4 {
    let image = &texture.image;
    if image.rgba.len() < 4 {
        return DVec4::ONE;
    }
    let [u, v] = texture.transform().map(|row| row.as_dvec3().dot(uv.extend(1.0)));
    let (width, height) = (i64::from(image.width), i64::from(image.height));
    let texel = |x: i64, y: i64| {
        let column = wrapped(x, width, texture.sampler.wrap_u);
        let row = wrapped(y, height, texture.sampler.wrap_v);
        let at = 4 * (row * width + column) as usize;
        let [red, green, blue, alpha] = [0, 1, 2, 3].map(|channel| image.rgba[at + channel]);
        DVec4::new(decode(red), decode(green), decode(blue), f64::from(alpha) / 255.0)
    };
    // Coordinates that are not finite read the first texel; larger ones than i64 can hold are clamped.
    let at = DVec2::new(u, v) * DVec2::new(width as f64, height as f64);
    let at = if at.is_finite() { at.clamp(DVec2::splat(-1e15), DVec2::splat(1e15)) } else { DVec2::ZERO };
    if !texture.sampler.magnify_linear {
        return texel(at.x.floor() as i64, at.y.floor() as i64);
    }
    let corner = (at - 0.5).floor();
    let part = at - 0.5 - corner;
    let (x, y) = (corner.x as i64, corner.y as i64);
    let above = texel(x, y).lerp(texel(x + 1, y), part.x);
    let below = texel(x, y + 1).lerp(texel(x + 1, y + 1), part.x);
    above.lerp(below, part.y)
}

fn wrapped(at: i64, size: i64, wrap: Wrap) -> i64 {
    match wrap {
        Wrap::Repeat => at.rem_euclid(size),
        Wrap::ClampToEdge => at.clamp(0, size - 1),
        Wrap::MirroredRepeat => {
            let at = at.rem_euclid(2 * size);
            if at < size { at } else { 2 * size - 1 - at }
        }
    }
}

/// Reads a lightmap, which holds E/π, bilinearly and clamped to its edges.
pub(crate) fn sample_lightmap(image: &LightmapImage, uv: DVec2) -> DVec3 {
    let (width, height) = (i64::from(image.width), i64::from(image.height));
    if image.texels.is_empty() || !uv.is_finite() {
        return DVec3::ZERO;
    }
    let at = uv.clamp(DVec2::splat(-8.0), DVec2::splat(8.0)) * DVec2::new(width as f64, height as f64) - 0.5;
    let (corner, part) = (at.floor(), at - at.floor());
    let texel = |right: i64, down: i64| {
        let x = (corner.x as i64 + right).clamp(0, width - 1);
        let y = (corner.y as i64 + down).clamp(0, height - 1);
        image.texels[(y * width + x) as usize].as_dvec3()
    };
    let above = texel(0, 0).lerp(texel(1, 0), part.x);
    let below = texel(0, 1).lerp(texel(1, 1), part.x);
    above.lerp(below, part.y)
}
