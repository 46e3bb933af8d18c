//! Lists that take long, in chunks: between them the caller may cancel, the clock is looked at, and what is done is kept in the
//! checkpoint. Not what is computed: a value depends on its index alone, so the chunks' borders show nowhere. A chunk that takes longer
//! than those before it made expect is given up within a moment if the caller cancels.

use std::time::Instant;

use rayon::prelude::*;

use crate::BakeError;
use crate::checkpoint::Record;
use crate::monitor::BakeMonitor;

/// Seconds that a chunk should take: a prompt answer, and long enough to keep the threads busy.
const PACE: f64 = 0.1;
/// Values of the first chunk, and of any.
const FIRST: usize = 1024;
const LEAST: usize = 64;
const MOST: usize = 1 << 16;

/// Computes one value per index, in order.
///
/// # Errors
/// [`BakeError::Cancelled`].
pub(crate) fn in_chunks<T: Send + Record>(
    count: usize,
    monitor: &mut BakeMonitor<'_>,
    compute: impl Fn(usize) -> T + Sync,
) -> Result<Vec<T>, BakeError> {
    chunks(count, monitor, false, compute)
}

/// As [`in_chunks`], but it ends when the time is up: the values are then those of the first indices only.
///
/// # Errors
/// [`BakeError::Cancelled`].
pub(crate) fn in_chunks_until_deadline<T: Send + Record>(
    count: usize,
    monitor: &mut BakeMonitor<'_>,
    compute: impl Fn(usize) -> T + Sync,
) -> Result<Vec<T>, BakeError> {
    chunks(count, monitor, true, compute)
}

/// As [`in_chunks`], of a list that is quick to make anew and so not kept in the checkpoint.
///
/// # Errors
/// [`BakeError::Cancelled`].
pub(crate) fn in_chunks_uncheckpointed<T: Send>(
    count: usize,
    monitor: &mut BakeMonitor<'_>,
    compute: impl Fn(usize) -> T + Sync,
) -> Result<Vec<T>, BakeError> {
    let mut values = Vec::with_capacity(count);
    while values.len() < count {
        let end = (values.len() + LEAST).min(count);
        values.extend(chunk(values.len(), end, count, monitor, &compute)?);
        monitor.advance(values.len() as f32 / count as f32)?;
    }
    Ok(values)
}

/// The values from `start` to `end`, of `count`.
fn chunk<T: Send>(
    start: usize,
    end: usize,
    count: usize,
    monitor: &mut BakeMonitor<'_>,
    compute: impl Fn(usize) -> T + Sync,
) -> Result<Vec<T>, BakeError> {
    let stop = monitor.stop().clone();
    let one = |index: usize| (!stop.is_cancelled()).then(|| compute(index));
    let done = monitor
        .run_interruptible(start as f32 / count as f32, || (start..end).into_par_iter().map(one).collect())?;
    // None only if it was stopped, which has ended here already.
    let done: Option<Vec<T>> = done;
    Ok(done.unwrap_or_default())
}

fn chunks<T: Send + Record>(
    count: usize,
    monitor: &mut BakeMonitor<'_>,
    may_end: bool,
    compute: impl Fn(usize) -> T + Sync,
) -> Result<Vec<T>, BakeError> {
    let mut values = Vec::with_capacity(count);
    let mut size = FIRST;
    while values.len() < count {
        let start = values.len();
        if let Some(kept) = monitor.load_chunk(start, count) {
            if kept.is_empty() && may_end {
                monitor.cut_short();
                break;
            }
            values.extend(kept);
        } else if may_end && monitor.clock().is_over() {
            monitor.store_chunk::<T>(start, count, &[]);
            monitor.cut_short();
            break;
        } else {
            let begun = Instant::now();
            let end = (start + size).min(count);
            values.extend(chunk(start, end, count, monitor, &compute)?);
            monitor.store_chunk(start, count, &values[start..]);
            let wanted = size as f64 * PACE / begun.elapsed().as_secs_f64().max(1e-6);
            size = (wanted as usize).min(4 * size).clamp(LEAST, MOST);
        }
        monitor.advance(values.len() as f32 / count as f32)?;
    }
    Ok(values)
}
