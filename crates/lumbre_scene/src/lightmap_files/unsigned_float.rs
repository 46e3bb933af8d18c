//! Unsigned floats of 11 and 10 bits with five exponent bits. Packing three of them into a word is in
//! `packed_format`.
//!
//! A number is (1 + m / 2^M) · 2^(e − 15) for 0 < e < 31 and m / 2^M · 2^−14 for e = 0; e = 31 is infinity or NaN
//! (Vulkan 1.3, sections "Unsigned 11-Bit Floating-Point Numbers" and "Unsigned 10-Bit Floating-Point Numbers").

/// A format, given by the number of its mantissa bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct UnsignedFloat {
    mantissa: u32,
}

/// 11-bit float with six mantissa bits; the largest number is 65024.
pub(crate) const FLOAT_11: UnsignedFloat = UnsignedFloat { mantissa: 6 };
/// 10-bit float with five mantissa bits; the largest number is 64512.
pub(crate) const FLOAT_10: UnsignedFloat = UnsignedFloat { mantissa: 5 };

impl UnsignedFloat {
    /// The code of the largest finite number.
    const fn largest_code(self) -> u32 {
        (31 << self.mantissa) - 1
    }

    /// The largest finite number.
    pub(crate) const fn largest(self) -> f32 {
        // (2 − 2^−M) · 2^15.
        (65_536 - (1 << (15 - self.mantissa))) as f32
    }

    /// The code nearest to a finite number, with ties to even, clamped to [0, largest].
    ///
    /// The error of a number in that range is at most max(2^−(M+1) · number, 2^−(15+M)), where M is the
    /// number of mantissa bits.
    pub(crate) fn encode(self, value: f32) -> u32 {
        let value = f64::from(value.clamp(0.0, self.largest()));
        // floor(log2) read from the bits, so it is exact.
        let exponent = (((value.to_bits() >> 52) & 0x7ff) as i32 - 1023).max(-14);
        let unit = f64::from_bits(((exponent - self.mantissa as i32 + 1023) as u64) << 52);
        // Subnormal numbers have no hidden bit and use the exponent of the smallest normal ones, so one
        // formula serves both. A mantissa that rounds up to the next power of two carries into the exponent.
        let units = (value / unit).round_ties_even() as u32;
        let code = (((exponent + 14) as u32) << self.mantissa) + units;
        code.min(self.largest_code())
    }

    /// Decodes the low bits of a code exactly; infinite or NaN if the exponent is 31.
    pub(crate) fn decode(self, code: u32) -> f32 {
        let mantissa = code & ((1 << self.mantissa) - 1);
        let exponent = code >> self.mantissa & 31;
        let fraction = mantissa as f32 / (1 << self.mantissa) as f32;
        match exponent {
            0 => fraction * 2f32.powi(-14),
            31 if mantissa == 0 => f32::INFINITY,
            31 => f32::NAN,
            _ => (1.0 + fraction) * 2f32.powi(exponent as i32 - 15),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FORMATS: [UnsignedFloat; 2] = [FLOAT_11, FLOAT_10];

    #[test]
    fn every_code_comes_back_and_is_a_half_float() {
        for format in FORMATS {
            for code in 0..=format.largest_code() {
                let value = format.decode(code);
                assert_eq!(format.encode(value), code);
                assert_eq!(half::f16::from_f32(value).to_f32(), value, "halves hold every one of them");
            }
            assert_eq!(format.decode(format.largest_code()), format.largest());
            assert_eq!(format.decode(format.largest_code() + 1), f32::INFINITY);
            assert!(format.decode(format.largest_code() + 2).is_nan());
        }
        assert_eq!((FLOAT_11.largest(), FLOAT_10.largest()), (65_024.0, 64_512.0));
        assert_eq!(FLOAT_11.encode(1.0), 0x3c0);
        assert_eq!(FLOAT_10.encode(1.0), 0x1e0);
    }

    /// Values between two neighbouring numbers round to the nearer one, and ties to the even one.
    #[test]
    fn rounds_to_the_nearest() {
        for format in FORMATS {
            for code in 0..format.largest_code() {
                let (low, high) = (format.decode(code), format.decode(code + 1));
                let middle = (low + high) / 2.0;
                assert_eq!(format.encode(middle), code + code % 2, "ties to even");
                assert_eq!(format.encode(f32::from_bits(middle.to_bits() - 1)), code);
                assert_eq!(format.encode(f32::from_bits(middle.to_bits() + 1)), code + 1);
                let bound = (f64::from(middle) * 0.5f64.powi(format.mantissa as i32 + 1))
                    .max(0.5f64.powi(15 + format.mantissa as i32));
                assert!(f64::from(middle - low) <= bound, "the bound that is stated");
            }
        }
    }

    #[test]
    fn what_is_out_of_range_is_clamped() {
        for format in FORMATS {
            for below in [-0.0, -1.0, f32::MIN, f32::MIN_POSITIVE, f32::from_bits(1)] {
                assert_eq!(format.encode(below), 0, "{below}");
            }
            for above in [format.largest() * 1.001, 65_536.0, f32::MAX] {
                assert_eq!(format.encode(above), format.largest_code(), "{above}");
            }
        }
    }
}
