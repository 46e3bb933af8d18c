//! Draws frames into memory beside those of a window, with renderers of its own, for their times or their
//! radiance.

use std::time::Instant;

use bevy_ecs::world::World;
use glam::Vec4;
use lumbre_render::{
    Display, FrameOptions, Gpu, Measure, MissingPipelines, Offscreen, OffscreenFormat, RenderError, Renderer,
};

use crate::rounds::milliseconds_since;

/// Draws frames of one size beside those of a window.
pub struct SideView {
    gpu: Gpu,
    size: (u32, u32),
    /// Renderers for timed frames and for pictures. Their formats differ, and therefore their pipelines.
    timed: (Renderer, Offscreen),
    looked_at: (Renderer, Offscreen),
}

impl SideView {
    /// Creates it for pictures of `size` pixels.
    ///
    /// # Errors
    /// [`RenderError::TargetTooLarge`], also for a size of 0.
    pub fn new(gpu: &Gpu, size: (u32, u32)) -> Result<Self, RenderError> {
        let beside = |format| -> Result<(Renderer, Offscreen), RenderError> {
            Ok((Renderer::new(gpu), Offscreen::new(gpu, size.0, size.1, format)?))
        };
        Ok(Self {
            gpu: gpu.clone(),
            size,
            timed: beside(OffscreenFormat::Rgba8)?,
            looked_at: beside(OffscreenFormat::LinearFloat)?,
        })
    }

    /// Returns width and height of its pictures in pixels.
    pub fn size(&self) -> (u32, u32) {
        self.size
    }

    /// Returns the milliseconds of a frame, from the call until the device has finished. The frame is drawn
    /// twice and the second drawing is timed: during the first, the renderer reads what has changed since it
    /// drew something else, and the device finishes the work of the window.
    ///
    /// # Errors
    /// As drawing a frame.
    pub fn milliseconds(&mut self, world: &mut World, options: &FrameOptions) -> Result<f64, RenderError> {
        let (renderer, target) = &mut self.timed;
        let options = FrameOptions {
            measure: Measure::Nothing,
            missing_pipelines: MissingPipelines::Wait,
            ..options.clone()
        };
        let mut drawn = || -> Result<f64, RenderError> {
            let begun = Instant::now();
            renderer.render(world, &target.target(), &options)?;
            renderer.wait()?;
            Ok(milliseconds_since(begun))
        };
        drawn()?;
        drawn()
    }

    /// Returns the radiance of a frame: linear RGB without exposure, W/(m² sr), top row first.
    ///
    /// # Errors
    /// As drawing a frame.
    pub fn radiance(&mut self, world: &mut World, options: &FrameOptions) -> Result<Vec<Vec4>, RenderError> {
        let (renderer, target) = &mut self.looked_at;
        let options = FrameOptions {
            display: Display::Linear,
            exposure: Some(1.0),
            full_precision: true,
            measure: Measure::Nothing,
            missing_pipelines: MissingPipelines::Wait,
            ..options.clone()
        };
        renderer.render(world, &target.target(), &options)?;
        target.read_linear(&self.gpu)
    }
}
