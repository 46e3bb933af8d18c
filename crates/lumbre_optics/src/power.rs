//! Powers of cosines that hold at 0⁰ and at exponents of a million. Not a highlight: those are `phong` and
//! `blinn_phong`.

use glam::DVec3;

/// Cosine above which [`power_of_cosine`] works from the sine.
const NEARLY_PARALLEL: f64 = 0.9_f32 as f64;
/// Smaller bases count as 0, smaller exponents too: well above f32's denormals, which a device may take for 0.
const SMALLEST_BASE: f64 = 1e-30_f32 as f64;
const SMALLEST_EXPONENT: f64 = 1e-30_f32 as f64;
/// Larger exponents count as this: above 4 n for the largest n that a material may have.
const LARGEST_EXPONENT: f64 = 1e7;

/// baseⁿ for a base in [0, 1], with 0⁰ = 1 and every base clamped to that range.
///
/// WGSL's pow is exp2(n log2(base)), undefined for a base of 0 or less: both ends are chosen explicitly.
///
/// # Error of the f32 twin
///
/// At most e^r - 1 of the power, r = ln 2 (n λ + u y) + 2 u (3 + 2 y), for y = n |log2 base|: pow is exp2(n
/// log2 base), whose logarithm WGSL gives λ = 2⁻²¹ (8 u) for bases from 1/2 and 6 u of itself below, whose
/// product rounds, and whose exp2 is good to 3 + 2 y units in the last place. So 2.1·10⁻⁵ at n = 64, 8.5·10⁻⁵
/// at 256, 3.4·10⁻⁴ at 1024, a third of it at 10⁶: `SHARP_HIGHLIGHTS` is for those. A base that is off itself by e
/// moves the power from (base - e)ⁿ to (base + e)ⁿ; near 0 with n near 0 that is everything, as 0ⁿ is 0 and
/// 0⁰ is 1.
pub fn safe_pow(base: f64, exponent: f64) -> f64 {
    if exponent < SMALLEST_EXPONENT {
        1.0
    } else if base < SMALLEST_BASE {
        0.0
    } else {
        base.min(1.0).powf(exponent.min(LARGEST_EXPONENT))
    }
}

/// cosⁿ of an angle whose cosine and squared sine are both known.
///
/// Near the peak 1 - cos loses its digits, so cosⁿ = exp(n/2 ln(1 - sin²)) is taken from the sine: in f32 its
/// absolute error stays under 10⁻⁶ at any n for exact sines, where cosⁿ itself is wrong by a third at n =
/// 10⁶. It also ignores the length that rounding gives to unit vectors.
///
/// # Error of the f32 twin
///
/// Above a cosine of .9: e^r - 1 of the power, r = y (11 u + z⁶/7) + 2 u (3 + 2 y), for y = n/2 |ln(1 -
/// sin²)| and z = sin²/(2 - sin²). The logarithm is an odd series in z, a division and five roundings of
/// which those of the small terms do not count, 9 u, cut off at z⁶/7 (2·10⁻⁷ at sin² = .19); two products;
/// exp. As y e⁻ʸ is at most 1/e the whole stays under 10⁻⁶ for any n. Below .9 that of [`safe_pow`]. An error
/// δ of sin² itself counts n δ/2.
pub fn power_of_cosine(cosine: f64, sine_squared: f64, exponent: f64) -> f64 {
    if cosine > NEARLY_PARALLEL {
        let logarithm = (-sine_squared.clamp(0.0, 0.25)).ln_1p();
        (0.5 * exponent.clamp(0.0, LARGEST_EXPONENT) * logarithm).exp()
    } else {
        safe_pow(cosine, exponent)
    }
}

/// max(axis · direction, 0)ⁿ: the cosine lobe around a unit axis.
///
/// The WGSL twin takes [`power_of_cosine`] with the feature `SHARP_HIGHLIGHTS` and [`safe_pow`] of the cosine
/// without it; the two part by 4·10⁻⁵ at n = 128 and by 0.3 % at n = 8192 in f32.
///
/// # Error of the f32 twin
///
/// With `SHARP_HIGHLIGHTS` that of [`power_of_cosine`], where each component of the cross product is off by 2
/// u of the sizes of its two products, so sin by about 2.5 u and sin² by δ = 5 u sin: for n = 10⁶, where the
/// lobe ends at sin = .004, n δ/2 is 6·10⁻⁴ of the lobe. Without it that of [`safe_pow`], its base off by 3 u
/// Σ|a b|; and it keeps the lengths that rounding gives to unit vectors, which this function ignores near the
/// peak: n times the relative length more.
pub fn cosine_lobe(axis: DVec3, direction: DVec3, exponent: f64) -> f64 {
    power_of_cosine(axis.dot(direction), axis.cross(direction).length_squared(), exponent)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_corners_of_pow() {
        assert_eq!(safe_pow(0.0, 0.0), 1.0);
        assert_eq!(safe_pow(-1.0, 0.0), 1.0);
        assert_eq!(safe_pow(0.0, 1e-3), 0.0);
        assert_eq!(safe_pow(-0.5, 3.0), 0.0);
        assert_eq!(safe_pow(1.0 + 1e-9, 1e6), 1.0);
        assert_eq!(safe_pow(0.5, 3.0), 0.125);
    }

    #[test]
    fn both_forms_agree_where_both_are_exact() {
        for degrees in [0.0, 0.1, 1.0, 10.0, 25.0, 26.0, 60.0, 89.0, 90.0, 120.0] {
            let angle = f64::to_radians(degrees);
            for exponent in [0.0, 0.5, 1.0, 3.0, 128.0, 1e4] {
                let expected = safe_pow(angle.cos(), exponent);
                let got = power_of_cosine(angle.cos(), angle.sin().powi(2), exponent);
                // The cosine's rounding, 2⁻⁵³, is multiplied by the exponent.
                assert!(
                    (got - expected).abs() <= 4e-16 * (1.0 + exponent),
                    "{degrees} degrees, n = {exponent}"
                );
            }
        }
    }

    #[test]
    fn a_million_keeps_its_digits() {
        // cos(θ)^n = exp(n ln cos θ), and ln cos θ = -θ²/2 - θ⁴/12 - θ⁶/45 - …: next term under 10⁻²³ here.
        let (angle, exponent) = (1e-3f64, 1e6);
        let expected =
            (-exponent * (angle.powi(2) / 2.0 + angle.powi(4) / 12.0 + angle.powi(6) / 45.0)).exp();
        let axis = DVec3::Z;
        let got = cosine_lobe(axis, DVec3::new(angle.sin(), 0.0, angle.cos()), exponent);
        // sin²'s relative rounding, a few 2⁻⁵³, times an exponent of 1/2.
        assert!((got / expected - 1.0).abs() < 1e-15, "{got} {expected}");
    }

    #[test]
    fn a_zero_vector_has_no_lobe() {
        assert_eq!(cosine_lobe(DVec3::ZERO, DVec3::Z, 5.0), 0.0);
        assert_eq!(cosine_lobe(DVec3::ZERO, DVec3::Z, 0.0), 1.0);
    }
}
