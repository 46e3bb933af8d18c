//! One device for all tests of this binary, and frames drawn on it with the finite-value probe on.

use std::sync::{Arc, Mutex, MutexGuard, Once, PoisonError};

use bevy_ecs::world::World;
use glam::DVec3;
use lumbre_render::{
    Accounting, Display, FrameOptions, FrameReport, Gpu, Offscreen, OffscreenFormat, RenderError, Renderer,
};
use lumbre_tests::device;

/// Validation errors of wgpu that no error scope caught.
static COMPLAINTS: Mutex<Vec<String>> = Mutex::new(Vec::new());

/// Returns the shared device, whose validation errors are kept. Without a driver the tests fail with a message on
/// what to install.
pub fn gpu() -> &'static Gpu {
    static LISTENS: Once = Once::new();
    let gpu = device::gpu();
    LISTENS.call_once(|| {
        gpu.device.on_uncaptured_error(Arc::new(|error| {
            COMPLAINTS.lock().unwrap_or_else(PoisonError::into_inner).push(format!("{error}"));
        }));
    });
    gpu
}

/// Options for unchanged radiance in full precision, with the probe on.
pub fn linear() -> FrameOptions {
    FrameOptions { display: Display::Linear, full_precision: true, probe: true, ..FrameOptions::default() }
}

/// Draws a frame of linear floats; fails if any pass left a value that is not finite.
pub fn draw(world: &mut World, width: u32, height: u32, options: &FrameOptions) -> (Vec<DVec3>, FrameReport) {
    Canvas::new(width, height).draw(world, options)
}

/// Draws a frame with the default display: half floats, a tone curve, eight bits. Returns RGBA, top row first;
/// fails as [`draw`] does.
#[allow(dead_code, reason = "shared with the hard cases, which show what overflows")]
pub fn shown(world: &mut World, width: u32, height: u32, options: &FrameOptions) -> Vec<u8> {
    let mut canvas = Canvas::of(width, height, OffscreenFormat::Rgba8);
    canvas.probed(world, options);
    canvas.frame.read_rgba8(gpu()).unwrap()
}

/// One renderer and one target for several frames, so that what is kept from frame to frame is tested too.
pub struct Canvas {
    renderer: Renderer,
    frame: Offscreen,
}

impl Canvas {
    /// Creates a new renderer and a target of linear floats.
    pub fn new(width: u32, height: u32) -> Self {
        Self::of(width, height, OffscreenFormat::LinearFloat)
    }

    fn of(width: u32, height: u32, format: OffscreenFormat) -> Self {
        let gpu = gpu();
        let frame = Offscreen::new(gpu, width, height, format).unwrap();
        Self { renderer: Renderer::new(gpu), frame }
    }

    /// Draws a frame; fails if any pass leaves a value that is not finite, or if wgpu's validation reports an
    /// error.
    pub fn draw(&mut self, world: &mut World, options: &FrameOptions) -> (Vec<DVec3>, FrameReport) {
        let report = self.probed(world, options);
        let pixels = self.frame.read_linear(gpu()).unwrap();
        (pixels.iter().map(|pixel| pixel.truncate().as_dvec3()).collect(), report)
    }

    /// Returns the accounting of the last frame, which must have been measured.
    #[allow(dead_code, reason = "shared with the hard cases, which count nothing")]
    pub fn accounting(&self) -> &Accounting {
        self.renderer.accounting().expect("the frame was measured")
    }

    /// Draws a frame with the probe on, regardless of the options. Every frame of a test goes through here, which
    /// the hard cases check.
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

    /// Expects that a frame cannot be drawn, and returns the error.
    pub fn refuse(&mut self, world: &mut World, options: &FrameOptions) -> RenderError {
        let _guard = one_at_a_time();
        match self.renderer.render(world, &self.frame.target(), options) {
            Err(error) => error,
            Ok(_) => panic!("a frame was drawn"),
        }
    }
}

/// Serializes the tests: the software rasterizer uses every core anyway, and each test's time is then its own. The
/// lock can still be used after a test that held it failed.
fn one_at_a_time() -> MutexGuard<'static, ()> {
    static ONE: Mutex<()> = Mutex::new(());
    ONE.lock().unwrap_or_else(PoisonError::into_inner)
}
