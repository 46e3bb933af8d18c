//! Numbers with a bound on their error, and the accuracy that WGSL guarantees for each operation (WGSL
//! specification, section 15.7.4).

/// Half a unit in the last place of 1, which is the relative error of one rounding to f32.
const ROUNDING: f64 = 5.960_464_477_539_063e-8;
/// The smallest normal number; smaller results may be flushed to zero.
const FLUSHED: f64 = 1.175_494_350_822_287_5e-38;

/// A real number and a bound on how much a device's f32 may differ from it. Booleans are 0 and 1; a bound of 1
/// means undecided.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Number {
    /// The result of exact arithmetic.
    pub value: f64,
    /// The device's number differs from it by at most this.
    pub error: f64,
}

impl Number {
    /// A number that the device has exactly, unless it is below the normal numbers and may be flushed to zero.
    pub fn exact(value: f64) -> Self {
        let error = if value.abs() < FLUSHED { value.abs() } else { 0.0 };
        Self { value, error }
    }

    /// A constant of the source, which is rounded to f32 unless it has few binary digits.
    pub(super) fn constant(value: f32) -> Self {
        let rounded = value.to_bits() & 0xff != 0;
        Self { value: value.into(), error: if rounded { ROUNDING * f64::from(value.abs()) } else { 0.0 } }
    }

    pub(super) fn boolean(value: bool, open: bool) -> Self {
        Self { value: f64::from(u8::from(value)), error: f64::from(u8::from(open)) }
    }

    /// Creates `value` with a propagated error and this many roundings of its own.
    fn rounded(value: f64, propagated: f64, roundings: f64) -> Self {
        let size = value.abs() + propagated;
        let error = propagated + roundings * ROUNDING * size + FLUSHED;
        let fits = size + error <= f64::from(f32::MAX);
        Self { value, error: if fits && !error.is_nan() { error } else { f64::INFINITY } }
    }

    fn low(self) -> f64 {
        self.value - self.error
    }

    fn high(self) -> f64 {
        self.value + self.error
    }

    pub(super) fn is_true(self) -> bool {
        self.value != 0.0
    }

    pub(super) fn is_open(self) -> bool {
        self.error != 0.0
    }

    pub(super) fn negate(self) -> Self {
        Self { value: -self.value, ..self }
    }

    pub(super) fn abs(self) -> Self {
        Self { value: self.value.abs(), ..self }
    }

    pub(super) fn add(self, other: Self) -> Self {
        let exact = self.error == 0.0 && other.error == 0.0 && (self.value == 0.0 || other.value == 0.0);
        if exact {
            return Self { value: self.value + other.value, error: 0.0 };
        }
        Self::rounded(self.value + other.value, self.error + other.error, 1.0)
    }

    pub(super) fn subtract(self, other: Self) -> Self {
        self.add(other.negate())
    }

    pub(super) fn multiply(self, other: Self) -> Self {
        let zero = Self { value: 0.0, error: 0.0 };
        if (self == zero && other.error.is_finite()) || (other == zero && self.error.is_finite()) {
            return zero;
        }
        if [self, other].contains(&Self { value: 1.0, error: 0.0 }) {
            let factor = if self.value == 1.0 && self.error == 0.0 { other } else { self };
            return factor;
        }
        Self::rounded(self.value * other.value, self.product_error(other), 1.0)
    }

    fn product_error(self, other: Self) -> f64 {
        let terms =
            [self.value.abs() * other.error, self.error * other.value.abs(), self.error * other.error];
        // A product of 0 and an unbounded error is NaN here and counts as unbounded.
        terms.iter().map(|term| if term.is_nan() { f64::INFINITY } else { *term }).sum()
    }

    /// Off by 2.5 units in the last place, for divisors whose reciprocal is a normal number.
    pub(super) fn divide(self, other: Self) -> Self {
        let value = self.value / other.value;
        let least = other.value.abs() - other.error;
        if !(least >= FLUSHED && other.value.abs() + other.error <= 1.0 / FLUSHED) {
            return Self { value: if value.is_nan() { 0.0 } else { value }, error: f64::INFINITY };
        }
        Self::rounded(value, (self.error + value.abs() * other.error) / least, 5.0)
    }

    pub(super) fn minimum(self, other: Self) -> Self {
        self.negate().maximum(other.negate()).negate()
    }

    pub(super) fn maximum(self, other: Self) -> Self {
        if self.low() >= other.high() {
            return self;
        }
        if other.low() >= self.high() {
            return other;
        }
        Self { value: self.value.max(other.value), error: self.error.max(other.error) }
    }

    /// Returns the sum of products, in any order, fused or not.
    pub(super) fn dot(left: &[Self], right: &[Self]) -> Self {
        let pairs = || left.iter().copied().zip(right.iter().copied());
        let value = pairs().map(|(a, b)| a.value * b.value).sum();
        let propagated: f64 = pairs().map(|(a, b)| a.product_error(b)).sum();
        let size: f64 = pairs().map(|(a, b)| (a.value * b.value).abs()).sum::<f64>() + propagated;
        if size == 0.0 {
            return Self { value, error: 0.0 };
        }
        // One rounding for each product, and one sum fewer than there are terms.
        let error = propagated + left.len() as f64 * (ROUNDING * size + FLUSHED);
        Self {
            value,
            error: if error.is_nan() || size > f64::from(f32::MAX) { f64::INFINITY } else { error },
        }
    }

    fn monotonic(self, function: impl Fn(f64) -> f64, roundings: f64) -> Self {
        let value = function(self.value);
        let propagated = (function(self.high()) - value).abs().max((value - function(self.low())).abs());
        let propagated = if propagated.is_nan() { f64::INFINITY } else { propagated };
        Self::rounded(value, propagated, roundings)
    }

    /// Off by 2 units in the last place.
    pub(super) fn inverse_square_root(self) -> Self {
        if self.low() < FLUSHED {
            return Self { value: self.value.max(FLUSHED).sqrt().recip(), error: f64::INFINITY };
        }
        self.monotonic(|x| x.sqrt().recip(), 4.0)
    }

    /// As 1/inverseSqrt: off by 4.5 units in the last place. Zero stays zero.
    pub(super) fn square_root(self) -> Self {
        if self == Self::exact(0.0) {
            return self;
        }
        self.monotonic(|x| x.max(0.0).sqrt(), 9.0)
    }

    /// Off by 3 + 2 |x| units in the last place.
    pub(super) fn exponential(self) -> Self {
        self.monotonic(f64::exp, 2.0 * (3.0 + 2.0 * (self.value.abs() + self.error)))
    }

    pub(super) fn exponential_2(self) -> Self {
        self.monotonic(f64::exp2, 2.0 * (3.0 + 2.0 * (self.value.abs() + self.error)))
    }

    /// Off by 2^-21 in [1/2, 2], otherwise by 3 units in the last place.
    pub(super) fn logarithm_2(self) -> Self {
        if self.low() < FLUSHED {
            return Self { value: self.value.max(FLUSHED).log2(), error: f64::INFINITY };
        }
        let (low, high) = (self.low(), self.high());
        let near_one = 2f64.powi(-21);
        if low >= 0.5 && high <= 2.0 {
            let mut result = self.monotonic(f64::log2, 0.0);
            result.error += near_one;
            return result;
        }
        let mut result = self.monotonic(f64::log2, 6.0);
        if high >= 0.5 && low <= 2.0 {
            result.error += near_one;
        }
        result
    }

    /// exp2(y log2(x)), as in the specification.
    pub(super) fn power(self, exponent: Self) -> Self {
        exponent.multiply(self.logarithm_2()).exponential_2()
    }

    /// Off by 4096 units in the last place.
    pub(super) fn arc_tangent_2(self, x: Self) -> Self {
        let value = self.value.atan2(x.value);
        let distance = self.value.hypot(x.value) - self.error.hypot(x.error);
        let turned = self.error.hypot(x.error) / distance;
        let propagated = if distance > 0.0 { turned.min(std::f64::consts::PI) } else { std::f64::consts::PI };
        Self::rounded(value, propagated, 8192.0)
    }

    /// Returns whether `self < other` (or `<=`), undecided if the errors overlap.
    pub(super) fn less(self, other: Self, or_equal: bool) -> Self {
        let value = if or_equal { self.value <= other.value } else { self.value < other.value };
        let certain = self.high() < other.low() || other.high() < self.low();
        let exact = self.error == 0.0 && other.error == 0.0;
        Self::boolean(value, !(certain || exact))
    }

    pub(super) fn equal(self, other: Self) -> Self {
        let apart = self.high() < other.low() || other.high() < self.low();
        let exact = self.error == 0.0 && other.error == 0.0;
        Self::boolean(self.value == other.value, !(apart || exact))
    }

    /// Returns a number that covers the results of both branches, with the value of the first.
    pub(super) fn hull(self, other: Self) -> Self {
        let error = self.error.max((other.value - self.value).abs() + other.error);
        Self { value: self.value, error: if error.is_nan() { f64::INFINITY } else { error } }
    }
}
