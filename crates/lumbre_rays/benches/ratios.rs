//! Throughput compared with the other crates, which trace each chunk of rays in turn so that the machine's noise
//! cancels in the ratios.
//!
//! `cargo bench -p lumbre_rays --bench ratios [-- PART_OF_A_SCENE_OR_BATCH]` prints millions of rays per second on
//! one thread from the median chunk, and how many times faster ours is, as median and quartiles over all chunks.
//! Above 1 ours is faster.

mod contestants;

use std::time::Instant;

use contestants::batches::Batch;
use contestants::tracers::Tracer;
use contestants::{Case, cases};

/// Rays per chunk: few enough to avoid the machine's interruptions, many enough for the resolution of the clock.
const CHUNK: usize = 2048;
const ROUNDS: usize = 5;

#[expect(clippy::print_stdout, reason = "the figures are what this program is for")]
fn main() {
    let wanted = std::env::args().skip(1).find(|argument| !argument.starts_with('-')).unwrap_or_default();
    for case in cases() {
        println!("{}: ours built in {:.2} ms", case.scene, case.tracers.build_seconds * 1e3);
        for batch in &case.batches {
            if case.scene.contains(&wanted) || batch.name.contains(&wanted) {
                println!("{}", compare(&case, batch));
            }
        }
    }
}

fn compare(case: &Case, batch: &Batch) -> String {
    case.tracers.agree(case.scene, batch);
    let tracers = Tracer::ALL;
    // Seconds of every chunk, by tracer.
    let mut seconds = vec![Vec::new(); tracers.len()];
    for round in 0..ROUNDS {
        for (turn, chunk) in batch.rays.chunks(CHUNK).enumerate() {
            for i in 0..tracers.len() {
                // Each tracer goes first equally often.
                let i = (i + turn + round) % tracers.len();
                let start = Instant::now();
                case.tracers.trace(tracers[i], batch.any, chunk);
                seconds[i].push(start.elapsed().as_secs_f64());
            }
        }
    }
    let mut text = format!("{} ({} triangles), {}:", case.scene, case.triangles, batch.name);
    for (i, tracer) in tracers.iter().enumerate() {
        let rate = CHUNK as f64 / quantile(&seconds[i], 0.5) / 1e6;
        text += &format!("\n  {:12} {rate:6.2} Mrays/s", tracer.name());
        if i > 0 {
            let ratios: Vec<f64> =
                seconds[i].iter().zip(&seconds[0]).map(|(theirs, ours)| theirs / ours).collect();
            let [low, middle, high] = [0.25, 0.5, 0.75].map(|share| quantile(&ratios, share));
            text += &format!("   ours / theirs {middle:5.2} ({low:.2} to {high:.2})");
        }
    }
    text
}

fn quantile(values: &[f64], share: f64) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted[((sorted.len() - 1) as f64 * share) as usize]
}
