//! Compiles shaders before the frames that need them are drawn.
//!
//! A software rasterizer compiles a shader when it first draws with it, on one thread, which takes longer
//! than many frames. But it stores the code on disk (Mesa's shader cache), where all devices of the machine
//! find it. So while the frames are drawn from the first to the last, a second thread draws the same frames
//! on a device of its own, from the last to the first, until the two meet. Nothing is timed meanwhile.

use std::sync::atomic::{AtomicBool, Ordering};

use lumbre_render::{Gpu, Offscreen, OffscreenFormat, RenderError, Renderer};

use crate::frame::{Frame, counting_options, picture_options};

/// The drawings of a frame: its picture in full precision, the same with its light evaluations counted, and
/// the frame as it is timed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Drawing {
    Picture,
    Counted,
    Timed,
}

/// Which drawings of each frame have been started, by either thread.
#[derive(Debug)]
pub struct Begun(Vec<[AtomicBool; 3]>);

impl Begun {
    /// Returns the state for this many frames, with nothing started.
    pub fn none_of(frames: usize) -> Self {
        Self((0..frames).map(|_| Default::default()).collect())
    }

    /// Marks a drawing of a frame as started. Returns true if it was not started before.
    pub fn begin(&self, frame: usize, drawing: Drawing) -> bool {
        !self.0[frame][drawing as usize].swap(true, Ordering::Relaxed)
    }
}

/// Returns a device for compiling ahead, if the adapter compiles shaders when it draws, there are at least
/// two cores, and devices do not block each other, as those of OpenGL do.
pub fn device_ahead(gpu: &Gpu) -> Option<Gpu> {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    if !gpu.is_software() || !gpu.has_independent_devices() || cores < 2 {
        return None;
    }
    // Without a second device, shaders are compiled when they are needed.
    gpu.another().inspect_err(|error| tracing::debug!("nothing is compiled ahead: {error}")).ok()
}

/// Makes the drawings that have not been started, from the last frame to the first, until `end` is set.
pub fn compile_ahead(
    gpu: &Gpu,
    size: (u32, u32),
    frames: &[Frame],
    drawings: &[Drawing],
    begun: &Begun,
    end: &AtomicBool,
) {
    if let Err(error) = draw(gpu, size, frames, drawings, begun, end) {
        // The thread that draws the frame for its result gets the same error, and reports it.
        tracing::debug!("nothing more is compiled ahead: {error}");
    }
}

fn draw(
    gpu: &Gpu,
    (width, height): (u32, u32),
    frames: &[Frame],
    drawings: &[Drawing],
    begun: &Begun,
    end: &AtomicBool,
) -> Result<(), RenderError> {
    let mut renderer = Renderer::new(gpu);
    let picture = Offscreen::new(gpu, width, height, OffscreenFormat::LinearFloat)?;
    let timed = Offscreen::new(gpu, width, height, OffscreenFormat::Rgba8)?;
    for (number, frame) in frames.iter().enumerate().rev() {
        for &drawing in drawings {
            if end.load(Ordering::Relaxed) {
                return Ok(());
            }
            if !begun.begin(number, drawing) {
                continue;
            }
            let (target, options) = match drawing {
                Drawing::Picture => (&picture, picture_options(&frame.options)),
                Drawing::Counted => (&picture, counting_options(&frame.options)),
                Drawing::Timed => (&timed, frame.options.clone()),
            };
            renderer.render(&mut frame.world(), &target.target(), &options)?;
            // The World is available to the other thread while this is compiled.
            renderer.wait()?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use lumbre_render::FrameOptions;
    use lumbre_scene::update_transforms;

    use super::*;
    use crate::scenes::{Air, room};

    #[test]
    fn everything_that_nobody_draws_is_drawn_until_the_end() {
        let gpu = Gpu::headless().unwrap();
        let frames = [Air::Clear, Air::Hazy].map(|air| {
            let mut world = room(air);
            update_transforms(&mut world);
            Frame::new(world, FrameOptions::default())
        });
        let what_is_left = |begun: &Begun| {
            let drawings =
                [(0, Drawing::Picture), (0, Drawing::Timed), (1, Drawing::Picture), (1, Drawing::Timed)];
            drawings.into_iter().filter(|(frame, drawing)| begun.begin(*frame, *drawing)).count()
        };
        let draw = |drawings: &[Drawing], end: bool| {
            let begun = Begun::none_of(2);
            begun.begin(0, Drawing::Timed);
            draw(&gpu, (32, 18), &frames, drawings, &begun, &AtomicBool::new(end)).unwrap();
            what_is_left(&begun)
        };
        let both = [Drawing::Picture, Drawing::Timed];
        assert_eq!((draw(&both, false), draw(&both, true), draw(&both[..1], false)), (0, 3, 1));
    }

    #[test]
    fn each_drawing_is_begun_once() {
        let begun = Begun::none_of(2);
        assert!(begun.begin(1, Drawing::Picture));
        assert!(!begun.begin(1, Drawing::Picture));
        assert!(begun.begin(1, Drawing::Timed) && begun.begin(0, Drawing::Picture));
    }
}
