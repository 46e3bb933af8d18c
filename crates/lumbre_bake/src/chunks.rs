//! Computes long lists in chunks. Between chunks progress is reported, the bake can be cancelled or run out of time,
//! and finished values are written to the checkpoint. A value depends on its index alone, so the result does not depend
//! on where one chunk ends and the next begins. If the caller cancels during a chunk, its remaining values are skipped.

use std::time::Instant;

use rayon::prelude::*;

use crate::BakeError;
/// What chunks consist of: values that a checkpoint can keep.
pub(crate) use crate::checkpoint::Record;
use crate::monitor::BakeMonitor;

/// Seconds that a chunk should take: short enough for regular progress, long enough to keep all threads busy.
const CHUNK_SECONDS: f64 = 0.1;
/// Number of values in the first chunk, and the limits for all others.
const FIRST_SIZE: usize = 1024;
const MIN_SIZE: usize = 64;
const MAX_SIZE: usize = 1 << 16;

/// Computes `count` values, one per index, in order.
pub(crate) fn in_chunks<T: Send + Record>(
    count: usize,
    monitor: &mut BakeMonitor<'_>,
    compute: impl Fn(usize) -> T + Sync,
) -> Result<Vec<T>, BakeError> {
    compute_chunks(count, monitor, false, compute)
}

/// As [`in_chunks`], but stops when the time is up and then returns the values of the first indices only.
pub(crate) fn in_chunks_until_deadline<T: Send + Record>(
    count: usize,
    monitor: &mut BakeMonitor<'_>,
    compute: impl Fn(usize) -> T + Sync,
) -> Result<Vec<T>, BakeError> {
    compute_chunks(count, monitor, true, compute)
}

/// A decision that depends on the clock. The checkpoint keeps it, so that a resumed bake decides the same.
pub(crate) fn decide<T: Copy + Send + Sync + Record>(
    monitor: &mut BakeMonitor<'_>,
    decision: T,
) -> Result<T, BakeError> {
    Ok(in_chunks(1, monitor, |_| decision)?.first().copied().unwrap_or(decision))
}

/// As [`in_chunks`], but without the checkpoint: for lists that are quick to compute again.
pub(crate) fn in_chunks_uncheckpointed<T: Send>(
    count: usize,
    monitor: &mut BakeMonitor<'_>,
    compute: impl Fn(usize) -> T + Sync,
) -> Result<Vec<T>, BakeError> {
    let mut values = Vec::with_capacity(count);
    // Small at first, as a value may take far longer here than elsewhere.
    let mut size = MIN_SIZE;
    while values.len() < count {
        let begun = Instant::now();
        let end = (values.len() + size).min(count);
        values.extend(compute_chunk(values.len(), end, count, monitor, &compute)?);
        size = next_size(size, begun);
        monitor.advance(values.len() as f32 / count as f32)?;
    }
    Ok(values)
}

/// The size of the chunk after one of `size` values that was begun at `begun` and has just ended.
fn next_size(size: usize, begun: Instant) -> usize {
    let on_time = size as f64 * CHUNK_SECONDS / begun.elapsed().as_secs_f64().max(1e-6);
    (on_time as usize).min(4 * size).clamp(MIN_SIZE, MAX_SIZE)
}

/// Computes the values `start..end` of a list of `count`.
fn compute_chunk<T: Send>(
    start: usize,
    end: usize,
    count: usize,
    monitor: &mut BakeMonitor<'_>,
    compute: impl Fn(usize) -> T + Sync,
) -> Result<Vec<T>, BakeError> {
    let stop = monitor.stop().clone();
    let value = |index: usize| (!stop.is_cancelled()).then(|| compute(index));
    let values: Option<Vec<T>> = monitor.run_interruptible(start as f32 / count as f32, || {
        (start..end).into_par_iter().map(value).collect()
    })?;
    // `None` only after a cancellation, for which `run_interruptible` has returned an error.
    Ok(values.unwrap_or_default())
}

/// If `stops_at_deadline`, the list may end early, which the checkpoint records as an empty chunk.
fn compute_chunks<T: Send + Record>(
    count: usize,
    monitor: &mut BakeMonitor<'_>,
    stops_at_deadline: bool,
    compute: impl Fn(usize) -> T + Sync,
) -> Result<Vec<T>, BakeError> {
    let mut values = Vec::with_capacity(count);
    let mut size = FIRST_SIZE;
    while values.len() < count {
        let start = values.len();
        if let Some(loaded) = monitor.load_chunk(start, count) {
            if loaded.is_empty() && stops_at_deadline {
                monitor.cut_short();
                break;
            }
            values.extend(loaded);
        } else if stops_at_deadline && monitor.clock().is_over() {
            monitor.store_chunk::<T>(start, count, &[]);
            monitor.cut_short();
            break;
        } else {
            let begun = Instant::now();
            let end = (start + size).min(count);
            values.extend(compute_chunk(start, end, count, monitor, &compute)?);
            monitor.store_chunk(start, count, &values[start..]);
            size = next_size(size, begun);
        }
        monitor.advance(values.len() as f32 / count as f32)?;
    }
    Ok(values)
}
