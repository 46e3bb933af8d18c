//! Powers of cosines that are correct for 0⁰ and for exponents up to a million. The highlights that use them are in
//! `phong` and `blinn_phong`.

use glam::DVec3;

/// Cosine above which [`power_of_cosine`] computes from the sine.
const NEARLY_PARALLEL: f64 = 0.9_f32 as f64;
/// Smaller bases and smaller exponents count as 0: well above f32's denormals, which a device may flush to 0.
const SMALLEST_BASE: f64 = 1e-30_f32 as f64;
const SMALLEST_EXPONENT: f64 = 1e-30_f32 as f64;
/// Larger exponents are clamped to this. It is above 4 n for the largest n that a material may have.
const LARGEST_EXPONENT: f64 = 1e7;

/// Returns baseⁿ with the base clamped to [0, 1] and 0⁰ = 1.
///
/// WGSL's pow is exp2(n log2(base)), which is undefined for a base of 0 or less, so both ends are handled
/// explicitly.
///
/// # Error of the f32 twin
///
/// At most e^r - 1 of the power, with r = ln 2 (n λ + u y) + 2 u (3 + 2 y) for y = n |log2 base|. WGSL's pow is
/// exp2(n log2 base): its logarithm is off by λ = 2⁻²¹ (8 u) for bases from 1/2 and by 6 u of itself below, the
/// product is rounded, and exp2 is good to 3 + 2 y units in the last place. That gives 2.1·10⁻⁵ at n = 64, 8.5·10⁻⁵
/// at 256, 3.4·10⁻⁴ at 1024, and a third of the power at 10⁶: such exponents need `SHARP_HIGHLIGHTS`. If the base
/// itself is off by e, the power lies between (base - e)ⁿ and (base + e)ⁿ; with base and n both near 0 that is
/// anything, as 0ⁿ is 0 and 0⁰ is 1.
pub fn safe_pow(base: f64, exponent: f64) -> f64 {
    if exponent < SMALLEST_EXPONENT {
        1.0
    } else if base < SMALLEST_BASE {
        0.0
    } else {
        base.min(1.0).powf(exponent.min(LARGEST_EXPONENT))
    }
}

/// Returns cosⁿ of an angle whose cosine and squared sine are both known.
///
/// Near the peak 1 - cos loses its digits, so cosⁿ = exp(n/2 ln(1 - sin²)) is computed from the sine. In f32 the
/// absolute error of that stays under 10⁻⁶ at any n for exact sines, where cosⁿ computed directly is wrong by a
/// third at n = 10⁶. It also ignores how far rounding takes the length of unit vectors from 1.
///
/// # Error of the f32 twin
///
/// Above a cosine of .9: e^r - 1 of the power, with r = y (11 u + z⁶/7) + 2 u (3 + 2 y) for y = n/2 |ln(1 - sin²)|
/// and z = sin²/(2 - sin²). The logarithm is an odd series in z, cut off at z⁶/7 (2·10⁻⁷ at sin² = .19); its
/// division and five roundings come to 9 u, as those of the small terms do not count. Two products and the exp
/// follow. As y e⁻ʸ is at most 1/e, the whole stays under 10⁻⁶ for any n. Below .9 it is that of [`safe_pow`]. An
/// error δ of sin² itself adds n δ/2.
pub fn power_of_cosine(cosine: f64, sine_squared: f64, exponent: f64) -> f64 {
    if cosine > NEARLY_PARALLEL {
        let logarithm = (-sine_squared.clamp(0.0, 0.25)).ln_1p();
        (0.5 * exponent.clamp(0.0, LARGEST_EXPONENT) * logarithm).exp()
    } else {
        safe_pow(cosine, exponent)
    }
}

/// Returns max(axis · direction, 0)ⁿ, the cosine lobe around a unit axis.
///
/// The WGSL twin uses [`power_of_cosine`] with the feature `SHARP_HIGHLIGHTS`, and without it [`safe_pow`] of the
/// cosine; in f32 the two differ by 4·10⁻⁵ at n = 128 and by 0.3 % at n = 8192.
///
/// # Error of the f32 twin
///
/// With `SHARP_HIGHLIGHTS` that of [`power_of_cosine`]: each component of the cross product is off by 2 u of the
/// magnitudes of its two products, so sin by about 2.5 u and sin² by δ = 5 u sin. For n = 10⁶, where the lobe ends
/// at sin = .004, n δ/2 is 6·10⁻⁴ of the lobe. Without the feature it is that of [`safe_pow`] with a base off by 3
/// u Σ|a b|, plus n times the relative amount by which rounding changes the length of the unit vectors, which this
/// function ignores near the peak.
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
                // The cosine's rounding, 2⁻⁵³, is amplified by the exponent.
                assert!(
                    (got - expected).abs() <= 4e-16 * (1.0 + exponent),
                    "{degrees} degrees, n = {exponent}"
                );
            }
        }
    }

    #[test]
    fn a_million_keeps_its_digits() {
        // cos(θ)^n = exp(n ln cos θ), and ln cos θ = -θ²/2 - θ⁴/12 - θ⁶/45 - …; the next term is under 10⁻²³ here.
        let (angle, exponent) = (1e-3f64, 1e6);
        let expected =
            (-exponent * (angle.powi(2) / 2.0 + angle.powi(4) / 12.0 + angle.powi(6) / 45.0)).exp();
        let axis = DVec3::Z;
        let got = cosine_lobe(axis, DVec3::new(angle.sin(), 0.0, angle.cos()), exponent);
        // The relative rounding of sin², a few 2⁻⁵³, times an exponent of 1/2.
        assert!((got / expected - 1.0).abs() < 1e-15, "{got} {expected}");
    }

    #[test]
    fn a_zero_vector_has_no_lobe() {
        assert_eq!(cosine_lobe(DVec3::ZERO, DVec3::Z, 5.0), 0.0);
        assert_eq!(cosine_lobe(DVec3::ZERO, DVec3::Z, 0.0), 1.0);
    }
}
