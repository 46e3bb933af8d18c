//! The hard cases of baking and ray casting, each with its expected value and the bound on the difference.
//! `cargo test -p lumbre_bake --test hard_cases_table -- --nocapture table` prints all of them; each is also a test.

#![allow(clippy::unwrap_used, reason = "helpers of tests fail as tests do")]

#[path = "../../../../tests/hard_cases/case.rs"]
mod case;
#[path = "../common/mod.rs"]
mod common;
#[path = "../common/corner.rs"]
mod corner;
mod energy;
#[path = "../../../lumbre_scene/tests/support/mod.rs"]
mod gltf_files;
mod maps;
mod places;
#[path = "../../../lumbre_rays/tests/common/mod.rs"]
mod random;
mod rays;
mod rows;
mod scenes;
#[path = "../../../../tests/hard_cases/table.rs"]
mod table;

use case::Case;
use rows::ROWS;
use table::Table;

fn all_cases() -> Table {
    let cases: Vec<Case> = [rays::cases(), places::cases(), energy::cases(), maps::cases()].concat();
    Table::new("Hard cases of baking and ray casting", &ROWS, cases)
}

/// Runs all cases and prints the table. With LUMBRE_WRITE_TABLES=1 it also rewrites its part of docs/hard-cases.md.
#[test]
fn table() {
    let command = "cargo test -p lumbre_bake --test hard_cases_table -- --nocapture table";
    let about = ". Where a case compares many values, the one farthest from its expectation is shown. What a row has elsewhere stands \
                 behind its links.";
    all_cases().print(command, about);
}

#[test]
fn the_page_lists_these_cases() {
    all_cases().in_step();
}
