//! Metering of the exposure: finds the factor that maps the log-average luminance of a frame to middle grey.
//! Applying the exposure belongs to the display.

use bevy_ecs::world::World;
use glam::Vec4;

use crate::{Display, FrameOptions, Gpu, Measure, Offscreen, OffscreenFormat, RenderError, Renderer};

/// The value that the log-average luminance is mapped to: the middle grey of photography.
const MIDDLE_GREY: f64 = 0.18;
/// Pixels below this luminance are not metered: they show the background, or a shadow that no light reaches.
const DARK: f64 = 1e-7;
/// Width of the metered frame, in pixels.
const WIDTH: u32 = 256;

/// The result of metering a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Metering {
    /// Log-average luminance of the lit pixels, in units of radiance: cd/m² if lights are given in candela
    /// and lux.
    pub luminance: f64,
    /// The factor on radiance that maps this luminance to middle grey.
    pub exposure: f32,
    /// Fraction of the lit pixels, from 0 to 1, that would be clipped to white without an exposure.
    pub clipped: f64,
}

impl Metering {
    /// Meters linear pixels. Returns `None` if none of them is lit.
    pub fn of(pixels: &[Vec4]) -> Option<Self> {
        let luminance = |pixel: &Vec4| {
            0.2126 * f64::from(pixel.x) + 0.7152 * f64::from(pixel.y) + 0.0722 * f64::from(pixel.z)
        };
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

    /// Returns the exposure value at ISO 100 that corresponds to this exposure: the factor is 1 / (1.2 ·
    /// 2^EV).
    pub fn exposure_value(&self) -> f64 {
        -(1.2 * f64::from(self.exposure)).log2()
    }
}

/// Meters frames repeatedly with the renderer that draws them, into a small target of its own.
#[derive(Debug)]
pub struct LightMeter {
    target: Offscreen,
}

impl LightMeter {
    /// Creates a meter for frames with this aspect ratio (width by height), which draws a picture of `width`
    /// texels per row.
    ///
    /// # Errors
    /// [`RenderError::TargetTooLarge`].
    pub fn new(gpu: &Gpu, width: u32, aspect: f64) -> Result<Self, RenderError> {
        let height = (f64::from(width) / aspect).round().clamp(1.0, 4096.0) as u32;
        Ok(Self { target: Offscreen::new(gpu, width, height, OffscreenFormat::LinearFloat)? })
    }

    /// Meters the frame that the options describe. The same World gives the same exposure.
    ///
    /// # Errors
    /// [`RenderError`], as for drawing a frame.
    pub fn measure(
        &self,
        gpu: &Gpu,
        renderer: &mut Renderer,
        world: &mut World,
        options: &FrameOptions,
    ) -> Result<Option<Metering>, RenderError> {
        let linear = FrameOptions {
            display: Display::Linear,
            exposure: Some(1.0),
            full_precision: true,
            multisample: Some(false),
            measure: Measure::Nothing,
            ..options.clone()
        };
        renderer.render(world, &self.target.target(), &linear)?;
        Ok(Metering::of(&self.target.read_linear(gpu)?))
    }
}

/// Meters one frame that the options describe, drawn small with this aspect ratio (width by height). The same
/// World gives the same exposure.
///
/// # Errors
/// [`RenderError`], as for drawing a frame.
pub fn meter(
    gpu: &Gpu,
    world: &mut World,
    options: &FrameOptions,
    aspect: f64,
) -> Result<Option<Metering>, RenderError> {
    LightMeter::new(gpu, WIDTH, aspect)?.measure(gpu, &mut Renderer::new(gpu), world, options)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_log_average_of_what_is_lit_becomes_a_middle_grey() {
        let grey = |value: f32| Vec4::new(value, value, value, 1.0);
        let found = Metering::of(&[grey(10.0), grey(1000.0), grey(0.0), grey(f32::NAN)]).unwrap();
        assert!((found.luminance - 100.0).abs() < 1e-3, "{found:?}");
        assert!((found.exposure - 0.0018).abs() < 1e-8 && found.clipped == 1.0, "{found:?}");
        // 1 / (1.2 * 2^EV)
        assert!((1.0 / (1.2 * found.exposure_value().exp2()) - 0.0018).abs() < 1e-8);
        let found = Metering::of(&[grey(0.5), grey(2.0)]).unwrap();
        assert_eq!(found.clipped, 0.5);
        assert_eq!(Metering::of(&[grey(0.0)]), None);
    }
}
