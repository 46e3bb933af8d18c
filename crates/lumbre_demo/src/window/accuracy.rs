//! The measurements of the view that the window shows: its error against the most accurate rendering, the
//! cost of its lights, and the Pareto-optimal settings. They are laid out in `overlay_accuracy`; the
//! measuring itself is in `lumbre_cost`.

use std::time::{Duration, Instant};

use bevy_ecs::prelude::*;
use lumbre_cost::{
    Beside, BesideReference, DrawSettings, LightCost, LightCosts, SideView, ViewFront, ViewWalk,
};
use lumbre_render::{FrameOptions, Gpu, RenderError};
use lumbre_scene::{ActiveCamera, GlobalTransform, SceneSettings};

use crate::{Game, ViewSettings};

/// Time for measured frames between two shown frames; short enough for the window to follow the mouse.
const BETWEEN_FRAMES: Duration = Duration::from_millis(40);

/// The measurements and their results.
#[derive(Default)]
pub struct Accuracy {
    /// Whether the reference is shown beside the frame.
    is_shown: bool,
    side: Option<SideView>,
    reference: BesideReference,
    beside: Option<Beside>,
    work: Work,
    lights: Vec<LightCost>,
    front: Option<ViewFront>,
    /// The camera's transform when the front was measured.
    measured_from: Option<GlobalTransform>,
}

/// What is being measured.
#[derive(Default)]
enum Work {
    #[default]
    Nothing,
    /// Requested; starts with the next frame.
    Asked,
    Lights(LightCosts),
    Settings(Box<ViewWalk>),
}

/// The results, for the overlay.
#[derive(Clone, Debug, Default)]
pub struct AccuracyFacts {
    /// Whether the reference is shown beside the frame.
    pub is_shown: bool,
    /// Relative RMSE and FLIP of the frame against the reference, once they are known.
    pub error: Option<(f64, Option<f64>)>,
    /// What is being measured, and the fraction of it that is done, 0 to 1.
    pub progress: Option<(&'static str, f64)>,
    /// The cost of the lights, the most expensive first.
    pub lights: Vec<LightCost>,
    /// The Pareto-optimal settings.
    pub front: Option<ViewFront>,
    /// The current settings.
    pub settings: Option<DrawSettings>,
    /// Whether the camera has moved since the front was measured.
    pub is_elsewhere: bool,
}

impl Accuracy {
    /// Shows or hides the reference beside the frame.
    pub fn toggle(&mut self) {
        self.is_shown = !self.is_shown;
        self.beside = None;
        self.reference.hurry();
    }

    /// Returns true if the reference is shown beside the frame.
    pub fn is_shown(&self) -> bool {
        self.is_shown
    }

    /// Starts to measure what lights and settings cost.
    pub fn measure(&mut self) {
        self.is_shown = true;
        self.work = Work::Asked;
    }

    /// Returns true while a measurement runs, during which nothing may move.
    pub fn is_measuring(&self) -> bool {
        !matches!(self.work, Work::Nothing)
    }

    /// Returns true if everything that was requested is available for a frame with these options.
    pub fn is_at_rest(&self, game: &Game, options: &FrameOptions) -> bool {
        let is_compared = || self.compared(&DrawSettings::current(&game.world, options)).is_some();
        !self.is_measuring() && (!self.is_shown || is_compared())
    }

    /// Returns the reference, if it was compared with a frame of these settings.
    fn compared(&self, settings: &DrawSettings) -> Option<&Beside> {
        self.beside.as_ref().filter(|beside| beside.settings == *settings)
    }

    /// Cancels the measurement; returns false if there is none.
    pub fn cancel(&mut self) -> bool {
        let was_measuring = self.is_measuring();
        self.work = Work::Nothing;
        was_measuring
    }

    /// Drops what was drawn on a device that is lost.
    pub fn forget_device(&mut self) {
        self.cancel();
        (self.side, self.beside) = (None, None);
        self.reference = BesideReference::default();
    }

    /// Drops the results for a file that is no longer shown.
    pub fn forget_file(&mut self) {
        *self = Self { is_shown: self.is_shown, ..Self::default() };
    }

    /// Returns the next better or next cheaper settings on the front, if there are any.
    pub fn next(&self, game: &Game, options: &FrameOptions, better: bool) -> Option<DrawSettings> {
        let front = self.front.as_ref()?;
        let settings = DrawSettings::current(&game.world, options);
        let from = AccuracyFacts::priced(front, &settings)?;
        let next = if better { front.next_better(from) } else { front.next_cheaper(from) };
        next.and_then(|place| front.ways.get(place)).map(|way| way.settings)
    }

    /// Draws what is due for a frame with these options, into pictures of its size. Returns each new
    /// reference picture once.
    ///
    /// # Errors
    /// As for drawing a frame.
    pub fn update(
        &mut self,
        gpu: &Gpu,
        size: (u32, u32),
        world: &mut World,
        options: &FrameOptions,
    ) -> Result<Option<&Beside>, RenderError> {
        if size.0 == 0 || size.1 == 0 {
            return Ok(None);
        }
        if !self.is_shown && !self.is_measuring() {
            self.side = None;
            return Ok(None);
        }
        let side = match self.side.take().filter(|side| side.size() == size) {
            Some(side) => side,
            None => {
                self.reference.hurry();
                // A measurement at another size is as invalid as one from another place, so it starts again.
                if self.is_measuring() {
                    self.work = Work::Asked;
                }
                SideView::new(gpu, size)?
            }
        };
        if self.is_measuring() {
            let side = self.side.insert(side);
            let begun = Instant::now();
            while begun.elapsed() < BETWEEN_FRAMES {
                self.work = match std::mem::take(&mut self.work) {
                    Work::Nothing => break,
                    Work::Asked => Work::Lights(LightCosts::begin(side, world, options)?),
                    Work::Lights(mut lights) => match lights.step(side, world, options)? {
                        None => Work::Lights(lights),
                        Some(found) => {
                            self.lights = found;
                            Work::Settings(Box::new(ViewWalk::begin(side, world, options)?))
                        }
                    },
                    Work::Settings(mut walk) => match walk.step(side, world, options)? {
                        None => Work::Settings(walk),
                        front => {
                            self.front = front;
                            self.measured_from = camera_place(world);
                            Work::Nothing
                        }
                    },
                };
            }
            return Ok(None);
        }
        // When the settings change, the comparison does not wait for its next turn.
        if self.beside.is_some() && self.compared(&DrawSettings::current(world, options)).is_none() {
            self.reference.hurry();
        }
        let side = self.side.insert(side);
        let found = self.reference.update(side, world, options)?.filter(|found| found.size == size);
        let is_new = found.is_some();
        if is_new {
            self.beside = found;
        }
        Ok(self.beside.as_ref().filter(|_| is_new))
    }

    /// Returns the results for a frame with these options.
    pub fn facts(&self, game: &mut Game, options: &FrameOptions) -> AccuracyFacts {
        let settings = DrawSettings::current(&game.world, options);
        AccuracyFacts {
            is_shown: self.is_shown,
            error: self.compared(&settings).map(|beside| (beside.error.relative_rmse, beside.error.flip)),
            progress: match &self.work {
                Work::Nothing => None,
                Work::Asked => Some(("what lights cost", 0.0)),
                Work::Lights(lights) => Some(("what lights cost", lights.fraction())),
                Work::Settings(walk) => Some(("what settings cost", walk.fraction())),
            },
            lights: self.lights.clone(),
            front: self.front.clone(),
            settings: Some(settings),
            is_elsewhere: self.front.is_some() && camera_place(&mut game.world) != self.measured_from,
        }
    }
}

impl AccuracyFacts {
    /// Returns the price of settings, if they are on the front or were in use when it was measured.
    pub fn priced<'a>(front: &'a ViewFront, settings: &DrawSettings) -> Option<&'a lumbre_cost::Priced> {
        let ways = front.ways.iter().chain([&front.now]);
        ways.into_iter().find(|way| way.settings == *settings)
    }
}

/// Applies settings to a game; they replace the choices made by keys.
pub fn choose(game: &mut Game, settings: &DrawSettings) {
    game.view = ViewSettings {
        shading: Some(settings.shading),
        shadows: settings.shadows,
        multisample: settings.multisample,
        ..game.view
    };
    let mut scene = game.world.get_resource_or_insert_with(SceneSettings::default);
    scene.frame = settings.frame();
}

/// Returns the transform of the active camera.
fn camera_place(world: &mut World) -> Option<GlobalTransform> {
    world.query_filtered::<&GlobalTransform, With<ActiveCamera>>().iter(world).next().copied()
}
