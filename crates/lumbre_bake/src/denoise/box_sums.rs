//! Unweighted sums over the neighbours of each texel on its surface. Weighted fits are in `weighted_fit`.

use fearless_simd::{Simd, f32x8};

use super::kernel::Kernel;
use super::neighbours::{Block, NeighbourRow};
use super::texel_rows::{ChannelRows, WINDOW, lanes, window};

/// Sums over neighbours up to `steps` steps of `step` texels away.
pub(crate) struct BoxSums<'a, const N: usize> {
    pub values: &'a ChannelRows<N>,
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
            |row, at| {
                let mut terms = [block.simd.splat_f32x8(0.0); N];
                for (channel, term) in terms.iter_mut().enumerate() {
                    *term = lanes(block.simd, self.values.window(row, channel), at);
                }
                terms
            },
        );
        sums
    }
}

impl<const N: usize> ChannelRows<N> {
    /// The window that eight texels see of a channel in a neighbour row.
    #[inline(always)]
    pub fn window(&self, neighbour_row: &NeighbourRow<'_>, channel: usize) -> &[f32; WINDOW] {
        let row = neighbour_row.row;
        window(&self.values, N * row.start + channel * row.stride + neighbour_row.column)
    }
}
