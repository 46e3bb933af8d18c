//! The texels of the lightmaps: which surface they show, the light that arrives there, and what stands in the texels
//! that show none. Not the transport between patches that the gather reads.

pub(crate) mod charts;
pub(crate) mod error_estimate;
pub(crate) mod fill;
pub(crate) mod footprint;
pub(crate) mod gather;
pub(crate) mod hidden;
pub(crate) mod lighting;
pub(crate) mod rounds;
pub(crate) mod seams;
pub(crate) mod smooth;
pub(crate) mod tile_sequence;

use rayon::prelude::*;

use crate::BakeError;
use crate::progress::Watch;

/// Computes one value per index, in order, in chunks between which the caller may cancel.
pub(crate) fn in_chunks<T: Send>(
    count: usize,
    watch: &mut Watch<'_>,
    compute: impl Fn(usize) -> T + Sync,
) -> Result<Vec<T>, BakeError> {
    // Small enough for a prompt answer to a cancellation, large enough to keep the threads busy.
    const CHUNK: usize = 8192;
    let mut values = Vec::with_capacity(count);
    for start in (0..count).step_by(CHUNK) {
        let end = (start + CHUNK).min(count);
        values.par_extend((start..end).into_par_iter().map(&compute));
        watch.advance(end as f32 / count as f32)?;
    }
    Ok(values)
}
