//! Kernels: what is computed of eight covered texels side by side, over all rows. Not the rows: those are `texel_rows`; nor what is computed.

use fearless_simd::{Level, Select, Simd, dispatch, f32x8, prelude::*, u32x8};

use super::neighbours::Block;
use super::surface::NONE;
use super::texel_rows::{ChannelRows, LANES, MARGIN, TexelRows, lanes, window};

/// Something to be computed of eight texels.
pub(crate) trait Kernel<const N: usize>: Sync {
    /// Of each lane, given what was there before, or zero; what it says of lanes without a texel does not count.
    fn at<S: Simd>(&self, block: &Block<'_, S>, before: &[f32x8<S>; N]) -> [f32x8<S>; N];
}

impl TexelRows {
    /// What a kernel makes of all covered texels.
    pub fn compute<const N: usize>(&self, kernel: &impl Kernel<N>) -> ChannelRows<N> {
        let mut strips = self.strips();
        self.change(&mut strips, kernel);
        strips
    }

    /// What a kernel makes of all covered texels, in place of what was there.
    pub fn change<const N: usize>(&self, strips: &mut ChannelRows<N>, kernel: &impl Kernel<N>) {
        self.by_rows(strips, |index, strip| {
            #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
            if let Some(simd) = self.level.as_avx2() {
                return simd.vectorize(
                    #[inline(always)]
                    || self.change_row(simd, kernel, index, strip),
                );
            }
            dispatch!(Level::baseline(), simd => self.change_row(simd, kernel, index, strip));
        });
    }

    #[inline(always)]
    fn change_row<const N: usize, S: Simd>(
        &self,
        simd: S,
        kernel: &impl Kernel<N>,
        index: usize,
        strip: &mut [f32],
    ) {
        let row = &self.rows[index];
        let zero = simd.splat_f32x8(0.0);
        for &column in &self.blocks[row.blocks.clone()] {
            let column = column as usize;
            let own: u32x8<S> = lanes(simd, window(&self.ground, row.start + column), MARGIN);
            let covered = simd.not_mask32x8(own.simd_eq(simd.splat_u32x8(NONE)));
            let block = Block::new(self, simd, index, column);
            let mut values = [zero; N];
            for (channel, value) in values.iter_mut().enumerate() {
                let at = channel * row.stride + MARGIN + column;
                *value = f32x8::from_slice(simd, &strip[at..at + LANES]);
            }
            let values = kernel.at(&block, &values);
            for (channel, value) in values.into_iter().enumerate() {
                let at = channel * row.stride + MARGIN + column;
                covered.select(value, zero).store_slice(&mut strip[at..at + LANES]);
            }
        }
    }
}
