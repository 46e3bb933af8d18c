//! A hard case and its outcome.

use std::fmt;

/// One case: its row in the list of hard cases, its name, and the function that runs it.
#[derive(Clone, Copy)]
pub struct Case {
    pub row: &'static str,
    pub name: &'static str,
    pub run: fn() -> Outcome,
}

impl Case {
    /// Runs the case as a test.
    pub fn check(&self) {
        let outcome = (self.run)();
        assert!(outcome.passes(), "{}: {outcome}", self.name);
    }
}

/// The expected and the actual result.
#[derive(Clone, Debug)]
pub enum Outcome {
    /// A number that must be within a bound, with the reason for the bound.
    Number { expected: f64, got: f64, bound: f64, because: &'static str },
    /// A text that must contain the expected one.
    Text { expected: &'static str, got: String },
}

impl Outcome {
    pub fn number(expected: f64, got: f64, bound: f64, because: &'static str) -> Self {
        Self::Number { expected, got, bound, because }
    }

    pub fn text(expected: &'static str, got: String) -> Self {
        Self::Text { expected, got }
    }

    /// Returns the pair with the largest difference, with the bound that holds for all pairs.
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

/// Formats a number with nine digits, in the shorter notation.
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

/// Lists cases under their rows, and makes a test of each.
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
