//! Atlases: the maps of several objects on pages of at most N x N texels, when asked for. Only where they go and how
//! their coordinates follow: the light is baked map by map, before.
//!
//! Around every map its border texels are repeated, so that filtering up to the border reads what a map of its own,
//! clamped, would show.

use std::sync::Arc;

use glam::DVec2;
use lumbre_mesh::TriangleMesh;
use lumbre_mesh::atlas::{AtlasOptions, pack};

use crate::scene::LightmapLayout;

/// Where an object's map lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Place {
    pub page: usize,
    /// Of its first texel on the page.
    pub x: u32,
    pub y: u32,
}

/// A page.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Page {
    pub width: u32,
    pub height: u32,
    /// The objects on it, ascending.
    pub objects: Vec<usize>,
}

/// All pages.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Pages {
    pub pages: Vec<Page>,
    /// Per object; `None` where it keeps a map of its own.
    pub places: Vec<Option<Place>>,
    /// Texels that are repeated around each map.
    margin: u32,
}

impl Pages {
    /// Puts the maps that fit on pages of at most `side` texels each way; `gap` free texels would part two maps. A map
    /// that is larger, or would be alone on its page, keeps its own.
    pub fn new(layout: &LightmapLayout, side: Option<u32>, gap: u32) -> Self {
        let own = Self { places: vec![None; layout.maps.len()], ..Self::default() };
        let Some(side) = side else { return own };
        let margin = gap.div_ceil(2);
        let padded = |index: usize| {
            let map = &layout.maps[index];
            (map.width + 2 * margin, map.height + 2 * margin)
        };
        let members: Vec<usize> = (0..layout.maps.len())
            .filter(|&index| padded(index).0 <= side && padded(index).1 <= side)
            .collect();
        let rectangles: Vec<(u32, u32)> = members.iter().map(|&index| padded(index)).collect();
        let Ok(packed) = pack(&rectangles, AtlasOptions { max_width: side, max_height: side, gap: 0 }) else {
            return own;
        };
        let mut on_page: Vec<Vec<usize>> = vec![Vec::new(); packed.pages.len()];
        for (member, place) in packed.placements.iter().enumerate() {
            on_page[place.page as usize].push(member);
        }
        let mut pages = Self { margin, ..own };
        for (same, &(width, height)) in on_page.iter().zip(&packed.pages).filter(|(same, _)| same.len() > 1) {
            let page = pages.pages.len();
            for &member in same {
                let at = packed.placements[member];
                pages.places[members[member]] = Some(Place { page, x: at.x + margin, y: at.y + margin });
            }
            pages.pages.push(Page {
                width,
                height,
                objects: same.iter().map(|&member| members[member]).collect(),
            });
        }
        pages
    }

    /// A page of values from those of the maps; `empty` where there is none.
    pub fn compose<T: Copy>(
        &self,
        page: usize,
        layout: &LightmapLayout,
        value: impl Fn(usize) -> T,
        empty: T,
    ) -> Vec<T> {
        let Page { width, height, objects } = &self.pages[page];
        let mut values = vec![empty; *width as usize * *height as usize];
        for &object in objects {
            let (map, Some(place)) = (&layout.maps[object], self.places[object]) else { continue };
            for y in 0..map.height + 2 * self.margin {
                for x in 0..map.width + 2 * self.margin {
                    // The nearest texel of the map.
                    let from = |at: u32, size: u32| at.saturating_sub(self.margin).min(size - 1);
                    let source = map.first
                        + from(y, map.height) as usize * map.width as usize
                        + from(x, map.width) as usize;
                    let (column, row) = (place.x - self.margin + x, place.y - self.margin + y);
                    values[row as usize * *width as usize + column as usize] = value(source);
                }
            }
        }
        values
    }

    /// A mesh of an object with the coordinates of its page.
    pub fn on_page(&self, layout: &LightmapLayout, object: usize, mesh: &TriangleMesh) -> Arc<TriangleMesh> {
        let mut mesh = mesh.clone();
        if let Some(place) = self.places[object] {
            let (map, page) = (&layout.maps[object], &self.pages[place.page]);
            let own = DVec2::new(f64::from(map.width), f64::from(map.height));
            let corner = DVec2::new(f64::from(place.x), f64::from(place.y));
            let whole = DVec2::new(f64::from(page.width), f64::from(page.height));
            for uv in &mut mesh.uv1 {
                *uv = ((uv.as_dvec2() * own + corner) / whole).as_vec2();
            }
        }
        Arc::new(mesh)
    }
}
