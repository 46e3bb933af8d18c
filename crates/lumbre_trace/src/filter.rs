//! Reconstruction filters: the weight of a sample for a pixel by its offset from the pixel's centre. How
//! samples are distributed over a filter is in `film`.

use glam::DVec2;

/// The reconstruction filter of a pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Filter {
    /// All samples in the pixel's square count alike.
    #[default]
    Box,
    /// The filter of Mitchell and Netravali with B = C = 1/3 and a radius of 2 pixels: sharp, rings slightly.
    Mitchell,
    /// The Blackman-Harris window with a radius of 1.5 pixels: soft, never rings.
    BlackmanHarris,
}

impl Filter {
    /// All filters.
    pub const ALL: &'static [Self] = &[Self::Box, Self::Mitchell, Self::BlackmanHarris];

    /// Returns the name used on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Box => "box",
            Self::Mitchell => "mitchell",
            Self::BlackmanHarris => "blackman-harris",
        }
    }

    /// Returns the filter with that name on the command line, or `None` if there is none.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|choice| choice.name() == name)
    }

    /// Returns how far the filter reaches from a pixel's centre along each axis, in pixels.
    pub fn radius(self) -> f64 {
        match self {
            Self::Box => 0.5,
            Self::Mitchell => 2.0,
            Self::BlackmanHarris => 1.5,
        }
    }

    /// Returns the filter's value at an offset from a pixel's centre, in pixels.
    pub fn value(self, offset: DVec2) -> f64 {
        self.along(offset.x.abs()) * self.along(offset.y.abs())
    }

    fn along(self, x: f64) -> f64 {
        if x > self.radius() {
            return 0.0;
        }
        match self {
            Self::Box => 1.0,
            Self::Mitchell => {
                let (b, c) = (1.0 / 3.0, 1.0 / 3.0);
                let value = if x < 1.0 {
                    (12.0 - 9.0 * b - 6.0 * c) * x.powi(3)
                        + (-18.0 + 12.0 * b + 6.0 * c) * x.powi(2)
                        + (6.0 - 2.0 * b)
                } else {
                    (-b - 6.0 * c) * x.powi(3)
                        + (6.0 * b + 30.0 * c) * x.powi(2)
                        + (-12.0 * b - 48.0 * c) * x
                        + (8.0 * b + 24.0 * c)
                };
                value / 6.0
            }
            Self::BlackmanHarris => {
                let turn = std::f64::consts::PI * (x / self.radius() + 1.0);
                let cosines =
                    0.488_29 * turn.cos() - 0.141_28 * (2.0 * turn).cos() + 0.011_68 * (3.0 * turn).cos();
                0.358_75 - cosines
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn filters_end_where_they_say_and_peak_in_the_middle() {
        for filter in Filter::ALL {
            let peak = filter.value(DVec2::ZERO);
            assert!(peak > 0.0);
            let steps = 200;
            for step in 0..=steps {
                let x = 1.2 * filter.radius() * f64::from(step) / f64::from(steps);
                let value = filter.value(DVec2::new(x, 0.0));
                assert!(value <= peak, "{} at {x}", filter.name());
                assert!(x <= filter.radius() || value == 0.0);
            }
        }
        // Known values of the Mitchell filter: 8/9 in the centre, 1/18 one pixel off, and a negative lobe
        // beyond.
        let along = |x| Filter::Mitchell.along(x);
        assert!((along(0.0) - 8.0 / 9.0).abs() < 1e-15 && (along(1.0) - 1.0 / 18.0).abs() < 1e-15);
        assert!(along(1.5) < 0.0 && along(2.0).abs() < 1e-15);
        // It is a partition of unity: copies shifted by whole pixels add up to 1 everywhere.
        for x in [0.0, 0.2, 0.5, 0.9] {
            let sum: f64 = (-3..=3).map(|k| along((x + f64::from(k)).abs())).sum();
            assert!((sum - 1.0).abs() < 1e-14, "{sum}");
        }
    }
}
