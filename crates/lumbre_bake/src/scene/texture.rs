//! Reads a material's texture at a point with bilinear filtering and glTF's wrap modes and transform. There are no mip
//! levels: patches and emitters average over several points instead.

use glam::{Vec2, Vec4};
use lumbre_optics::decode_srgb_byte;
use lumbre_scene::{TextureReference, Wrap};

/// RGBA at texture coordinates; the colour channels are decoded from sRGB if `srgb` is set.
pub(crate) fn sample(texture: &TextureReference, uv: Vec2, srgb: bool) -> Vec4 {
    let uv = texture.transformed(uv);
    if !uv.is_finite() {
        return Vec4::ONE;
    }
    let image = &texture.image;
    let size = Vec2::new(image.width as f32, image.height as f32);
    let at = uv * size - 0.5;
    let low = at.floor();
    let fraction = at - low;
    let [left, right] = [0.0, 1.0].map(|dx| wrap(low.x + dx, image.width, texture.sampler.wrap_u));
    let [upper, lower] = [0.0, 1.0].map(|dy| wrap(low.y + dy, image.height, texture.sampler.wrap_v));
    let read = |x: usize, y: usize| {
        let first = 4 * (y * image.width as usize + x);
        let Some(&[r, g, b, a]) = image.rgba.get(first..first + 4) else { return Vec4::ONE };
        let channel =
            |value: u8| if srgb { decode_srgb_byte(value) as f32 } else { f32::from(value) / 255.0 };
        Vec4::new(channel(r), channel(g), channel(b), f32::from(a) / 255.0)
    };
    let top = read(left, upper).lerp(read(right, upper), fraction.x);
    let bottom = read(left, lower).lerp(read(right, lower), fraction.x);
    top.lerp(bottom, fraction.y)
}

/// The column or row inside the image that `index` wraps to.
fn wrap(index: f32, size: u32, wrap: Wrap) -> usize {
    let size_f = size.max(1) as f32;
    let last = size.max(1) as usize - 1;
    // The remainder without the slow exact `%`. For large indices, rounding may be off by a texel, so the result is
    // clamped below.
    let remainder = |period: f32| index - period * (index / period).floor();
    let wrapped = match wrap {
        Wrap::Repeat => remainder(size_f),
        Wrap::MirroredRepeat => {
            let period = remainder(2.0 * size_f);
            if period < size_f { period } else { 2.0 * size_f - 1.0 - period }
        }
        Wrap::ClampToEdge => index.max(0.0),
    };
    (wrapped as usize).min(last)
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use lumbre_scene::Image;

    use super::*;

    fn two_texels() -> TextureReference {
        let rgba = vec![0, 0, 0, 255, 255, 255, 255, 255];
        TextureReference::new(Arc::new(Image { name: "two".into(), width: 2, height: 1, rgba }))
    }

    #[test]
    fn texel_centres_are_exact_and_halfway_is_the_mean() {
        let texture = two_texels();
        assert_eq!(sample(&texture, Vec2::new(0.25, 0.5), true).x, 0.0);
        assert_eq!(sample(&texture, Vec2::new(0.75, 0.5), true).x, 1.0);
        assert_eq!(sample(&texture, Vec2::new(0.5, 0.5), true).x, 0.5);
        // Repeats: u = 1.25 is u = 0.25.
        assert_eq!(sample(&texture, Vec2::new(1.25, -3.0), true).x, 0.0);
    }

    #[test]
    fn wrapping_never_leaves_the_image() {
        for mode in [Wrap::Repeat, Wrap::MirroredRepeat, Wrap::ClampToEdge] {
            for index in [-1e9, -3.0, -1.0, 0.0, 1.0, 2.0, 7.0, 1e9] {
                assert!(wrap(index, 2, mode) < 2);
            }
        }
        assert_eq!([-2.0, -1.0, 0.0, 1.0, 2.0].map(|i| wrap(i, 2, Wrap::MirroredRepeat)), [1, 0, 0, 1, 1]);
    }
}
