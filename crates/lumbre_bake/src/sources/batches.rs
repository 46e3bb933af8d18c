//! Batches of shadow samples, and the variance of their mean. The samples are drawn elsewhere.

/// Number of batches of samples whose spread estimates the error of their mean (the method of batch means). Each batch
/// is a contiguous section of the samples, and so a low-discrepancy sequence of its own. (Every fourth sample would not
/// be: the spread of such batches is several times larger than the error.) All samples together are distributed better
/// than each batch alone, so the true error is smaller.
pub(crate) const BATCHES: usize = 4;

/// The batch that sample number `sample` of `samples` belongs to.
pub(crate) fn batch_of(sample: u32, samples: u32) -> usize {
    (sample as usize * BATCHES / samples.max(1) as usize).min(BATCHES - 1)
}

/// Safety factor on the variance: four batches estimate their spread poorly, and at straight edges they agree better
/// than they should.
const VARIANCE_FACTOR: f32 = 2.0;

/// Variance of the mean of all batches, estimated from each batch's mean.
pub(crate) fn variance_of_mean(batches: [f32; BATCHES]) -> f32 {
    let mean = batches.iter().sum::<f32>() / BATCHES as f32;
    let squares: f32 = batches.iter().map(|batch| (batch - mean).powi(2)).sum();
    VARIANCE_FACTOR * squares / (BATCHES * (BATCHES - 1)) as f32
}
