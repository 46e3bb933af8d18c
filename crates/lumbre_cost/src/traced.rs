//! Traces reference pictures in f64.

use bevy_ecs::world::World;
use lumbre_trace::{Integrator, Picture as Traced, TraceOptions, TraceReport, trace};

use crate::picture::Picture;
use crate::scene_file::SceneFile;
use crate::{Conditions, CostError};

/// Traces the lighting equation at the centre of every pixel, without shadows and mirrors, and with lightmaps
/// as in a frame.
///
/// # Errors
/// [`CostError::Trace`], [`CostError::Load`], [`CostError::Interrupted`].
pub fn lighting_of(conditions: &Conditions<'_>, scene: &SceneFile) -> Result<Picture, CostError> {
    Ok(traced(conditions, scene, &lighting_options(conditions))?.0)
}

/// Returns the options of [`lighting_of`].
pub fn lighting_options(conditions: &Conditions<'_>) -> TraceOptions {
    TraceOptions { depth: Some(0), shadows: false, ..ray_tree(conditions) }
}

/// Returns the options of the ray tree for the pictures of a report.
pub fn ray_tree(conditions: &Conditions<'_>) -> TraceOptions {
    TraceOptions { size: conditions.size, integrator: Integrator::Whitted, ..TraceOptions::default() }
}

/// Traces a picture of a scene, and returns it with the tracer's report.
///
/// # Errors
/// [`CostError::Trace`], [`CostError::Load`], [`CostError::Interrupted`].
pub fn traced(
    conditions: &Conditions<'_>,
    scene: &SceneFile,
    options: &TraceOptions,
) -> Result<(Picture, TraceReport), CostError> {
    traced_world(conditions, &mut scene.open(conditions.aspect())?, options)
}

/// Traces a picture of a World, and returns it with the tracer's report.
///
/// # Errors
/// [`CostError::Trace`], [`CostError::Interrupted`].
pub fn traced_world(
    conditions: &Conditions<'_>,
    world: &mut World,
    options: &TraceOptions,
) -> Result<(Picture, TraceReport), CostError> {
    // The progress of the study is not reported from here; the listener only decides whether to go on.
    let (picture, report) = trace(world, options, &|_| (conditions.listener)(None))?;
    if report.ended == lumbre_trace::Ended::Interrupted {
        return Err(CostError::Interrupted);
    }
    Ok((of(picture), report))
}

fn of(picture: Traced) -> Picture {
    Picture { width: picture.width as usize, radiance: picture.radiance }
}
