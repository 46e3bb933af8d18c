//! Counts rays that leak: those that end on the black back of a surface or inside something closed, and those that leave a
//! scene that is closed on all sides. Not their repair: `texels::hidden` takes out what lies inside geometry, before.

use std::sync::atomic::{AtomicU64, Ordering};

/// Counters that threads share without waiting for each other.
const SHARDS: usize = 16;

/// A counter on a cache line of its own.
#[derive(Debug, Default)]
#[repr(align(64))]
struct Shard(AtomicU64);

/// Counts rays that leak.
#[derive(Debug, Default)]
pub(crate) struct Leaks {
    shards: [Shard; SHARDS],
    /// Whether rooms that are closed on all sides hold the whole scene: no ray should leave it.
    pub closed_scene: bool,
}

impl Leaks {
    /// For a scene that is closed on all sides, or not.
    pub fn new(closed_scene: bool) -> Self {
        Self { closed_scene, ..Self::default() }
    }

    /// Counts a ray.
    pub fn note(&self) {
        let thread = rayon::current_thread_index().unwrap_or(0) % SHARDS;
        self.shards[thread].0.fetch_add(1, Ordering::Relaxed);
    }

    /// Rays counted so far: exact where no thread is casting.
    pub fn count(&self) -> u64 {
        self.shards.iter().map(|shard| shard.0.load(Ordering::Relaxed)).sum()
    }
}
