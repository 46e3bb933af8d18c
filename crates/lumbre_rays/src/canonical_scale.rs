//! The power of two that scales a scene's largest coordinate to [1, 2).
//!
//! Multiplying by a power of two is exact, so a scene scaled by 2^k is traced with exactly the same numbers: no
//! threshold, overflow or underflow depends on the unit of length.

use glam::Vec3;

/// Exact factors to and from the canonical scale.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct CanonicalScale {
    /// World to canonical, a power of two.
    pub to_canonical: f32,
    /// Canonical to world, its reciprocal.
    pub to_world: f32,
}

impl CanonicalScale {
    /// Creates the scale for a scene whose largest absolute coordinate is `largest`, which must be finite.
    pub fn for_largest(largest: f32) -> Self {
        // Both 2^e and 2^-e are normal numbers for |e| <= 126.
        let exponent = (((largest.to_bits() >> 23) & 0xff) as i32 - 127).clamp(-126, 126);
        Self { to_canonical: power_of_two(-exponent), to_world: power_of_two(exponent) }
    }

    /// A world position in canonical units.
    pub fn canonical(&self, position: Vec3) -> Vec3 {
        position * self.to_canonical
    }
}

fn power_of_two(exponent: i32) -> f32 {
    f32::from_bits(((exponent + 127) as u32) << 23)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_largest_coordinate_lands_in_one_to_two() {
        for largest in [1.0, 1.999, 2.0, 3.7e5, 1e-30, 1.2e-38, 3.0e38] {
            let scale = CanonicalScale::for_largest(largest);
            let canonical = largest * scale.to_canonical;
            assert!((1.0..4.0).contains(&canonical), "{largest} became {canonical}");
            assert_eq!(canonical * scale.to_world, largest);
        }
    }
}
