//! Textures as the twin samples them: the first level with the magnification filter, in f64.

use glam::{DVec2, DVec3, DVec4};
use lumbre_scene::{LightmapImage, TextureReference, Wrap};

/// Returns the rows of a texture's transform: u' = row.(u, v, 1).
pub(super) fn transform(texture: &TextureReference) -> [DVec3; 2] {
    let (sin, cos) = f64::from(texture.rotation).sin_cos();
    let (scale, offset) = (texture.scale.as_dvec2(), texture.offset.as_dvec2());
    // KHR_texture_transform: scale, then rotation, then offset; v increases downwards.
    [DVec3::new(cos * scale.x, sin * scale.y, offset.x), DVec3::new(-sin * scale.x, cos * scale.y, offset.y)]
}

/// Returns the channels of a texture, 0 to 1, at coordinates of its set.
pub(super) fn sample(texture: &TextureReference, uv: DVec2) -> DVec4 {
    let [u, v] = transform(texture).map(|row| row.dot(uv.extend(1.0)));
    let image = &texture.image;
    let (width, height) = (i64::from(image.width), i64::from(image.height));
    let wrapped = |at: i64, size: i64, wrap: Wrap| match wrap {
        Wrap::Repeat => at.rem_euclid(size),
        Wrap::ClampToEdge => at.clamp(0, size - 1),
        Wrap::MirroredRepeat => {
            let at = at.rem_euclid(2 * size);
            if at < size { at } else { 2 * size - 1 - at }
        }
    };
    let texel = |x: i64, y: i64| {
        let (x, y) = (wrapped(x, width, texture.sampler.wrap_u), wrapped(y, height, texture.sampler.wrap_v));
        let at = 4 * (y * width + x) as usize;
        DVec4::from_array([0, 1, 2, 3].map(|channel| f64::from(image.rgba[at + channel]) / 255.0))
    };
    let at = DVec2::new(u, v) * DVec2::new(width as f64, height as f64);
    if !texture.sampler.magnify_linear {
        return texel(at.x.floor() as i64, at.y.floor() as i64);
    }
    let (corner, part) = ((at - 0.5).floor(), (at - 0.5) - (at - 0.5).floor());
    let (x, y) = (corner.x as i64, corner.y as i64);
    texel(x, y).lerp(texel(x + 1, y), part.x).lerp(texel(x, y + 1).lerp(texel(x + 1, y + 1), part.x), part.y)
}

/// Samples a lightmap: bilinear, clamped to the edge.
pub(super) fn sample_lightmap(image: &LightmapImage, uv: DVec2) -> DVec3 {
    let (width, height) = (image.width as i64, image.height as i64);
    let at = uv * DVec2::new(width as f64, height as f64) - 0.5;
    let (corner, part) = (at.floor(), at - at.floor());
    let texel = |dx: i64, dy: i64| {
        let x = (corner.x as i64 + dx).clamp(0, width - 1);
        let y = (corner.y as i64 + dy).clamp(0, height - 1);
        image.texels[(y * width + x) as usize].as_dvec3()
    };
    texel(0, 0).lerp(texel(1, 0), part.x).lerp(texel(0, 1).lerp(texel(1, 1), part.x), part.y)
}
