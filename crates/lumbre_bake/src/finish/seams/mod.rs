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

use crate::coverage::CoveredTexels;
use crate::monitor::BakeMonitor;
use crate::report::{SeamReport, StageNotes};
use crate::{BakeError, BakeOptions};
use least_squares::{Patience, Unknowns};

/// The values of the maps, per texel of all maps.
pub(crate) struct MapValues<'a> {
    /// Irradiance, W/m²; NaN where nothing is known.
    pub light: &'a mut [Vec3],
    /// Squared errors, mean of the channels; NaN where no surface is shown.
    pub variances: &'a mut [f32],
}

/// Closes the seams of the maps, unless that is switched off, and reports the outcome. How far a texel is moved is
/// added to its error. `mean` is the mean irradiance of the open texels, mean of the channels.
pub(crate) fn close_seams(
    texels: &CoveredTexels<'_>,
    mean: f64,
    shown: MapValues<'_>,
    options: &BakeOptions,
    monitor: &mut BakeMonitor<'_>,
) -> Result<(SeamReport, StageNotes), BakeError> {
    if !options.seams {
        return Ok((SeamReport::default(), StageNotes::of_skipped("seams: switched off")));
    }
    let patience = if monitor.clock().is_over() { Patience::LATE } else { Patience::WHOLE };
    monitor.run_interruptible(0.0, || close(texels, mean, shown, patience))
}

fn close(
    texels: &CoveredTexels<'_>,
    mean: f64,
    shown: MapValues<'_>,
    patience: Patience,
) -> (SeamReport, StageNotes) {
    if mean.is_nan() || mean <= 0.0 {
        return (SeamReport::default(), StageNotes::of_skipped("seams: the maps are black"));
    }
    let edges = edges::borders(texels.scene);
    let seams = samples::Sampling { texels, filled: shown.light, edges: &edges }.all();
    let mut notes = StageNotes::of_rays(seams.rays);
    if seams.crowded > 0 {
        notes.warnings.push(format!("so many borders of charts lie in one place that {} of them were not compared with all others; seams may show there", seams.crowded));
    }
    if seams.samples.is_empty() {
        notes.skipped.push("seams: no two borders of charts join smoothly in one place".into());
        return (SeamReport::default(), notes);
    }
    let unknowns = Unknowns::new(texels, &shown, &seams.samples);
    let report = unknowns.solve(&seams.samples, shown, mean, patience, &texels.scene.stop);
    (SeamReport { edges: seams.pairs, ..report }, notes)
}
