//! Who lies around eight texels side by side, on their surface or one that goes on from it. Not what is done with them.

use fearless_simd::{Select, Simd, f32x8, mask32x8, prelude::*, u32x8};

use super::texel_rows::{ChannelRows, LANES, MARGIN, MapRow, TexelRows, WINDOW, lanes, window};
use crate::denoise::surface::{NONE, goes_on};

/// Eight texels side by side, at least the first of them covered.
pub(crate) struct Block<'g, S: Simd> {
    grid: &'g TexelRows,
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
    pub row: &'g MapRow,
    pub column: usize,
    ground: &'g [u32; WINDOW],
}

/// The texels' own place in a window.
pub(crate) const OWN: usize = MARGIN;

impl<'g, S: Simd> Block<'g, S> {
    /// In a row of the grid, from a column on.
    #[inline(always)]
    pub fn new(grid: &'g TexelRows, simd: S, row: usize, column: usize) -> Self {
        let own: u32x8<S> = lanes(simd, window(&grid.ground, grid.rows[row].start + column), OWN);
        Self { grid, simd, row, column, own, alike: own.simd_eq(own[0]).all_true() }
    }

    /// What strips hold of the texels themselves.
    #[inline(always)]
    pub fn own<const N: usize>(&self, strips: &ChannelRows<N>, channel: usize) -> f32x8<S> {
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
        strips: &ChannelRows<N>,
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

#[cfg(test)]
pub(crate) mod tests {
    use fearless_simd::Level;
    use glam::Vec3;

    use super::*;
    use crate::denoise::kernel::Kernel;
    use crate::denoise::surface::Surface;

    const SIZES: [(u32, u32); 4] = [(37, 23), (5, 3), (1, 40), (90, 30)];

    /// SplitMix64, in [0, 1).
    pub(crate) fn random(state: &mut u64) -> f32 {
        *state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = *state;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 40) as f32 / (1 << 24) as f32
    }

    /// Maps in tiles of random surfaces, of which some go on and some do not, with holes; as these instructions compute them.
    pub(crate) fn random_grid(level: Level) -> TexelRows {
        let surface =
            |chart, x: f32, y: f32| Surface { chart, normal: Vec3::new(x, y, 0.0).normalize(), group: 0 };
        let surfaces =
            vec![surface(0, 1.0, 0.0), surface(0, 1.0, 0.2), surface(1, 1.0, 0.0), surface(1, 0.0, 1.0)];
        let mut state = 11;
        let mut ground = Vec::new();
        for (width, height) in SIZES {
            let tiles: Vec<u32> = (0..1000).map(|_| (random(&mut state) * 4.0) as u32).collect();
            for place in 0..width * height {
                // Wide ones: whole windows lie on one surface, too.
                let tile = place / width / 13 * 10 + place % width / 45;
                let hole = random(&mut state) < 0.02;
                ground.push(if hole { NONE } else { tiles[tile as usize] });
            }
        }
        let mut grid = TexelRows::new(SIZES.into_iter(), ground.into_iter(), surfaces);
        grid.level = level;
        grid
    }

    /// Random numbers of all covered texels.
    pub(crate) fn random_strips<const N: usize>(grid: &TexelRows, seed: u64) -> ChannelRows<N> {
        grid.fill(|row, column| {
            let mut state = seed ^ ((row * 1000 + column) as u64) << 20;
            std::array::from_fn(|_| random(&mut state))
        })
    }

    struct Means<'a> {
        of: &'a ChannelRows<2>,
        steps: usize,
        step: usize,
    }

    impl Kernel<2> for Means<'_> {
        #[inline(always)]
        fn at<S: Simd>(&self, block: &Block<'_, S>, _: &[f32x8<S>; 2]) -> [f32x8<S>; 2] {
            [0, 1].map(
                #[inline(always)]
                |channel| block.mean(self.of, channel, self.steps, self.step),
            )
        }
    }

    /// By asking every texel within reach.
    fn direct_mean(
        grid: &TexelRows,
        of: &ChannelRows<2>,
        [row, column]: [usize; 2],
        steps: i64,
        step: i64,
    ) -> [f32; 2] {
        let surface = |row: usize, column: i64| {
            let width = grid.rows[row].stride - MARGIN - (LANES - 1);
            let column = usize::try_from(column).ok().filter(|column| *column < width)?;
            Some(grid.ground[grid.rows[row].start + MARGIN + column])
        };
        let own = surface(row, column as i64).unwrap();
        let (mut sums, mut count) = ([0.0; 2], 0.0);
        for down in -steps..=steps {
            let down = down * step;
            if down < -i64::from(grid.rows[row].before) || down > i64::from(grid.rows[row].after) {
                continue;
            }
            let row = (row as i64 + down) as usize;
            for right in -steps..=steps {
                let column = column as i64 + right * step;
                let Some(other) = surface(row, column).filter(|&other| other != NONE) else { continue };
                if other == own || goes_on(&grid.surfaces, own, other) {
                    let values = grid.get(of, row, column as usize);
                    sums = [sums[0] + values[0], sums[1] + values[1]];
                    count += 1.0;
                }
            }
        }
        sums.map(|sum| sum / count)
    }

    #[test]
    fn means_are_those_of_direct_sums_with_every_set_of_instructions() {
        for level in [Level::new(), Level::baseline()] {
            let grid = random_grid(level);
            let of: ChannelRows<2> = random_strips(&grid, 5);
            let mut texels = 0;
            for (steps, step) in [(0, 3), (1, 1), (1, 3), (2, 1), (2, 3), (3, 3), (4, 3), (12, 1)] {
                let means = grid.compute(&Means { of: &of, steps, step });
                for row in 0..grid.rows.len() {
                    let first = grid.rows[row].start + MARGIN;
                    for column in 0..grid.rows[row].stride - MARGIN - (LANES - 1) {
                        if grid.ground[first + column] == NONE {
                            assert_eq!(grid.get(&means, row, column), [0.0; 2]);
                            continue;
                        }
                        // In the same order: the same bits.
                        let direct = direct_mean(&grid, &of, [row, column], steps as i64, step as i64);
                        assert_eq!(grid.get(&means, row, column), direct, "{row} {column} {steps} {step}");
                        texels += 1;
                    }
                }
            }
            assert!(texels > 20_000, "{texels}");
        }
    }
}
