//! Everything that lives and dies with a device: the surface, the renderer, the overlay's painter. Not the window, which outlives
//! devices.

use std::sync::Arc;

use anyhow::{Context, Result};
use bevy_ecs::world::World;
use lumbre_render::{
    Acquired, FrameOptions, FrameReport, Gpu, LightMeter, Metering, MissingPipelines, Offscreen,
    OffscreenFormat, RenderError, Renderer, WindowSurface,
};
use winit::event_loop::ActiveEventLoop;
use winit::window::Window;

use super::overlay_painter::OverlayPainter;

/// A device and what is on it.
pub struct Stage {
    window: Arc<Window>,
    gpu: Gpu,
    surface: WindowSurface,
    renderer: Renderer,
    painter: OverlayPainter,
    /// Paints into pictures that are kept, which have another format than the window.
    picture_painter: Option<OverlayPainter>,
    /// Written to see whether the device is there.
    probe: wgpu::Buffer,
    /// Made when it is first asked, and for the size of the window then.
    meter: Option<((u32, u32), LightMeter)>,
}

/// Texels in a row of the picture that is metered: enough for a mean.
const METER_WIDTH: u32 = 64;
/// Bytes of the probe: the least that may be written.
const PROBE_BYTES: wgpu::BufferSize = match wgpu::BufferSize::new(wgpu::COPY_BUFFER_ALIGNMENT) {
    Some(bytes) => bytes,
    None => wgpu::BufferSize::MIN,
};

/// A frame of the overlay, ready to paint.
pub struct OverlayFrame {
    /// What to paint.
    pub triangles: Vec<egui::ClippedPrimitive>,
    /// What changed since the last one.
    pub textures: egui::TexturesDelta,
    /// Pixels per point.
    pub scale: f32,
}

/// What became of a frame.
pub enum Shown {
    /// It is on its way to the screen.
    Frame(Box<FrameReport>),
    /// The window has no place for one at the moment.
    Nothing,
    /// The device is gone; all of the stage has to be made anew.
    DeviceLost,
}

impl Stage {
    /// Opens a device for a window. `pictures` says whether pictures will be taken.
    ///
    /// # Errors
    /// There is no device that can present to the window; the message says what to install.
    pub fn new(event_loop: &ActiveEventLoop, window: Arc<Window>, pictures: bool) -> Result<Self> {
        let display = Box::new(event_loop.owned_display_handle());
        let descriptor = wgpu::InstanceDescriptor::new_with_display_handle_from_env(display);
        let instance = wgpu::Instance::new(descriptor);
        let surface =
            instance.create_surface(window.clone()).context("the window gives no surface to draw on")?;
        let gpu = Gpu::for_surface(instance, &surface)?;
        let size = window.inner_size();
        let surface = WindowSurface::new(&gpu, surface, size.width, size.height)?;
        let renderer = Renderer::new(&gpu);
        let painter = OverlayPainter::new(&gpu, surface.format());
        let picture_painter =
            pictures.then(|| OverlayPainter::new(&gpu, OffscreenFormat::Rgba8.texture_format()));
        let probe = gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("probe"),
            size: PROBE_BYTES.get(),
            usage: wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        Ok(Self { window, gpu, surface, renderer, painter, picture_painter, probe, meter: None })
    }

    /// The device.
    pub fn gpu(&self) -> &Gpu {
        &self.gpu
    }

    /// Width and height of the surface in pixels; zero while minimised.
    pub fn size(&self) -> (u32, u32) {
        self.surface.size()
    }

    /// Follows the window's size.
    pub fn resize(&mut self, width: u32, height: u32) {
        self.surface.resize(&self.gpu, width, height);
    }

    /// Draws a frame and shows it.
    ///
    /// # Errors
    /// What the renderer cannot draw.
    pub fn show(
        &mut self,
        world: &mut World,
        options: &FrameOptions,
        overlay: OverlayFrame,
    ) -> Result<Shown> {
        let OverlayFrame { triangles, mut textures, scale } = overlay;
        let size = self.size();
        if !self.is_alive() {
            textures.clear();
            return Ok(Shown::DeviceLost);
        }
        self.painter.prepare(&self.gpu, triangles.clone(), &textures, size, scale);
        if let Some(painter) = &mut self.picture_painter {
            painter.prepare(&self.gpu, triangles, &textures, size, scale);
        }
        textures.clear();
        let frame = match self.surface.acquire(&self.gpu) {
            Acquired::Frame(frame) => frame,
            Acquired::Skip if self.gpu.is_lost() => return Ok(Shown::DeviceLost),
            Acquired::Skip => return Ok(Shown::Nothing),
            Acquired::Lost => {
                self.renew_surface()?;
                return Ok(Shown::Nothing);
            }
        };
        let painter = &self.painter;
        let drawn =
            self.renderer.render_with_overlay(world, &frame.target, options, |pass| painter.paint(pass));
        match drawn {
            Ok(report) => {
                self.window.pre_present_notify();
                frame.present(&self.gpu);
                Ok(Shown::Frame(Box::new(report)))
            }
            Err(RenderError::DeviceLost) => Ok(Shown::DeviceLost),
            Err(_) if self.gpu.is_lost() => Ok(Shown::DeviceLost),
            Err(error) => Err(error.into()),
        }
    }

    /// Meters the World as these options show it; nothing if no light is seen, or there is no device or no window to show it on.
    ///
    /// # Errors
    /// What the renderer cannot draw or read back.
    pub fn measure(&mut self, world: &mut World, options: &FrameOptions) -> Result<Option<Metering>> {
        let (width, height) = self.size();
        if width == 0 || height == 0 || !self.is_alive() {
            return Ok(None);
        }
        let meter = match self.meter.take().filter(|(size, _)| *size == (width, height)) {
            Some((_, meter)) => meter,
            None => LightMeter::new(&self.gpu, METER_WIDTH, f64::from(width) / f64::from(height))?,
        };
        let (_, meter) = self.meter.insert(((width, height), meter));
        match meter.measure(&self.gpu, &mut self.renderer, world, options) {
            Ok(metering) => Ok(metering),
            // The next frame makes another device.
            Err(_) if self.gpu.is_lost() => Ok(None),
            Err(error) => Err(error.into()),
        }
    }

    /// The frame as it was shown last, drawn once more into memory: width, height, RGBA bytes.
    ///
    /// # Errors
    /// What the renderer cannot draw or read back.
    pub fn picture(&mut self, world: &mut World, options: &FrameOptions) -> Result<(u32, u32, Vec<u8>)> {
        let (width, height) = self.size();
        let offscreen = Offscreen::new(&self.gpu, width, height, OffscreenFormat::Rgba8)?;
        let target = offscreen.target();
        // It shows all that the frame should.
        let options = &FrameOptions { missing_pipelines: MissingPipelines::Wait, ..options.clone() };
        match &self.picture_painter {
            Some(painter) => {
                self.renderer.render_with_overlay(world, &target, options, |pass| painter.paint(pass))?
            }
            None => self.renderer.render(world, &target, options)?,
        };
        Ok((width, height, offscreen.read_rgba8(&self.gpu)?))
    }

    /// Whether the device still takes data. egui's upload ends the program where it does not, so it is asked first.
    fn is_alive(&self) -> bool {
        // A lost device tells its callback when it is polled; an error of polling says the same.
        let polled = self.gpu.device.poll(wgpu::PollType::Poll).is_ok();
        polled
            && !self.gpu.is_lost()
            && self.gpu.queue.write_buffer_with(&self.probe, 0, PROBE_BYTES).is_some()
    }

    fn renew_surface(&mut self) -> Result<()> {
        let surface = self.gpu.instance.create_surface(self.window.clone())?;
        let size = self.window.inner_size();
        self.surface = WindowSurface::new(&self.gpu, surface, size.width, size.height)?;
        Ok(())
    }
}
