//! One device for all tests of this binary, and frames drawn on it with the finite-value probe on.

use std::sync::{Mutex, OnceLock};

use bevy_ecs::world::World;
use glam::DVec3;
use lumbre_render::{Display, FrameOptions, FrameReport, Gpu, Offscreen, OffscreenFormat, Renderer};

/// The device. Without a driver the tests fail, and say what to install.
pub fn gpu() -> &'static Gpu {
    static GPU: OnceLock<Gpu> = OnceLock::new();
    GPU.get_or_init(|| match Gpu::headless() {
        Ok(gpu) => gpu,
        Err(error) => panic!("{error}"),
    })
}

/// Options that keep radiance as it is, in full precision, probed.
pub fn linear() -> FrameOptions {
    FrameOptions { display: Display::Linear, full_precision: true, probe: true, ..FrameOptions::default() }
}

/// Draws a frame of linear floats; fails if any pass left a value that is not finite.
pub fn draw(world: &mut World, width: u32, height: u32, options: &FrameOptions) -> (Vec<DVec3>, FrameReport) {
    // One at a time: the software rasterizer uses every core anyway, and a test's time is then its own.
    static ONE: Mutex<()> = Mutex::new(());
    let _guard = ONE.lock();
    let gpu = gpu();
    let mut renderer = Renderer::new(gpu);
    let frame = Offscreen::new(gpu, width, height, OffscreenFormat::LinearFloat).unwrap();
    let report = renderer.render(world, &frame.target(), options).unwrap();
    if options.probe {
        let measured = renderer.wait().unwrap().expect("a frame was drawn");
        assert!(measured.probed);
        assert_eq!(measured.non_finite, None);
    }
    let pixels = frame.read_linear(gpu).unwrap();
    (pixels.iter().map(|pixel| pixel.truncate().as_dvec3()).collect(), report)
}
