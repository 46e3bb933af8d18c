//! The covered texels in rows, with the surface that each lies on, for computations over neighbours on the same
//! surface. What is computed is in the kernels.

use std::collections::HashMap;

use rayon::prelude::*;

use super::box_sums::BoxSums;
use super::surface::{NONE, Surface};
use super::texel_rows::{ChannelRows, TexelRows};
use crate::coverage::{CoveredTexels, MapAxes, Texel};
use crate::texel_index::MapTexel;

/// The neighbourhoods of all covered texels.
pub(crate) struct Neighbourhoods<'a> {
    pub texels: &'a CoveredTexels<'a>,
    grid: TexelRows,
    /// For each covered texel, the number of its chart within its group; [`NONE`] for hidden ones.
    pub texel_charts: Vec<u32>,
    /// The first row of each map in the grid.
    first_rows: Vec<usize>,
    /// The first texel of each row.
    row_starts: Vec<MapTexel>,
}

impl<'a> Neighbourhoods<'a> {
    /// Texels of different `groups` are no neighbours of each other; an empty list puts all in one group.
    pub fn new(texels: &'a CoveredTexels<'a>, groups: &[u32]) -> Self {
        let CoveredTexels { scene, layout, charts, .. } = texels;
        let mut surfaces: Vec<Surface> = Vec::new();
        let mut numbers: HashMap<(u32, [u32; 3], u32), u32> = HashMap::new();
        let mut texel_surfaces = vec![NONE; layout.texels];
        let (mut chart_numbers, mut surface_charts) = (HashMap::new(), Vec::new());
        let mut texel_charts = vec![NONE; texels.list.len()];
        for (index, texel) in texels.open() {
            let (chart, normal) =
                (charts[texel.triangle as usize], scene.triangles[texel.triangle as usize].normal);
            let group = groups.get(index.place()).copied().unwrap_or(0);
            let key = (chart, normal.to_array().map(f32::to_bits), group);
            let surface = *numbers.entry(key).or_insert_with(|| {
                let next_chart = chart_numbers.len() as u32;
                surface_charts.push(*chart_numbers.entry((chart, group)).or_insert(next_chart));
                surfaces.push(Surface { chart, normal, group });
                surfaces.len() as u32 - 1
            });
            texel_charts[index.place()] = surface_charts[surface as usize];
            texel_surfaces[texel.index.place()] = surface;
        }
        let sizes = layout.maps.iter().map(|map| (map.width, map.height));
        let mut grid = TexelRows::new(sizes, texel_surfaces.into_iter(), surfaces);
        grid.stop = scene.stop.clone();
        let (mut first_rows, mut row_starts) = (Vec::new(), Vec::new());
        for map in &layout.maps {
            first_rows.push(row_starts.len());
            row_starts.extend((0..map.height).map(|row| map.texel(0, row)));
        }
        Self { texels, grid, texel_charts, first_rows, row_starts }
    }

    /// How the map lies on a texel's surface.
    pub fn map_axes(&self, index: usize) -> MapAxes {
        self.texels.list[index].map_axes(self.texels.scene)
    }

    /// The rows of all maps.
    pub fn grid(&self) -> &TexelRows {
        &self.grid
    }

    /// Channels with the values of each covered texel that is not hidden; `value_of` takes its index among the covered
    /// ones.
    pub fn fill<const N: usize>(&self, value_of: impl Fn(usize) -> [f32; N] + Sync) -> ChannelRows<N> {
        self.grid.fill(|row, column| {
            let place = MapTexel::new(self.row_starts[row].place() + column);
            self.texels.open_at(place).map_or([0.0; N], |texel| value_of(texel.place()))
        })
    }

    /// For each texel, the sums over neighbours of the same chart and about the same normal: those in every `step`th
    /// row and column, up to `steps` steps each way. Zero for hidden texels.
    pub fn sums<const N: usize>(
        &self,
        value_of: impl Fn(usize) -> [f32; N] + Sync,
        steps: usize,
        step: usize,
    ) -> Vec<[f32; N]> {
        let sums = self.grid.compute(&BoxSums { values: &self.fill(value_of), steps, step });
        self.read(&sums)
    }

    /// The values of each covered texel; zero for hidden ones.
    pub fn read<const N: usize>(&self, channels: &ChannelRows<N>) -> Vec<[f32; N]> {
        let value_of = |texel: &Texel| {
            let row = self.first_rows[texel.map.place()] + texel.y as usize;
            if texel.is_hidden() { [0.0; N] } else { self.grid.get(channels, row, texel.x as usize) }
        };
        self.texels.list.par_iter().map(value_of).collect()
    }
}
