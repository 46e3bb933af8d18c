//! What a bake writes into its report on the way. Not what it computes.

use crate::coverage::footprint::Texel;
use crate::direct_light::DirectLight;
use crate::final_gather::error_ledger::{ErrorLedger, open_sum, relative_to, root};
use crate::monitor::BakeMonitor;
use crate::{BakeOptions, BakeReport, ErrorAtTime};
use glam::Vec3;

/// Ends the last stage.
pub(crate) fn finish(mut report: BakeReport, monitor: &mut BakeMonitor<'_>) -> BakeReport {
    monitor.end_stage(&mut report);
    // What is still to be done with the result may be interrupted too.
    monitor.checkpoint.flush();
    report.seconds = monitor.seconds();
    // From here on there is a map of that error.
    if !report.curve.is_empty() {
        report.curve.push(ErrorAtTime { seconds: report.seconds, error: report.estimated_error });
    }
    report.resumed_seconds = monitor.checkpoint.resumed;
    report.warnings.append(&mut monitor.checkpoint.warnings);
    let casting: f64 = report
        .stages
        .iter()
        .filter(|stage| {
            ["direct light", "form factors", "final gather", "probes", "resolution"]
                .contains(&stage.stage.as_str())
        })
        .map(|stage| stage.seconds)
        .sum();
    report.mega_rays_per_second = if casting > 0.0 { report.rays as f64 * 1e-6 / casting } else { 0.0 };
    report
}

/// The mean over the texels that are not hidden.
pub(crate) fn note_mean(texels: &[Texel], values: &[Vec3], report: &mut BakeReport) {
    let (mut sum, mut count) = (glam::DVec3::ZERO, 0u32);
    for (_, value) in texels.iter().zip(values).filter(|(texel, _)| !texel.is_hidden()) {
        sum += value.as_dvec3();
        count += 1;
    }
    report.mean_irradiance = (sum / f64::from(count.max(1))).to_array();
}

/// The error of a map without bounces, whose variances are those.
pub(crate) fn note_direct_error(
    texels: &[Texel],
    direct: &DirectLight,
    variances: &[f32],
    options: &BakeOptions,
    report: &mut BakeReport,
) {
    let open = texels.iter().filter(|texel| !texel.is_hidden()).count().max(1) as f64;
    let mean = report.mean_irradiance.iter().sum::<f64>() / 3.0;
    report.estimated_error = root(open_sum(texels, &direct.local.relative(variances)) / open);
    report.error_of_mean = relative_to(mean, open_sum(texels, variances) / open);
    report.error_reached = report.estimated_error <= options.error;
    report.error_parts = ErrorLedger::of_direct_light(direct).parts(texels, &direct.local);
}
