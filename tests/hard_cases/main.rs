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
mod highlights;
mod lists;
mod many_lights;
mod normals;
mod overflow;
mod places;
mod probe;
mod spots;

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

/// The rows of the list, in its order.
const ROWS: [&str; 17] = [
    "normal of length 0",
    "light at the surface, d = 0 and a = b = 0",
    "l = -v, half vector 0",
    "pow(0, 0), pow(negative, n), n = 0",
    "n = 1 to 10^6",
    "specular aliasing",
    "grazing v, Fresnel at 90 degrees, the critical angle",
    "spot cutoff 0, 90, 180; inner = outer; exponent 0, 128; direction 0",
    "attenuation (0,0,0), negative, not a number; intensity 0, 1e-30, 1e30; colour infinite",
    "the largest product stays below the target's overflow",
    "0, 1, 10 000 lights; all in one place; all behind the camera; a light larger than the world",
    "lists of lights: around, beside and behind the camera, at the end of a range, empty",
    "depth: near 1e-3, far 1e6; coplanar faces",
    "world at 10^5 to 10^7 m from the origin",
    "singular or mirroring transform, scale 0 or negative, non-uniform scale",
    "Gouraud with a spot inside one triangle",
    "zero-size window, 1x1, minimised, resize each frame, device lost",
];

/// And the last two: what holds for every frame, and fog.
const OF_ALL_FRAMES: [&str; 2] = ["NaN in any frame", "fog"];

/// Every case, by row.
fn all() -> Vec<Case> {
    let mut all = [
        functions::cases(),
        normals::cases(),
        highlights::cases(),
        spots::cases(),
        files::cases(),
        frames::cases(),
        places::cases(),
        many_lights::cases(),
        lists::cases(),
        overflow::cases(),
        probe::cases(),
    ]
    .concat();
    let rows = || ROWS.iter().chain(&OF_ALL_FRAMES);
    let row = |case: &Case| {
        rows().position(|row| *row == case.row).unwrap_or_else(|| panic!("no row {}", case.row))
    };
    all.sort_by_key(row);
    assert!(rows().all(|row| all.iter().any(|case| case.row == *row)), "a row without a case");
    all
}

#[test]
fn table() {
    println!("{}\n", adapter::gpu().describe());
    let mut failed = Vec::new();
    let mut row = "";
    for case in all() {
        if case.row != row {
            row = case.row;
            println!("\n## {row}\n\n{HEADING}");
        }
        let outcome = (case.run)();
        println!("| {} | {outcome} |", case.name.replace('_', " "));
        if !outcome.passes() {
            failed.push(format!("{}: {outcome}", case.name));
        }
    }
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
