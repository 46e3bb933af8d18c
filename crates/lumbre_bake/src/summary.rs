//! Writes the figures of the whole bake into its report: mean irradiance, error, worst places and times. How errors are
//! estimated is in `final_gather`.

use glam::{DVec3, Vec3};

use crate::coverage::{CoveredTexels, Texel};
use crate::final_gather::{ErrorLedger, GatherReport, LitTexels, MapError};
use crate::finish::FinishedMaps;
use crate::finish::worst_places::worst_places;
use crate::monitor::BakeMonitor;
use crate::probes::PlacedVolume;
use crate::radiosity::{ExchangeReport, PatchResolution};
use crate::report::StageNotes;
use crate::scene::SceneObject;
use crate::{BakeError, BakeOptions, BakeReport, Ended, ErrorAtTime, ProbeReport};

/// Ends the last stage and writes the times and the checkpoint's warnings.
pub(crate) fn finish(report: &mut BakeReport, monitor: &mut BakeMonitor<'_>) {
    monitor.end_stage();
    // The caller may be interrupted while it saves the result, and would then resume from here.
    monitor.checkpoint.flush();
    report.stages = std::mem::take(&mut monitor.stages);
    report.seconds = monitor.seconds();
    report.threads = rayon::current_num_threads();
    // Only now does a map with that error exist.
    if !report.curve.is_empty() {
        report.curve.push(ErrorAtTime { seconds: report.seconds, error: report.estimated_error });
    }
    report.resumed_seconds = monitor.checkpoint.resumed;
    report.warnings.append(&mut monitor.checkpoint.warnings);
    let casting = monitor.casting_seconds;
    report.mega_rays_per_second = if casting > 0.0 { report.rays as f64 * 1e-6 / casting } else { 0.0 };
}

/// The figures of the stages that compute the light.
pub(crate) struct LightFigures<'a> {
    pub patch_resolution: PatchResolution,
    pub exchanged: ExchangeReport,
    /// `None` where nothing bounces.
    pub gathered: Option<GatherReport>,
    pub volume: Option<&'a PlacedVolume>,
}

/// Writes what is known once every texel has its light: the figures of the stages so far, the mean irradiance, the
/// errors and the worst places.
pub(crate) fn write_light(
    lit: &LitTexels<'_>,
    figures: LightFigures<'_>,
    objects: &[SceneObject],
    options: &BakeOptions,
    monitor: &mut BakeMonitor<'_>,
    report: &mut BakeReport,
) -> Result<(), BakeError> {
    let LightFigures { patch_resolution, exchanged, gathered, volume } = figures;
    let LitTexels { texels, direct, indirect, light } = *lit;
    let CoveredTexels { layout, list, hidden, .. } = texels;
    report.texels = layout.texels;
    report.coverage = list.len() as f64 / layout.texels.max(1) as f64;
    report.hidden_texels = *hidden;
    report.memory_bytes = patch_resolution.memory_bytes;
    report.patches = exchanged.patches;
    report.form_factors = exchanged.form_factors;
    report.energy_lost = exchanged.energy_lost;
    report.iterations = exchanged.iterations;
    report.residual = exchanged.residual;
    report.residual_bound = exchanged.residual_bound;
    report.probes = volume.map_or_else(ProbeReport::default, |volume| volume.report);
    report.mean_irradiance = mean_irradiance(list, light).to_array();
    let gathered = match gathered {
        Some(gathered) => gathered,
        None => without_bounces(lit, report.mean_of_channels(), options, monitor),
    };
    let error = gathered.error;
    report.estimated_error = error.relative;
    report.error_of_mean = error.of_mean;
    report.error_in_worst_view = error.in_worst_view;
    report.error_reached = error.reaches(options.error);
    report.error_parts = error.parts;
    report.curve = gathered.curve;
    report.ended = gathered.ended;
    report.leaked_rays = gathered.leaked_rays;
    report.gather_rays = gathered.gather_rays;
    let squared_errors = direct.local.relative(&indirect.variances.expected);
    let worst = || worst_places(texels.scene, objects, &texels.list, &squared_errors, error.relative);
    report.worst = monitor.run_interruptible(0.0, worst)?;
    Ok(())
}

/// Writes the figures of the finished maps, and the notes of all stages.
pub(crate) fn write_maps(finished: &FinishedMaps, notes: StageNotes, report: &mut BakeReport) {
    report.set_notes(notes);
    report.maps = finished.maps.len();
    report.atlases = finished.atlases;
    report.seams = finished.seams;
    report.resolution = finished.resolution_error;
}

/// In place of the final gather's figures where nothing bounces: the errors of direct light alone. `mean` is the mean
/// irradiance, mean of the channels, W/m².
fn without_bounces(
    lit: &LitTexels<'_>,
    mean: f64,
    options: &BakeOptions,
    monitor: &BakeMonitor<'_>,
) -> GatherReport {
    let ledger = ErrorLedger::of_direct_light(lit.texels, lit.direct);
    let error = MapError::new(&ledger, &lit.indirect.variances, mean);
    let ended = Ended::after(error.reaches(options.error), monitor.is_late(), true);
    let curve = vec![ErrorAtTime { seconds: monitor.seconds(), error: error.relative }];
    GatherReport { error, curve, ended, leaked_rays: 0, gather_rays: 0.0 }
}

/// Mean irradiance over the texels that are not hidden, W/m².
fn mean_irradiance(texels: &[Texel], light: &[Vec3]) -> DVec3 {
    let (mut sum, mut count) = (DVec3::ZERO, 0u32);
    for (_, light) in texels.iter().zip(light).filter(|(texel, _)| !texel.is_hidden()) {
        sum += light.as_dvec3();
        count += 1;
    }
    sum / f64::from(count.max(1))
}
