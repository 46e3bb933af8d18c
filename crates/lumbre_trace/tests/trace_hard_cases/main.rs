//! The hard cases of tracing, each with its expected value and the bound that it must keep. `cargo test
//! --workspace --test trace_hard_cases -- --nocapture table` prints them all; each is also a test of its own.

#![allow(clippy::unwrap_used, reason = "helpers of tests fail as tests do")]

#[path = "../../../../tests/hard_cases/case.rs"]
mod case;
mod limits;
mod media;
mod mirrors;
mod starts;
#[path = "../support/mod.rs"]
mod support;
#[path = "../../../../tests/hard_cases/table.rs"]
mod table;

use table::Table;

/// The rows of the table, each with how the tracer deals with the case and which other tests cover it.
const ROWS: [(&str, &str); 7] = [
    (
        "rays that start on a surface",
        "A ray starts off its triangle by some ulps of the triangle's own coordinates, off an exact surface by the rounding of its point; there is no absolute length. Also [paths](../crates/lumbre_trace/tests/trace_paths.rs) `rays_that_start_on_a_surface_do_not_meet_it`.",
    ),
    (
        "coplanar glass",
        "Solids whose faces lie in each other are crossed together, from the innermost medium before to the innermost behind: no light is lost or mirrored where nothing changes. Where something opaque lies in the same plane it is what rays meet: nothing gets past a floor that glass stands on. Also [paths](../crates/lumbre_trace/tests/trace_paths.rs) `glass_that_touches_glass_has_no_face_between`.",
    ),
    (
        "media inside media",
        "A ray carries the stack of what it is inside of; what is left need not be what was entered last. Also [paths](../crates/lumbre_trace/tests/trace_paths.rs) `a_bubble_in_glass_is_air_and_a_stone_in_water_is_stone`.",
    ),
    (
        "depth 50",
        "Points are found in f64, so that the fiftieth is as good as the first but for what the surfaces themselves spread; what is cut off has a stated bound. Also [closed forms](../crates/lumbre_trace/tests/trace_closed_forms.rs) `a_chain_of_mirrors_is_a_geometric_series`.",
    ),
    ("weight 10^-6", "Weights are products in f64; what falls below the least is not traced, and counted."),
    (
        "a mirror in a mirror",
        "Hundreds of mirrors keep their digits: each direction is reflected about the face's own normal where the lit one would lead through it.",
    ),
    (
        "a camera inside glass",
        "The eye's media come from one ray to infinity: what it leaves without having entered contains the eye, wherever it is.",
    ),
];

fn whole() -> Table {
    let cases = [starts::cases(), media::cases(), limits::cases(), mirrors::cases()].concat();
    Table::new("Hard cases of tracing", &ROWS, cases)
}

/// Runs all cases and prints the table. With LUMBRE_WRITE_TABLES=1 it also writes the table into
/// docs/hard-cases.md.
#[test]
fn table() {
    let command = "cargo test --workspace --test trace_hard_cases -- --nocapture table";
    let about = ". Where a case compares many values, the one farthest from its expectation is shown. What a row has elsewhere stands \
                 behind its links.";
    whole().print(command, about);
}

#[test]
fn the_page_lists_these_cases() {
    whole().in_step();
}
