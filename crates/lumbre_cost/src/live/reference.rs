//! Compares the view with its reference from time to time: both are drawn between frames of the window, and
//! compared on a thread of their own.

use std::sync::mpsc::{Receiver, TryRecvError, channel};
use std::thread;
use std::time::{Duration, Instant};

use bevy_ecs::prelude::*;
use glam::{DVec3, Vec4};
use lumbre_render::{FrameOptions, RenderError};
use lumbre_scene::{ActiveCamera, Camera};

use super::side_view::SideView;
use crate::picture::{Picture, compared_at};
use crate::tune::{Choices, DrawSettings};
use crate::{ErrorOf, ErrorOver};

/// Drawing and comparing may take at most one part in this many of the time.
const SHARE: u32 = 4;
/// Shortest pause between two comparisons.
const MIN_PAUSE: Duration = Duration::from_millis(500);

/// A reference picture, and the difference of a frame from it.
#[derive(Clone, Debug, PartialEq)]
pub struct Beside {
    /// Width and height in pixels.
    pub size: (u32, u32),
    /// The reference as displayed: red, green, blue, alpha, top row first.
    pub rgba: Vec<u8>,
    /// The difference of the frame from it.
    pub error: ErrorOf,
    /// The settings of the frame.
    pub settings: DrawSettings,
}

/// Draws references from time to time.
#[derive(Default)]
pub struct BesideReference {
    compared: Option<(Instant, Receiver<Option<Beside>>)>,
    due: Option<Instant>,
}

impl BesideReference {
    /// Makes the next call of [`update`](Self::update) draw a reference, whatever the time.
    pub fn hurry(&mut self) {
        self.due = None;
    }

    /// Draws the frame with these options and its reference, if it is time for it, and returns a comparison
    /// that has been completed since the last call. The caller must ensure that the World has a camera that
    /// sees something.
    ///
    /// # Errors
    /// As drawing a frame.
    pub fn update(
        &mut self,
        side: &mut SideView,
        world: &mut World,
        options: &FrameOptions,
    ) -> Result<Option<Beside>, RenderError> {
        let found = self.take();
        let begun = Instant::now();
        if self.compared.is_some() || self.due.is_some_and(|due| begun < due) {
            return Ok(found);
        }
        let best = Choices::of(world, options.exposure).with_format_of(world).reference();
        let exposure = options.exposure.unwrap_or_else(|| exposure_of(world, options));
        let reference = best.drawn(world, options, |world, options| side.radiance(world, options))?;
        let frame = side.radiance(world, options)?;
        let (size, settings) = (side.size(), DrawSettings::current(world, options));
        let (sender, receiver) = channel();
        let compare = move || {
            let found = beside(size, settings, [&reference, &frame], f64::from(exposure));
            // The receiver is gone if the window was closed.
            let _ = sender.send(found);
        };
        // If no thread can be started, there is no comparison this time.
        if thread::Builder::new().name("compare".to_owned()).spawn(compare).is_ok() {
            self.compared = Some((begun, receiver));
        }
        Ok(found)
    }

    fn take(&mut self) -> Option<Beside> {
        let (begun, receiver) = self.compared.as_ref()?;
        let found = match receiver.try_recv() {
            Err(TryRecvError::Empty) => return None,
            Ok(found) => found,
            Err(TryRecvError::Disconnected) => None,
        };
        self.due = Some(Instant::now() + MIN_PAUSE.max(begun.elapsed() * (SHARE - 1)));
        self.compared = None;
        found
    }
}

/// Returns the exposure factor of the camera that a frame is drawn from.
fn exposure_of(world: &mut World, options: &FrameOptions) -> f32 {
    let asked = options.camera.and_then(|camera| world.get::<Camera>(camera).copied());
    let mut active = world.query_filtered::<&Camera, With<ActiveCamera>>();
    asked.or_else(|| active.iter(world).next().copied()).map_or(1.0, |camera| camera.exposure)
}

fn beside(
    size: (u32, u32),
    settings: DrawSettings,
    [reference, frame]: [&[Vec4]; 2],
    exposure: f64,
) -> Option<Beside> {
    let picture = |pixels: &[Vec4]| Picture {
        width: size.0 as usize,
        radiance: pixels.iter().map(|pixel| pixel.truncate().as_dvec3()).collect(),
    };
    let (reference, frame) = (picture(reference), picture(frame));
    let error = compared_at(&reference, &frame, ErrorOver::Picture, exposure)?.error;
    let bytes = |pixel: DVec3| {
        let [red, green, blue] = (255.0 * pixel).round().to_array().map(|channel| channel as u8);
        [red, green, blue, u8::MAX]
    };
    let rgba = reference.shown(exposure).into_iter().flat_map(bytes).collect();
    Some(Beside { size, rgba, error, settings })
}
