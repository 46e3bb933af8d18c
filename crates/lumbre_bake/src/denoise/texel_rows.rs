//! The covered texels of all maps as rows with margins, to be computed eight side by side: each lane takes the very steps that its texel
//! alone would take, so that the bits are the same whatever instructions the machine has. Not what is computed, nor who lies around whom.

use std::ops::Range;

use fearless_simd::{Level, Simd, prelude::*};
use rayon::prelude::*;

use crate::cancel_token::CancelToken;
use crate::denoise::surface::{NONE, Surface};

/// Texels side by side.
pub(crate) const LANES: usize = 8;
/// Texels to each side that a neighbourhood may reach.
pub(crate) const MARGIN: usize = 12;
/// Cells of a row that no texel of its map has.
pub(crate) const BESIDE_A_ROW: usize = MARGIN + LANES - 1;
/// What eight texels see of a row.
pub(crate) const WINDOW: usize = MARGIN + LANES + MARGIN;

/// Where the rows of all maps begin, and which of their texels are covered.
pub(crate) struct TexelRows {
    pub rows: Vec<MapRow>,
    /// First columns of the blocks of all rows.
    pub blocks: Vec<u32>,
    /// Of each cell of the rows its surface; [`NONE`] where nothing is covered, and in the margins.
    pub ground: Vec<u32>,
    pub surfaces: Vec<Surface>,
    /// Cells of all rows, without the last margin.
    cells: usize,
    /// The instructions that this machine has; every level computes the same bits.
    pub level: Level,
    /// Whether nobody waits for what is computed any more.
    pub stop: CancelToken,
}

/// A row of a map.
pub(crate) struct MapRow {
    /// Its first cell, and how many there are: a margin, the texels, and what a last block hangs over. The next row's margin is also
    /// this one's.
    pub start: usize,
    pub stride: usize,
    /// Rows of the same map before and after it.
    pub before: u32,
    pub after: u32,
    pub blocks: Range<usize>,
}

/// `N` numbers of each cell, row by row: a row of the first, a row of the second, and so on. Zero where no texel is.
pub(crate) struct ChannelRows<const N: usize> {
    pub values: Vec<f32>,
}

impl TexelRows {
    /// Of maps of these widths and heights, and the surface of each of their texels, [`NONE`] if it counts nowhere.
    pub fn new(
        sizes: impl Iterator<Item = (u32, u32)>,
        mut ground: impl Iterator<Item = u32>,
        surfaces: Vec<Surface>,
    ) -> Self {
        let (mut rows, mut blocks, mut cells) = (Vec::new(), Vec::new(), Vec::new());
        for (width, height) in sizes {
            for row in 0..height {
                let start = cells.len();
                cells.resize(start + MARGIN, NONE);
                cells.extend(ground.by_ref().take(width as usize));
                cells.resize(start + width as usize + BESIDE_A_ROW, NONE);
                let (first_block, mut column) = (blocks.len(), 0);
                while let Some(gap) = cells[start + MARGIN + column..].iter().position(|&own| own != NONE) {
                    blocks.push((column + gap) as u32);
                    column += gap + LANES;
                }
                let stride = cells.len() - start;
                let blocks = first_block..blocks.len();
                rows.push(MapRow { start, stride, before: row, after: height - 1 - row, blocks });
            }
        }
        let count = cells.len();
        cells.resize(count + MARGIN, NONE);
        let (level, stop) = (Level::new(), CancelToken::default());
        Self { rows, blocks, ground: cells, surfaces, cells: count, level, stop }
    }

    /// Numbers of each covered texel, which is told by its row (of all maps) and column.
    pub fn fill<const N: usize>(&self, of: impl Fn(usize, usize) -> [f32; N] + Sync) -> ChannelRows<N> {
        let mut strips = self.strips();
        self.by_rows(&mut strips, |index, strip| {
            let row = &self.rows[index];
            let ground = &self.ground[row.start + MARGIN..row.start + row.stride];
            for (column, _) in ground.iter().enumerate().filter(|(_, surface)| **surface != NONE) {
                for (channel, value) in of(index, column).into_iter().enumerate() {
                    strip[channel * row.stride + MARGIN + column] = value;
                }
            }
        });
        strips
    }

    /// Zero everywhere.
    pub fn strips<const N: usize>(&self) -> ChannelRows<N> {
        ChannelRows { values: vec![0.0; N * self.cells + MARGIN] }
    }

    /// Writes every row's strips, each for itself.
    pub fn by_rows<const N: usize>(
        &self,
        strips: &mut ChannelRows<N>,
        write: impl Fn(usize, &mut [f32]) + Sync,
    ) {
        let mut rest = &mut strips.values[..];
        let mut rows = Vec::with_capacity(self.rows.len());
        for row in &self.rows {
            let (own, after) = rest.split_at_mut(N * row.stride);
            rows.push(own);
            rest = after;
        }
        let rows = rows.into_par_iter().enumerate().filter(|_| !self.stop.is_cancelled());
        rows.for_each(|(index, row)| write(index, row));
    }

    /// What the strips hold of a texel.
    pub fn get<const N: usize>(&self, strips: &ChannelRows<N>, row: usize, column: usize) -> [f32; N] {
        let row = &self.rows[row];
        let first = N * row.start + MARGIN + column;
        std::array::from_fn(|channel| strips.values[first + channel * row.stride])
    }
}

/// What is seen from the cell `at` on.
#[inline(always)]
pub(crate) fn window<T>(values: &[T], at: usize) -> &[T; WINDOW] {
    values[at..].first_chunk().expect("rows end with margins")
}

/// Eight of a window.
#[inline(always)]
pub(crate) fn lanes<S: Simd, V: SimdBase<S>>(simd: S, window: &[V::Element; WINDOW], at: usize) -> V {
    V::from_slice(simd, &window[at..at + LANES])
}
