//! The covered texels of all maps, with what is hidden taken out of their footprints. Not the light that they receive.

use super::charts::charts;
use super::contact_lines::ContactLines;
use super::divided_texels::{FoundLines, contact_lines, divided_texels};
use super::footprint::{Texel, footprints, open_texels};
use super::hidden::remove_hidden;
use crate::BakeError;
use crate::monitor::BakeMonitor;
use crate::report::StageNotes;
use crate::scene::{BakeScene, LightmapLayout};
use crate::texel_index::{CoveredTexel, MapTexel};

/// The texels that show a surface, map by map and row by row. Lists "of the covered texels" are in this order.
pub(crate) struct CoveredTexels<'a> {
    pub scene: &'a BakeScene,
    pub layout: &'a LightmapLayout,
    pub list: Vec<Texel>,
    /// How many of them other geometry hides in part or whole.
    pub hidden: usize,
    /// Per texel of all maps, the covered texel there; `None` where no surface is in the open.
    open_by_place: Vec<Option<CoveredTexel>>,
    /// The chart of every triangle of the scene.
    pub charts: Vec<u32>,
    /// The texels that a thin wall divides (see `divided_texels`).
    pub divided: Vec<CoveredTexel>,
    /// The lines along which other surfaces touch what the texels show.
    pub contacts: ContactLines,
    /// Side length of a texel of mean area on its surface, canonical units.
    pub side: f32,
}

impl<'a> CoveredTexels<'a> {
    /// Finds the covered texels, and takes what is hidden out of their footprints.
    pub fn new(
        scene: &'a BakeScene,
        layout: &'a LightmapLayout,
        monitor: &mut BakeMonitor<'_>,
    ) -> Result<(Self, StageNotes), BakeError> {
        let (mut list, charts, FoundLines { all: contacts, hiding }) = monitor
            .run_interruptible(0.0, || {
                (footprints(scene, layout), charts(scene), contact_lines(scene, layout))
            })?;
        // Divided texels are found twice: first from the whole footprints, as they may hide something that rays miss,
        // and again from the footprints that are left once hidden parts are removed.
        let maybe_divided: Vec<MapTexel> = monitor.run_interruptible(0.0, || {
            let divided = divided_texels(&list, &open_by_place(layout, &list), &hiding);
            divided.iter().map(|texel| list[texel.place()].index).collect()
        })?;
        let (hidden, rays) = remove_hidden(scene, layout, &mut list, &hiding, &maybe_divided, monitor)?;
        drop(hiding);
        let open_by_place = open_by_place(layout, &list);
        let divided = monitor.run_interruptible(1.0, || divided_texels(&list, &open_by_place, &contacts))?;
        let area: f64 = scene.triangles.iter().map(|triangle| f64::from(triangle.area)).sum();
        let side = (area / list.len().max(1) as f64).sqrt() as f32;
        let texels = Self { scene, layout, list, hidden, open_by_place, charts, divided, contacts, side };
        Ok((texels, StageNotes::of_rays(rays)))
    }

    /// The covered texel at a place of the maps, if it shows a surface in the open.
    pub fn open_at(&self, place: MapTexel) -> Option<CoveredTexel> {
        self.open_by_place[place.place()]
    }

    /// The chart of the texel at a place of the maps; `None` if it shows no surface in the open.
    pub fn chart_at(&self, place: MapTexel) -> Option<u32> {
        self.open_at(place).map(|texel| self.chart(&self.list[texel.place()]))
    }

    /// The chart of what a texel shows.
    pub fn chart(&self, texel: &Texel) -> u32 {
        self.charts[texel.triangle as usize]
    }

    /// The texels that show a surface in the open, each with its index among the covered texels.
    pub fn open(&self) -> impl Iterator<Item = (CoveredTexel, &Texel)> {
        open_texels(&self.list)
    }
}

/// Per texel of all maps, the covered texel there that is not hidden.
fn open_by_place(layout: &LightmapLayout, list: &[Texel]) -> Vec<Option<CoveredTexel>> {
    let mut by_place = vec![None; layout.texels];
    for (covered, texel) in open_texels(list) {
        by_place[texel.index.place()] = Some(covered);
    }
    by_place
}
