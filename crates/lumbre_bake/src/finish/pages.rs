//! Atlases: if requested, the maps of several objects are put on pages of at most N x N texels. Only where the maps lie
//! and how coordinates follow: before that, the light is baked map by map.
//!
//! The border texels of every map are repeated around it, so that filtering up to the border reads what a clamped map
//! of the object's own would give.

use std::sync::Arc;

use glam::DVec2;
use lumbre_mesh::TriangleMesh;
use lumbre_mesh::atlas::{AtlasOptions, pack};

use crate::scene::LightmapLayout;

/// Where an object's map lies on the pages.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct PagePlacement {
    pub page: usize,
    /// Column and row of its first texel on the page.
    pub x: u32,
    pub y: u32,
}

/// A page, which several objects share.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Page {
    pub width: u32,
    pub height: u32,
    /// The objects on it, in ascending order.
    pub objects: Vec<usize>,
}

/// All pages, and which objects are on them.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Pages {
    pub pages: Vec<Page>,
    /// Per object, its place; `None` where it keeps a map of its own.
    pub places: Vec<Option<PagePlacement>>,
    /// Width of the border of repeated texels around each map.
    margin: u32,
}

impl Pages {
    /// Puts maps on pages of at most `side` texels each way; two maps on a page are at least `gap` texels apart. A map
    /// that does not fit, or would be alone on its page, stays a map of its own. Without `side` all do.
    pub fn new(layout: &LightmapLayout, side: Option<u32>, gap: u32) -> Self {
        let no_pages = Self { places: vec![None; layout.maps.len()], ..Self::default() };
        let Some(side) = side else { return no_pages };
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
            return no_pages;
        };
        let mut on_page: Vec<Vec<usize>> = vec![Vec::new(); packed.pages.len()];
        for (member, place) in packed.placements.iter().enumerate() {
            on_page[place.page as usize].push(member);
        }
        let mut pages = Self { margin, ..no_pages };
        for (on_page, &(width, height)) in
            on_page.iter().zip(&packed.pages).filter(|(on_page, _)| on_page.len() > 1)
        {
            let page = pages.pages.len();
            for &member in on_page {
                let at = packed.placements[member];
                pages.places[members[member]] =
                    Some(PagePlacement { page, x: at.x + margin, y: at.y + margin });
            }
            pages.pages.push(Page {
                width,
                height,
                objects: on_page.iter().map(|&member| members[member]).collect(),
            });
        }
        pages
    }

    /// A page with `value` of each texel that it shows, given the texel's place in lists per texel of all maps; `empty`
    /// where no map lies.
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
                    // The nearest texel of the map: in the border, its edge is repeated.
                    let nearest = |at: u32, size: u32| at.saturating_sub(self.margin).min(size - 1);
                    let source = map.texel(nearest(x, map.width), nearest(y, map.height)).place();
                    let (column, row) = (place.x - self.margin + x, place.y - self.margin + y);
                    values[row as usize * *width as usize + column as usize] = value(source);
                }
            }
        }
        values
    }

    /// A mesh of an object whose `uv1` reads the object's page instead of a map of its own.
    pub fn on_page(&self, layout: &LightmapLayout, object: usize, mesh: &TriangleMesh) -> Arc<TriangleMesh> {
        let mut mesh = mesh.clone();
        if let Some(place) = self.places[object] {
            let (map, page) = (&layout.maps[object], &self.pages[place.page]);
            let map_size = DVec2::new(f64::from(map.width), f64::from(map.height));
            let corner = DVec2::new(f64::from(place.x), f64::from(place.y));
            let page_size = DVec2::new(f64::from(page.width), f64::from(page.height));
            for uv in &mut mesh.uv1 {
                *uv = ((uv.as_dvec2() * map_size + corner) / page_size).as_vec2();
            }
        }
        Arc::new(mesh)
    }
}
