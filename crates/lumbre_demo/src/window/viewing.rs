//! The state of the window's file apart from drawing: the file that is open, one that is being opened, the
//! running bake, and the exposure. Events are handled in `app`, and drawing in `stage`.

use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, TryRecvError, channel};
use std::thread;
use std::time::Duration;

use anyhow::Result;
use lumbre_optics::Light;
use lumbre_render::FrameOptions;

use super::stage::Stage;
use crate::opened::CLIPPED;
use crate::{
    Action, Adaptation, BackgroundBake, BakeNews, BakeStatus, Exposure, GameError, OpenOptions, Opened,
    Recording, Viewpoint,
};

/// Time between two measurements of the exposure.
const METER_EVERY: Duration = Duration::from_millis(250);

/// A message that is shown until the next one.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Message {
    /// The text.
    pub text: String,
    /// Whether it reports an error.
    pub is_error: bool,
}

/// How the exposure is chosen.
#[derive(Clone, Copy, Debug)]
enum Metered {
    /// By the camera, or by a given factor.
    Not(Option<f32>),
    /// By the camera, unless the first measurement clips too much.
    IfNeeded,
    /// By metering.
    Always(Adaptation),
}

impl Metered {
    fn of(opened: &Opened) -> Self {
        match opened.exposure {
            Exposure::Factor(factor) => Self::Not(Some(factor)),
            Exposure::Auto => Self::Always(Adaptation::default()),
            Exposure::AsNeeded if opened.is_photometric => Self::IfNeeded,
            Exposure::AsNeeded => Self::Not(None),
        }
    }
}

/// Facts about the light that was baked in this session.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightFacts {
    /// The name of the pass that it comes from.
    pub pass: &'static str,
    /// Estimated relative error.
    pub error: f64,
    /// Whether a uniform sky was added to the file.
    pub under_a_sky: bool,
    /// Whether it comes from the last pass.
    pub is_final: bool,
    /// Number of surfaces with a lightmap.
    pub surfaces: usize,
}

/// A file in the window, and the work on it.
pub struct Viewing {
    /// The file.
    pub opened: Opened,
    options: OpenOptions,
    opening: Option<(PathBuf, Receiver<Result<Opened, GameError>>)>,
    bake: Option<BackgroundBake>,
    /// Whether the bake is written as soon as it is complete.
    keeps_bake: bool,
    light: Option<LightFacts>,
    metered: Metered,
    since_metered: Option<Duration>,
    message: Option<Message>,
    /// The recording of a file that has since been replaced.
    recording: Option<Recording>,
}

impl Viewing {
    /// Creates the state of an open file; `options` apply to files that are opened later.
    pub fn new(opened: Opened, options: OpenOptions) -> Self {
        let metered = Metered::of(&opened);
        Self {
            opened,
            options,
            opening: None,
            bake: None,
            keeps_bake: false,
            light: None,
            metered,
            since_metered: None,
            message: None,
            recording: None,
        }
    }

    /// Does what [`Viewing::new`] does, and bakes the file at once and writes it when the bake is complete.
    pub fn baking(opened: Opened, options: OpenOptions) -> Self {
        let mut viewing = Self::new(opened, options);
        viewing.toggle_bake();
        viewing.keeps_bake = true;
        viewing
    }

    /// Returns the recording of the first file that was played.
    pub fn take_recording(&mut self) -> Option<Recording> {
        self.recording.take().or_else(|| self.opened.game.take_recording())
    }

    /// Starts to open another file. The current one stays until the new one is ready.
    pub fn open(&mut self, path: &Path) {
        let (sender, receiver) = channel();
        let (file, options) = (path.to_owned(), self.options.clone());
        let started = thread::Builder::new().name("open".to_owned()).spawn(move || {
            // The window may be closed, or may be opening another file.
            let _ = sender.send(Opened::open(&file, &options));
        });
        match started {
            Ok(_) => {
                self.say(format!("opening {} …", path.display()));
                self.opening = Some((path.to_owned(), receiver));
            }
            Err(error) => self.complain(format!(
                "{}: no thread can be started to open it: {error}; close other programs",
                path.display()
            )),
        }
    }

    /// Carries out a command.
    pub fn apply(&mut self, action: Action) {
        match action {
            Action::ToggleBake => self.toggle_bake(),
            Action::SaveBake => self.save_bake(),
            Action::ToggleAutoExposure => self.toggle_metering(),
            _ => {}
        }
        self.opened.game.apply(action);
        self.sync_default_lights();
    }

    /// Cancels the running bake; returns false if there is none.
    pub fn cancel(&mut self) -> bool {
        let baking = self.bake.as_ref().filter(|bake| bake.is_baking());
        baking.inspect(|bake| bake.cancel()).is_some()
    }

    /// Returns true if nothing is being opened, baked or written.
    pub fn is_at_rest(&self) -> bool {
        self.opening.is_none() && !self.bake.as_ref().is_some_and(BackgroundBake::is_running)
    }

    /// Takes over the results of other threads. Returns true if another file is shown now.
    pub fn update(&mut self, passed: Duration) -> bool {
        self.take_bake();
        if let Metered::Always(adaptation) = &mut self.metered {
            adaptation.step(passed.as_secs_f64());
        }
        if let Some(since) = &mut self.since_metered {
            *since += passed;
        }
        self.take_opened()
    }

    /// Measures the exposure if it is due.
    ///
    /// # Errors
    /// The renderer cannot draw the World.
    pub fn measure(&mut self, stage: &mut Stage, options: &FrameOptions) -> Result<()> {
        let is_due = self.since_metered.is_none_or(|since| since >= METER_EVERY);
        if matches!(self.metered, Metered::Not(_)) || !is_due {
            return Ok(());
        }
        self.since_metered = Some(Duration::ZERO);
        let metering = stage.measure(&mut self.opened.game.world, options)?;
        match (&mut self.metered, metering) {
            (Metered::IfNeeded, Some(metering)) if metering.clipped > CLIPPED => {
                let mut adaptation = Adaptation::default();
                adaptation.metered(metering.exposure);
                self.metered = Metered::Always(adaptation);
            }
            (Metered::IfNeeded, Some(_)) => self.metered = Metered::Not(None),
            (Metered::Always(adaptation), Some(metering)) => adaptation.metered(metering.exposure),
            _ => {}
        }
        Ok(())
    }

    /// Returns the exposure of the next frame, or `None` for the camera's.
    pub fn exposure(&self) -> Option<f32> {
        match &self.metered {
            Metered::Not(factor) => *factor,
            Metered::IfNeeded => None,
            Metered::Always(adaptation) => adaptation.exposure(),
        }
    }

    /// Returns true if the exposure adapts.
    pub fn adapts(&self) -> bool {
        matches!(self.metered, Metered::Always(_))
    }

    /// Returns the progress of the bake, if one runs.
    pub fn bake_status(&self) -> Option<&BakeStatus> {
        self.bake.as_ref()?.status()
    }

    /// Returns the light baked in this session, if it is shown.
    pub fn light(&self) -> Option<LightFacts> {
        self.light
    }

    /// Returns true if there is a bake that can be saved.
    pub fn can_save(&self) -> bool {
        self.bake.as_ref().is_some_and(BackgroundBake::can_be_saved)
    }

    /// Returns the latest message.
    pub fn message(&self) -> Option<&Message> {
        self.message.as_ref()
    }

    /// Shows a message that nothing can be measured while the bake runs.
    pub fn say_that_it_works(&mut self) {
        self.say("what settings cost can be measured when the bake has ended".to_owned());
    }

    fn say(&mut self, text: String) {
        self.message = Some(Message { text, is_error: false });
    }

    fn complain(&mut self, text: String) {
        tracing::warn!("{text}");
        self.message = Some(Message { text, is_error: true });
    }

    fn take_opened(&mut self) -> bool {
        let Some((path, receiver)) = &self.opening else { return false };
        let outcome = match receiver.try_recv() {
            Err(TryRecvError::Empty) => return false,
            Ok(outcome) => outcome.map_err(|error| error.to_string()),
            Err(TryRecvError::Disconnected) => Err(format!(
                "{}: the reader has ended unexpectedly: this is a fault of the program; please report it with the file",
                path.display()
            )),
        };
        self.opening = None;
        match outcome {
            Ok(mut opened) => {
                // The choices made by keys persist.
                opened.game.view = self.opened.game.view;
                let recording = self.take_recording();
                *self = Self { recording, ..Self::new(opened, self.options.clone()) };
                true
            }
            Err(error) => {
                self.complain(error);
                false
            }
        }
    }

    fn toggle_bake(&mut self) {
        if self.cancel() {
            return;
        }
        if self.bake.as_ref().is_some_and(BackgroundBake::is_running) {
            return self.say("the baked file is being written".to_owned());
        }
        self.keeps_bake = false;
        match BackgroundBake::start(&self.opened.path, &self.options.load, &self.options.bake) {
            Ok(bake) => {
                self.bake = Some(bake);
                self.message = None;
            }
            Err(error) => self.complain(error.to_string()),
        }
    }

    fn save_bake(&mut self) {
        let place = self.opened.place_of_bake();
        match &mut self.bake {
            Some(bake) if bake.can_be_saved() => {
                bake.save(&place);
                self.say(format!("writing {} …", place.display()));
            }
            Some(bake) if bake.is_running() => {
                self.say("the bake can be saved when it has ended".to_owned());
            }
            _ => self.say("nothing is baked yet: B bakes".to_owned()),
        }
    }

    fn take_bake(&mut self) {
        let Some(bake) = &mut self.bake else { return };
        let news = bake.news();
        for one in news {
            match one {
                BakeNews::Light(light) => {
                    light.apply(&mut self.opened.game.world, &self.opened.nodes);
                    self.light = Some(LightFacts {
                        pass: light.pass,
                        error: light.error,
                        under_a_sky: light.under_a_sky,
                        is_final: light.is_final,
                        surfaces: light.len(),
                    });
                    if light.is_empty() {
                        self.say("nothing in this file stands still, so nothing was baked".to_owned());
                    }
                    self.opened.game.view.lightmaps = true;
                    self.since_metered = None;
                    self.sync_default_lights();
                }
                BakeNews::Saved(path) => self.say(format!("written: {}", path.display())),
                BakeNews::Cancelled => self.say("the bake was cancelled; B begins again".to_owned()),
                BakeNews::Failed(error) => self.complain(error.to_string()),
            }
        }
        if self.keeps_bake && self.can_save() {
            self.keeps_bake = false;
            self.save_bake();
        }
    }

    /// Default lights from the camera replace missing light, so they are off while baked light is shown.
    fn sync_default_lights(&mut self) {
        let game = &mut self.opened.game;
        let lit = self.light.is_some_and(|light| light.surfaces > 0) && game.view.lightmaps;
        for &entity in &self.opened.default_lights {
            if let Some(mut light) = game.world.get_mut::<Light>(entity)
                && light.enabled == lit
            {
                light.enabled = !lit;
            }
        }
    }

    fn toggle_metering(&mut self) {
        self.metered = match self.metered {
            Metered::Always(_) => match self.opened.exposure {
                Exposure::Factor(factor) => Metered::Not(Some(factor)),
                Exposure::AsNeeded | Exposure::Auto => Metered::Not(None),
            },
            Metered::Not(_) | Metered::IfNeeded => Metered::Always(Adaptation::default()),
        };
        self.since_metered = None;
    }

    /// Describes where the picture is taken from.
    pub fn viewpoint(&self) -> String {
        let game = &self.opened.game;
        match game.viewpoint() {
            Viewpoint::Player if game.player().flying => "flying".to_owned(),
            Viewpoint::Player => "walking".to_owned(),
            Viewpoint::Orbit(_) => "turning around it".to_owned(),
            Viewpoint::FileCamera(index) => {
                game.cameras().get(*index).map_or_else(String::new, |(_, name)| format!("camera {name}"))
            }
        }
    }
}
