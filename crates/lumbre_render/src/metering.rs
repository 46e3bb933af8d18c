//! Exposure by metering: from a frame's log-average luminance to the factor that shows it as a middle grey. Not the display.

use bevy_ecs::world::World;
use glam::Vec4;

use crate::{Display, FrameOptions, Gpu, Measure, Offscreen, OffscreenFormat, RenderError, Renderer};

/// What the log-average luminance becomes: the middle grey of photography.
const MIDDLE_GREY: f64 = 0.18;
/// Below this a pixel shows no light, and is not metered: the background, or a shadow without any.
const DARK: f64 = 1e-7;
/// Width of the frame that is metered, in pixels.
const WIDTH: u32 = 256;

/// What metering found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Metering {
    /// Log-average luminance of what is lit, in units of radiance: cd/m² where lights are in candela and lux.
    pub luminance: f64,
    /// The factor on radiance that shows it as a middle grey.
    pub exposure: f32,
    /// Share of what is lit that would be white without an exposure, 0 to 1.
    pub clipped: f64,
}

impl Metering {
    /// Of linear pixels; nothing if none of them is lit.
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

    /// The exposure value at ISO 100 whose factor is this exposure: the factor is 1 / (1.2 · 2^EV).
    pub fn exposure_value(&self) -> f64 {
        -(1.2 * f64::from(self.exposure)).log2()
    }
}

/// Meters frames again and again, with the renderer that draws them: a small picture of its own beside them.
#[derive(Debug)]
pub struct LightMeter {
    target: Offscreen,
}

impl LightMeter {
    /// A meter for frames of a width by height of `aspect`, by a picture of at most `width` texels a row.
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
    /// [`RenderError`], as drawing a frame has it.
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

/// Meters one frame that the options describe, drawn small, of a width by height of `aspect`. The same World gives the same exposure.
///
/// # Errors
/// [`RenderError`], as drawing a frame has it.
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
