//! RGB9E5: three nine-bit mantissas that share a five-bit exponent, 32 bits per colour.
//!
//! A channel is m · 2^(e − 24), m < 512, e < 32 (`EXT_texture_shared_exponent`, N = 9, B = 15, Emax = 31; the
//! same format is `VK_FORMAT_E5B9G9R9_UFLOAT_PACK32`). Red is in bits 0 to 8, green in 9 to 17, blue in 18 to 26,
//! and the exponent in 27 to 31.

use glam::{DVec3, Vec3};

/// The largest number: 511/512 · 2^16.
pub(crate) const LARGEST: f32 = 65_408.0;

const MANTISSA: u32 = 9;
/// The exponent's bias plus the bits of the mantissa.
const SHIFT: i32 = 15 + MANTISSA as i32;

/// Encodes a finite colour as the nearest shared-exponent colour; ties round up. Channels are clamped to [0,
/// 65408].
///
/// Each channel of a colour in that range is rounded to within half a unit: its error is at most max(largest
/// channel / 511.5, 2^-25). This is the rule of `EXT_texture_shared_exponent`, evaluated without rounding in
/// f64.
pub(crate) fn encode(color: Vec3) -> u32 {
    let color = color.clamp(Vec3::ZERO, Vec3::splat(LARGEST)).as_dvec3();
    let largest = color.max_element();
    // floor(log2) read from the bits, so it is exact. Every f32 except 0 is a normal f64; 0 gives a value far
    // below -16.
    let floor_log2 = ((largest.to_bits() >> 52) & 0x7ff) as i32 - 1023;
    let mut exponent = floor_log2.max(-16) + 16;
    let round = |color: DVec3, exponent: i32| (color * power_of_two(SHIFT - exponent) + 0.5).floor();
    if round(color, exponent).max_element() > 511.0 {
        // The largest channel rounds up to the next power of two. This never happens at exponent 31, as the
        // largest input is exactly 511/512 · 2^16.
        exponent += 1;
    }
    let mantissas = round(color, exponent).as_uvec3();
    mantissas.x
        | mantissas.y << MANTISSA
        | mantissas.z << (2 * MANTISSA)
        | (exponent as u32) << (3 * MANTISSA)
}

/// Decodes 32 bits exactly.
pub(crate) fn decode(bits: u32) -> Vec3 {
    let exponent = (bits >> (3 * MANTISSA)) as i32;
    let mantissa = |channel: u32| f64::from(bits >> (channel * MANTISSA) & 0x1ff);
    (DVec3::new(mantissa(0), mantissa(1), mantissa(2)) * power_of_two(exponent - SHIFT)).as_vec3()
}

/// 2^n, exactly, for n in [-1022, 1023].
fn power_of_two(n: i32) -> f64 {
    f64::from_bits(((n + 1023) as u64) << 52)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_code_decodes_and_encodes_to_the_same_color() {
        for exponent in 0..32u32 {
            for red in 0..512u32 {
                // Green and blue run through all mantissas as well, in other orders.
                let code = red | ((red * 5 + 3) % 512) << 9 | ((red * 301 + 77) % 512) << 18 | exponent << 27;
                let color = decode(code);
                assert_eq!(color.x, red as f32 * 2f32.powi(exponent as i32 - 24));
                assert_eq!(decode(encode(color)), color, "{code:#x}");
            }
        }
        assert_eq!(decode(encode(Vec3::splat(LARGEST))), Vec3::splat(LARGEST));
        assert_eq!(encode(Vec3::ZERO), 0);
        // 1.0 is 256 · 2^(16 − 24).
        assert_eq!(encode(Vec3::ONE), 256 | 256 << 9 | 256 << 18 | 16 << 27);
    }

    /// Checks that the code is the nearest one to the colour and has the smallest exponent that can hold it.
    fn nearest(color: Vec3, code: u32) {
        let (decoded, exponent) = (decode(code).as_dvec3(), (code >> 27) as i32);
        let unit = 2f64.powi(exponent - 24);
        let difference = (decoded - color.as_dvec3()).abs();
        assert!(difference.max_element() <= 0.5 * unit, "{color} became {decoded}, unit {unit}");
        // The exponent is the smallest possible: with one less the largest channel would round to above 511.
        if exponent > 0 {
            let mantissa = (color.max_element() as f64 / (0.5 * unit) + 0.5).floor();
            assert!(mantissa > 511.0, "{color} would fit exponent {}", exponent - 1);
        }
    }

    #[test]
    fn the_nearest_color_within_the_closed_bound() {
        let mut state = 0x9e37_79b9_7f4a_7c15u64;
        let mut random = || {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            state
        };
        for _ in 0..400_000 {
            // Any positive float up to the largest value, log-uniform, including subnormals.
            let mut channel = || f32::from_bits((random() >> 32) as u32 % (LARGEST.to_bits() + 1));
            let color = Vec3::new(channel(), channel(), channel());
            let code = encode(color);
            nearest(color, code);
            let largest = f64::from(color.max_element());
            let bound = (largest / 511.5).max(2f64.powi(-25));
            let difference = (decode(code).as_dvec3() - color.as_dvec3()).abs().max_element();
            assert!(difference <= bound, "{color}: {difference} above {bound}");
        }
        // Values whose largest channel rounds up to a power of two and needs the next exponent.
        for power in -14..16 {
            for step in 0..64 {
                let red = f32::from_bits((2f32.powi(power)).to_bits() - step * 1024);
                let color = Vec3::new(red, red * 0.377, red * 1e-3);
                nearest(color, encode(color));
            }
        }
    }

    /// The algorithm as `EXT_texture_shared_exponent` states it (section "Encode"; the Vulkan specification repeats it
    /// for `VK_FORMAT_E5B9G9R9_UFLOAT_PACK32`), with N = 9, B = 15, Emax = 31: NaN and negative channels count as 0.
    fn by_the_specification(color: [f32; 3]) -> u32 {
        let largest = f64::from(LARGEST);
        // "max(0, min(sharedexp_max, c))", where NaN gives 0.
        let [red, green, blue] = color.map(|channel| f64::from(channel).max(0.0).min(largest));
        let max = red.max(green).max(blue);
        let preliminary = (max.log2().floor() as i32).max(-16) + 1 + 15;
        let rounded = (max / 2f64.powi(preliminary - 15 - 9) + 0.5).floor();
        let exponent = if rounded == 512.0 { preliminary + 1 } else { preliminary };
        let code = |channel: f64| (channel / 2f64.powi(exponent - 15 - 9) + 0.5).floor() as u32;
        code(red) | code(green) << 9 | code(blue) << 18 | (exponent as u32) << 27
    }

    #[test]
    fn hard_cases_get_the_codes_of_the_specification() {
        let subnormal = f32::from_bits(1);
        let half_a_unit = 2f32.powi(-25);
        let cases = [
            [0.0; 3],
            [-0.0, 0.0, -0.0],
            [subnormal, f32::MIN_POSITIVE, 0.0],
            [half_a_unit, half_a_unit.next_down(), half_a_unit.next_up()],
            [LARGEST, LARGEST.next_down(), 0.0],
            [LARGEST.next_up(), 1.0, f32::MAX],
            [f32::INFINITY, f32::NEG_INFINITY, 1.0],
            // One channel dominates, and the others vanish or fall on a tie.
            [1e4, 1e-4, 0.0],
            [65_000.0, 64.0, 63.99],
            [1.0, 1.0 / 512.0, 1.0 / 1024.0],
            // The largest channel rounds up to the next power of two.
            [511.5, 511.49997, 1.0],
            [1f32.next_down(), 0.5, 0.25],
            [-1.0, -1e30, 0.7],
        ];
        for color in cases {
            let wanted = by_the_specification(color);
            assert_eq!(
                encode(Vec3::from_array(color)),
                wanted,
                "{color:?}: the specification has {wanted:#010x}"
            );
        }
        // NaN has no code of its own: whoever stores light decides that it is 0, as the specification does.
        let of_format = |color: [f32; 3]| {
            let clamped = crate::LightmapEncoding::Rgb9E5.clamped(Vec3::from_array(color));
            encode(clamped)
        };
        for color in [[f32::NAN, 0.25, 3.0], [f32::NAN; 3], [f32::NAN, f32::INFINITY, -1.0]] {
            assert_eq!(of_format(color), by_the_specification(color), "{color:?}");
        }
    }

    #[test]
    fn what_is_out_of_range_is_clamped() {
        assert_eq!(decode(encode(Vec3::new(-1.0, 1e30, f32::MAX))), Vec3::new(0.0, LARGEST, LARGEST));
        assert_eq!(encode(Vec3::splat(-0.0)), 0);
        assert_eq!(encode(Vec3::splat(f32::MIN_POSITIVE)), 0);
        // Half of the smallest unit rounds up, as the rule requires.
        assert_eq!(decode(encode(Vec3::splat(2f32.powi(-25)))), Vec3::splat(2f32.powi(-24)));
    }
}
