//! Unit vectors from vectors that may be zero. Which normal is used is decided in `two_sided`.

use glam::DVec3;

/// Squared length below which a vector counts as having no direction, so a length of 10⁻¹⁵.
///
/// This is the smallest square that keeps f32 away from its denormals with room for the reciprocal root.
pub const TINY_LENGTH_SQUARED: f64 = 1e-30;

/// Vectors with a larger component are scaled down before squaring: the square of 10¹⁵⁴ overflows f64.
const HUGE_COMPONENT: f64 = 1e100;

/// Returns `v / |v|`, and the zero vector for the zero vector (OpenGL's zero normal stays zero).
///
/// If `v` is shorter than the root of [`TINY_LENGTH_SQUARED`], the result is finite and shorter than 1. The WGSL
/// twin is valid for lengths up to 10¹⁹, where the square overflows f32.
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

/// Returns `v / |v|`, or `None` if `v` has no direction: if it is shorter than about 10⁻¹⁵ or not finite.
pub fn try_normalize(v: DVec3) -> Option<DVec3> {
    let unit = safe_normalize(v);
    // A vector with a direction has length 1 here, up to rounding (a few times 10⁻¹⁶).
    (unit.is_finite() && unit.length_squared() > 0.5).then_some(unit)
}

/// Returns |v| without intermediate overflow: the result is infinite only if the length itself is.
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
