//! The conditions that all studies are run under: device, effort, sizes, and the listener for progress.

use std::cell::RefCell;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::time::Duration;

use lumbre_render::{Gpu, Renderer};

use crate::command_line::quoted;
use crate::converged::ConvergedBakes;
use crate::rounds::Rounds;
use crate::shared_bakes::SharedBakes;

use crate::{CostError, Spread};

/// How many times less time a quick report spends on frames than a full one.
const QUICK: f64 = 14.0;

/// Receives the fraction of a study that is done, or `None` if there is nothing new, and decides whether to
/// go on. It is called from any thread.
pub type Listener<'a> = dyn Fn(Option<f64>) -> ControlFlow<()> + Sync + 'a;

/// The conditions that all studies are run under.
#[derive(Clone, Copy)]
pub struct Conditions<'a> {
    /// The device that draws.
    pub gpu: &'a Gpu,
    /// A second device, on which shaders are compiled before the frames that need them are drawn. `None` for
    /// hardware GPUs.
    pub ahead: Option<&'a Gpu>,
    /// The renderer for all pictures of a study, so that compiled shaders are reused.
    pub pictures: &'a RefCell<Renderer>,
    /// Converged bakes that earlier studies of the report have made.
    pub converged: &'a ConvergedBakes,
    /// Other bakes that earlier studies of the report have made.
    pub bakes: &'a SharedBakes,
    /// Whether to measure fewer points and rounds.
    pub quick: bool,
    /// Whether only counts are wanted: nothing is timed or compared, and whatever serves only that is done
    /// once, or cut short.
    pub counts_only: bool,
    /// Whether the light evaluations of frames are counted, which needs shader variants of its own.
    pub counts_lights: bool,
    /// Width and height of the study's pictures in pixels.
    pub size: (u32, u32),
    /// Requested width and height. A study may draw smaller pictures.
    pub size_of_report: (u32, u32),
    /// Seed of all random numbers.
    pub seed: u32,
    /// The report's folder. Scenes that a study creates are written below it.
    pub folder: &'a Path,
    /// The scene files that were passed; if there are none, a study creates its own scene.
    pub files: &'a [PathBuf],
    /// Whether frames are timed as a window shows them, with a tone curve and in eight bits. Otherwise they
    /// are timed as their pictures are drawn, in linear floats, so that both use the same pipelines: a
    /// software rasterizer takes longer to compile a pipeline than to draw a few frames.
    pub as_shown: bool,
    /// The listener for progress.
    pub listener: &'a Listener<'a>,
}

impl Conditions<'_> {
    /// Returns width divided by height.
    pub fn aspect(&self) -> f64 {
        f64::from(self.size.0) / f64::from(self.size.1)
    }

    /// Reports the fraction of the study that is done.
    ///
    /// # Errors
    /// [`CostError::Interrupted`] if the listener asks to stop.
    pub fn tell(&self, fraction: f64) -> Result<(), CostError> {
        match (self.listener)(Some(fraction)) {
            ControlFlow::Continue(()) => Ok(()),
            ControlFlow::Break(()) => Err(CostError::Interrupted),
        }
    }

    /// Returns rounds for about this many seconds of a full report, with less time in a quick one, and
    /// without any timing if only counts are wanted.
    pub fn rounds(&self, seconds: f64) -> Rounds {
        match self.quick {
            _ if self.counts_only => Rounds { warm_up: 0, min: 0, max: 0, time: Duration::ZERO },
            true => Rounds { warm_up: 1, min: 5, max: 15, time: Duration::from_secs_f64(seconds / QUICK) },
            false => Rounds { warm_up: 1, min: 5, max: 51, time: Duration::from_secs_f64(seconds) },
        }
    }

    /// Returns the number of repetitions of work that takes too long for [`Self::rounds`]: the fewest with
    /// which times can be told apart, or one if only counts are wanted.
    pub fn repetitions(&self) -> usize {
        if self.counts_only { 1 } else { Spread::MIN_ROUNDS_TO_DISTINGUISH }
    }

    /// Returns the command that draws a file's frame as a study draws it, for its picture and its time. Each
    /// of the additional `arguments` is preceded by a space.
    pub fn drawing(&self, file: &str, arguments: &str) -> String {
        let asked = format!("{arguments} --size {}", self.size_text());
        let timed = "--frames 20 --timings times.json";
        match self.as_shown {
            true => format!(
                "lumbre render {file} -o frame.exr{asked} && lumbre render {file} -o frame.png{asked} {timed}"
            ),
            false => format!("lumbre render {file} -o frame.exr{asked} {timed}"),
        }
    }

    /// Returns the command that runs a study again as it was run for this report, to be run in the report's
    /// folder.
    pub fn again(&self, study: &str) -> String {
        let files = self.files.iter().map(|path| {
            let whole = path.canonicalize();
            format!(" {}", quoted(&whole.as_deref().unwrap_or(path).to_string_lossy()))
        });
        let quick = if self.quick { " --quick" } else { "" };
        let counts = if self.counts_only { " --counts-only" } else { "" };
        format!(
            "lumbre cost{} -o again --study {study}{quick}{counts} --size {} --seed {}",
            files.collect::<String>(),
            Self::text_of(self.size_of_report),
            self.seed
        )
    }

    /// Returns the time limit of a bake that serves as a reference, from the seconds in a full and in a quick
    /// report. If only counts are wanted, nothing is compared with it, and it ends almost at once.
    pub fn reference_time(&self, full: f64, quick: f64) -> Duration {
        let seconds = if self.counts_only { 0.01 } else { self.unless_quick(full, quick) };
        Duration::from_secs_f64(seconds)
    }

    /// Returns the first value in a full report, the second in a quick one.
    pub fn unless_quick<T>(&self, full: T, quick: T) -> T {
        if self.quick { quick } else { full }
    }

    /// Returns the size of the pictures as the command line expects it.
    pub fn size_text(&self) -> String {
        Self::text_of(self.size)
    }

    fn text_of((width, height): (u32, u32)) -> String {
        format!("{width}x{height}")
    }
}
