//! Writes the figures of the whole bake into its report: mean irradiance, error, worst places and times. How errors are
//! estimated is in `final_gather`.

use glam::{DVec3, Vec3};

use crate::coverage::footprint::Texel;
use crate::final_gather::error_ledger::ErrorLedger;
use crate::final_gather::lit_texels::LitTexels;
use crate::final_gather::map_error::MapError;
use crate::finish::worst_places::worst_places;
use crate::monitor::BakeMonitor;
use crate::scene::SceneObject;
use crate::stage::{Stage, StageProfile};
use crate::{BakeError, BakeOptions, BakeReport, Ended, ErrorAtTime, StageTime};

/// Ends the last stage and writes the times and the checkpoint's warnings.
pub(crate) fn finish(mut report: BakeReport, monitor: &mut BakeMonitor<'_>) -> BakeReport {
    monitor.end_stage(&mut report);
    // The caller may be interrupted while it saves the result, and would then resume from here.
    monitor.checkpoint.flush();
    report.seconds = monitor.seconds();
    // Only now does a map with that error exist.
    if !report.curve.is_empty() {
        report.curve.push(ErrorAtTime { seconds: report.seconds, error: report.estimated_error });
    }
    report.resumed_seconds = monitor.checkpoint.resumed;
    report.warnings.append(&mut monitor.checkpoint.warnings);
    let casting: Vec<StageProfile> =
        Stage::ALL.into_iter().map(Stage::profile).filter(|profile| profile.casts_rays).collect();
    let is_casting = |stage: &&StageTime| casting.iter().any(|profile| profile.name == stage.stage);
    let casting = report.stages.iter().filter(is_casting);
    let casting: f64 = casting.map(|stage| stage.seconds).sum();
    report.mega_rays_per_second = if casting > 0.0 { report.rays as f64 * 1e-6 / casting } else { 0.0 };
    report
}

/// Writes what is known once every texel has its light: the mean irradiance, the worst places and, if nothing bounces,
/// the error.
pub(crate) fn write(
    lit: &LitTexels<'_>,
    bounces: bool,
    objects: &[SceneObject],
    options: &BakeOptions,
    monitor: &mut BakeMonitor<'_>,
    report: &mut BakeReport,
) -> Result<(), BakeError> {
    let LitTexels { texels, direct, indirect, light } = *lit;
    let (list, errors) = (&texels.list, &indirect.variances);
    report.mean_irradiance = mean_irradiance(list, light).to_array();
    if !bounces {
        // Otherwise the rounds of the gather have written the error already.
        let ledger = ErrorLedger::of_direct_light(direct);
        let mean = report.mean_irradiance.iter().sum::<f64>() / 3.0;
        let error = MapError::new(&ledger, errors, list, &direct.local, mean);
        error.write_report(options.error, ledger.parts(list, &direct.local), report);
        report.ended = Ended::after(report.error_reached, monitor.is_late(), true);
        report.curve.push(ErrorAtTime { seconds: monitor.seconds(), error: report.estimated_error });
    }
    let (squared_errors, whole) = (direct.local.relative(&errors.expected), report.estimated_error);
    report.worst = monitor
        .run_interruptible(0.0, || worst_places(texels.scene, objects, list, &squared_errors, whole))?;
    Ok(())
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
