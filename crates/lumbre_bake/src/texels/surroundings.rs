//! Which texels lie around a texel on the same surface. Not what is done with them.

use std::collections::HashMap;

use glam::Vec3;

use super::footprint::Texel;
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
}

/// Triangles of one chart with the very same normal.
#[derive(Clone, Copy)]
struct Surface {
    chart: u32,
    normal: Vec3,
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

const NONE: u32 = u32::MAX;

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
        Self { scene, layout, texels, surface_of, surfaces, cells }
    }

    /// Length of a texel's side on its surface, canonical units.
    pub fn texel_side(&self, texel: &Texel) -> f32 {
        texel.side(self.scene)
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
                if cell.surface == own || self.goes_on(own, cell.surface) {
                    let first = cell.place as usize;
                    let end = first + ((count - 1) * step) as usize + 1;
                    visit(Run { down: row * step, right: column * step, first, end });
                }
                column += count;
            }
        }
    }

    /// Whether light may be compared over two surfaces.
    fn goes_on(&self, surface: u32, other: u32) -> bool {
        let Some(other) = self.surfaces.get(other as usize) else { return false };
        let own = &self.surfaces[surface as usize];
        own.chart == other.chart && own.normal.dot(other.normal) > 0.9
    }
}
