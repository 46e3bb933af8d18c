//! Everything that belongs to a device: the surface, the renderer and the overlay's painter. The window is in
//! `app` and outlives devices.

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

/// A device and what was created on it.
pub struct Stage {
    window: Arc<Window>,
    gpu: Gpu,
    surface: WindowSurface,
    renderer: Renderer,
    painter: OverlayPainter,
    /// Paints into pictures that are saved, whose format differs from the window's.
    picture_painter: Option<OverlayPainter>,
    /// Written to test whether the device still works.
    probe: wgpu::Buffer,
    /// Created when first used, with the size of the window at that time.
    meter: Option<((u32, u32), LightMeter)>,
}

/// Width of the picture that is metered, in texels; enough for a mean.
const METER_WIDTH: u32 = 64;
/// Size of the probe in bytes: the smallest write that is allowed.
const PROBE_BYTES: wgpu::BufferSize = match wgpu::BufferSize::new(wgpu::COPY_BUFFER_ALIGNMENT) {
    Some(bytes) => bytes,
    None => wgpu::BufferSize::MIN,
};

/// The overlay of one frame, ready to paint.
pub struct OverlayFrame {
    /// What to paint.
    pub triangles: Vec<egui::ClippedPrimitive>,
    /// The textures that changed since the last frame.
    pub textures: egui::TexturesDelta,
    /// Physical pixels per logical pixel.
    pub scale: f32,
}

/// The result of showing a frame.
pub enum Shown {
    /// The frame was submitted for presentation.
    Frame(Box<FrameReport>),
    /// The window cannot take a frame at the moment.
    Nothing,
    /// The device is lost; the whole stage has to be created again.
    DeviceLost,
}

impl Stage {
    /// Opens a device for a window. `pictures` says whether [`picture`](Self::picture) will be used.
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

    /// Returns the device.
    pub fn gpu(&self) -> &Gpu {
        &self.gpu
    }

    /// Returns the size of the surface in pixels; zero while minimised.
    pub fn size(&self) -> (u32, u32) {
        self.surface.size()
    }

    /// Resizes the surface to the window's size.
    pub fn resize(&mut self, width: u32, height: u32) {
        self.surface.resize(&self.gpu, width, height);
    }

    /// Draws a frame with its overlay and presents it.
    ///
    /// # Errors
    /// The renderer cannot draw the World.
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

    /// Meters the World as it is drawn with these options. Returns `None` if no light is visible, the device
    /// is lost or the window has no size.
    ///
    /// # Errors
    /// The renderer cannot draw the World, or the result cannot be read back.
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

    /// Draws the last frame again into memory, and returns its width, height and RGBA bytes.
    ///
    /// # Errors
    /// The renderer cannot draw the World, or the result cannot be read back.
    pub fn picture(&mut self, world: &mut World, options: &FrameOptions) -> Result<(u32, u32, Vec<u8>)> {
        let (width, height) = self.size();
        let offscreen = Offscreen::new(&self.gpu, width, height, OffscreenFormat::Rgba8)?;
        let target = offscreen.target();
        // The picture is complete: it waits for pipelines that a frame would skip while they are compiled.
        let options = &FrameOptions { missing_pipelines: MissingPipelines::Wait, ..options.clone() };
        match &self.picture_painter {
            Some(painter) => {
                self.renderer.render_with_overlay(world, &target, options, |pass| painter.paint(pass))?
            }
            None => self.renderer.render(world, &target, options)?,
        };
        Ok((width, height, offscreen.read_rgba8(&self.gpu)?))
    }

    /// Returns true if the device still accepts data. It is tested before egui uploads its own, which would
    /// abort the program otherwise.
    fn is_alive(&self) -> bool {
        // Polling runs the callback of a lost device; an error of polling means the same.
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
