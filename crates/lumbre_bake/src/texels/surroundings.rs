//! Which texels lie around a texel on the same surface. Not what is done with them.

use std::collections::HashMap;

use glam::Vec3;

use super::footprint::Texel;
use super::lanes::{Grid, Strips};
use crate::scene::{BakeScene, LightmapLayout};

/// Who lies around whom.
pub(crate) struct Surroundings<'a> {
    scene: &'a BakeScene,
    layout: &'a LightmapLayout,
    pub texels: &'a [Texel],
    /// Of each triangle, its surface.
    surface_of: Vec<u32>,
    surfaces: Vec<Surface>,
    /// Of each texel of all maps.
    cells: Vec<Cell>,
    /// The same in rows, eight side by side.
    grid: Grid,
    /// Of each map, its first row in the grid; and of each row there, its first texel of all maps.
    first_rows: Vec<usize>,
    firsts: Vec<usize>,
}

/// Triangles of one chart with the very same normal.
#[derive(Clone, Copy)]
pub(crate) struct Surface {
    pub chart: u32,
    pub normal: Vec3,
}

/// A texel of a map.
#[derive(Clone, Copy)]
struct Cell {
    /// Number of the covered texel; [`NONE`] if it shows nothing in the open.
    place: u32,
    surface: u32,
    /// Texels from here on in its row, this one included, on the same surface: their numbers follow each other.
    run: u32,
}

/// No texel, no surface.
pub(crate) const NONE: u32 = u32::MAX;

/// Neighbours in a row, one after the other in every so many columns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Run {
    /// From the texel's row and column to the first of them.
    pub down: i64,
    pub right: i64,
    /// The first covered texel, and the one after the last.
    pub first: usize,
    pub end: usize,
}

impl<'a> Surroundings<'a> {
    pub fn new(
        scene: &'a BakeScene,
        layout: &'a LightmapLayout,
        texels: &'a [Texel],
        charts: &'a [u32],
    ) -> Self {
        let mut surfaces: Vec<Surface> = Vec::new();
        let mut numbers: HashMap<(u32, [u32; 3]), u32> = HashMap::new();
        let surface = |(triangle, &chart): (&crate::scene::SceneTriangle, &u32)| {
            let key = (chart, triangle.normal.to_array().map(f32::to_bits));
            *numbers.entry(key).or_insert_with(|| {
                surfaces.push(Surface { chart, normal: triangle.normal });
                surfaces.len() as u32 - 1
            })
        };
        let surface_of: Vec<u32> = scene.triangles.iter().zip(charts).map(surface).collect();
        let mut cells = vec![Cell { place: NONE, surface: NONE, run: 1 }; layout.texels];
        for (index, texel) in texels.iter().enumerate().filter(|(_, texel)| !texel.is_hidden()) {
            let surface = surface_of[texel.triangle as usize];
            cells[texel.index as usize] = Cell { place: index as u32, surface, run: 1 };
        }
        for map in &layout.maps {
            for row in 0..map.height as usize {
                let first = map.first + row * map.width as usize;
                let cells = &mut cells[first..first + map.width as usize];
                for column in (1..cells.len()).rev() {
                    let next = cells[column];
                    let own = &mut cells[column - 1];
                    if own.surface == next.surface && own.place != NONE && own.place + 1 == next.place {
                        own.run = next.run + 1;
                    }
                }
            }
        }
        let sizes = layout.maps.iter().map(|map| (map.width, map.height));
        let ground = cells.iter().map(|cell| cell.surface);
        let grid = Grid::new(sizes, ground, surfaces.clone());
        let (mut first_rows, mut firsts) = (Vec::new(), Vec::new());
        for map in &layout.maps {
            first_rows.push(firsts.len());
            firsts.extend((0..map.height as usize).map(|row| map.first + row * map.width as usize));
        }
        Self { scene, layout, texels, surface_of, surfaces, cells, grid, first_rows, firsts }
    }

    /// Length of a texel's side on its surface, canonical units.
    pub fn texel_side(&self, texel: &Texel) -> f32 {
        texel.side(self.scene)
    }

    /// The texels in rows.
    pub fn grid(&self) -> &Grid {
        &self.grid
    }

    /// Numbers of each covered texel, by its place in the list of them.
    pub fn fill<const N: usize>(&self, of: impl Fn(usize) -> [f32; N] + Sync) -> Strips<N> {
        self.grid.fill(|row, column| of(self.cells[self.firsts[row] + column].place as usize))
    }

    /// The texel's row and column in the grid, if it is there.
    pub fn place(&self, texel: &Texel) -> Option<(usize, usize)> {
        let row = self.first_rows[texel.object as usize] + texel.y as usize;
        (!texel.is_hidden()).then_some((row, texel.x as usize))
    }

    /// Calls `visit` for the texels of the same chart and about the same normal, up to so many steps each way: those in every `step`th row and
    /// column from the texel's.
    #[inline(always)]
    pub fn around(&self, texel: &Texel, steps: i64, step: i64, mut visit: impl FnMut(usize)) {
        self.runs(texel, steps, step, |run| (run.first..run.end).step_by(step as usize).for_each(&mut visit));
    }

    /// The same in runs, row by row.
    #[inline(always)]
    pub fn runs(&self, texel: &Texel, steps: i64, step: i64, mut visit: impl FnMut(Run)) {
        let map = &self.layout.maps[texel.object as usize];
        let (width, height) = (i64::from(map.width), i64::from(map.height));
        let (x, y) = (i64::from(texel.x), i64::from(texel.y));
        // As many steps each way as stay on the map.
        let reach = |to_edge: i64| if steps * step <= to_edge { steps } else { to_edge / step };
        let (left, right) = (reach(x), reach(width - 1 - x));
        let own = self.surface_of[texel.triangle as usize];
        for row in -reach(y)..=reach(height - 1 - y) {
            let line = map.first as i64 + (y + row * step) * width + x;
            let mut column = -left;
            while column <= right {
                let cell = self.cells[(line + column * step) as usize];
                let wanted = right - column + 1;
                let run = i64::from(cell.run);
                let count = if run > (wanted - 1) * step { wanted } else { (run - 1) / step + 1 };
                if cell.surface == own || goes_on(&self.surfaces, own, cell.surface) {
                    let first = cell.place as usize;
                    let end = first + ((count - 1) * step) as usize + 1;
                    visit(Run { down: row * step, right: column * step, first, end });
                }
                column += count;
            }
        }
    }
}

/// Whether light may be compared over two surfaces.
pub(crate) fn goes_on(surfaces: &[Surface], surface: u32, other: u32) -> bool {
    let [Some(own), Some(other)] = [surface, other].map(|index| surfaces.get(index as usize)) else {
        return false;
    };
    own.chart == other.chart && own.normal.dot(other.normal) > 0.9
}
