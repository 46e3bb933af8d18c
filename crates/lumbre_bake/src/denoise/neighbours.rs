//! The neighbours of eight texels side by side: those on the same surface, or on one over which light is continuous.
//! What is computed from them is in the kernels.

use fearless_simd::{Select, Simd, f32x8, mask32x8, prelude::*, u32x8};

use super::surface::{NONE, is_continuous};
use super::texel_rows::{ChannelRows, LANES, MARGIN, MapRow, TexelRows, WINDOW, lanes, window};

/// Eight texels side by side, at least the first of them covered.
pub(crate) struct Block<'g, S: Simd> {
    grid: &'g TexelRows,
    pub simd: S,
    row: usize,
    column: usize,
    /// The surfaces of the texels.
    surfaces: u32x8<S>,
    /// Whether all eight texels are on one surface.
    is_one_surface: bool,
}

/// A row in which eight texels have neighbours.
#[derive(Clone, Copy)]
pub(crate) struct NeighbourRow<'g> {
    /// Its distance below the texels' own row, in rows; negative above it.
    pub down: i64,
    pub row: &'g MapRow,
    pub column: usize,
    surfaces: &'g [u32; WINDOW],
}

/// The position of the texels themselves in a window.
pub(crate) const CENTER: usize = MARGIN;

impl<'g, S: Simd> Block<'g, S> {
    /// The eight texels of a row of the grid that begin at a column.
    #[inline(always)]
    pub fn new(grid: &'g TexelRows, simd: S, row: usize, column: usize) -> Self {
        let surfaces: u32x8<S> =
            lanes(simd, window(&grid.cell_surfaces, grid.rows[row].start + column), CENTER);
        let is_one_surface = surfaces.simd_eq(surfaces[0]).all_true();
        Self { grid, simd, row, column, surfaces, is_one_surface }
    }

    /// A channel's values of the texels themselves.
    #[inline(always)]
    pub fn center<const N: usize>(&self, channels: &ChannelRows<N>, channel: usize) -> f32x8<S> {
        let row = &self.grid.rows[self.row];
        let at = N * row.start + channel * row.stride + self.column;
        lanes(self.simd, window(&channels.values, at), CENTER)
    }

    /// The rows of the same map up to `steps` steps above and below, from top to bottom.
    #[inline(always)]
    pub fn rows(&self, steps: usize, step: usize) -> impl Iterator<Item = NeighbourRow<'g>> + use<'g, S> {
        let (grid, index, column) = (self.grid, self.row, self.column);
        let own_row = &grid.rows[index];
        let up = steps.min(own_row.before as usize / step) as i64;
        let down = steps.min(own_row.after as usize / step) as i64;
        (-up..=down).map(move |steps| {
            let down = steps * step as i64;
            let row = &grid.rows[(index as i64 + down) as usize];
            let surfaces = window(&grid.cell_surfaces, row.start + column);
            NeighbourRow { down, row, column, surfaces }
        })
    }

    /// Whether the eight texels, and all texels of a row within `reach` columns of them, are on one surface.
    #[inline(always)]
    pub fn all_on_surface(&self, row: &NeighbourRow<'g>, reach: usize) -> bool {
        let mut all = self.is_one_surface;
        let mut at = CENTER - reach;
        while all && at < CENTER + reach {
            all = self.same_surface(row, at).all_true();
            at += LANES;
        }
        all && self.same_surface(row, CENTER + reach).all_true()
    }

    /// The texels that are on the same surface as the one at `at` in the row's window, shifted with them.
    #[inline(always)]
    fn same_surface(&self, row: &NeighbourRow<'g>, at: usize) -> mask32x8<S> {
        let others: u32x8<S> = lanes(self.simd, row.surfaces, at);
        self.surfaces.simd_eq(others)
    }

    /// The texels whose counterpart at `at` in the row's window is a neighbour: on the same surface, or one over which
    /// light is continuous.
    #[inline(always)]
    pub fn neighbour_mask(&self, row: &NeighbourRow<'g>, at: usize) -> mask32x8<S> {
        let same = self.same_surface(row, at);
        let mut continuous = 0;
        if !same.all_true() {
            let others: u32x8<S> = lanes(self.simd, row.surfaces, at);
            let none = self.simd.splat_u32x8(NONE);
            let is_decided = same | self.surfaces.simd_eq(none) | none.simd_eq(others);
            let mut undecided = !is_decided.to_bitmask() & ((1 << LANES) - 1);
            while undecided != 0 {
                let lane = undecided.trailing_zeros() as usize & (LANES - 1);
                undecided &= undecided - 1;
                continuous |=
                    u64::from(is_continuous(&self.grid.surfaces, self.surfaces[lane], others[lane])) << lane;
            }
        }
        same | mask32x8::from_bitmask(self.simd, continuous)
    }

    /// The sums of `terms` over all neighbours, in the order of rows and columns, and the number of neighbours.
    #[inline(always)]
    pub fn sums<const M: usize>(
        &self,
        steps: usize,
        step: usize,
        terms: impl Fn(&NeighbourRow<'g>, usize) -> [f32x8<S>; M],
    ) -> ([f32x8<S>; M], f32x8<S>) {
        let zero = self.simd.splat_f32x8(0.0);
        let one = self.simd.splat_f32x8(1.0);
        let (mut sums, mut count) = ([zero; M], zero);
        for row in self.rows(steps, step) {
            let all = self.all_on_surface(&row, steps * step);
            for place in 0..2 * steps + 1 {
                let at = CENTER - steps * step + place * step;
                let terms = terms(&row, at);
                if all {
                    for k in 0..M {
                        sums[k] += terms[k];
                    }
                    count += one;
                    continue;
                }
                let mask = self.neighbour_mask(&row, at);
                for k in 0..M {
                    sums[k] += mask.select(terms[k], zero);
                }
                count += mask.select(one, zero);
            }
        }
        (sums, count)
    }

    /// The mean of a channel over all neighbours.
    #[inline(always)]
    pub fn mean<const N: usize>(
        &self,
        channels: &ChannelRows<N>,
        channel: usize,
        steps: usize,
        step: usize,
    ) -> f32x8<S> {
        let (sums, count) = self.sums(
            steps,
            step,
            #[inline(always)]
            |row, at| [lanes(self.simd, channels.window(row, channel), at)],
        );
        sums[0] / count.max(1.0)
    }
}
