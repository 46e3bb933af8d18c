//! Reference pictures by rays, in f64. Not what is compared with them.

use bevy_ecs::world::World;
use lumbre_trace::{Integrator, Picture as Traced, TraceOptions, TraceReport, trace};

use crate::picture::Picture;
use crate::scene_file::SceneFile;
use crate::{Conditions, CostError};

/// The lighting equation at the middle of every pixel: neither shadows nor mirrors, lightmaps as a frame has them.
///
/// # Errors
/// [`CostError::Trace`], [`CostError::Load`], [`CostError::Interrupted`].
pub fn lighting_of(conditions: &Conditions<'_>, scene: &SceneFile) -> Result<Picture, CostError> {
    let options = TraceOptions { depth: Some(0), shadows: false, ..ray_tree(conditions) };
    Ok(traced(conditions, scene, &options)?.0)
}

/// The ray tree's options for the pictures of a report.
pub fn ray_tree(conditions: &Conditions<'_>) -> TraceOptions {
    TraceOptions { size: conditions.size, integrator: Integrator::Whitted, ..TraceOptions::default() }
}

/// A traced picture, with what is said of it.
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

/// The same of a World.
///
/// # Errors
/// [`CostError::Trace`], [`CostError::Interrupted`].
pub fn traced_world(
    conditions: &Conditions<'_>,
    world: &mut World,
    options: &TraceOptions,
) -> Result<(Picture, TraceReport), CostError> {
    // What the study tells of itself stays as it is; the listener is only asked whether to go on.
    let (picture, report) = trace(world, options, &|_| (conditions.listener)(None))?;
    if report.ended == lumbre_trace::Ended::Interrupted {
        return Err(CostError::Interrupted);
    }
    Ok((of(picture), report))
}

fn of(picture: Traced) -> Picture {
    Picture { width: picture.width as usize, radiance: picture.radiance }
}
