//! Exposure by metering a traced picture, as frames are metered. Not the display.

use glam::DVec3;

/// What the log-average luminance becomes: the middle grey of photography.
const MIDDLE_GREY: f64 = 0.18;
/// Below this a pixel shows no light, and is not metered.
const DARK: f64 = 1e-7;

/// What metering found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Metering {
    /// Log-average luminance of what is lit, in units of radiance.
    pub luminance: f64,
    /// The factor on radiance that shows it as a middle grey.
    pub exposure: f32,
    /// Share of what is lit that would be white without an exposure, 0 to 1.
    pub clipped: f64,
}

impl Metering {
    /// Of radiances; nothing if none is lit.
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

    /// The exposure value at ISO 100 whose factor is this exposure: the factor is 1 / (1.2 · 2^EV).
    pub fn exposure_value(&self) -> f64 {
        -(1.2 * f64::from(self.exposure)).log2()
    }
}

/// Of linear RGB with sRGB's primaries.
pub(crate) fn luminance(color: DVec3) -> f64 {
    color.dot(DVec3::new(0.2126, 0.7152, 0.0722))
}
