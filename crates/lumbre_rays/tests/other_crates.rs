//! Other crates' hierarchies and triangle tests find the same hits as ours, with every batch of the benchmark's
//! rooms.

#[path = "../benches/contestants/mod.rs"]
mod contestants;

use contestants::scenes::rooms;
use contestants::{Case, cases_of};

#[test]
fn obvhs_and_bvh_agree_with_us() {
    for Case { scene, tracers, batches, .. } in cases_of(rooms()) {
        for batch in &batches {
            let hits = tracers.agree(scene, batch);
            // In a closed room nearly every ray hits; many rays to the lamp do not.
            assert!(hits > batch.rays.len() / 10, "{scene}, {}: {hits} hits", batch.name);
        }
    }
}
