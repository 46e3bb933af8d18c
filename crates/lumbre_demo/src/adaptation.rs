//! Eye adaptation: an exposure that follows the metered one smoothly. The metering is in `lumbre_render`.

/// Time constant in seconds: the time in which the difference from the metered exposure falls to 1/e.
const SECONDS: f64 = 0.5;

/// An exposure that approaches the metered one exponentially in stops (log2), so that brightening and
/// darkening by the same factor take the same time.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Adaptation {
    /// Binary logarithms of the current and of the metered exposure.
    stops: Option<(f64, f64)>,
}

impl Adaptation {
    /// Sets a metered exposure. The first one applies at once, since there is nothing to adapt from.
    /// Exposures without a finite logarithm are ignored.
    pub fn metered(&mut self, exposure: f32) {
        let wanted = f64::from(exposure).log2();
        if wanted.is_finite() {
            self.stops = Some((self.stops.map_or(wanted, |(now, _)| now), wanted));
        }
    }

    /// Advances the adaptation by a time.
    pub fn step(&mut self, seconds: f64) {
        if let Some((now, wanted)) = &mut self.stops
            && seconds > 0.0
        {
            *now += (*wanted - *now) * (1.0 - (-seconds / SECONDS).exp());
        }
    }

    /// Returns the current exposure; `None` before anything was metered.
    pub fn exposure(&self) -> Option<f32> {
        self.stops.map(|(now, _)| now.exp2() as f32)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn follows_the_meter_by_an_exponential_in_stops() {
        let mut eye = Adaptation::default();
        assert_eq!(eye.exposure(), None);
        eye.metered(1.0);
        assert_eq!(eye.exposure(), Some(1.0));
        // Four stops darker. The same time in frames of different lengths gives the same exposure.
        eye.metered(1.0 / 16.0);
        let mut other = eye;
        for _ in 0..100 {
            eye.step(0.005);
        }
        other.step(0.3);
        other.step(0.2);
        let expected = (-4.0 * (1.0 - (-1f64).exp())).exp2();
        for eye in [eye, other] {
            assert!((f64::from(eye.exposure().unwrap()) / expected - 1.0).abs() < 1e-6, "{eye:?}");
        }
        eye.step(60.0);
        assert!((eye.exposure().unwrap() * 16.0 - 1.0).abs() < 1e-6);
    }

    #[test]
    fn what_is_no_exposure_is_left_aside() {
        let mut eye = Adaptation::default();
        eye.metered(0.0);
        eye.metered(f32::NAN);
        assert_eq!(eye.exposure(), None);
        eye.metered(2.0);
        eye.metered(f32::INFINITY);
        eye.step(f64::NAN);
        eye.step(1.0);
        assert_eq!(eye.exposure(), Some(2.0));
    }
}
