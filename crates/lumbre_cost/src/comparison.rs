//! Compares two reports. Counts and errors differ if they differ by more than a factor. Times are judged
//! relative to the drift that all times of their study have in common, because a machine is not equally fast
//! at every hour: they differ if their quartiles do not overlap then, and if the difference is larger than
//! what two runs of one program differ by.

use std::fmt;

use crate::findings::{milliseconds, percent, rounded};
use crate::{CostReport, Point, Spread, Study};

/// A difference between two reports.
#[derive(Clone, Debug, PartialEq)]
pub struct Change {
    /// The study.
    pub study: String,
    /// Series and label of the point; empty if the change concerns the whole study.
    pub point: String,
    /// The difference.
    pub what: What,
}

/// The kind of a difference between two reports.
#[derive(Clone, Debug, PartialEq)]
pub enum What {
    /// It is only in the first report.
    Gone,
    /// It is only in the second report.
    New,
    /// A count differs.
    Count {
        /// The name of the count.
        name: String,
        /// Its value in the first report.
        before: f64,
        /// Its value in the second report.
        after: f64,
    },
    /// A count is only in the first report.
    Uncounted {
        /// The name of the count.
        name: String,
    },
    /// A count is only in the second report.
    Counted {
        /// The name of the count.
        name: String,
    },
    /// It has a time or an error only in the first report.
    Lost(Figure),
    /// It has a time or an error only in the second report.
    Gained(Figure),
    /// It was measured by another method, and is not compared.
    Method {
        /// The method of the first report.
        before: u32,
        /// The method of the second report.
        after: u32,
    },
    /// The error differs.
    Error {
        /// Its value in the first report, as a fraction.
        before: f64,
        /// Its value in the second report, as a fraction.
        after: f64,
    },
    /// The time differs by more than the study as a whole, and the quartiles do not overlap.
    Time {
        /// Its value in the first report.
        before: Spread,
        /// Its value in the second report.
        after: Spread,
        /// The factor by which the times of the study differ as a whole.
        drift: f64,
    },
    /// The times of the whole study differ by a factor: the median of its points' ratios.
    Drift {
        /// The median ratio of a time to that of the first report.
        factor: f64,
        /// The number of points that have both times.
        points: usize,
    },
}

/// What a point may lack.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Figure {
    /// A time.
    Time,
    /// An error.
    Error,
}

impl Figure {
    fn with_article(self) -> &'static str {
        match self {
            Self::Time => "a time",
            Self::Error => "an error",
        }
    }
}

/// Errors below this are rounding errors, whose ratio means nothing.
const NEGLIGIBLE_ERROR: f64 = 1e-5;

/// The factor by which a time may differ between two runs of one program, beyond the drift of its study. On a
/// processor that draws, the scheduler of the operating system decides how the threads of a frame share its
/// cores, and a whole run may keep to one way: of 152 times of two quick reports, all were within 1.6.
pub const NOISE_OF_RUNS: f64 = 1.8;
/// The factor by which the times of a study as a whole may grow before the program is to blame rather than the
/// machine: a frame of two threads takes twice as long while something else keeps one of two cores busy.
pub const DRIFT_OF_MACHINES: f64 = 2.5;
/// Smallest number of points whose median ratio is taken for a drift. With fewer, one slower point would
/// be taken for a slower machine.
const MIN_POINTS_OF_DRIFT: usize = 5;
/// How many times the scatter of a study's ratios a ratio may lie beyond their median.
const SCATTERS: f64 = 3.0;
/// Ratio of the standard deviation of a normal distribution to its median absolute deviation.
const DEVIATION: f64 = 1.4826;

/// How the times of a study differ as a whole.
#[derive(Clone, Copy, Debug)]
struct Drift {
    /// The median ratio; of an even number, the smaller of the two in the middle, so that half of a study
    /// which has become slower stands out against the other half.
    factor: f64,
    /// The factor by which ratios scatter about it.
    scatter: f64,
    /// The number of ratios.
    points: usize,
}

impl Drift {
    /// A drift of nothing.
    const NONE: Self = Self { factor: 1.0, scatter: 1.0, points: 0 };

    /// Returns the drift of these ratios; `None` if there are too few of them.
    fn of(ratios: &[f64]) -> Option<Self> {
        if ratios.len() < MIN_POINTS_OF_DRIFT {
            return None;
        }
        let mut sorted = ratios.to_vec();
        sorted.sort_by(f64::total_cmp);
        let factor = *sorted.get((sorted.len() - 1) / 2)?;
        let apart: Vec<f64> = ratios.iter().map(|ratio| (ratio / factor).ln().abs()).collect();
        let scatter = (DEVIATION * Spread::of(&apart)?.median).exp();
        Some(Self { factor, scatter, points: ratios.len() })
    }
}

/// Returns the ratios of the times of a study's points to those in another report.
fn ratios_of_times(before: &Study, after: &Study) -> Vec<f64> {
    let ratio = |point: &Point| {
        let other = after.points.iter().find(|found| is_same(point, found))?;
        let (was, is) = (point.milliseconds?.median, other.milliseconds?.median);
        (was > 0.0 && is > 0.0).then_some(is / was)
    };
    before.points.iter().filter_map(ratio).collect()
}

impl Change {
    /// Returns true if the second report is worse by this change: a point, a count or an error is missing, or
    /// a count or an error is larger. Times alone do not make a report worse.
    pub fn is_worse(&self) -> bool {
        match &self.what {
            What::Gone | What::Uncounted { .. } | What::Lost(Figure::Error) => true,
            What::New | What::Counted { .. } | What::Time { .. } | What::Drift { .. } => false,
            What::Lost(Figure::Time) | What::Gained(_) | What::Method { .. } => false,
            What::Count { before, after, .. } | What::Error { before, after } => after > before,
        }
    }

    /// Returns true if a time is longer in the second report, relative to its study, or if the whole study
    /// takes longer than a machine's drift explains.
    pub fn is_slower(&self) -> bool {
        match &self.what {
            What::Time { before, after, drift } => after.median > before.median * drift,
            What::Drift { factor, .. } => *factor > DRIFT_OF_MACHINES,
            _ => false,
        }
    }
}

impl fmt::Display for Change {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.study)?;
        if !self.point.is_empty() {
            write!(f, ", {}", self.point)?;
        }
        let times = |before: f64, after: f64| match before {
            0.0 => String::new(),
            _ => format!(" ({} times)", rounded(after / before)),
        };
        match &self.what {
            What::Gone => write!(f, ": is missing"),
            What::New => write!(f, ": is new"),
            What::Uncounted { name } => write!(f, ": {name} is no longer counted"),
            What::Counted { name } => write!(f, ": {name} is counted for the first time"),
            What::Lost(figure) => write!(f, ": no longer has {}", figure.with_article()),
            What::Gained(figure) => write!(f, ": has {} for the first time", figure.with_article()),
            What::Method { before, after } => {
                write!(f, ": was measured by method {after} instead of {before}, and is not compared")
            }
            What::Count { name, before, after } => {
                let factor = times(*before, *after);
                write!(f, ": {name} {} instead of {}{factor}", rounded(*after), rounded(*before))
            }
            What::Error { before, after } => {
                let factor = times(*before, *after);
                write!(f, ": error {} instead of {}{factor}", percent(*after), percent(*before))
            }
            What::Time { before, after, drift } => {
                let factor = times(before.median, after.median);
                write!(f, ": {} instead of {}{factor}", milliseconds(after), milliseconds(before))?;
                match *drift == 1.0 {
                    true => Ok(()),
                    false => write!(
                        f,
                        ", {} times relative to its study",
                        rounded(after.median / before.median / drift)
                    ),
                }
            }
            What::Drift { factor, points } => {
                write!(f, ": its {points} times are {} times as long in the median", rounded(*factor))
            }
        }
    }
}

/// Returns the differences between two reports that exceed a factor (above 1) in either direction. Times of
/// points must exceed [`NOISE_OF_RUNS`] too.
pub fn compare_reports(before: &CostReport, after: &CostReport, factor: f64) -> Vec<Change> {
    let mut changes = Vec::new();
    let whole = |study: &str, what| Change { study: study.to_owned(), point: String::new(), what };
    let pairs = before.studies.iter().filter_map(|study| {
        after.study(&study.name).filter(|other| other.method == study.method).map(|other| (study, other))
    });
    let all: Vec<f64> = pairs.flat_map(|(study, other)| ratios_of_times(study, other)).collect();
    // Studies of few points share the drift of all others.
    let drift_of_all = Drift::of(&all).unwrap_or(Drift::NONE);
    for study in &before.studies {
        let Some(other) = after.study(&study.name) else {
            changes.push(whole(&study.name, What::Gone));
            continue;
        };
        if study.method != other.method {
            changes.push(whole(&study.name, What::Method { before: study.method, after: other.method }));
            continue;
        }
        let own = Drift::of(&ratios_of_times(study, other));
        if let Some(Drift { factor: drift, points, .. }) = own
            && is_beyond(1.0, drift, factor)
        {
            changes.push(whole(&study.name, What::Drift { factor: drift, points }));
        }
        let drift = own.unwrap_or(drift_of_all);
        let mut note = |point: &Point, what| {
            let point = format!("{}, {}", point.series, point.label);
            changes.push(Change { study: study.name.clone(), point, what });
        };
        for point in &study.points {
            match other.points.iter().find(|found| is_same(point, found)) {
                Some(found) => {
                    differences(point, found, factor, drift).into_iter().for_each(|what| note(point, what))
                }
                None => note(point, What::Gone),
            }
        }
        for point in
            other.points.iter().filter(|point| !study.points.iter().any(|known| is_same(known, point)))
        {
            note(point, What::New);
        }
    }
    for study in after.studies.iter().filter(|study| before.study(&study.name).is_none()) {
        changes.push(whole(&study.name, What::New));
    }
    changes
}

fn is_same(a: &Point, b: &Point) -> bool {
    a.series == b.series && a.label == b.label
}

/// Returns true if two numbers differ by more than a factor.
fn is_beyond(a: f64, b: f64, factor: f64) -> bool {
    a != b && !(b <= a * factor && a <= b * factor)
}

fn differences(before: &Point, after: &Point, factor: f64, drift: Drift) -> Vec<What> {
    let beyond = |a: f64, b: f64| is_beyond(a, b, factor);
    let mut found = Vec::new();
    for (name, &count) in &before.counts {
        match after.counts.get(name) {
            Some(&now) if beyond(count, now) => {
                found.push(What::Count { name: name.clone(), before: count, after: now });
            }
            Some(_) => {}
            None => found.push(What::Uncounted { name: name.clone() }),
        }
    }
    let is_new = |name: &&String| !before.counts.contains_key(*name);
    found.extend(after.counts.keys().filter(is_new).map(|name| What::Counted { name: name.clone() }));
    for (figure, was, is) in [
        (Figure::Time, before.milliseconds.is_some(), after.milliseconds.is_some()),
        (Figure::Error, before.error.is_some(), after.error.is_some()),
    ] {
        match (was, is) {
            (true, false) => found.push(What::Lost(figure)),
            (false, true) => found.push(What::Gained(figure)),
            _ => {}
        }
    }
    if let (Some(was), Some(is)) = (before.error, after.error) {
        // Differences within the references' own uncertainty are not reported.
        let open = was.uncertainty + is.uncertainty + NEGLIGIBLE_ERROR;
        let (was, is) = (was.relative_rmse, is.relative_rmse);
        if beyond(was, is) && (was - is).abs() > open {
            found.push(What::Error { before: was, after: is });
        }
    }
    if let (Some(was), Some(is)) = (before.milliseconds, after.milliseconds) {
        let expected = was.times(drift.factor);
        let apart = expected.is_below(&is) || is.is_below(&expected);
        // However much a study scatters, no point may differ by more than whole machines do.
        let scatter = drift.scatter.powf(SCATTERS).min(DRIFT_OF_MACHINES);
        let noise = factor.max(NOISE_OF_RUNS).max(scatter);
        if apart && is_beyond(expected.median, is.median, noise) {
            found.push(What::Time { before: was, after: is, drift: drift.factor });
        }
    }
    found
}
