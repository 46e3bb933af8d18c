//! The lightmaps of all objects: where their texels are in the list of all texels. Map sizes and lightmap coordinates are
//! found in `layouter`.

use std::ops::Range;
use std::sync::Arc;

use glam::Vec2;
use lumbre_mesh::TriangleMesh;

use super::SceneTriangle;
use crate::texel_index::MapTexel;

/// The lightmap of one object.
#[derive(Clone, Debug, Default)]
pub(crate) struct MapLayout {
    /// One mesh per primitive of the object, with lightmap coordinates in `uv1`.
    pub meshes: Vec<Arc<TriangleMesh>>,
    /// For each primitive, whether its textures' coordinates moved from `uv1` to `uv0`.
    pub moved: Vec<bool>,
    /// Texels in a row.
    pub width: u32,
    /// Number of texel rows.
    pub height: u32,
    /// Index of its first texel in the sequence of all maps' texels.
    pub first: usize,
}

impl MapLayout {
    /// The texel in a column and a row.
    pub fn texel(&self, x: u32, y: u32) -> MapTexel {
        MapTexel::new(self.first + (y * self.width + x) as usize)
    }

    /// The places of its texels in lists per texel of all maps.
    pub fn places(&self) -> Range<usize> {
        self.first..self.first + (self.width * self.height) as usize
    }

    /// The four texels that bilinear filtering reads at a place of the map, in texels, and their weights, row by row.
    /// Beyond the border, the texel at the border is read.
    pub fn bilinear(&self, place: Vec2) -> [(MapTexel, f32); 4] {
        let at = place - 0.5;
        let low = at.floor();
        let fraction = at - low;
        [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)].map(|step| {
            let step = Vec2::from(step);
            let share = (Vec2::ONE - step) * (Vec2::ONE - fraction) + step * fraction;
            // `as` saturates at 0.
            let (x, y) = ((low.x + step.x) as u32, (low.y + step.y) as u32);
            (self.texel(x.min(self.width - 1), y.min(self.height - 1)), share.x * share.y)
        })
    }

    /// The columns and rows at most `radius` away from those of a texel, its own included, row by row.
    pub fn around(&self, x: u32, y: u32, radius: u32) -> impl Iterator<Item = (u32, u32)> + use<> {
        let columns = x.saturating_sub(radius)..=(x + radius).min(self.width - 1);
        let rows = y.saturating_sub(radius)..=(y + radius).min(self.height - 1);
        rows.flat_map(move |y| columns.clone().map(move |x| (x, y)))
    }

    /// The texels at most `radius` columns and rows away from one, itself included, row by row.
    pub fn neighbourhood(&self, x: u32, y: u32, radius: u32) -> impl Iterator<Item = MapTexel> {
        self.around(x, y, radius).map(|(x, y)| self.texel(x, y))
    }
}

/// The lightmaps of all objects.
#[derive(Clone, Debug, Default)]
pub(crate) struct LightmapLayout {
    /// One per object.
    pub maps: Vec<MapLayout>,
    /// Number of texels of all maps together.
    pub texels: usize,
    /// Target density, texels per canonical unit.
    pub density: f64,
}

impl LightmapLayout {
    /// The texel at a point of a triangle; `None` if the point lies outside of its map.
    pub fn texel_at(&self, triangle: &SceneTriangle, at: (f32, f32)) -> Option<MapTexel> {
        let map = &self.maps[triangle.map.place()];
        let place = triangle.place_on_map(at);
        let (x, y) = (place.x as u32, place.y as u32);
        (x < map.width && y < map.height).then(|| map.texel(x, y))
    }
}
