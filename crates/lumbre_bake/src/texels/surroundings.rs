//! Which texels lie around a texel on the same surface. Not what is done with them.

use super::footprint::Texel;
use crate::scene::{BakeScene, LightmapLayout};

/// Who lies around whom.
pub(crate) struct Surroundings<'a> {
    scene: &'a BakeScene,
    layout: &'a LightmapLayout,
    pub texels: &'a [Texel],
    charts: &'a [u32],
    /// Covered texel of each texel of all maps, and its triangle.
    place: Vec<(u32, u32)>,
}

impl<'a> Surroundings<'a> {
    pub fn new(
        scene: &'a BakeScene,
        layout: &'a LightmapLayout,
        texels: &'a [Texel],
        charts: &'a [u32],
    ) -> Self {
        let mut place = vec![(u32::MAX, u32::MAX); layout.texels];
        for (index, texel) in texels.iter().enumerate().filter(|(_, texel)| !texel.is_hidden()) {
            place[texel.index as usize] = (index as u32, texel.triangle);
        }
        Self { scene, layout, texels, charts, place }
    }

    /// Length of a texel's side on its surface, canonical units.
    pub fn texel_side(&self, texel: &Texel) -> f32 {
        texel.side(self.scene)
    }

    /// Texels of the same chart and about the same normal, with their offsets.
    pub fn of(&'a self, texel: &'a Texel, radius: i64) -> impl Iterator<Item = (f32, f32, usize)> + 'a {
        self.every(texel, radius, 1)
    }

    /// Those of them in every `step`th row and column from the texel's.
    pub fn every(
        &'a self,
        texel: &'a Texel,
        steps: i64,
        step: i64,
    ) -> impl Iterator<Item = (f32, f32, usize)> + 'a {
        let map = &self.layout.maps[texel.object as usize];
        let (width, height) = (i64::from(map.width), i64::from(map.height));
        let (x, y) = (i64::from(texel.x), i64::from(texel.y));
        let within = |from: i64, size: i64| {
            // As many steps each way as stay on the map.
            -steps.min(from / step)..=steps.min((size - 1 - from) / step)
        };
        let columns = within(x, width);
        within(y, height).flat_map(move |row| {
            let first = map.first as i64 + (y + row * step) * width + x;
            columns.clone().filter_map(move |column| {
                let (other, triangle) = self.place[(first + column * step) as usize];
                (triangle == texel.triangle || self.goes_on(texel.triangle, triangle)).then_some((
                    (column * step) as f32,
                    (row * step) as f32,
                    other as usize,
                ))
            })
        })
    }

    /// Whether light may be compared over two triangles.
    fn goes_on(&self, triangle: u32, other: u32) -> bool {
        other != u32::MAX
            && self.charts[triangle as usize] == self.charts[other as usize]
            && self.scene.triangles[triangle as usize].normal.dot(self.scene.triangles[other as usize].normal)
                > 0.9
    }
}
