//! How far a bake or a traced picture has come, for whoever waits: a bar on a terminal, a line every ten seconds in a pipe. Not the bake.

use std::io::IsTerminal;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};
use lumbre::bake::Progress;

/// Between two lines.
const EVERY: Duration = Duration::from_secs(10);

/// What is shown on standard error.
pub enum Shown {
    Nothing,
    Bar(ProgressBar),
    Lines(Lines),
}

impl Shown {
    /// Of a bake: a bar if standard error is a terminal, else lines; nothing if `quiet`.
    pub fn new(quiet: bool) -> Self {
        Self::of("bake", quiet)
    }

    /// The same of something else that takes its time, by its name.
    pub fn of(what: &'static str, quiet: bool) -> Self {
        match (quiet, std::io::stderr().is_terminal()) {
            (true, _) => Self::Nothing,
            (false, true) => Self::Bar(bar()),
            (false, false) => Self::Lines(Lines::new(what)),
        }
    }

    /// Shows how far the bake is now.
    pub fn update(&mut self, progress: Progress) {
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

    /// Takes the bar away.
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

/// The lines of one bake, or of whatever else.
pub struct Lines {
    what: &'static str,
    begun: Instant,
    /// When the next one is due.
    due: Duration,
}

impl Lines {
    fn new(what: &'static str) -> Self {
        Self { what, begun: Instant::now(), due: Duration::ZERO }
    }

    /// The line that is due, so long after the beginning.
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
