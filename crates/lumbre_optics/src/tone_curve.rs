//! From radiance to display values: the tone curve and sRGB's encoding. Exposure is a factor that is applied
//! before. Twin: shaders/tone_curve.wesl, where a polynomial stands for the power of the encoding.

use std::sync::LazyLock;

use glam::DVec3;

/// Khronos PBR Neutral (Khronos 3D Commerce, 2024): colours below 0.8 keep their values except for a small toe,
/// brighter ones are compressed and desaturated. Takes radiance after exposure and returns values in [0, 1].
pub fn tone_curve(radiance: DVec3) -> DVec3 {
    let (compression_start, desaturation) = (0.8 - 0.04, 0.15);
    let mut color = radiance.max(DVec3::ZERO);
    let darkest = color.min_element();
    color -= if darkest < 0.08 { darkest - 6.25 * darkest * darkest } else { 0.04 };
    let peak = color.max_element();
    if peak < compression_start {
        return color;
    }
    let span = 1.0 - compression_start;
    let compressed = 1.0 - span * span / (peak + span - compression_start);
    let white = 1.0 - 1.0 / (desaturation * (peak - compressed) + 1.0);
    (color * (compressed / peak)).lerp(DVec3::splat(compressed), white)
}

/// Encodes a linear value in [0, 1] as sRGB (IEC 61966-2-1).
pub fn encode_srgb(linear: f64) -> f64 {
    if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}

/// Decodes an sRGB value in [0, 1] to linear (IEC 61966-2-1).
pub fn decode_srgb(encoded: f64) -> f64 {
    if encoded <= 0.040_45 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
}

/// [`decode_srgb`] of a byte of a picture, from a table: the power would take longer than the rest of a texture
/// sample.
pub fn decode_srgb_byte(byte: u8) -> f64 {
    static DECODED: LazyLock<[f64; 256]> =
        LazyLock::new(|| std::array::from_fn(|byte| decode_srgb(byte as f64 / 255.0)));
    DECODED[usize::from(byte)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn encoding_and_decoding_are_inverse() {
        for byte in 0..=255 {
            assert!((encode_srgb(decode_srgb_byte(byte)) * 255.0 - f64::from(byte)).abs() < 1e-9, "{byte}");
        }
        assert_eq!((encode_srgb(0.0), decode_srgb(0.0), decode_srgb_byte(255)), (0.0, 0.0, 1.0));
        assert_eq!([0.5, 0.216].map(|linear| (encode_srgb(linear) * 255.0).round()), [188.0, 128.0]);
    }

    #[test]
    fn the_tone_curve_rises_and_ends_at_white() {
        let grey = |value: f64| tone_curve(DVec3::splat(value)).x;
        // Below its compression the curve is neutral: .3 only loses the toe of .04.
        assert!((grey(0.3) - 0.26).abs() < 1e-12);
        let values = (0..200).map(|step| grey(0.01 * 1.08f64.powi(step))).collect::<Vec<_>>();
        assert!(values.windows(2).all(|pair| pair[0] < pair[1] && pair[1] < 1.0), "{values:?}");
        assert!(tone_curve(DVec3::new(1e30, 0.0, 5.0)).max_element() <= 1.0);
    }
}
