//! Estimates the squared bias of smoothing: the error that it adds to the light while it removes noise.

use fearless_simd::{Simd, f32x8, prelude::*};

use super::filter_features::center_values;
use super::filter_pass::Smoothed;
use super::kernel::Kernel;
use super::neighbours::Block;
use super::plane::{VALUES, VALUES_PER_HALF};
use super::texel_rows::{ChannelRows, lanes};

/// Steps each way over which signed differences are averaged, and over which their products are averaged then.
const BLOCK_RADIUS: usize = 1;
const BIAS_RADIUS: usize = 3;

/// Compares the smoothed value of one half with the raw values of the other, which are independent of it. The product
/// of its differences to two raw replicates, each averaged over a block, has as its expected value the squared bias
/// plus the variance of the smoothed value, which is subtracted. (The squared difference of a single texel has the same
/// expected value, with ten times the noise.) The result may be negative by chance. The texels of a block are `STEP`
/// apart.
pub(crate) struct Products<'a, const STEP: usize> {
    pub raw: &'a Smoothed,
    pub smoothed: &'a ChannelRows<VALUES>,
}

impl<const STEP: usize> Kernel<1> for Products<'_, STEP> {
    #[inline(always)]
    fn at<S: Simd>(&self, block: &Block<'_, S>, _: &[f32x8<S>; 1]) -> [f32x8<S>; 1] {
        let simd = block.simd;
        let zero = simd.splat_f32x8(0.0);
        let (sums, count) = block.sums(
            BLOCK_RADIUS,
            STEP,
            #[inline(always)]
            |row, at| {
                let mut differences = [zero; VALUES];
                for place in 0..VALUES_PER_HALF {
                    let (half, channel) = (place / 3, place % 3);
                    let first = half * VALUES_PER_HALF + channel;
                    let one: f32x8<S> = lanes(simd, self.smoothed.window(row, first), at);
                    let two: f32x8<S> = lanes(simd, self.smoothed.window(row, first + 3), at);
                    let mean = (one + two) * 0.5;
                    for replicate in 0..2 {
                        let raw = (1 - half) * VALUES_PER_HALF + 3 * replicate + channel;
                        let raw: f32x8<S> = lanes(simd, self.raw.window(row, raw), at);
                        differences[first + 3 * replicate] = mean - raw;
                    }
                }
                differences
            },
        );
        let count = count.max(1.0);
        let scale = simd.splat_f32x8(1.0) / (count * count);
        let center = center_values(block, self.smoothed);
        let mut total = zero;
        for half in 0..2 {
            let (mut product, mut variance) = (zero, zero);
            for first in half * VALUES_PER_HALF..half * VALUES_PER_HALF + 3 {
                product += sums[first] * sums[first + 3];
                let difference = center[first] - center[first + 3];
                variance += difference * difference;
            }
            total += product * scale - variance * 0.25;
        }
        [total / 6.0]
    }
}

/// The mean of the products over the neighbours.
#[inline(always)]
pub(crate) fn squared_bias<S: Simd>(
    block: &Block<'_, S>,
    step: usize,
    products: &ChannelRows<1>,
) -> f32x8<S> {
    block.mean(products, 0, BIAS_RADIUS, step)
}
