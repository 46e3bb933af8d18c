//! What the formats of lightmaps can hold: their ranges, what becomes of other values, and their errors.

use glam::Vec3;
use half::f16;

use super::PackedFormat;
use crate::LightmapEncoding;

/// The largest value of a channel as f32. It is also the strongest light that a file may have, far enough from the
/// largest f32 that products of the shading equations stay finite.
const LARGEST_FLOAT: f32 = 1e30;

impl LightmapEncoding {
    /// The largest value of a channel on the GPU: 1e30, 65504 or 65408.
    pub fn largest(self) -> f32 {
        match self {
            Self::Rgb32Float => LARGEST_FLOAT,
            Self::Rgb16Float => f16::MAX.to_f32(),
            Self::Rgb9E5 => PackedFormat::Rgb9E5.largest().max_element(),
        }
    }

    /// Returns a colour whose channels are finite and within [0, [`largest`](Self::largest)]: larger values, infinity
    /// included, become the largest one; negative values and NaN become 0.
    pub fn clamped(self, color: Vec3) -> Vec3 {
        // f32::max returns the other operand if one is NaN.
        Vec3::from_array(color.to_array().map(|channel| channel.max(0.0).min(self.largest())))
    }

    /// Upper bound on the error of storing each channel of a colour within [0, [`largest`](Self::largest)], in closed
    /// form: 0 for f32, half a unit of the last of 11 bits for f16, and that of [`PackedFormat::largest_error`] for
    /// RGB9E5.
    pub fn largest_error(self, color: Vec3) -> Vec3 {
        match self {
            Self::Rgb32Float => Vec3::ZERO,
            // f16 has a unit of 2^-24 below 2^-14.
            Self::Rgb16Float => (color / 2048.0).max(Vec3::splat(2f32.powi(-25))),
            Self::Rgb9E5 => PackedFormat::Rgb9E5.largest_error(color),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_clamped_is_finite_and_within_the_format() {
        let odd =
            [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -1.0, -0.0, 0.0, 1e-45, 1.0, 65_450.0, f32::MAX];
        for format in LightmapEncoding::ALL {
            for value in odd {
                let stored = format.clamped(Vec3::new(value, 1.0, value));
                assert!(
                    stored.is_finite() && stored.min_element() >= 0.0,
                    "{format:?}: {value} became {stored}"
                );
                assert!(stored.max_element() <= format.largest());
                // One channel that is out of range changes no other one.
                assert_eq!(stored.y, 1.0);
                let expected = if value.is_nan() { 0.0 } else { value.clamp(0.0, format.largest()) };
                assert_eq!(stored.x, expected, "{format:?}: {value}");
            }
        }
    }
}
