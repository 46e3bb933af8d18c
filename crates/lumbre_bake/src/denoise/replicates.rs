//! Replicates: independent estimates of the same light. Their mean is the estimate, and their spread gives its error.
//! How they are sampled is of no concern here.

use glam::Vec3;
use rayon::prelude::*;

use super::neighbourhoods::Neighbourhoods;
use crate::squared_errors::SquaredErrors;

/// Replicates per texel. Their spread does not include the error of data that all of them read.
pub(crate) const REPLICATES: usize = 4;

/// A texel's estimates of its light, one per replicate.
pub(crate) type Estimates = [Vec3; REPLICATES];

/// The mean of the replicates.
pub(crate) fn mean(estimates: &Estimates) -> Vec3 {
    estimates.iter().sum::<Vec3>() / REPLICATES as f32
}

/// The variance of the replicates' mean.
pub(crate) fn variance(estimates: &Estimates) -> Vec3 {
    let mean = mean(estimates);
    let squares: Vec3 = estimates.iter().map(|&e| (e - mean) * (e - mean)).sum();
    squares / (REPLICATES * (REPLICATES - 1)) as f32
}

/// Steps each way, and texels per step, over which the spread of the replicates is averaged.
const SPREAD_STEPS: usize = 2;
const SPREAD_STEP: usize = 3;
/// The squared relative error of a variance from four replicates: 2 / (4 - 1).
const RELATIVE_VARIANCE: f32 = 2.0 / 3.0;

/// Standard errors of the neighbours' mean variance that are added to it, out of caution. With one, 94.6 % of the
/// texels of two rooms baked to an error of 1 % are within twice their stated error (mean of four seeds); with one and
/// a half 96.6 % are, and with two 97.9 %, for twice the rays.
const CAUTION: f32 = 1.5;

/// The variance of every texel's mean. Four replicates alone give a poor estimate of it: in one case of seven the mean
/// is further than two of their standard errors from the truth (Student's t with three degrees of freedom). So the
/// variances of the neighbours are used too. The cautious figure for a single texel is the larger of its own variance
/// and the neighbours' mean plus [`CAUTION`] standard errors, since sampling stops where the estimate is small by
/// chance. The figure to be expected over many texels is the neighbours' mean.
pub(crate) fn spread(neighbourhoods: &Neighbourhoods<'_>, estimates: &[Estimates]) -> SquaredErrors {
    let variances: Vec<f32> = estimates.par_iter().map(|e| variance(e).element_sum() / 3.0).collect();
    // The replicates of a half are smoothed with the same weights, so only the difference of the halves shows the noise
    // of the weights.
    let of_halves: Vec<f32> = estimates
        .par_iter()
        .map(|[a, b, c, d]| {
            let half_difference = 0.25 * (*a + *b - *c - *d);
            (half_difference * half_difference).element_sum() / 3.0
        })
        .collect();
    let terms = |index: usize| [1.0, variances[index], variances[index] * variances[index], of_halves[index]];
    let sums = neighbourhoods.sums(terms, SPREAD_STEPS, SPREAD_STEP);
    let errors = |([count, sum, squares, of_halves], variance): ([f32; 4], &f32)| {
        let mean = (sum / count.max(1.0)).max(of_halves / count.max(1.0));
        (variance.max(mean + CAUTION * standard_error([count, sum, squares])), mean)
    };
    let (cautious, expected) = sums.into_par_iter().zip(&variances).map(errors).unzip();
    SquaredErrors { cautious, expected }
}

/// The standard error of the mean of variances, from their count, their sum and the sum of their squares. It is at
/// least that of variances with three degrees of freedom each, because the scatter of a few says little.
pub(crate) fn standard_error([count, sum, squares]: [f32; 3]) -> f32 {
    let count = count.max(1.0);
    let mean = sum / count;
    let scatter = (squares / count - mean * mean).max(RELATIVE_VARIANCE * mean * mean);
    (scatter / count).sqrt()
}
