//! What may be wrong with a texel, from what the stages know of themselves. Not a comparison with a better bake: that is a test's.
//!
//! ```text
//!   variance = direct light: spread of interleaved groups of shadow samples
//!            + final gather: spread of four scrambles, after smoothing
//!            + smoothing:    half of the scrambles smoothed against the other half raw, over the neighbourhood
//!            + form factors: half the difference of two half solutions, gathered by the texel's own rays
//!            + patches' size: the difference to the solution with patches twice as large, gathered likewise
//!            + patches:      patch against real bounce, checked at some of the hits, over the neighbourhood
//!            + solver:       residual / (1 - rho) of the light by bounces
//! ```
//!
//! Not in it: the map's own resolution, and what a penumbra hides that all samples of a texel and of its neighbours missed.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::footprint::Texel;
use super::gather::{Gathered, SCRAMBLES};
use super::smooth::{Estimates, mean, variance};
use super::surroundings::Surroundings;
use crate::transport::direct::Direct;

/// What the gather leaves of each kind, squared, mean of the channels, per covered texel.
pub(crate) struct GatherErrors<'a> {
    pub gathered: &'a [Gathered],
    pub estimates: &'a [Estimates],
    /// Variance of the mean of each.
    pub spread: &'a [f32],
    pub smoothing_bias: &'a [f32],
    pub patch_bias: &'a [PatchBias],
    /// Relative, of the solver.
    pub residual_bound: f64,
}

/// Steps each way, and texels of a step, over which the spread of the scrambles is put together.
const SPREAD_STEPS: i64 = 2;
const SPREAD_STEP: i64 = 3;

/// Variance of every texel's mean, mean of the channels. Four scrambles alone tell it badly: in one case of seven the mean is further than
/// two of their standard errors from the truth (Student's t with three degrees of freedom); their neighbours' tell it too, and the larger counts.
pub(crate) fn spread(surroundings: &Surroundings<'_>, texels: &[Texel], estimates: &[Estimates]) -> Vec<f32> {
    let own: Vec<f32> = estimates.iter().map(|e| variance(e).element_sum() / 3.0).collect();
    let halves: Vec<f32> = estimates
        .iter()
        .map(|[a, b, c, d]| {
            let apart = 0.25 * (*a + *b - *c - *d);
            (apart * apart).element_sum() / 3.0
        })
        .collect();
    let sure: f32 = std::env::var("SURE").ok().and_then(|v| v.parse().ok()).unwrap_or(1.0); // TEMP
    let around = |texel: &Texel| {
        let (mut sum, mut squares, mut of_halves, mut count) = (0.0, 0.0, 0.0, 0u32);
        surroundings.every(texel, SPREAD_STEPS, SPREAD_STEP).for_each(|(.., other)| {
            sum += own[other];
            squares += own[other] * own[other];
            of_halves += halves[other];
            count += 1;
        });
        let count = count.max(1) as f32;
        let (mean, of_halves) = (sum / count, of_halves / count);
        let by_chance = ((squares / count - mean * mean).max(0.0) / count).sqrt();
        mean.max(of_halves) + sure * by_chance
        let correction = if correction.is_finite() { correction } else { DVec3::ZERO };
        let later = later * square(correction);
        let (rest, expected) = ((unknown.max(0.0) + later) as f32, (unknown + later) as f32);
        PatchBias { correction: correction.as_vec3(), rest, expected }
    };
    texels.par_iter().map(around).collect()
}
