//! Compares two reports. Counts and errors differ if they differ by more than a factor; times, only if their
//! quartiles do not overlap either.

use std::fmt;

use crate::findings::{milliseconds, percent, rounded};
use crate::{CostReport, Point, Spread};

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
    /// The time differs, and the quartiles do not overlap.
    Time {
        /// Its value in the first report.
        before: Spread,
        /// Its value in the second report.
        after: Spread,
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

impl Change {
    /// Returns true if the second report is worse by this change: a point, a count or an error is missing, or
    /// a count or an error is larger. Times alone do not make a report worse.
    pub fn is_worse(&self) -> bool {
        match &self.what {
            What::Gone | What::Uncounted { .. } | What::Lost(Figure::Error) => true,
            What::New | What::Counted { .. } | What::Time { .. } | What::Lost(Figure::Time) => false,
            What::Gained(_) | What::Method { .. } => false,
            What::Count { before, after, .. } | What::Error { before, after } => after > before,
        }
    }

    /// Returns true if it is a time that is longer in the second report.
    pub fn is_slower(&self) -> bool {
        matches!(&self.what, What::Time { before, after } if after.median > before.median)
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
            What::Time { before, after } => {
                let factor = times(before.median, after.median);
                write!(f, ": {} instead of {}{factor}", milliseconds(after), milliseconds(before))
            }
        }
    }
}

/// Returns the differences between two reports that exceed a factor (above 1) in either direction.
pub fn compare_reports(before: &CostReport, after: &CostReport, factor: f64) -> Vec<Change> {
    let mut changes = Vec::new();
    let whole = |study: &str, what| Change { study: study.to_owned(), point: String::new(), what };
    for study in &before.studies {
        let Some(other) = after.study(&study.name) else {
            changes.push(whole(&study.name, What::Gone));
            continue;
        };
        if study.method != other.method {
            changes.push(whole(&study.name, What::Method { before: study.method, after: other.method }));
            continue;
        }
        let mut note = |point: &Point, what| {
            let point = format!("{}, {}", point.series, point.label);
            changes.push(Change { study: study.name.clone(), point, what });
        };
        for point in &study.points {
            match other.points.iter().find(|found| is_same(point, found)) {
                Some(found) => {
                    differences(point, found, factor).into_iter().for_each(|what| note(point, what))
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

fn differences(before: &Point, after: &Point, factor: f64) -> Vec<What> {
    let beyond = |a: f64, b: f64| a != b && !(b <= a * factor && a <= b * factor);
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
        let apart = was.is_below(&is) || is.is_below(&was);
        if apart && beyond(was.median, is.median) {
            found.push(What::Time { before: was, after: is });
        }
    }
    found
}
