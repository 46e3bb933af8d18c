//! Closes seams by least squares: where two chart borders lie in one place and their surfaces join smoothly, the texels
//! that bilinear filtering reads there are moved until both sides show the same light, though by no more than their
//! errors allow. Within a map, across maps and across objects. Not the continuation of charts into empty texels: that
//! is `fill`.
//!
//! ```text
//!   chart borders ─► pairs in one place ─► samples, two per texel ────────────────► least squares ─► texels
//!                    (also parts of edges)  (normals agree, nothing in between)      (conjugate gradients)
//! ```
//!
//! After Iwanicki, "Lighting Technology of The Last of Us", SIGGRAPH 2013 (the equations), and Sloan and Silvennoinen,
//! "Directional Lightmap Encoding Insights", SIGGRAPH Asia 2018; the weights and limits by the texels' errors are our
//! own.

mod edge_grid;
mod edges;
mod least_squares;
mod samples;

use glam::Vec3;

use crate::coverage::covered_texels::CoveredTexels;
use crate::monitor::BakeMonitor;
use crate::report::SeamReport;
use crate::{BakeError, BakeOptions, BakeReport};
use least_squares::{Patience, Unknowns};

/// The values of the maps, per texel of all maps.
pub(crate) struct MapValues<'a> {
    /// Irradiance, W/m²; NaN where nothing is known.
    pub light: &'a mut [Vec3],
    /// Squared errors, mean of the channels; NaN where no surface is shown.
    pub variances: &'a mut [f32],
}

/// The outcome of closing seams.
struct Closed {
    /// What was done, or the reason why nothing was.
    pub report: Result<SeamReport, &'static str>,
    pub rays: u64,
    /// A warning if some edges were not compared with all others.
    pub warning: Option<String>,
}

/// Closes the seams of the maps, unless that is switched off, and reports the outcome. How far a texel is moved is
/// added to its error. `mean` is the mean irradiance of the open texels, mean of the channels.
pub(crate) fn close_seams(
    texels: &CoveredTexels<'_>,
    mean: f64,
    shown: MapValues<'_>,
    options: &BakeOptions,
    monitor: &mut BakeMonitor<'_>,
    report: &mut BakeReport,
) -> Result<(), BakeError> {
    if !options.seams {
        report.skipped.push("seams: switched off".into());
        return Ok(());
    }
    let patience = if monitor.clock().is_over() { Patience::LATE } else { Patience::WHOLE };
    let closed = monitor.run_interruptible(0.0, || close(texels, mean, shown, patience))?;
    report.rays += closed.rays;
    report.warnings.extend(closed.warning);
    match closed.report {
        Ok(closed) => report.seams = closed,
        Err(reason) => report.skipped.push(format!("seams: {reason}")),
    }
    Ok(())
}

fn close(texels: &CoveredTexels<'_>, mean: f64, shown: MapValues<'_>, patience: Patience) -> Closed {
    if mean.is_nan() || mean <= 0.0 {
        return Closed { report: Err("the maps are black"), rays: 0, warning: None };
    }
    let edges = edges::borders(texels.scene);
    let seams = samples::Sampling { texels, filled: shown.light, edges: &edges }.all();
    let (rays, crowded) = (seams.rays, seams.crowded);
    let warning = (crowded > 0).then(|| {
        format!("so many borders of charts lie in one place that {crowded} of them were not compared with all others; seams may show there")
    });
    if seams.samples.is_empty() {
        return Closed { report: Err("no two borders of charts join smoothly in one place"), rays, warning };
    }
    let unknowns = Unknowns::new(texels, &shown, &seams.samples);
    let mut report = unknowns.solve(&seams.samples, shown, mean, patience, &texels.scene.stop);
    report.edges = seams.pairs;
    Closed { report: Ok(report), rays, warning }
}
