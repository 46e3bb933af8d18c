//! Batches of shadow samples, and the variance of their mean. Not the sampling.

/// Batches of samples whose spread tells the error of their mean (the method of batch means): each is a low-discrepancy sequence of its own. (One
/// in every four samples is not: their spread is several times larger than the error.) All together are spread better than apart, so that the true
/// error is smaller.
pub(crate) const BATCHES: usize = 4;

/// The batch of one of so many samples.
pub(crate) fn batch_of(sample: u32, samples: u32) -> usize {
    (sample as usize * BATCHES / samples.max(1) as usize).min(BATCHES - 1)
}

/// Four batches tell their own spread badly, and at straight edges they agree better than they should: it counts twice.
const FEW_BATCHES: f32 = 2.0;

/// Variance of the mean of all batches, from each batch's mean.
pub(crate) fn variance_of_mean(batches: [f32; BATCHES]) -> f32 {
    let mean = batches.iter().sum::<f32>() / BATCHES as f32;
    let squares: f32 = batches.iter().map(|batch| (batch - mean).powi(2)).sum();
    FEW_BATCHES * squares / (BATCHES * (BATCHES - 1)) as f32
}
