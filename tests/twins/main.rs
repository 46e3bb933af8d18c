//! Every lighting function of `shaders/optics` on the GPU against its f64 twin, over a million random and a hundred thousand hard
//! inputs each. `cargo test --workspace --test twins -- --nocapture` prints the table.

#![allow(clippy::unwrap_used, reason = "helpers of tests fail as tests do")]

mod atmosphere;
mod highlights;
mod inputs;
mod judge;
mod lights;
mod microfacets;
mod refraction;
mod vectors;

use std::sync::OnceLock;

use judge::{HEADING, Twin};
use lumbre_render::Gpu;

/// The device of all tests here.
fn gpu() -> &'static Gpu {
    static GPU: OnceLock<Gpu> = OnceLock::new();
    GPU.get_or_init(|| Gpu::headless().unwrap_or_else(|error| panic!("{error}")))
}

fn all() -> Vec<Twin> {
    [
        vectors::twins(),
        lights::twins(),
        highlights::twins(),
        microfacets::twins(),
        refraction::twins(),
        atmosphere::twins(),
    ]
    .into_iter()
    .flatten()
    .collect()
}

#[test]
fn every_function_keeps_its_bound() {
    println!("{}\n{HEADING}", gpu().describe());
    let only = std::env::var("LUMBRE_TWIN").ok();
    let mut failed = Vec::new();
    for twin in all().iter().filter(|twin| only.as_ref().is_none_or(|only| twin.name.contains(only))) {
        let verdict = twin.judge(gpu());
        println!("{verdict}");
        if !verdict.passes() {
            failed.push(format!("{verdict:?}"));
        }
    }
    assert!(failed.is_empty(), "{failed:#?}");
}
