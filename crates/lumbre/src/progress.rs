//! Shows the progress of long operations: a bar on a terminal, or a line every ten seconds in a pipe.

use std::io::IsTerminal;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};
use lumbre::bake;

/// Time between two lines.
const EVERY: Duration = Duration::from_secs(10);

/// How far a long operation is: a bake, a picture, a measurement.
#[derive(Clone, Copy)]
pub struct Progress {
    /// Name of the running stage.
    pub stage: &'static str,
    /// Completed fraction of this stage, in [0, 1].
    pub stage_fraction: f32,
    /// Completed fraction of the whole, in [0, 1].
    pub fraction: f32,
    /// Estimated relative error of the result so far, if there is an estimate.
    pub error: Option<f64>,
}

impl From<bake::Progress> for Progress {
    fn from(bake: bake::Progress) -> Self {
        Self {
            stage: bake.stage,
            stage_fraction: bake.stage_fraction,
            fraction: bake.fraction,
            error: bake.error,
        }
    }
}

/// The form in which progress is shown on standard error.
pub enum Shown {
    Nothing,
    Bar(ProgressBar),
    Lines(Lines),
}

impl Shown {
    /// Shows the progress of a bake: as a bar if standard error is a terminal, otherwise as lines; not at all
    /// if `quiet`.
    pub fn new(quiet: bool) -> Self {
        Self::of("bake", quiet)
    }

    /// Shows the progress of the operation named `what` in the same way.
    pub fn of(what: &'static str, quiet: bool) -> Self {
        match (quiet, std::io::stderr().is_terminal()) {
            (true, _) => Self::Nothing,
            (false, true) => Self::Bar(bar()),
            (false, false) => Self::Lines(Lines::new(what)),
        }
    }

    /// Shows the current progress.
    pub fn update(&mut self, progress: impl Into<Progress>) {
        let progress = progress.into();
        match self {
            Self::Nothing => {}
            Self::Bar(bar) => {
                bar.set_message(match progress.error {
                    Some(error) => format!("{}, {:.1} % off", progress.stage, 100.0 * error),
                    None => progress.stage.to_owned(),
                });
                bar.set_position((progress.fraction * 1000.0) as u64);
            }
            Self::Lines(lines) => {
                if let Some(line) = lines.line(lines.begun.elapsed(), progress) {
                    eprintln!("{line}");
                }
            }
        }
    }

    /// Removes the bar.
    pub fn finish(&self) {
        if let Self::Bar(bar) = self {
            bar.finish_and_clear();
        }
    }
}

fn bar() -> ProgressBar {
    let bar = ProgressBar::new(1000);
    if let Ok(style) = ProgressStyle::with_template("{msg:28} {wide_bar} {percent:>3} % {eta:>4} left") {
        bar.set_style(style);
    }
    bar
}

/// Progress lines of one operation.
pub struct Lines {
    what: &'static str,
    begun: Instant,
    /// Time at which the next line is due, since the start.
    due: Duration,
}

impl Lines {
    fn new(what: &'static str) -> Self {
        Self { what, begun: Instant::now(), due: Duration::ZERO }
    }

    /// Returns the line that is due at a time after the start, if any.
    fn line(&mut self, after: Duration, progress: Progress) -> Option<String> {
        if after < self.due {
            return None;
        }
        self.due = after + EVERY;
        let Progress { stage, stage_fraction, fraction, error } = progress;
        let mut line = format!(
            "lumbre: {stage}: {:.0} % ({:.0} % of the {}) after {:.0} s",
            100.0 * stage_fraction,
            100.0 * fraction,
            self.what,
            after.as_secs_f64()
        );
        if let Some(error) = error {
            line.push_str(&format!("; estimated error {:.1} %", 100.0 * error));
        }
        Some(line)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn there_is_a_line_at_once_and_one_every_ten_seconds() {
        let at =
            |fraction: f32, error| Progress { stage: "direct light", stage_fraction: 0.45, fraction, error };
        let mut lines = Lines::new("bake");
        let mut said = Vec::new();
        for step in 0..=400u32 {
            let after = Duration::from_millis(100) * step;
            let error = (step > 150).then_some(0.031);
            said.extend(lines.line(after, at(0.12, error)));
        }
        assert_eq!(
            said,
            [
                "lumbre: direct light: 45 % (12 % of the bake) after 0 s",
                "lumbre: direct light: 45 % (12 % of the bake) after 10 s",
                "lumbre: direct light: 45 % (12 % of the bake) after 20 s; estimated error 3.1 %",
                "lumbre: direct light: 45 % (12 % of the bake) after 30 s; estimated error 3.1 %",
                "lumbre: direct light: 45 % (12 % of the bake) after 40 s; estimated error 3.1 %",
            ]
        );
    }
}
