//! The accepted error of a picture, shared by all settings that trade accuracy for speed.

/// The largest accepted difference of any pixel and channel, in exposed linear radiance between 0 and 1, the
/// display's white. Above 0 and at most 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ErrorBound(f32);

impl ErrorBound {
    /// Creates a bound, or returns `None` if the number is not above 0 and at most 1.
    pub fn new(error: f32) -> Option<Self> {
        (error > 0.0 && error <= 1.0).then_some(Self(error))
    }

    /// Returns the number.
    pub fn get(self) -> f32 {
        self.0
    }
}

// Values are never NaN or zero, so equality is reflexive and agrees with the bits.
impl Eq for ErrorBound {}

impl std::hash::Hash for ErrorBound {
    fn hash<H: std::hash::Hasher>(&self, state: &mut H) {
        self.0.to_bits().hash(state);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_errors_that_a_display_can_show_are_bounds() {
        assert_eq!(ErrorBound::new(0.25).map(ErrorBound::get), Some(0.25));
        assert_eq!(ErrorBound::new(1.0).map(ErrorBound::get), Some(1.0));
        for error in [0.0, -0.0, -1.0, 1.1, f32::NAN, f32::INFINITY] {
            assert_eq!(ErrorBound::new(error), None, "{error}");
        }
    }
}
