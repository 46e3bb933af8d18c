//! Frames in a window: the surface, its size, and what to do when it is occluded, outdated or lost.
//! Independent of the library that created the window.

use crate::{FrameTarget, Gpu, RenderError};

/// A window's surface, configured for a device.
#[derive(Debug)]
pub struct WindowSurface {
    surface: wgpu::Surface<'static>,
    configuration: wgpu::SurfaceConfiguration,
    configured: bool,
}

/// One image of the surface, to draw into and to present.
#[derive(Debug)]
pub struct SurfaceFrame {
    /// The target to draw into.
    pub target: FrameTarget,
    texture: wgpu::SurfaceTexture,
}

impl SurfaceFrame {
    /// Presents the image in the window.
    pub fn present(self, gpu: &Gpu) {
        gpu.queue.present(self.texture);
    }
}

/// The result of acquiring the next image of a surface.
#[derive(Debug)]
pub enum Acquired {
    /// An image to draw into and present.
    Frame(Box<SurfaceFrame>),
    /// Nothing to draw into at the moment (minimised, covered, or just reconfigured). Try again at the next
    /// redraw.
    Skip,
    /// The surface is lost. Create a new one from the window.
    Lost,
}

impl WindowSurface {
    /// Configures a surface that `gpu` can present to. A size of zero (minimised) is allowed; no frame is
    /// acquired until `resize`.
    ///
    /// # Errors
    /// [`RenderError::SurfaceUnsupported`].
    pub fn new(
        gpu: &Gpu,
        surface: wgpu::Surface<'static>,
        width: u32,
        height: u32,
    ) -> Result<Self, RenderError> {
        let unsupported = || RenderError::SurfaceUnsupported { adapter: gpu.adapter.get_info().name };
        let capabilities = surface.get_capabilities(&gpu.adapter);
        // The display pass encodes sRGB itself, so that window and file match exactly. A format that encodes
        // once more is only the second choice.
        let format = capabilities
            .formats
            .iter()
            .copied()
            .find(|format| {
                matches!(format, wgpu::TextureFormat::Bgra8Unorm | wgpu::TextureFormat::Rgba8Unorm)
            })
            .or_else(|| capabilities.formats.first().copied())
            .ok_or_else(unsupported)?;
        let mut configuration =
            surface.get_default_config(&gpu.adapter, width.max(1), height.max(1)).ok_or_else(unsupported)?;
        configuration.format = format;
        configuration.present_mode = wgpu::PresentMode::AutoVsync;
        let mut this = Self { surface, configuration, configured: false };
        this.resize(gpu, width, height);
        Ok(this)
    }

    /// Sets the size of the images to the window's size in physical pixels.
    pub fn resize(&mut self, gpu: &Gpu, width: u32, height: u32) {
        self.configured = false;
        let limit = gpu.device.limits().max_texture_dimension_2d;
        self.configuration.width = width.min(limit);
        self.configuration.height = height.min(limit);
        self.configure(gpu);
    }

    fn configure(&mut self, gpu: &Gpu) {
        if self.configuration.width > 0 && self.configuration.height > 0 {
            self.surface.configure(&gpu.device, &self.configuration);
            self.configured = true;
        }
    }

    /// Returns the texel format of the images.
    pub fn format(&self) -> wgpu::TextureFormat {
        self.configuration.format
    }

    /// Returns width and height in pixels; zero while minimised.
    pub fn size(&self) -> (u32, u32) {
        (self.configuration.width, self.configuration.height)
    }

    /// Acquires the next image.
    pub fn acquire(&mut self, gpu: &Gpu) -> Acquired {
        if !self.configured {
            return Acquired::Skip;
        }
        match self.surface.get_current_texture() {
            wgpu::CurrentSurfaceTexture::Success(texture)
            | wgpu::CurrentSurfaceTexture::Suboptimal(texture) => {
                let target = FrameTarget::from_texture(&texture.texture);
                Acquired::Frame(Box::new(SurfaceFrame { target, texture }))
            }
            wgpu::CurrentSurfaceTexture::Outdated => {
                self.configure(gpu);
                Acquired::Skip
            }
            wgpu::CurrentSurfaceTexture::Lost => Acquired::Lost,
            wgpu::CurrentSurfaceTexture::Timeout
            | wgpu::CurrentSurfaceTexture::Occluded
            | wgpu::CurrentSurfaceTexture::Validation => Acquired::Skip,
        }
    }
}
