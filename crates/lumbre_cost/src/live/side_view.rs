//! Frames beside those of a window: drawn into memory by renderers of their own, for their time or for their light. Not what they are drawn for.

use std::time::Instant;

use bevy_ecs::world::World;
use glam::Vec4;
use lumbre_render::{
    Display, FrameOptions, Gpu, Measure, MissingPipelines, Offscreen, OffscreenFormat, RenderError, Renderer,
};

use crate::rounds::milliseconds_since;

/// Draws frames of one size on a device, beside those that are shown.
pub struct SideView {
    gpu: Gpu,
    size: (u32, u32),
    /// Draws what is timed; the other one, what is looked at: their formats differ, and with them their pipelines.
    timed: (Renderer, Offscreen),
    looked_at: (Renderer, Offscreen),
}

impl SideView {
    /// For pictures of `size` pixels.
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

    /// Width and height of its pictures in pixels.
    pub fn size(&self) -> (u32, u32) {
        self.size
    }

    /// Milliseconds of a frame, from the call until the device has finished. It is drawn twice, and the second one is timed: in the first the renderer reads
    /// what has changed since it drew something else, and whatever the window had begun on the device is finished.
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

    /// The light of a frame: linear RGB without exposure, W/(m² sr), top row first.
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
