//! Which texels lie around a texel on the same surface. Not what is done with them.

use crate::denoise::surface::{NONE, Surface};
use std::collections::HashMap;

use rayon::prelude::*;

use super::box_sums::BoxSums;
use super::texel_rows::{ChannelRows, TexelRows};
use crate::coverage::footprint::Texel;
use crate::scene::{BakeScene, LightmapLayout};

/// Who lies around whom.
pub(crate) struct Neighbourhoods<'a> {
    scene: &'a BakeScene,
    pub texels: &'a [Texel],
    /// Of each texel of all maps, its place among the covered ones; [`NONE`] if it shows nothing in the open.
    places: Vec<u32>,
    grid: TexelRows,
    /// Of each map, its first row in the grid; and of each row there, its first texel of all maps.
    first_rows: Vec<usize>,
    firsts: Vec<usize>,
}

impl<'a> Neighbourhoods<'a> {
    /// Texels of different groups are not compared with each other; an empty list has all in one.
    pub fn new(
        scene: &'a BakeScene,
        layout: &LightmapLayout,
        texels: &'a [Texel],
        charts: &[u32],
        groups: &[u32],
    ) -> Self {
        let mut surfaces: Vec<Surface> = Vec::new();
        let mut numbers: HashMap<(u32, [u32; 3], u32), u32> = HashMap::new();
        let mut places = vec![NONE; layout.texels];
        let mut ground = vec![NONE; layout.texels];
        for (index, texel) in texels.iter().enumerate().filter(|(_, texel)| !texel.is_hidden()) {
            let (chart, normal) =
                (charts[texel.triangle as usize], scene.triangles[texel.triangle as usize].normal);
            let group = groups.get(index).copied().unwrap_or(0);
            let key = (chart, normal.to_array().map(f32::to_bits), group);
            let surface = *numbers.entry(key).or_insert_with(|| {
                surfaces.push(Surface { chart, normal, group });
                surfaces.len() as u32 - 1
            });
            places[texel.index.place()] = index as u32;
            ground[texel.index.place()] = surface;
        }
        let sizes = layout.maps.iter().map(|map| (map.width, map.height));
        let mut grid = TexelRows::new(sizes, ground.into_iter(), surfaces);
        grid.stop = scene.stop.clone();
        let (mut first_rows, mut firsts) = (Vec::new(), Vec::new());
        for map in &layout.maps {
            first_rows.push(firsts.len());
            firsts.extend((0..map.height as usize).map(|row| map.first + row * map.width as usize));
        }
        Self { scene, texels, places, grid, first_rows, firsts }
    }

    /// Length of a texel's side on its surface, canonical units.
    pub fn texel_side(&self, texel: &Texel) -> f32 {
        texel.side(self.scene)
    }

    /// The texels in rows.
    pub fn grid(&self) -> &TexelRows {
        &self.grid
    }

    /// Numbers of each covered texel, by its place in the list of them.
    pub fn fill<const N: usize>(&self, of: impl Fn(usize) -> [f32; N] + Sync) -> ChannelRows<N> {
        self.grid.fill(|row, column| of(self.places[self.firsts[row] + column] as usize))
    }

    /// Of each texel, sums of numbers over the texels of the same chart and about the same normal, up to so many steps each way: of those in
    /// every `step`th row and column from the texel's. Zero of a hidden one.
    pub fn sums<const N: usize>(
        &self,
        of: impl Fn(usize) -> [f32; N] + Sync,
        steps: usize,
        step: usize,
    ) -> Vec<[f32; N]> {
        let sums = self.grid.compute(&BoxSums { of: &self.fill(of), steps, step });
        self.read(&sums)
    }

    /// What strips hold of each texel, zero of a hidden one.
    pub fn read<const N: usize>(&self, strips: &ChannelRows<N>) -> Vec<[f32; N]> {
        let of = |texel: &Texel| {
            let row = self.first_rows[texel.object as usize] + texel.y as usize;
            if texel.is_hidden() { [0.0; N] } else { self.grid.get(strips, row, texel.x as usize) }
        };
        self.texels.par_iter().map(of).collect()
    }
}
