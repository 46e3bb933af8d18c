//! Counts the rays that leak: those that end on the black back of a surface or inside a closed mesh, and those that
//! leave a scene that is closed on all sides. It does not repair leaks: `coverage::hidden` removes texels inside
//! geometry before.

use std::sync::atomic::{AtomicU64, Ordering};

/// Number of counters, so that threads rarely contend for the same one.
const SHARDS: usize = 16;

/// A counter on a cache line of its own.
#[derive(Debug, Default)]
#[repr(align(64))]
struct Shard(AtomicU64);

/// Counts rays that leak.
#[derive(Debug, Default)]
pub(crate) struct Leaks {
    shards: [Shard; SHARDS],
    /// Whether closed rooms contain the whole scene, so that no ray should leave it.
    pub closed_scene: bool,
}

impl Leaks {
    /// Zero counters for a scene that is closed on all sides or not.
    pub fn new(closed_scene: bool) -> Self {
        Self { closed_scene, ..Self::default() }
    }

    /// Counts one leaking ray.
    pub fn note(&self) {
        let thread = rayon::current_thread_index().unwrap_or(0) % SHARDS;
        self.shards[thread].0.fetch_add(1, Ordering::Relaxed);
    }

    /// Rays counted so far; exact only while no thread casts rays.
    pub fn count(&self) -> u64 {
        self.shards.iter().map(|shard| shard.0.load(Ordering::Relaxed)).sum()
    }
}
