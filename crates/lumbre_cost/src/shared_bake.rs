//! Bakes of a report that several studies show and none of them times: each is made once.

use std::cell::RefCell;
use std::collections::HashMap;
use std::rc::Rc;

use bevy_ecs::prelude::*;
use lumbre_bake::{BakeOptions, BakeReport};
use lumbre_scene::{Lightmap, Mesh};

use crate::baked::{Baked, bake_scene};
use crate::scene_file::SceneFile;
use crate::{Conditions, CostError};

/// The lit objects of a baked scene, and the report of its bake.
pub struct SharedBake {
    lit: Vec<(Entity, Mesh, Lightmap)>,
    report: BakeReport,
}

/// The shared bakes of a report, by scene and options.
#[derive(Default)]
pub struct SharedBakes(RefCell<HashMap<String, Rc<SharedBake>>>);

impl SharedBakes {
    /// Keeps a bake without probes for later studies.
    pub fn keep(&self, scene: &SceneFile, options: &BakeOptions, baked: &mut Baked) {
        let mut lit = baked.world.query::<(Entity, &Mesh, &Lightmap)>();
        let lit = lit.iter(&baked.world).map(|(entity, mesh, map)| (entity, mesh.clone(), map.clone()));
        let kept = SharedBake { lit: lit.collect(), report: baked.report.clone() };
        self.0.borrow_mut().insert(key(scene, options), Rc::new(kept));
    }

    fn get(&self, scene: &SceneFile, options: &BakeOptions) -> Option<Rc<SharedBake>> {
        self.0.borrow().get(&key(scene, options)).map(Rc::clone)
    }
}

fn key(scene: &SceneFile, options: &BakeOptions) -> String {
    format!("{} {options:?}", scene.in_commands())
}

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
    let Some(known) = conditions.bakes.get(scene, options) else {
        let mut baked = bake_scene(conditions, scene, options, told)?;
        conditions.bakes.keep(scene, options, &mut baked);
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
