//! Replicates: independent estimates of the same light, whose mean is the estimate and whose spread is its error. Not how they are gathered.

use glam::Vec3;
use rayon::prelude::*;

use super::neighbourhoods::Neighbourhoods;
use crate::squared_errors::SquaredErrors;

/// Independent replicates per texel: their spread is the texel's error, apart from that of what they all read.
pub(crate) const REPLICATES: usize = 4;

/// What a texel has, before and after.
pub(crate) type Estimates = [Vec3; REPLICATES];
/// Mean of the replicates.
pub(crate) fn mean(estimates: &Estimates) -> Vec3 {
    estimates.iter().sum::<Vec3>() / REPLICATES as f32
}

/// Variance of that mean.
pub(crate) fn variance(estimates: &Estimates) -> Vec3 {
    let mean = mean(estimates);
    let squares: Vec3 = estimates.iter().map(|&e| (e - mean) * (e - mean)).sum();
    squares / (REPLICATES * (REPLICATES - 1)) as f32
}

/// Steps each way, and texels of a step, over which the spread of the replicates is put together.
const SPREAD_STEPS: usize = 2;
const SPREAD_STEP: usize = 3;
/// Squared, by how much of itself the variance of four replicates is off: 2 / (4 - 1).
const ALONE: f32 = 2.0 / 3.0;

/// Standard errors of the neighbours' mean: with one, two rooms of which 1 % is asked are within twice what is stated on 94.6 % of their texels
/// (mean of four seeds), with one and a half on 96.6 %, and with two on 97.9 % for twice the rays.
const BEYOND: f32 = 1.5;

/// Variance of every texel's mean. Four replicates alone tell it badly: in one case of seven the mean is further than two of their standard errors
/// from the truth (Student's t with three degrees of freedom); their neighbours' tell it too. Of a single texel the larger is stated, with so many
/// standard errors of the neighbours' mean, since rays end where it is small by chance; over many texels the neighbours' mean is right.
pub(crate) fn spread(neighbourhoods: &Neighbourhoods<'_>, estimates: &[Estimates]) -> SquaredErrors {
    let own: Vec<f32> = estimates.par_iter().map(|e| variance(e).element_sum() / 3.0).collect();
    // The replicates of a half are smoothed by the same weights: what those bring by chance, only the halves tell.
    let halves: Vec<f32> = estimates
        .par_iter()
        .map(|[a, b, c, d]| {
            let apart = 0.25 * (*a + *b - *c - *d);
            (apart * apart).element_sum() / 3.0
        })
        .collect();
    let numbers = |index: usize| [1.0, own[index], own[index] * own[index], halves[index]];
    let sums = neighbourhoods.sums(numbers, SPREAD_STEPS, SPREAD_STEP);
    let both = |([count, sum, squares, of_halves], own): ([f32; 4], &f32)| {
        let mean = (sum / count.max(1.0)).max(of_halves / count.max(1.0));
        (own.max(mean + BEYOND * standard_error([count, sum, squares])), mean)
    };
    let (cautious, expected) = sums.into_par_iter().zip(&own).map(both).unzip();
    SquaredErrors { cautious, expected }
}

/// Of the mean of so many variances, of which these are the sum and that of the squares: at least that of as many values with three degrees of
/// freedom each, as of few, what they differ by says little.
pub(crate) fn standard_error([count, sum, squares]: [f32; 3]) -> f32 {
    let count = count.max(1.0);
    let mean = sum / count;
    let scatter = (squares / count - mean * mean).max(ALONE * mean * mean);
    (scatter / count).sqrt()
}
