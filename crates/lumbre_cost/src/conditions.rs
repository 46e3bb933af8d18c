//! What every study is run under: the device, the effort, the sizes, and who is told how far it is. Not what is studied.

use std::cell::RefCell;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::time::Duration;

use lumbre_render::{Gpu, Renderer};

use crate::command_line::quoted;
use crate::converged::ConvergedBakes;
use crate::rounds::Rounds;

use crate::{CostError, Spread};

/// By which factor the frames of a quick report have less time than those of a full one.
const QUICK: f64 = 14.0;

/// Who is told how much of a study is done, 0 to 1, or nothing new, and says whether to go on. Called from any thread.
pub type Listener<'a> = dyn Fn(Option<f64>) -> ControlFlow<()> + Sync + 'a;

/// What every study is run under.
#[derive(Clone, Copy)]
pub struct Conditions<'a> {
    /// The device that draws.
    pub gpu: &'a Gpu,
    /// Another device, on which shaders are compiled ahead of the frames that need them; where a GPU draws there is none.
    pub ahead: Option<&'a Gpu>,
    /// Draws all pictures of a study: what it has compiled for one serves the next.
    pub pictures: &'a RefCell<Renderer>,
    /// Bakes that a report has already, for studies that want the same.
    pub converged: &'a ConvergedBakes,
    /// Fewer points and rounds.
    pub quick: bool,
    /// Nothing is timed and nothing compared: whatever serves only that is done once, or cut short.
    pub counts_only: bool,
    /// Width and height of the study's pictures in pixels.
    pub size: (u32, u32),
    /// Width and height that the report was asked for: a study may draw smaller pictures.
    pub size_of_report: (u32, u32),
    /// Of everything that draws random numbers.
    pub seed: u32,
    /// The folder of the report: scenes that a study makes are written below it.
    pub folder: &'a Path,
    /// Scenes that were given; without any a study makes its own.
    pub files: &'a [PathBuf],
    /// Frames are timed as a window shows them, with a tone curve, in eight bits. Otherwise as their pictures are drawn, in linear light and floats: then a picture and its time come from the same
    /// pipelines, which a software rasterizer takes longer to compile than to draw with a few times.
    pub as_shown: bool,
    /// Who is told.
    pub listener: &'a Listener<'a>,
}

impl Conditions<'_> {
    /// Width by height.
    pub fn aspect(&self) -> f64 {
        f64::from(self.size.0) / f64::from(self.size.1)
    }

    /// Tells how much of the study is done.
    ///
    /// # Errors
    /// [`CostError::Interrupted`] if somebody asked for an end.
    pub fn tell(&self, fraction: f64) -> Result<(), CostError> {
        match (self.listener)(Some(fraction)) {
            ControlFlow::Continue(()) => Ok(()),
            ControlFlow::Break(()) => Err(CostError::Interrupted),
        }
    }

    /// Rounds for about so many seconds, a small part of them if it has to be quick; none for counts alone.
    pub fn rounds(&self, seconds: f64) -> Rounds {
        match self.quick {
            _ if self.counts_only => Rounds { warm_up: 0, fewest: 0, most: 0, time: Duration::ZERO },
            true => {
                Rounds { warm_up: 1, fewest: 5, most: 15, time: Duration::from_secs_f64(seconds / QUICK) }
            }
            false => Rounds { warm_up: 1, fewest: 5, most: 51, time: Duration::from_secs_f64(seconds) },
        }
    }

    /// How often work is done that takes too long for rounds by time: as often as its times have to be repeated to be told apart, and once for counts alone.
    pub fn repetitions(&self) -> usize {
        if self.counts_only { 1 } else { Spread::FEWEST_ROUNDS_THAT_TELL }
    }

    /// The command that draws a file's frame as a study draws it, for its picture and for its time. `arguments` are what is asked for besides, each with a space before it.
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

    /// The command that runs a study again as it was run for this report, in the folder of the report.
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

    /// How long a bake may take that others are compared with, in seconds of a full and of a quick report. For counts alone, which are not compared with it, hardly any time.
    pub fn reference_time(&self, full: f64, quick: f64) -> Duration {
        let seconds = if self.counts_only { 0.01 } else { self.unless_quick(full, quick) };
        Duration::from_secs_f64(seconds)
    }

    /// The first of two in a full report, the second in a quick one.
    pub fn unless_quick<T>(&self, full: T, quick: T) -> T {
        if self.quick { quick } else { full }
    }

    /// The pictures' size as the command line has it.
    pub fn size_text(&self) -> String {
        Self::text_of(self.size)
    }

    fn text_of((width, height): (u32, u32)) -> String {
        format!("{width}x{height}")
    }
}
