//! The covered texels of all maps, and what of them lies in the open. Not the light that they show.

use super::charts::charts;
use super::divided_texels::{crossed, divided_texels};
use super::footprint::{Texel, footprints};
use super::hidden::remove_hidden;
use crate::monitor::BakeMonitor;
use crate::scene::{BakeScene, LightmapLayout};
use crate::texel_index::{CoveredTexel, MapTexel};
use crate::{BakeError, BakeReport};

/// The texels that show a surface, map by map, row by row; lists "of the covered texels" are in this order.
pub(crate) struct CoveredTexels<'a> {
    pub layout: &'a LightmapLayout,
    pub list: Vec<Texel>,
    /// The chart of every triangle of the scene.
    pub charts: Vec<u32>,
    /// Those that a wall divides.
    pub divided: Vec<CoveredTexel>,
    /// Length of a texel's side on the surface, canonical units, by the mean of all.
    pub side: f32,
}

impl<'a> CoveredTexels<'a> {
    /// Finds them, and takes what is hidden out of their footprints.
    ///
    /// # Errors
    /// [`BakeError::Cancelled`].
    pub fn new(
        scene: &BakeScene,
        layout: &'a LightmapLayout,
        monitor: &mut BakeMonitor<'_>,
        report: &mut BakeReport,
    ) -> Result<Self, BakeError> {
        let (mut list, charts, crossed) = monitor
            .run_interruptible(0.0, || (footprints(scene, layout), charts(scene), crossed(scene, layout)))?;
        // Which texels a wall divides is asked twice: of all that they cover, to know where to look closely, and of what is then found in the open.
        let touched: Vec<MapTexel> = monitor.run_interruptible(0.0, || {
            let divided = divided_texels(layout, &list, &crossed);
            divided.iter().map(|texel| list[texel.place()].index).collect()
        })?;
        let crossed_texels = crossed.iter().map(|(texel, _)| *texel);
        (report.hidden_texels, report.rays) =
            remove_hidden(scene, layout, &mut list, crossed_texels, &touched, monitor)?;
        let divided = monitor.run_interruptible(1.0, || divided_texels(layout, &list, &crossed))?;
        report.texels = layout.texels;
        report.coverage = list.len() as f64 / layout.texels.max(1) as f64;
        let area: f64 = scene.triangles.iter().map(|triangle| f64::from(triangle.area)).sum();
        let side = (area / list.len().max(1) as f64).sqrt() as f32;
        Ok(Self { layout, list, charts, divided, side })
    }
}
