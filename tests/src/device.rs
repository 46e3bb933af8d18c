//! The device that all tests of a program draw with, and where it may differ from an exact rasterizer and from
//! another pipeline of its own. What is said here of graphics processors was measured on an NVIDIA H100.

use std::sync::OnceLock;

use glam::DVec3;
use lumbre_render::Gpu;

/// Returns the device.
///
/// # Panics
/// Without a driver, with a message on what to install.
pub fn gpu() -> &'static Gpu {
    static GPU: OnceLock<Gpu> = OnceLock::new();
    GPU.get_or_init(|| Gpu::headless().unwrap_or_else(|error| panic!("{error}")))
}

/// Returns how many bits the device's rasterizer keeps of a vertex's place within a pixel, or `None` if it
/// interpolates between the places that the vertex shader returned, as llvmpipe does.
///
/// Graphics processors move each vertex to the nearest of 256 places along each axis of a pixel (eight bits: what
/// Direct3D 11.3 requires in section 3.4.1, and what all desktop drivers report as Vulkan's
/// `subPixelPrecisionBits`) and interpolate between these. On a ball of 120 pixels, light differs by up to 1.7e-4
/// from that between the exact places, and by rounding alone from that between the moved ones.
pub fn subpixel_bits() -> Option<u32> {
    (!gpu().is_software()).then_some(8)
}

/// Returns how far each pixel of a frame may be from one in which the same surfaces lie where moved corners
/// ([`subpixel_bits`]) do not take them: half of such a step along both axes, at most 0.71 of it, times twice how much
/// the frame changes from the pixel to those beside it, since it may change faster in between. The frame is `width`
/// pixels wide.
pub fn apart_by_moved_corners(frame: &[DVec3], width: usize) -> Vec<f64> {
    let Some(bits) = subpixel_bits() else { return vec![0.0; frame.len()] };
    let step = 1.42 / f64::from(1_u32 << bits);
    let height = frame.len() / width;
    let change = |at: usize| {
        let (x, y) = (at % width, at / width);
        let beside = (y.saturating_sub(1)..height.min(y + 2))
            .flat_map(|y| (x.saturating_sub(1)..width.min(x + 2)).map(move |x| y * width + x));
        beside.map(|beside| (frame[beside] - frame[at]).abs().max_element()).fold(0.0, f64::max)
    };
    (0..frame.len()).map(|at| step * change(at)).collect()
}

/// Returns the number of pixels that a comparison with the twin must at least have, where an exact rasterizer leaves
/// `pixels`. Where corners are moved, some triangles are left out because rounding decides which way
/// (`TwinFrame::uncertain`).
pub fn least_compared(pixels: usize) -> usize {
    if subpixel_bits().is_some() { pixels / 2 } else { pixels }
}

/// Returns how much a texture's filter may be off, relative to how much light changes from texel to texel: graphics
/// processors compute its weights with eight bits, so that two places that differ by rounding may be a step apart.
pub fn filter_step() -> f64 {
    if gpu().is_software() { 0.0 } else { 1.0 / 256.0 }
}

/// Returns how far two pipelines may be apart that compute the same expressions. A software rasterizer gives the
/// same bits. Compilers of graphics processors contract products and sums as each pipeline allows, which WGSL
/// permits (section 15.7.4), so that each operation may be rounded once less.
pub fn apart_between_pipelines() -> f64 {
    if gpu().is_software() { 0.0 } else { 1e-5 }
}

/// Tells whether two frames are the same as far as two pipelines can draw the same ([`apart_between_pipelines`],
/// relative to values above 1).
///
/// # Panics
/// If the frames differ in size.
pub fn same_by_another_pipeline(got: &[DVec3], expected: &[DVec3]) -> bool {
    assert_eq!(got.len(), expected.len(), "frames of different sizes");
    let bound = apart_between_pipelines();
    let same = |(got, expected): (&DVec3, &DVec3)| {
        let limit = DVec3::splat(bound * expected.max_element().max(1.0));
        got == expected || (*got - *expected).abs().cmple(limit).all()
    };
    got.iter().zip(expected).all(same)
}
