//! The hard cases of lighting and rasterizing, each with the value that it must give and the bound that it must keep.
//! `cargo test --workspace --test hard_cases -- --nocapture table` prints them all; each is a test of its own too.

#![allow(clippy::unwrap_used, reason = "helpers of tests fail as tests do")]

#[path = "../frames/adapter.rs"]
#[allow(dead_code, reason = "shared with the frame tests, which use all of it")]
mod adapter;
mod case;
mod files;
mod frames;
mod functions;
mod many_lights;
mod overflow;
mod places;

use case::{Case, HEADING};

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

fn all() -> Vec<Case> {
    [
        functions::cases(),
        files::cases(),
        frames::cases(),
        places::cases(),
        many_lights::cases(),
        overflow::cases(),
    ]
    .concat()
}

#[test]
fn table() {
    println!("{}\n{HEADING}", adapter::gpu().describe());
    let failed: Vec<String> = all()
        .iter()
        .filter_map(|case| {
            let outcome = (case.run)();
            println!("| {} | {} | {outcome} |", case.row, case.name.replace('_', " "));
            (!outcome.passes()).then(|| format!("{}: {outcome}", case.name))
        })
        .collect();
    assert!(failed.is_empty(), "{failed:#?}");
}

#[test]
fn a_case_can_fail() {
    use case::Outcome;
    assert!(!Outcome::number(1.0, 1.1, 0.05, "").passes());
    assert!(!Outcome::number(1.0, f64::NAN, 10.0, "").passes());
    assert!(!Outcome::number(1.0, f64::INFINITY, f64::INFINITY, "").passes());
    assert!(!Outcome::text("lamp", "some light is wrong".to_owned()).passes());
}
