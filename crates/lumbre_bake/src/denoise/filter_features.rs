//! A texel's noise, and what tells edges from it. Not the weights that come of them.

use fearless_simd::{Simd, f32x8, prelude::*};

use super::neighbours::Block;
use super::plane::{HALF, VALUES};
use super::texel_rows::{ChannelRows, lanes};
use crate::denoise::filter_pass::Smoothed;
use crate::denoise::kernel::Kernel;
use crate::denoise::replicates::REPLICATES;

/// Reach over which a texel's noise is averaged, in steps.
pub(crate) const NOISE_STEPS: usize = 2;

/// Variance of the replicates' mean, sum of the channels.
pub(crate) struct Variances<'a>(pub &'a Smoothed);

impl Kernel<1> for Variances<'_> {
    #[inline(always)]
    fn at<S: Simd>(&self, block: &Block<'_, S>, _: &[f32x8<S>; 1]) -> [f32x8<S>; 1] {
        [sum_of_variances(block.simd, &own_values(block, self.0))]
    }
}

/// The channels of all replicates of the texels themselves.
#[inline(always)]
pub(crate) fn own_values<const N: usize, S: Simd>(
    block: &Block<'_, S>,
    strips: &ChannelRows<N>,
) -> [f32x8<S>; VALUES] {
    let mut values = [block.simd.splat_f32x8(0.0); VALUES];
    for (place, value) in values.iter_mut().enumerate() {
        *value = block.own(strips, place);
    }
    values
}

/// As [`variance`], sum of the channels.
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

/// A texel's noise: its own spread of four is itself noise, the neighbourhood's mean is not. And what tells edges: the means of both halves
/// over the texels next to it. Each half's weights come from the other half: noise that shaped the weights would pull the mean towards
/// what is most frequent, and light is lost (Rousselle, Knaus, Zwicker, "Adaptive Rendering with Non-Local Means", 2012).
pub(crate) struct Features<'a, const STEP: usize> {
    /// Reach of the means that tell edges, in steps.
    pub steps: usize,
    pub estimates: &'a Smoothed,
    pub variances: &'a ChannelRows<1>,
}
/// The channels for the weights of each half, and the noise.
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
            |beside, at| {
                let mut sums = [simd.splat_f32x8(0.0); 2 * 3];
                for (place, sum) in sums.iter_mut().enumerate() {
                    let (half, channel) = (1 - place / 3, place % 3);
                    let first = 3 * HALF * half + channel;
                    let one: f32x8<S> = lanes(simd, self.estimates.beside(beside, first), at);
                    let two: f32x8<S> = lanes(simd, self.estimates.beside(beside, first + 3), at);
                    *sum = one + two;
                }
                sums
            },
        );
        let scale = simd.splat_f32x8(1.0) / (count * HALF as f32).max(1.0);
        let mut features = [block.mean(self.variances, 0, NOISE_STEPS, STEP); FEATURES];
        for (guide, sum) in features.iter_mut().zip(sums) {
            *guide = sum * scale;
        }
        features
    }
}
