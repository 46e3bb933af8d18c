//! Runs kernels, which compute values for eight texels side by side, over all rows of the maps. The rows are in
//! `texel_rows`; the kernels are in the files of what they compute.

use fearless_simd::{Level, Select, Simd, dispatch, f32x8, prelude::*, u32x8};

use super::neighbours::Block;
use super::surface::NONE;
use super::texel_rows::{ChannelRows, LANES, MARGIN, TexelRows, lanes, window};

/// A computation of `N` channels for eight texels at once.
pub(crate) trait Kernel<const N: usize>: Sync {
    /// The new values of all lanes, given the old ones or zero. Lanes without a texel are ignored.
    fn at<S: Simd>(&self, block: &Block<'_, S>, old: &[f32x8<S>; N]) -> [f32x8<S>; N];
}

impl TexelRows {
    /// A kernel's values for all covered texels.
    pub fn compute<const N: usize>(&self, kernel: &impl Kernel<N>) -> ChannelRows<N> {
        let mut channels = self.zeros();
        self.update(&mut channels, kernel);
        channels
    }

    /// Replaces the values of all covered texels by those that a kernel computes from them.
    pub fn update<const N: usize>(&self, channels: &mut ChannelRows<N>, kernel: &impl Kernel<N>) {
        self.for_each_row(channels, |index, values| {
            #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
            if let Some(simd) = self.level.as_avx2() {
                return simd.vectorize(
                    #[inline(always)]
                    || self.update_row(simd, kernel, index, values),
                );
            }
            dispatch!(Level::baseline(), simd => self.update_row(simd, kernel, index, values));
        });
    }

    #[inline(always)]
    fn update_row<const N: usize, S: Simd>(
        &self,
        simd: S,
        kernel: &impl Kernel<N>,
        index: usize,
        row_values: &mut [f32],
    ) {
        let row = &self.rows[index];
        let zero = simd.splat_f32x8(0.0);
        for &column in &self.blocks[row.blocks.clone()] {
            let column = column as usize;
            let surfaces: u32x8<S> = lanes(simd, window(&self.cell_surfaces, row.start + column), MARGIN);
            let covered = simd.not_mask32x8(surfaces.simd_eq(simd.splat_u32x8(NONE)));
            let block = Block::new(self, simd, index, column);
            let mut values = [zero; N];
            for (channel, value) in values.iter_mut().enumerate() {
                let at = channel * row.stride + MARGIN + column;
                *value = f32x8::from_slice(simd, &row_values[at..at + LANES]);
            }
            let values = kernel.at(&block, &values);
            for (channel, value) in values.into_iter().enumerate() {
                let at = channel * row.stride + MARGIN + column;
                covered.select(value, zero).store_slice(&mut row_values[at..at + LANES]);
            }
        }
    }
}
