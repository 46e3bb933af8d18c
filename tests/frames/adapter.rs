//! One device for all tests of this binary, and frames drawn on it with the finite-value probe on.

use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};

use bevy_ecs::world::World;
use glam::DVec3;
use lumbre_render::{
    Accounting, Display, FrameOptions, FrameReport, Gpu, Offscreen, OffscreenFormat, RenderError, Renderer,
};

/// What wgpu's validation complained about, and nobody caught.
static COMPLAINTS: Mutex<Vec<String>> = Mutex::new(Vec::new());

/// The device. Without a driver the tests fail, and say what to install.
pub fn gpu() -> &'static Gpu {
    static GPU: OnceLock<Gpu> = OnceLock::new();
    GPU.get_or_init(|| match Gpu::headless() {
        Ok(gpu) => {
            gpu.device.on_uncaptured_error(Arc::new(|error| {
                COMPLAINTS.lock().unwrap_or_else(PoisonError::into_inner).push(format!("{error}"));
            }));
            gpu
        }
        Err(error) => panic!("{error}"),
    })
}

/// Options that keep radiance as it is, in full precision, probed.
pub fn linear() -> FrameOptions {
    FrameOptions { display: Display::Linear, full_precision: true, probe: true, ..FrameOptions::default() }
}

/// Draws a frame of linear floats; fails if any pass left a value that is not finite.
pub fn draw(world: &mut World, width: u32, height: u32, options: &FrameOptions) -> (Vec<DVec3>, FrameReport) {
    Canvas::new(width, height).draw(world, options)
}

/// Draws a frame as people see it: half floats, the display's curve, eight bits. RGBA, top row first; fails as [`draw`] does.
#[allow(dead_code, reason = "shared with the hard cases, which show what overflows")]
pub fn shown(world: &mut World, width: u32, height: u32, options: &FrameOptions) -> Vec<u8> {
    let mut canvas = Canvas::of(width, height, OffscreenFormat::Rgba8);
    canvas.probed(world, options);
    canvas.frame.read_rgba8(gpu()).unwrap()
}

/// One renderer and one target for several frames, so that what it keeps from frame to frame is under test too.
pub struct Canvas {
    renderer: Renderer,
    frame: Offscreen,
}

impl Canvas {
    /// A fresh renderer and a target of linear floats.
    pub fn new(width: u32, height: u32) -> Self {
        Self::of(width, height, OffscreenFormat::LinearFloat)
    }

    fn of(width: u32, height: u32, format: OffscreenFormat) -> Self {
        let gpu = gpu();
        let frame = Offscreen::new(gpu, width, height, format).unwrap();
        Self { renderer: Renderer::new(gpu), frame }
    }

    /// Draws a frame; fails if any pass left a value that is not finite, or if wgpu's validation complained.
    pub fn draw(&mut self, world: &mut World, options: &FrameOptions) -> (Vec<DVec3>, FrameReport) {
        let report = self.probed(world, options);
        let pixels = self.frame.read_linear(gpu()).unwrap();
        (pixels.iter().map(|pixel| pixel.truncate().as_dvec3()).collect(), report)
    }

    /// The account of the last frame, if it was measured.
    #[allow(dead_code, reason = "shared with the hard cases, which count nothing")]
    pub fn accounting(&self) -> &Accounting {
        self.renderer.accounting().expect("the frame was measured")
    }

    /// Every frame of a test goes through here, whatever its options say: the hard cases look that there is no other way.
    fn probed(&mut self, world: &mut World, options: &FrameOptions) -> FrameReport {
        let _guard = one_at_a_time();
        let options = FrameOptions { probe: true, ..options.clone() };
        let report = self.renderer.render(world, &self.frame.target(), &options).unwrap();
        let measured = self.renderer.wait().unwrap().expect("a frame was drawn");
        assert!(measured.probed, "the probe looked at nothing");
        assert_eq!(measured.non_finite, None);
        let complaints = std::mem::take(&mut *COMPLAINTS.lock().unwrap_or_else(PoisonError::into_inner));
        assert!(complaints.is_empty(), "wgpu complains: {complaints:#?}");
        report
    }

    /// Tries to draw what cannot be drawn.
    pub fn refuse(&mut self, world: &mut World, options: &FrameOptions) -> RenderError {
        let _guard = one_at_a_time();
        match self.renderer.render(world, &self.frame.target(), options) {
            Err(error) => error,
            Ok(_) => panic!("a frame was drawn"),
        }
    }
}

/// The software rasterizer uses every core anyway, and a test's time is then its own. Held by a test that failed, it still serves.
fn one_at_a_time() -> MutexGuard<'static, ()> {
    static ONE: Mutex<()> = Mutex::new(());
    ONE.lock().unwrap_or_else(PoisonError::into_inner)
}
