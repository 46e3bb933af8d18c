//! Sums of numbers over the neighbours of each texel on its surface, all with the same weight. Not a fit.

use crate::denoise::neighbours::Beside;
use crate::denoise::texel_rows::{WINDOW, lanes, window};
use fearless_simd::{Simd, f32x8};

use super::kernel::Kernel;
use super::neighbours::Block;
use super::texel_rows::ChannelRows;

/// Sums over neighbours.
pub(crate) struct BoxSums<'a, const N: usize> {
    pub of: &'a ChannelRows<N>,
    pub steps: usize,
    pub step: usize,
}

impl<const N: usize> Kernel<N> for BoxSums<'_, N> {
    #[inline(always)]
    fn at<S: Simd>(&self, block: &Block<'_, S>, _: &[f32x8<S>; N]) -> [f32x8<S>; N] {
        let (sums, _) = block.sums(
            self.steps,
            self.step,
            #[inline(always)]
            |beside, at| {
                let mut terms = [block.simd.splat_f32x8(0.0); N];
                for (channel, term) in terms.iter_mut().enumerate() {
                    *term = lanes(block.simd, self.of.beside(beside, channel), at);
                }
                terms
            },
        );
        sums
    }
}

impl<const N: usize> ChannelRows<N> {
    /// What eight texels see of a channel in a row.
    #[inline(always)]
    pub fn beside(&self, beside: &Beside<'_>, channel: usize) -> &[f32; WINDOW] {
        let row = beside.row;
        window(&self.values, N * row.start + channel * row.stride + beside.column)
    }
}
