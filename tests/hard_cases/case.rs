//! A hard case and what came of it.

use std::fmt;

/// One case: a row of the list of hard cases, a name, and how it is run.
#[derive(Clone, Copy)]
pub struct Case {
    pub row: &'static str,
    pub name: &'static str,
    pub run: fn() -> Outcome,
}

impl Case {
    /// Runs it as a test.
    pub fn check(&self) {
        let outcome = (self.run)();
        assert!(outcome.passes(), "{}: {outcome}", self.name);
    }
}

/// What was expected and what came.
#[derive(Clone, Debug)]
pub enum Outcome {
    /// A number within a bound, which has its reason.
    Number { expected: f64, got: f64, bound: f64, because: &'static str },
    /// An answer in words that has to hold this.
    Text { expected: &'static str, got: String },
}

impl Outcome {
    pub fn number(expected: f64, got: f64, bound: f64, because: &'static str) -> Self {
        Self::Number { expected, got, bound, because }
    }

    pub fn text(expected: &'static str, got: String) -> Self {
        Self::Text { expected, got }
    }

    /// The pair that is farthest apart of its own bound.
    pub fn worst(pairs: impl IntoIterator<Item = (f64, f64)>, bound: f64, because: &'static str) -> Self {
        let apart = |(expected, got): &(f64, f64)| {
            let apart = (expected - got).abs();
            if apart.is_nan() { f64::INFINITY } else { apart }
        };
        let pair = pairs.into_iter().max_by(|a, b| apart(a).total_cmp(&apart(b)));
        let (expected, got) = pair.expect("a case compares something");
        Self::number(expected, got, bound, because)
    }

    pub fn passes(&self) -> bool {
        match self {
            Self::Number { expected, got, bound, .. } => got.is_finite() && (got - expected).abs() <= *bound,
            Self::Text { expected, got } => got.contains(expected),
        }
    }
}

/// The heading of the table.
pub const HEADING: &str = "| case | expected | got | bound | why | pass |\n|---|---|---|---|---|---|";

/// Nine digits, in whichever notation shows them.
fn shortest(number: f64) -> String {
    let size = number.abs();
    if size == 0.0 || (1e-4..1e6).contains(&size) {
        format!("{number:.9}").trim_end_matches('0').trim_end_matches('.').to_owned()
    } else {
        format!("{number:.8e}")
    }
}

impl fmt::Display for Outcome {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let pass = if self.passes() { "yes" } else { "NO" };
        match self {
            Self::Number { expected, got, bound, because } => {
                let (expected, got) = (shortest(*expected), shortest(*got));
                let because = because.replace('|', "\\|");
                write!(f, "{expected} | {got} | {bound:.1e} | {because} | {pass}")
            }
            Self::Text { expected, got } => {
                let got: String = got.chars().take(110).collect();
                write!(f, "\"{expected}\" | {} | | said | {pass}", got.replace(['|', '\n'], " "))
            }
        }
    }
}

/// Lists cases under their row, and makes a test of each.
#[macro_export]
macro_rules! cases {
    ($($row:literal { $($name:ident),+ $(,)? })+) => {
        /// The cases of this file.
        pub fn cases() -> Vec<$crate::case::Case> {
            vec![$($($crate::case::Case { row: $row, name: stringify!($name), run: $name }),+),+]
        }

        mod tests {
            $($(#[test]
            fn $name() {
                $crate::case::Case { row: $row, name: stringify!($name), run: super::$name }.check();
            })+)+
        }
    };
}
