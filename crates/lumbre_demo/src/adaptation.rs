//! The eye's adaptation: an exposure that follows what is metered, smoothly. Not the metering: that is `lumbre_render`'s.

/// Seconds after which a change of light has lost all but 1/e of its effect.
const SECONDS: f64 = 0.5;

/// An exposure that goes to where the meter points, evenly in exposure values: as many stops up as down in the same time.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Adaptation {
    /// Binary logarithms of the exposure, as it is and as it was metered.
    stops: Option<(f64, f64)>,
}

impl Adaptation {
    /// Takes a metered exposure. The first one holds at once: nobody sees a picture brighten that was never dark.
    pub fn metered(&mut self, exposure: f32) {
        let wanted = f64::from(exposure).log2();
        if wanted.is_finite() {
            self.stops = Some((self.stops.map_or(wanted, |(now, _)| now), wanted));
        }
    }

    /// Lets time pass.
    pub fn step(&mut self, seconds: f64) {
        if let Some((now, wanted)) = &mut self.stops
            && seconds > 0.0
        {
            *now += (*wanted - *now) * (1.0 - (-seconds / SECONDS).exp());
        }
    }

    /// The exposure now; nothing before anything was metered.
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
        // Four stops darker; frames of different lengths come to the same place.
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
