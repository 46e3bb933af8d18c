//! The covered texels of all maps as rows with margins, for SIMD computation of eight texels side by side. Each lane
//! takes exactly the steps that scalar code for its texel would take, so that the bits are the same at every SIMD
//! level. Neighbours are found in `neighbours`.

use std::ops::Range;

use fearless_simd::{Level, Simd, prelude::*};
use rayon::prelude::*;

use super::surface::{NONE, Surface};
use crate::cancel_token::CancelToken;

/// Texels that are computed side by side.
pub(crate) const LANES: usize = 8;
/// The farthest that a neighbourhood may reach to each side, in texels.
pub(crate) const MARGIN: usize = 12;
/// Cells of a row that hold no texel of its map.
pub(crate) const BESIDE_A_ROW: usize = MARGIN + LANES - 1;
/// Cells of a row within reach of eight texels.
pub(crate) const WINDOW: usize = MARGIN + LANES + MARGIN;

/// The rows of all maps, one after the other, with the surface of each of their cells.
pub(crate) struct TexelRows {
    pub rows: Vec<MapRow>,
    /// The first columns of the blocks of eight texels, of all rows.
    pub blocks: Vec<u32>,
    /// The surface of each cell; [`NONE`] where no texel is covered, and in the margins.
    pub cell_surfaces: Vec<u32>,
    pub surfaces: Vec<Surface>,
    /// The number of cells of all rows, without the last margin.
    cells: usize,
    /// The SIMD level of this machine; every level computes the same bits.
    pub level: Level,
    /// Cancelled when the result is no longer wanted.
    pub stop: CancelToken,
}

/// A row of a map.
pub(crate) struct MapRow {
    /// Its first cell.
    pub start: usize,
    /// The number of its cells: a margin, the texels, and room for the lanes of a last block beyond them. The margin of
    /// the next row also serves as this one's right margin.
    pub stride: usize,
    /// The number of rows of the same map above and below it.
    pub before: u32,
    pub after: u32,
    /// Its blocks, a range of [`TexelRows::blocks`].
    pub blocks: Range<usize>,
}

/// `N` channels of each cell, row by row: each row holds all values of its first channel, then of the second, and so
/// on. Zero where there is no texel.
pub(crate) struct ChannelRows<const N: usize> {
    pub values: Vec<f32>,
}

impl TexelRows {
    /// The rows of maps with these widths and heights; `texel_surfaces` yields the surface of each of their texels,
    /// [`NONE`] for those that are left out.
    pub fn new(
        sizes: impl Iterator<Item = (u32, u32)>,
        mut texel_surfaces: impl Iterator<Item = u32>,
        surfaces: Vec<Surface>,
    ) -> Self {
        let (mut rows, mut blocks, mut cells) = (Vec::new(), Vec::new(), Vec::new());
        for (width, height) in sizes {
            for row in 0..height {
                let start = cells.len();
                cells.resize(start + MARGIN, NONE);
                cells.extend(texel_surfaces.by_ref().take(width as usize));
                cells.resize(start + width as usize + BESIDE_A_ROW, NONE);
                let (first_block, mut column) = (blocks.len(), 0);
                while let Some(gap) =
                    cells[start + MARGIN + column..].iter().position(|&surface| surface != NONE)
                {
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
        Self { rows, blocks, cell_surfaces: cells, surfaces, cells: count, level, stop }
    }

    /// Channels with values for all covered texels; `value_of` takes the row (among those of all maps) and the column.
    pub fn fill<const N: usize>(&self, value_of: impl Fn(usize, usize) -> [f32; N] + Sync) -> ChannelRows<N> {
        let mut channels = self.zeros();
        self.for_each_row(&mut channels, |index, values| {
            let row = &self.rows[index];
            let surfaces = &self.cell_surfaces[row.start + MARGIN..row.start + row.stride];
            for (column, _) in surfaces.iter().enumerate().filter(|(_, surface)| **surface != NONE) {
                for (channel, value) in value_of(index, column).into_iter().enumerate() {
                    values[channel * row.stride + MARGIN + column] = value;
                }
            }
        });
        channels
    }

    /// Channels that are zero everywhere.
    pub fn zeros<const N: usize>(&self) -> ChannelRows<N> {
        ChannelRows { values: vec![0.0; N * self.cells + MARGIN] }
    }

    /// Calls `write` in parallel with every row's index and the values of all its channels.
    pub fn for_each_row<const N: usize>(
        &self,
        channels: &mut ChannelRows<N>,
        write: impl Fn(usize, &mut [f32]) + Sync,
    ) {
        let mut rest = &mut channels.values[..];
        let mut rows = Vec::with_capacity(self.rows.len());
        for row in &self.rows {
            let (values, after) = rest.split_at_mut(N * row.stride);
            rows.push(values);
            rest = after;
        }
        let rows = rows.into_par_iter().enumerate().filter(|_| !self.stop.is_cancelled());
        rows.for_each(|(index, values)| write(index, values));
    }

    /// The values of a texel.
    pub fn get<const N: usize>(&self, channels: &ChannelRows<N>, row: usize, column: usize) -> [f32; N] {
        let row = &self.rows[row];
        let first = N * row.start + MARGIN + column;
        std::array::from_fn(|channel| channels.values[first + channel * row.stride])
    }
}

/// The window that begins at `at`.
#[inline(always)]
pub(crate) fn window<T>(values: &[T], at: usize) -> &[T; WINDOW] {
    values[at..].first_chunk().expect("rows end with margins")
}

/// Eight values of a window, from `at` on.
#[inline(always)]
pub(crate) fn lanes<S: Simd, V: SimdBase<S>>(simd: S, window: &[V::Element; WINDOW], at: usize) -> V {
    V::from_slice(simd, &window[at..at + LANES])
}
