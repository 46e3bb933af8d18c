//! Makes converged bakes, which other bakes are compared with: as accurate as they get within a time limit.
//! Each is made once per report.

use std::rc::Rc;
use std::time::Duration;

use lumbre_bake::{BakeOptions, Quality};
use lumbre_render::FrameOptions;

use crate::baked::{bake_world, maps_of};
use crate::converged::Converged;
use crate::frames::draw_picture;
use crate::scene_file::SceneFile;
use crate::{Conditions, CostError};

/// Returns the options for a converged bake of the texels that `options` bake: with other random numbers,
/// without smoothing, and as accurate as it gets within a time.
pub fn converged(conditions: &Conditions<'_>, options: &BakeOptions, time: Duration) -> BakeOptions {
    BakeOptions {
        quality: Quality::Reference,
        error: 1e-3,
        time: Some(time),
        seed: conditions.seed.wrapping_add(99),
        denoise: false,
        ..*options
    }
}

/// Returns the converged bake of a scene. `told` are the fractions of the study that are done before and
/// after.
///
/// # Errors
/// [`CostError::Bake`], [`CostError::Load`], [`CostError::Render`], [`CostError::Interrupted`].
pub fn converged_bake(
    conditions: &Conditions<'_>,
    scene: &SceneFile,
    options: &BakeOptions,
    told: [f64; 2],
) -> Result<Rc<Converged>, CostError> {
    let key = format!("{} {options:?}", scene.in_commands());
    if let Some(known) = conditions.converged.get(&key) {
        return Ok(known);
    }
    let (mut baked, _) = bake_world(conditions, scene.open(conditions.aspect())?, options, None, told)?;
    let maps = maps_of(&mut baked.world);
    let picture = draw_picture(conditions, &mut baked.world, &FrameOptions::default())?;
    Ok(conditions.converged.keep(key, Converged { maps, picture, report: baked.report }))
}
