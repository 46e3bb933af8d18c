//! Automatic exposure of a traced picture from its log-average luminance, by the same rule as frames.

use glam::DVec3;

/// The displayed value that the log-average luminance is exposed to: photographic middle grey.
const MIDDLE_GREY: f64 = 0.18;
/// Pixels of this luminance or less count as unlit and are not metered.
const DARK: f64 = 1e-7;

/// The result of metering a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Metering {
    /// Log-average luminance of the lit pixels, in units of radiance.
    pub luminance: f64,
    /// The factor on radiance that displays this luminance as middle grey.
    pub exposure: f32,
    /// Fraction of the lit pixels whose luminance is 1 or more, which would be white without an exposure; 0
    /// to 1.
    pub clipped: f64,
}

impl Metering {
    /// Meters the radiance of all pixels; returns `None` if none is lit.
    pub fn of(pixels: &[DVec3]) -> Option<Self> {
        let luminance = |pixel: &DVec3| luminance(*pixel);
        let lit: Vec<f64> =
            pixels.iter().map(luminance).filter(|&value| value > DARK && value.is_finite()).collect();
        if lit.is_empty() {
            return None;
        }
        let count = lit.len() as f64;
        let luminance = (lit.iter().map(|value| value.ln()).sum::<f64>() / count).exp();
        let exposure = (MIDDLE_GREY / luminance).clamp(1e-30, 1e30) as f32;
        let clipped = lit.iter().filter(|&&value| value >= 1.0).count() as f64 / count;
        Some(Self { luminance, exposure, clipped })
    }

    /// Returns the exposure value (EV) at ISO 100 that gives this exposure: the factor is 1 / (1.2 · 2^EV).
    pub fn exposure_value(&self) -> f64 {
        -(1.2 * f64::from(self.exposure)).log2()
    }
}

/// Luminance of linear RGB with sRGB's primaries.
pub(crate) fn luminance(color: DVec3) -> f64 {
    color.dot(DVec3::new(0.2126, 0.7152, 0.0722))
}
