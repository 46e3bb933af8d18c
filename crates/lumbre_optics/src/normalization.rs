//! Unit vectors from vectors that may be zero. Not the choice of which normal to use: that is `two_sided`.

use glam::DVec3;

/// Squared length under which a vector counts as having no direction, so a length of 10⁻¹⁵.
///
/// The smallest square that f32 keeps away from its denormals with room for the reciprocal root.
pub const TINY_LENGTH_SQUARED: f64 = 1e-30;

/// Components above this are scaled down before they are squared: f64 overflows at 10¹⁵⁴ squared.
const HUGE_COMPONENT: f64 = 1e100;

/// `v / |v|`, and the zero vector for the zero vector (OpenGL's zero normal stays zero).
///
/// Shorter than [`TINY_LENGTH_SQUARED`]'s root the result is shorter than 1, and finite. The twin in WGSL
/// holds for lengths up to 10¹⁹, where f32's square overflows.
///
/// # Error of the f32 twin
///
/// 7 u of each component: the square is a sum of positive terms, 3 u, which the root halves; inverseSqrt 4 u;
/// a product; and 2⁻²⁴ for components whose squares are flushed. For lengths up to 10¹⁹, beyond which the
/// square is infinite and the result 0.
pub fn safe_normalize(v: DVec3) -> DVec3 {
    let largest = v.abs().max_element();
    let v = if largest > HUGE_COMPONENT { v / largest } else { v };
    v / v.length_squared().max(TINY_LENGTH_SQUARED).sqrt()
}

/// `v / |v|`, or nothing where `v` has no direction: shorter than 10⁻¹⁵, or not finite.
pub fn try_normalize(v: DVec3) -> Option<DVec3> {
    let unit = safe_normalize(v);
    // A vector that has a direction comes back with length 1 but for rounding (a few times 10⁻¹⁶).
    (unit.is_finite() && unit.length_squared() > 0.5).then_some(unit)
}

/// |v| without overflow on the way: `f64::MAX` in every component gives infinity only if the length itself
/// does.
pub fn safe_length(v: DVec3) -> f64 {
    let largest = v.abs().max_element();
    if largest > HUGE_COMPONENT { (v / largest).length() * largest } else { v.length() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ordinary_vectors_become_unit() {
        assert_eq!(safe_normalize(DVec3::new(3.0, 0.0, -4.0)), DVec3::new(0.6, 0.0, -0.8));
    }

    #[test]
    fn the_zero_vector_stays_zero() {
        assert_eq!(safe_normalize(DVec3::ZERO), DVec3::ZERO);
        assert_eq!(try_normalize(DVec3::ZERO), None);
        assert_eq!(try_normalize(DVec3::NAN), None);
        assert_eq!(try_normalize(DVec3::INFINITY), None);
    }

    #[test]
    fn the_smallest_and_the_largest_are_finite() {
        assert!(safe_normalize(DVec3::splat(f64::MIN_POSITIVE)).is_finite());
        let unit = safe_normalize(DVec3::new(f64::MAX, -f64::MAX, f64::MAX));
        // Two roundings of 2⁻⁵³ and a square root.
        assert!((unit.length() - 1.0).abs() < 1e-15);
        assert!((safe_length(DVec3::new(3e200, 4e200, 0.0)) / 5e200 - 1.0).abs() < 1e-15);
    }
}
