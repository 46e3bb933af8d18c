//! The three microfacet distributions of Blinn, "Models of light reflection for computer synthesized pictures"
//! (1977), scaled to 1 where the half vector is the normal. The complete model is in `torrance_sparrow`.
//!
//! All take the angle between n and h, as its cosine and squared sine, and an exponent n. All fall to a half at the
//! angle β = acos(2^(-1/n)) at which cosⁿ does, so one shininess gives highlights of the same width in all three.

use std::f64::consts::{LN_2, SQRT_2};

use crate::angle::quarter_angle;
use crate::power::power_of_cosine;

/// Smallest exponent that is divided by; far above it, β has already reached 90 degrees.
const SMALLEST_EXPONENT: f64 = 1e-6;
/// Largest exponent that is told from larger ones. Beyond it, sin² β would be a subnormal f32, which devices may flush
/// to 0.
const LARGEST_EXPONENT: f64 = 1e30;

/// Returns sin² β = 1 - 4^(-1/n), the squared sine of the angle at which cosⁿ is a half.
///
/// Computed without the difference from 1 where β is small, so that n = 10⁶ keeps its digits.
///
/// # Error of the f32 twin
///
/// With x = 2 ln 2/n, off by 7 u, the error is 7 u x e⁻ˣ, plus, up to x = 1/4, that of a series good to 10⁻⁸ and 7
/// u of itself, and beyond it exp's 2 u (3 + 2 x) e⁻ˣ and u. At most 32 u relative, just beyond 1/4.
pub fn half_value_sine_squared(shininess: f64) -> f64 {
    -(-2.0 * LN_2 / shininess.clamp(SMALLEST_EXPONENT, LARGEST_EXPONENT)).exp_m1()
}

/// Returns β in radians, from 0 to π/2: the angle at which the highlight of the exponent `shininess` falls to a
/// half.
///
/// # Error of the f32 twin
///
/// sin β cos β times the sum of the relative errors of its sine (half of that of sin² β, and a root's 9 u) and of
/// its cosine (7 u ln 2/n, and exp's), plus 9 u of the angle: about 20 u.
pub fn half_value_angle(shininess: f64) -> f64 {
    // The cosine is computed separately, as 2^(-1/n): 1 - sin² has lost its digits where the angle is large.
    let cosine = (-LN_2 / shininess.clamp(SMALLEST_EXPONENT, LARGEST_EXPONENT)).exp();
    quarter_angle(half_value_sine_squared(shininess).sqrt(), cosine)
}

/// D1 = cosⁿ: Phong's.
///
/// # Error of the f32 twin
///
/// That of [`power_of_cosine`](crate::power_of_cosine).
pub fn distribution_cosine_power(cosine: f64, sine_squared: f64, shininess: f64) -> f64 {
    power_of_cosine(cosine, sine_squared, shininess)
}

/// D2 = exp(-(c₂ α)²), c₂ = sqrt(ln 2)/β: Torrance and Sparrow's.
///
/// # Error of the f32 twin
///
/// e^r - 1 relative, with r = x (2 ρ + 4 u) + 2 u (3 + 2 x) for the exponent x = (c₂ α)² and the relative error ρ
/// of α/β: 9 u of each angle, 9 u of the root of sin² and [`half_value_angle`]'s, 6 u. At most 40 u absolute.
pub fn distribution_gaussian(cosine: f64, sine_squared: f64, shininess: f64) -> f64 {
    let angle = quarter_angle(sine_squared.max(0.0).sqrt(), cosine.clamp(0.0, 1.0));
    let ratio = angle / half_value_angle(shininess).max(1e-6);
    // Beyond 10 half-value angles nothing is left in f32 (2⁻¹⁰⁰).
    (-LN_2 * (ratio * ratio).min(100.0)).exp()
}

/// D3 = (c₃²/(cos²α (c₃² - 1) + 1))², c₃² = (1 - cos²β)/(√2 - cos²β): Trowbridge and Reitz's, the one that
/// Blinn recommends and that `torrance_sparrow` uses.
///
/// The divisor is computed as c₃² + sin²α (1 - c₃²), which is equal but avoids the difference that cancels at the
/// peak.
///
/// # Error of the f32 twin
///
/// For q² with q = A/(A + B), A = c₃², B = sin² α (1 - A): q is off by q (1 - q) times the relative errors of A
/// ((1 - A) times that of [`half_value_sine_squared`], and 8 u) and of 1 - A, and by 6 u of itself; D is off by 2
/// q times that. At most 30 u. If the squared sine itself is off by δ, that adds q² (1 - A) δ/A.
pub fn distribution_trowbridge_reitz(sine_squared: f64, shininess: f64) -> f64 {
    let c3_squared = trowbridge_reitz_width_squared(shininess);
    let ratio = c3_squared / (c3_squared + sine_squared.clamp(0.0, 1.0) * (1.0 - c3_squared));
    ratio * ratio
}

/// Returns c₃², from 0 for a mirror to .71 for the exponent 0: the squared roughness α² where this distribution is
/// written as GGX.
pub(crate) fn trowbridge_reitz_width_squared(shininess: f64) -> f64 {
    let half_value = half_value_sine_squared(shininess);
    half_value / (SQRT_2 - 1.0 + half_value)
}

#[cfg(test)]
mod tests {
    use super::*;

    const EXPONENTS: [f64; 6] = [0.5, 1.0, 10.0, 128.0, 8192.0, 1e6];

    #[test]
    fn each_is_one_at_the_peak_and_a_half_at_the_half_value_angle() {
        for shininess in EXPONENTS {
            let beta = half_value_angle(shininess);
            let (sine, cosine) = beta.sin_cos();
            let values = [
                distribution_cosine_power(cosine, sine * sine, shininess),
                distribution_gaussian(cosine, sine * sine, shininess),
                distribution_trowbridge_reitz(sine * sine, shininess),
            ];
            for value in values {
                // sin² β of a rounded β: a few 2⁻⁵³ relative, times the slope at the half value, which is at most
                // ln 2.
                assert!((value - 0.5).abs() < 4e-15, "n = {shininess}: {values:?}");
            }
            assert_eq!(distribution_cosine_power(1.0, 0.0, shininess), 1.0);
            assert_eq!(distribution_gaussian(1.0, 0.0, shininess), 1.0);
            assert_eq!(distribution_trowbridge_reitz(0.0, shininess), 1.0);
        }
    }

    #[test]
    fn the_half_value_angle_of_known_exponents() {
        // cos β = 2^(-1/n): 60 degrees for 1, 45 for 2; ln 2 = n β²/2 for large n, and the next term is β²/6
        // relative.
        assert!((half_value_angle(1.0).to_degrees() - 60.0).abs() < 1e-13);
        assert!((half_value_angle(2.0).to_degrees() - 45.0).abs() < 1e-13);
        assert!((half_value_angle(1e6) / (2.0 * LN_2 / 1e6).sqrt() - 1.0).abs() < 1e-6);
        assert!((half_value_angle(0.0) - std::f64::consts::FRAC_PI_2).abs() < 1e-15);
    }

    #[test]
    fn trowbridge_reitz_equals_its_textbook_form() {
        for shininess in [1.0, 10.0, 100.0] {
            let cos_beta_squared = half_value_angle(shininess).cos().powi(2);
            let c3_squared = (1.0 - cos_beta_squared) / (SQRT_2 - cos_beta_squared);
            for degrees in [0.0, 3.0, 20.0, 60.0, 90.0] {
                let cosine = f64::to_radians(degrees).cos();
                let textbook = (c3_squared / (cosine * cosine * (c3_squared - 1.0) + 1.0)).powi(2);
                let got = distribution_trowbridge_reitz(1.0 - cosine * cosine, shininess);
                // The textbook form's own cancellation, 2⁻⁵³/c₃², is the larger error: c₃² is .03 at n = 100.
                assert!((got - textbook).abs() < 1e-13, "{shininess} {degrees}");
            }
        }
    }

    #[test]
    fn exponent_zero_is_finite() {
        for value in [
            distribution_cosine_power(0.0, 1.0, 0.0),
            distribution_gaussian(0.0, 1.0, 0.0),
            distribution_trowbridge_reitz(1.0, 0.0),
        ] {
            assert!((0.0..=1.0).contains(&value));
        }
    }
}
