//! An angle from its sine and cosine. This is a helper that no equation names: f32 needs it because WGSL's atan2 is
//! only good to 4096 units in the last place.

use std::f64::consts::FRAC_PI_2;

/// Avoids 0/0.
const SMALLEST_DIVISOR: f64 = 1e-30;

/// Returns the angle in radians, 0 to π/2, of a sine and a cosine that are at least 0: `sine.atan2(cosine)`. Only
/// their ratio matters, unless both are under 10⁻³⁰ (which cannot happen for a sine and cosine of one angle); then
/// the result goes to 0.
///
/// # Error of the f32 twin
///
/// At most 9 u of the angle, u = 2⁻²⁴. The tangent is a division (5 u). The polynomial (Abramowitz and Stegun,
/// Handbook of Mathematical Functions, 4.4.49) is off by 1.8·10⁻⁸ (.3 u). Its terms beyond the first are at most 27
/// % of the sum, each off by at most 15 u (two tangents, a product, its coefficient), and add 3 u, less the
/// flattening of the arctangent (its logarithmic slope is .79 there); the sum adds 1 u. Beyond 45 degrees the
/// smaller angle has a smaller share of the result, and the rounding of π/2 and of the difference make up for that.
pub fn quarter_angle(sine: f64, cosine: f64) -> f64 {
    let tangent = sine.min(cosine) / sine.max(cosine).max(SMALLEST_DIVISOR);
    if sine > cosine { FRAC_PI_2 - tangent.atan() } else { tangent.atan() }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_4;

    use super::*;

    #[test]
    fn known_angles() {
        assert_eq!(quarter_angle(0.0, 0.0), 0.0);
        assert_eq!(quarter_angle(0.0, 1.0), 0.0);
        assert_eq!(quarter_angle(1.0, 0.0), FRAC_PI_2);
        assert_eq!(quarter_angle(2.0, 2.0), FRAC_PI_4);
    }
}
