//! Bounds of powers of cosines.

use std::f64::consts::LN_2;

use super::{FLUSHED, U};

/// A number and how much the device's own may differ from it.
#[derive(Clone, Copy)]
pub struct Off {
    pub value: f64,
    pub error: f64,
}

impl Off {
    pub fn exact(value: f64) -> Self {
        Self { value, error: 0.0 }
    }

    fn low(self) -> f64 {
        self.value - self.error
    }

    fn high(self) -> f64 {
        self.value + self.error
    }
}

/// Converts an absolute error r of a logarithm to the relative error of its exponential; r is limited to 50.
pub fn grown(r: f64) -> f64 {
    r.min(50.0).exp_m1()
}

/// exp: 3 + 2 |x| units in the last place.
pub fn exponential(x: f64) -> f64 {
    2.0 * U * (3.0 + 2.0 * x.abs())
}

/// pow(b, n) = exp2(n log2 b), relative: the logarithm, off by 8 u absolute for bases from 1/2 (2⁻²¹), otherwise by
/// 6 u of itself; the product's rounding; exp2.
fn power_roundings(base: f64, exponent: f64) -> f64 {
    let (base, exponent) = (base.clamp(1e-30, 1.0), exponent.clamp(0.0, 1e7));
    let logarithm = base.log2().abs();
    let of_logarithm = if base >= 0.5 { 8.0 * U } else { 6.0 * U * logarithm };
    let power = exponent * logarithm;
    LN_2 * (exponent * of_logarithm + U * power) + exponential(power)
}

/// safe_pow for a base and an exponent that are themselves off: their effect, evaluated at both ends, and the
/// roundings.
pub fn safe_pow(base: Off, exponent: Off) -> f64 {
    let power = lumbre_optics::safe_pow;
    let value = power(base.value, exponent.value);
    let high = power(base.high(), exponent.low());
    let low = power(base.low(), exponent.high());
    let roundings = |base: f64, exponent: f64, value: f64| value * grown(power_roundings(base, exponent));
    let own = roundings(base.value, exponent.value, value).max(roundings(base.high(), exponent.low(), high));
    (high - value).max(value - low) + own + FLUSHED
}

/// The terms that logarithm_of_one_minus omits: z⁶/7 relative, and smaller ones, with z = x/(2 - x).
fn series(x: f64) -> f64 {
    let z = x / (2.0 - x);
    1.1 * z.powi(6) / 7.0
}

/// logarithm_of_one_minus: 9 u and the omitted terms.
pub fn logarithm_of_one_minus(x: f64) -> f64 {
    (-x).ln_1p().abs() * (9.0 * U + series(x)) + FLUSHED
}

/// exp(n/2 ln(1 - sin²)): the errors of sine and exponent at both ends, 11 u of the exponent, and exp.
fn from_sine(sine_squared: Off, exponent: Off) -> (f64, f64) {
    let logarithm = |s: f64| (-s.clamp(0.0, 0.25)).ln_1p();
    let power = |s: f64, n: f64| (0.5 * n.clamp(0.0, 1e7) * logarithm(s)).exp();
    let value = power(sine_squared.value, exponent.value);
    let high = power(sine_squared.low(), exponent.low());
    let low = power(sine_squared.high(), exponent.high());
    let roundings = |s: f64, n: f64, value: f64| {
        let y = (0.5 * n.clamp(0.0, 1e7) * logarithm(s)).abs();
        value * grown(y * (11.0 * U + series(s.clamp(0.0, 0.25))) + exponential(y))
    };
    let own = roundings(sine_squared.value, exponent.value, value).max(roundings(
        sine_squared.low(),
        exponent.low(),
        high,
    ));
    (value, (high - value).max(value - low) + own + FLUSHED)
}

/// power_of_cosine: the form that is used, or the range of both where the cosine is within its error of .9.
pub fn power_of_cosine(cosine: Off, sine_squared: Off, exponent: Off) -> f64 {
    let nearly_parallel = f64::from(0.9f32);
    if cosine.low() > nearly_parallel {
        return from_sine(sine_squared, exponent).1;
    }
    if cosine.high() <= nearly_parallel {
        return safe_pow(cosine, exponent);
    }
    let (value, error) = from_sine(sine_squared, exponent);
    let between = (value - lumbre_optics::safe_pow(cosine.value, exponent.value)).abs();
    between + error.max(safe_pow(cosine, exponent))
}
