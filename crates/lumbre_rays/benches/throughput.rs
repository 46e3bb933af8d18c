//! Millions of rays per second of every crate, scene and batch, measured by divan.
//!
//! Run `cargo bench -p lumbre_rays --bench throughput [-- FILTER]`. For ratios that the machine's noise does not
//! distort use `--bench ratios`.

mod contestants;

use std::fmt;
use std::sync::LazyLock;

use contestants::tracers::Tracer;
use contestants::{Case, cases};
use divan::counter::ItemsCount;

static CASES: LazyLock<Vec<Case>> = LazyLock::new(cases);

fn main() {
    divan::main();
}

/// One row of the table.
#[derive(Clone, Copy)]
struct Row {
    case: usize,
    batch: usize,
    tracer: Tracer,
}

impl fmt::Display for Row {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let case = &CASES[self.case];
        write!(f, "{}: {}: {}", case.scene, case.batches[self.batch].name, self.tracer.name())
    }
}

fn rows() -> impl Iterator<Item = Row> {
    CASES.iter().enumerate().flat_map(|(case, content)| {
        (0..content.batches.len())
            .flat_map(move |batch| Tracer::ALL.map(|tracer| Row { case, batch, tracer }))
    })
}

#[divan::bench(args = rows(), sample_count = 20, sample_size = 1)]
fn trace(bencher: divan::Bencher, row: &Row) {
    let case = &CASES[row.case];
    let batch = &case.batches[row.batch];
    bencher
        .counter(ItemsCount::new(batch.rays.len()))
        .bench(|| case.tracers.trace(row.tracer, batch.any, &batch.rays));
}
