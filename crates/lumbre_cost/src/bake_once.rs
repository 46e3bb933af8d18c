//! Bakes that several studies of a report show: each is made once, so that its time, where a study states it, is that
//! of a single bake and not of rounds.

use bevy_ecs::prelude::*;
use lumbre_bake::BakeOptions;
use lumbre_scene::{Lightmap, Mesh};

use crate::baked::{Baked, bake_scene};
use crate::scene_file::SceneFile;
use crate::shared_bakes::SharedBake;
use crate::{Conditions, CostError};

/// Returns a scene baked without probes, which an earlier study may have done. `told` are the fractions of the study
/// that are done before and after.
///
/// # Errors
/// [`CostError::Bake`], [`CostError::Load`], [`CostError::Interrupted`].
pub fn bake_once(
    conditions: &Conditions<'_>,
    scene: &SceneFile,
    options: &BakeOptions,
    told: [f64; 2],
) -> Result<Baked, CostError> {
    let Some(known) = conditions.bakes.get(&key(scene, options)) else {
        let mut baked = bake_scene(conditions, scene, options, told)?;
        keep_bake(conditions, scene, options, &mut baked);
        return Ok(baked);
    };
    // The scene is read again and has the same entities.
    let mut world = scene.open(conditions.aspect())?;
    for (entity, mesh, map) in &known.lit {
        if let Ok(mut entity) = world.get_entity_mut(*entity) {
            entity.insert((mesh.clone(), map.clone()));
        }
    }
    Ok(Baked { world, report: known.report.clone() })
}

/// Keeps a bake without probes for later studies.
pub fn keep_bake(conditions: &Conditions<'_>, scene: &SceneFile, options: &BakeOptions, baked: &mut Baked) {
    let mut lit = baked.world.query::<(Entity, &Mesh, &Lightmap)>();
    let lit = lit.iter(&baked.world).map(|(entity, mesh, map)| (entity, mesh.clone(), map.clone()));
    let kept = SharedBake { lit: lit.collect(), report: baked.report.clone() };
    conditions.bakes.keep(key(scene, options), kept);
}

fn key(scene: &SceneFile, options: &BakeOptions) -> String {
    format!("{} {options:?}", scene.in_commands())
}
