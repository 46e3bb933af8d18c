//! From the light of the covered texels to the maps that objects show: gaps filled, seams closed, resolution measured,
//! pages composed. The order of these steps, and not the steps.

use glam::Vec3;

use super::baked_maps::{BakedMap, BakedObject, FilledTexels, baked_objects};
use super::fill::fill;
use super::pages::Pages;
use super::resolution_error::{DensePoint, compare};
use super::seams::{MapValues, close_seams};
use super::separate_light::separate;
use crate::final_gather::LitTexels;
use crate::monitor::BakeMonitor;
use crate::report::{ResolutionReport, SeamReport, StageNotes};
use crate::scene::SceneObject;
use crate::{BakeError, BakeOptions};

/// The objects of a scene with their finished maps, and the figures of these, as in [`BakeReport`](crate::BakeReport).
pub(crate) struct FinishedMaps {
    pub objects: Vec<BakedObject>,
    pub maps: Vec<BakedMap>,
    pub atlases: usize,
    pub seams: SeamReport,
    pub resolution_error: ResolutionReport,
}

/// The light of all maps with its gaps filled, and its squared errors.
pub(crate) struct FilledMaps {
    irradiance: Vec<Vec3>,
    variances: Vec<f32>,
}

/// Fills the maps of all objects from the light of the covered texels. Charts are continued by `gap` texels.
pub(crate) fn filled_maps(
    lit: &LitTexels<'_>,
    gap: u32,
    monitor: &mut BakeMonitor<'_>,
) -> Result<FilledMaps, BakeError> {
    monitor.advance(0.2)?;
    let (irradiance, variances) = monitor
        .run_interruptible(0.2, || fill(lit.texels, lit.light, &lit.indirect.variances.cautious, gap))?;
    monitor.advance(1.0)?;
    Ok(FilledMaps { irradiance, variances })
}

/// Finishes filled maps. `mean` is their mean irradiance, mean of the channels; `points` are what the finished maps are
/// compared with, to measure what their resolution costs.
pub(crate) fn finished_maps(
    lit: &LitTexels<'_>,
    filled: FilledMaps,
    points: &[DensePoint],
    mean: f64,
    objects: &[SceneObject],
    options: &BakeOptions,
    monitor: &mut BakeMonitor<'_>,
) -> Result<(FinishedMaps, StageNotes), BakeError> {
    let texels = lit.texels;
    let FilledMaps { mut irradiance, mut variances } = filled;
    let values = MapValues { light: &mut irradiance, variances: &mut variances };
    let (seams, notes) = close_seams(texels, mean, values, options, monitor)?;
    monitor.advance(0.9)?;
    let resolution_error =
        monitor.run_interruptible(0.9, || compare(texels, &irradiance, &variances, points))?;
    let pages =
        monitor.run_interruptible(0.9, || Pages::new(texels.layout, options.atlas_size, options.gap))?;
    let separate = monitor
        .run_interruptible(1.0, || options.separate_light.then(|| separate(lit, &irradiance, options.gap)))?;
    let filled = FilledTexels { irradiance: &irradiance, variances: &variances, separate: separate.as_ref() };
    let (objects, maps) =
        monitor.run_interruptible(1.0, || baked_objects(objects, texels.layout, &filled, &pages))?;
    monitor.advance(1.0)?;
    let atlases = pages.pages.len();
    Ok((FinishedMaps { objects, maps, atlases, seams, resolution_error }, notes))
}
