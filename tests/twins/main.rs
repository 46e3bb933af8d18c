//! Compares every lighting function of `shaders/optics` on the GPU with its f64 twin, over a million random and a
//! hundred thousand hard inputs each. `cargo test --workspace --test twins -- --nocapture` prints the table.
//! `LUMBRE_TWIN=name` selects the functions with that in their names, and `LUMBRE_TWIN_WORST=1` prints the worst
//! input of each in the form of `worst_inputs.rs`.

#![allow(clippy::unwrap_used, reason = "helpers of tests fail as tests do")]
#![allow(clippy::print_stdout, reason = "the table is what the test is for")]

mod atmosphere;
mod bounds;
mod completeness;
mod depth_planes;
mod highlights;
mod inputs;
mod judge;
mod light_components;
mod lights;
mod materials;
mod microfacets;
mod negative_controls;
mod polygons;
mod probes;
mod refraction;
mod regressions;
mod shading;
mod srgb;
mod vectors;
mod verdict;
mod worst_inputs;

use std::sync::OnceLock;

use judge::Twin;
use lumbre_tests::device::gpu;
use verdict::{HEADING, LEGEND};

/// The twins of all functions.
fn all() -> &'static [Twin] {
    static ALL: OnceLock<Vec<Twin>> = OnceLock::new();
    let modules = || {
        [
            vectors::twins(),
            lights::twins(),
            highlights::twins(),
            microfacets::twins(),
            refraction::twins(),
            shading::twins(),
            materials::twins(),
            polygons::twins(),
            probes::twins(),
            atmosphere::twins(),
        ]
    };
    ALL.get_or_init(|| modules().into_iter().flatten().collect())
}

/// Returns the twin with that name.
fn twin(name: &str) -> &'static Twin {
    let mut found = all().iter().filter(|twin| twin.name == name);
    match (found.next(), found.next()) {
        (Some(twin), None) => twin,
        _ => panic!("there is not one twin called {name:?}"),
    }
}

#[test]
fn every_function_keeps_its_bound() {
    println!("{}\n{LEGEND}\n{HEADING}", gpu().describe());
    let only = std::env::var("LUMBRE_TWIN").ok();
    let worst = std::env::var_os("LUMBRE_TWIN_WORST").is_some();
    let mut failed = Vec::new();
    for twin in all().iter().filter(|twin| only.as_ref().is_none_or(|only| twin.name.contains(only))) {
        let verdict = twin.judge(gpu());
        println!("{verdict}");
        if worst {
            println!("{}", verdict.regression());
        }
        if !verdict.passes() {
            failed.push(format!("{verdict:#?}"));
        }
    }
    assert!(failed.is_empty(), "{}", failed.join("\n"));
}
