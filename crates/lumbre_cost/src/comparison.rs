//! Two reports side by side: counts and errors, which do not depend on the hour, beyond a factor; and times, only where their quartiles lie
//! apart. Not the measuring.

use std::fmt;

use crate::findings::{milliseconds, percent, rounded};
use crate::{CostReport, Point, Spread};

/// A difference between two reports.
#[derive(Clone, Debug, PartialEq)]
pub struct Change {
    /// Of which study.
    pub study: String,
    /// Of which point, as series and label; empty if it is the study as a whole.
    pub point: String,
    /// What differs.
    pub what: What,
}

/// What differs between two reports.
#[derive(Clone, Debug, PartialEq)]
pub enum What {
    /// It is in the first alone.
    Gone,
    /// It is in the second alone.
    New,
    /// A count is another one.
    Count {
        /// Its name.
        name: String,
        /// In the first.
        before: f64,
        /// In the second.
        after: f64,
    },
    /// It is not counted any more.
    Uncounted {
        /// Its name.
        name: String,
    },
    /// It is counted for the first time.
    Counted {
        /// Its name.
        name: String,
    },
    /// It has no time or no error any more.
    Lost(Figure),
    /// It has a time or an error for the first time.
    Gained(Figure),
    /// It was measured in another way, so that nothing of it is compared.
    Method {
        /// In the first.
        before: u32,
        /// In the second.
        after: u32,
    },
    /// The error is another one.
    Error {
        /// In the first, as a share.
        before: f64,
        /// In the second, as a share.
        after: f64,
    },
    /// The time is another one, and the quartiles lie apart.
    Time {
        /// In the first.
        before: Spread,
        /// In the second.
        after: Spread,
    },
}

/// What a point may have or not.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Figure {
    /// A time.
    Time,
    /// An error.
    Error,
}

impl Figure {
    fn name(self) -> &'static str {
        match self {
            Self::Time => "time",
            Self::Error => "error",
        }
    }
}

/// Errors below this differ by rounding: a factor between them means nothing.
const NEGLIGIBLE_ERROR: f64 = 1e-5;

impl Change {
    /// Whether the second report is the worse one by it: a point, a count or an error is gone, or a count or an error grew. Times are no failure by themselves.
    pub fn is_worse(&self) -> bool {
        match &self.what {
            What::Gone | What::Uncounted { .. } | What::Lost(Figure::Error) => true,
            What::New | What::Counted { .. } | What::Time { .. } | What::Lost(Figure::Time) => false,
            What::Gained(_) | What::Method { .. } => false,
            What::Count { before, after, .. } | What::Error { before, after } => after > before,
        }
    }

    /// Whether it is a time that grew.
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
            What::Gone => write!(f, ": is not there any more"),
            What::New => write!(f, ": is new"),
            What::Uncounted { name } => write!(f, ": {name} is not counted any more"),
            What::Counted { name } => write!(f, ": {name} is counted for the first time"),
            What::Lost(figure) => write!(f, ": has no {} any more", figure.name()),
            What::Gained(figure) => write!(
                f,
                ": has {} for the first time",
                if *figure == Figure::Time { "a time" } else { "an error" }
            ),
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

/// What is different in the second report, beyond a factor (more than 1) in either direction.
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
        // What the references themselves leave open is no change.
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
