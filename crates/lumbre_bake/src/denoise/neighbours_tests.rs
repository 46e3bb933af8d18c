//! Tests of the means over neighbours, and the random rows of texels that other tests of this folder use, too.

use fearless_simd::{Level, Simd, f32x8};
use glam::Vec3;

use super::kernel::Kernel;
use super::neighbours::Block;
use super::surface::{NONE, Surface, is_continuous};
use super::texel_rows::{ChannelRows, LANES, MARGIN, TexelRows};

const SIZES: [(u32, u32); 4] = [(37, 23), (5, 3), (1, 40), (90, 30)];

/// SplitMix64, in [0, 1).
pub(crate) fn random(state: &mut u64) -> f32 {
    *state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let mut z = *state;
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((z ^ (z >> 31)) >> 40) as f32 / (1 << 24) as f32
}

/// Maps of tiles with random surfaces, some of which are continuous with each other, and with holes; computed at
/// this SIMD level.
pub(crate) fn random_grid(level: Level) -> TexelRows {
    let surface =
        |chart, x: f32, y: f32| Surface { chart, normal: Vec3::new(x, y, 0.0).normalize(), group: 0 };
    let surfaces =
        vec![surface(0, 1.0, 0.0), surface(0, 1.0, 0.2), surface(1, 1.0, 0.0), surface(1, 0.0, 1.0)];
    let mut state = 11;
    let mut texel_surfaces = Vec::new();
    for (width, height) in SIZES {
        let tiles: Vec<u32> = (0..1000).map(|_| (random(&mut state) * 4.0) as u32).collect();
        for place in 0..width * height {
            // The tiles are wide, so that some windows lie on one surface.
            let tile = place / width / 13 * 10 + place % width / 45;
            let hole = random(&mut state) < 0.02;
            texel_surfaces.push(if hole { NONE } else { tiles[tile as usize] });
        }
    }
    let mut grid = TexelRows::new(SIZES.into_iter(), texel_surfaces.into_iter(), surfaces);
    grid.level = level;
    grid
}

/// Random values for all covered texels.
pub(crate) fn random_channels<const N: usize>(grid: &TexelRows, seed: u64) -> ChannelRows<N> {
    grid.fill(|row, column| {
        let mut state = seed ^ ((row * 1000 + column) as u64) << 20;
        std::array::from_fn(|_| random(&mut state))
    })
}

struct Means<'a> {
    values: &'a ChannelRows<2>,
    steps: usize,
    step: usize,
}

impl Kernel<2> for Means<'_> {
    #[inline(always)]
    fn at<S: Simd>(&self, block: &Block<'_, S>, _: &[f32x8<S>; 2]) -> [f32x8<S>; 2] {
        [0, 1].map(
            #[inline(always)]
            |channel| block.mean(self.values, channel, self.steps, self.step),
        )
    }
}

/// The means over neighbours, found by testing every texel within reach.
fn direct_mean(
    grid: &TexelRows,
    channels: &ChannelRows<2>,
    [row, column]: [usize; 2],
    steps: i64,
    step: i64,
) -> [f32; 2] {
    let surface = |row: usize, column: i64| {
        let width = grid.rows[row].stride - MARGIN - (LANES - 1);
        let column = usize::try_from(column).ok().filter(|column| *column < width)?;
        Some(grid.cell_surfaces[grid.rows[row].start + MARGIN + column])
    };
    let center = surface(row, column as i64).unwrap();
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
            if other == center || is_continuous(&grid.surfaces, center, other) {
                let values = grid.get(channels, row, column as usize);
                sums = [sums[0] + values[0], sums[1] + values[1]];
                count += 1.0;
            }
        }
    }
    sums.map(|sum| sum / count)
}

#[test]
fn means_equal_those_of_direct_sums_at_every_simd_level() {
    for level in [Level::new(), Level::baseline()] {
        let grid = random_grid(level);
        let channels: ChannelRows<2> = random_channels(&grid, 5);
        let mut texels = 0;
        for (steps, step) in [(0, 3), (1, 1), (1, 3), (2, 1), (2, 3), (3, 3), (4, 3), (12, 1)] {
            let means = grid.compute(&Means { values: &channels, steps, step });
            for row in 0..grid.rows.len() {
                let first = grid.rows[row].start + MARGIN;
                for column in 0..grid.rows[row].stride - MARGIN - (LANES - 1) {
                    if grid.cell_surfaces[first + column] == NONE {
                        assert_eq!(grid.get(&means, row, column), [0.0; 2]);
                        continue;
                    }
                    // Both add in the same order, so the bits are equal.
                    let direct = direct_mean(&grid, &channels, [row, column], steps as i64, step as i64);
                    assert_eq!(grid.get(&means, row, column), direct, "{row} {column} {steps} {step}");
                    texels += 1;
                }
            }
        }
        assert!(texels > 20_000, "{texels}");
    }
}
