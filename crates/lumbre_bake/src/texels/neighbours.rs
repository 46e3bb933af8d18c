//! Who lies around eight texels side by side, on their surface or one that goes on from it. Not what is done with them.

use fearless_simd::{Select, Simd, f32x8, mask32x8, prelude::*, u32x8};

use super::lanes::{Grid, LANES, MARGIN, MapRow, Strips, WINDOW, lanes, window};
use super::surroundings::{NONE, goes_on};

/// Eight texels side by side, at least the first of them covered.
pub(crate) struct Block<'g, S: Simd> {
    grid: &'g Grid,
    pub simd: S,
    row: usize,
    column: usize,
    /// Their surfaces, and whether those are one.
    own: u32x8<S>,
    alike: bool,
}

/// A row in which eight texels have neighbours.
#[derive(Clone, Copy)]
pub(crate) struct Beside<'g> {
    /// Rows from the texels' own to it.
    pub down: i64,
    row: &'g MapRow,
    column: usize,
    ground: &'g [u32; WINDOW],
}

/// The texels' own place in a window.
pub(crate) const OWN: usize = MARGIN;

impl<'g, S: Simd> Block<'g, S> {
    /// In a row of the grid, from a column on.
    #[inline(always)]
    pub fn new(grid: &'g Grid, simd: S, row: usize, column: usize) -> Self {
        let own: u32x8<S> = lanes(simd, window(&grid.ground, grid.rows[row].start + column), OWN);
        Self { grid, simd, row, column, own, alike: own.simd_eq(own[0]).all_true() }
    }

    /// What strips hold of the texels themselves.
    #[inline(always)]
    pub fn own<const N: usize>(&self, strips: &Strips<N>, channel: usize) -> f32x8<S> {
        let row = &self.grid.rows[self.row];
        let at = N * row.start + channel * row.stride + self.column;
        lanes(self.simd, window(&strips.values, at), OWN)
    }

    /// The rows of the map so many steps up and down.
    #[inline(always)]
    pub fn rows(&self, steps: usize, step: usize) -> impl Iterator<Item = Beside<'g>> + use<'g, S> {
        let (grid, index, column) = (self.grid, self.row, self.column);
        let own = &grid.rows[index];
        let up = steps.min(own.before as usize / step) as i64;
        let down = steps.min(own.after as usize / step) as i64;
        (-up..=down).map(move |steps| {
            let down = steps * step as i64;
            let row = &grid.rows[(index as i64 + down) as usize];
            Beside { down, row, column, ground: window(&grid.ground, row.start + column) }
        })
    }

    /// Whether all that is within reach in a row is on the texels' one surface.
    #[inline(always)]
    pub fn all_count(&self, beside: &Beside<'g>, reach: usize) -> bool {
        let mut all = self.alike;
        let mut at = OWN - reach;
        while all && at < OWN + reach {
            all = self.same(beside, at).all_true();
            at += LANES;
        }
        all && self.same(beside, OWN + reach).all_true()
    }

    #[inline(always)]
    fn same(&self, beside: &Beside<'g>, at: usize) -> mask32x8<S> {
        let others: u32x8<S> = lanes(self.simd, beside.ground, at);
        self.own.simd_eq(others)
    }

    /// The texels whose neighbour `at` that place of the window counts: those on the same surface, or one that goes on from it.
    #[inline(always)]
    pub fn counts(&self, beside: &Beside<'g>, at: usize) -> mask32x8<S> {
        let same = self.same(beside, at);
        let mut more = 0;
        if !same.all_true() {
            let others: u32x8<S> = lanes(self.simd, beside.ground, at);
            let none = self.simd.splat_u32x8(NONE);
            let sure = same | self.own.simd_eq(none) | none.simd_eq(others);
            let mut unsure = !sure.to_bitmask() & ((1 << LANES) - 1);
            while unsure != 0 {
                let lane = unsure.trailing_zeros() as usize & (LANES - 1);
                unsure &= unsure - 1;
                more |= u64::from(goes_on(&self.grid.surfaces, self.own[lane], others[lane])) << lane;
            }
        }
        same | mask32x8::from_bitmask(self.simd, more)
    }

    /// Sums of terms over neighbours, row by row and column by column, and how many there are.
    #[inline(always)]
    pub fn sums<const M: usize>(
        &self,
        steps: usize,
        step: usize,
        terms: impl Fn(&Beside<'g>, usize) -> [f32x8<S>; M],
    ) -> ([f32x8<S>; M], f32x8<S>) {
        let zero = self.simd.splat_f32x8(0.0);
        let one = self.simd.splat_f32x8(1.0);
        let (mut sums, mut count) = ([zero; M], zero);
        for beside in self.rows(steps, step) {
            let all = self.all_count(&beside, steps * step);
            for place in 0..2 * steps + 1 {
                let at = OWN - steps * step + place * step;
                let terms = terms(&beside, at);
                if all {
                    for k in 0..M {
                        sums[k] += terms[k];
                    }
                    count += one;
                    continue;
                }
                let counts = self.counts(&beside, at);
                for k in 0..M {
                    sums[k] += counts.select(terms[k], zero);
                }
                count += counts.select(one, zero);
            }
        }
        (sums, count)
    }

    /// Mean of a channel over neighbours.
    #[inline(always)]
    pub fn mean<const N: usize>(
        &self,
        strips: &Strips<N>,
        channel: usize,
        steps: usize,
        step: usize,
    ) -> f32x8<S> {
        let (sums, count) = self.sums(
            steps,
            step,
            #[inline(always)]
            |beside, at| [lanes(self.simd, strips.beside(beside, channel), at)],
        );
        sums[0] / count.max(1.0)
    }
}

impl<const N: usize> Strips<N> {
    /// What eight texels see of a channel in a row.
    #[inline(always)]
    pub fn beside(&self, beside: &Beside<'_>, channel: usize) -> &[f32; WINDOW] {
        let row = beside.row;
        window(&self.values, N * row.start + channel * row.stride + beside.column)
    }
}
