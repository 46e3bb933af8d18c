//! What smoothing may have done to the light besides taking its noise away. Not the smoothing.

use fearless_simd::{Simd, f32x8, prelude::*};

use super::filter_features::own_values;
use super::neighbours::Block;
use super::plane::{OF_HALF, VALUES};
use super::texel_rows::{ChannelRows, lanes};
use crate::denoise::filter_pass::Smoothed;
use crate::denoise::kernel::Kernel;

/// Texels around one over which differences are averaged with their sign, and then without it.
const BLOCK_RADIUS: usize = 1;
const BIAS_RADIUS: usize = 3;

/// The smoothed value of one half against the raw values of the other, which know nothing of it: the product of its differences
/// to two replicates, each averaged over a block, has the square of the bias as its mean, and the smoothed value's own variance.
/// (A single texel's squared difference says the same with ten times the noise.) May be negative, by chance.
/// Blocks are of texels `STEP` apart.
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
            |beside, at| {
                let mut differences = [zero; VALUES];
                for place in 0..OF_HALF {
                    let (half, channel) = (place / 3, place % 3);
                    let first = half * OF_HALF + channel;
                    let one: f32x8<S> = lanes(simd, self.smoothed.beside(beside, first), at);
                    let two: f32x8<S> = lanes(simd, self.smoothed.beside(beside, first + 3), at);
                    let mean = (one + two) * 0.5;
                    for replicate in 0..2 {
                        let raw = (1 - half) * OF_HALF + 3 * replicate + channel;
                        let raw: f32x8<S> = lanes(simd, self.raw.beside(beside, raw), at);
                        differences[first + 3 * replicate] = mean - raw;
                    }
                }
                differences
            },
        );
        let count = count.max(1.0);
        let scale = simd.splat_f32x8(1.0) / (count * count);
        let own = own_values(block, self.smoothed);
        let mut both = zero;
        for half in 0..2 {
            let (mut product, mut chance) = (zero, zero);
            for first in half * OF_HALF..half * OF_HALF + 3 {
                product += sums[first] * sums[first + 3];
                let apart = own[first] - own[first + 3];
                chance += apart * apart;
            }
            both += product * scale - chance * 0.25;
        }
        [both / 6.0]
    }
}

/// The mean of the products around.
#[inline(always)]
pub(crate) fn squared_bias<S: Simd>(
    block: &Block<'_, S>,
    step: usize,
    products: &ChannelRows<1>,
) -> f32x8<S> {
    block.mean(products, 0, BIAS_RADIUS, step)
}
