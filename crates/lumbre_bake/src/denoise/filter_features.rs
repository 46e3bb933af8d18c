//! The features of a texel that the weights of its neighbours depend on: its noise, and local means by which edges are
//! told from noise. The weights themselves are in `weighted_fit`.

use fearless_simd::{Simd, f32x8, prelude::*};

use super::filter_pass::Smoothed;
use super::kernel::Kernel;
use super::neighbours::Block;
use super::plane::{REPLICATES_PER_HALF, VALUES, VALUES_PER_HALF};
use super::replicates::REPLICATES;
use super::texel_rows::{ChannelRows, lanes};

/// The reach, in steps, over which the noise of texels is averaged.
pub(crate) const NOISE_STEPS: usize = 2;

/// The variance of the replicates' mean, sum of the channels.
pub(crate) struct Variances<'a>(pub &'a Smoothed);

impl Kernel<1> for Variances<'_> {
    #[inline(always)]
    fn at<S: Simd>(&self, block: &Block<'_, S>, _: &[f32x8<S>; 1]) -> [f32x8<S>; 1] {
        [sum_of_variances(block.simd, &center_values(block, self.0))]
    }
}

/// All replicates of the block's own texels.
#[inline(always)]
pub(crate) fn center_values<const N: usize, S: Simd>(
    block: &Block<'_, S>,
    channels: &ChannelRows<N>,
) -> [f32x8<S>; VALUES] {
    let mut values = [block.simd.splat_f32x8(0.0); VALUES];
    for (place, value) in values.iter_mut().enumerate() {
        *value = block.center(channels, place);
    }
    values
}

/// The variance of the replicates' mean, as `replicates::variance` computes it; sum of the channels.
#[inline(always)]
pub(crate) fn sum_of_variances<S: Simd>(simd: S, values: &[f32x8<S>; VALUES]) -> f32x8<S> {
    let mut sum = simd.splat_f32x8(0.0);
    for channel in 0..3 {
        let [a, b, c, d] = [values[channel], values[3 + channel], values[6 + channel], values[9 + channel]];
        let mean = (a + b + c + d) / REPLICATES as f32;
        let [a, b, c, d] = [a - mean, b - mean, c - mean, d - mean];
        sum += (a * a + b * b + c * c + d * d) / (REPLICATES * (REPLICATES - 1)) as f32;
    }
    sum
}

/// The features of each texel. Its noise is the mean variance of its neighbourhood, as a variance from only four
/// replicates is itself noisy. The features, by which edges are detected, are the means of each half of the replicates
/// over the adjacent texels. The weights of each half are computed from the other half: weights correlated with the
/// noise that they average would pull the mean towards the most frequent values, and lose light (Rousselle, Knaus,
/// Zwicker, "Adaptive Rendering with Non-Local Means", 2012).
pub(crate) struct Features<'a, const STEP: usize> {
    /// The reach of the means, in steps.
    pub steps: usize,
    pub estimates: &'a Smoothed,
    pub variances: &'a ChannelRows<1>,
}

/// Three channels of the features for each half's weights, and the noise.
pub(crate) const FEATURES: usize = 2 * 3 + 1;
pub(crate) const NOISE: usize = 2 * 3;

impl<const STEP: usize> Kernel<FEATURES> for Features<'_, STEP> {
    #[inline(always)]
    fn at<S: Simd>(&self, block: &Block<'_, S>, _: &[f32x8<S>; FEATURES]) -> [f32x8<S>; FEATURES] {
        let simd = block.simd;
        let (sums, count) = block.sums(
            self.steps,
            STEP,
            #[inline(always)]
            |row, at| {
                let mut sums = [simd.splat_f32x8(0.0); 2 * 3];
                for (place, sum) in sums.iter_mut().enumerate() {
                    let (half, channel) = (1 - place / 3, place % 3);
                    let first = VALUES_PER_HALF * half + channel;
                    let one: f32x8<S> = lanes(simd, self.estimates.window(row, first), at);
                    let two: f32x8<S> = lanes(simd, self.estimates.window(row, first + 3), at);
                    *sum = one + two;
                }
                sums
            },
        );
        let scale = simd.splat_f32x8(1.0) / (count * REPLICATES_PER_HALF as f32).max(1.0);
        let mut features = [block.mean(self.variances, 0, NOISE_STEPS, STEP); FEATURES];
        for (feature, sum) in features.iter_mut().zip(sums) {
            *feature = sum * scale;
        }
        features
    }
}
