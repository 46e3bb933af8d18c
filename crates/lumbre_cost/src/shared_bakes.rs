//! Bakes of a report that several studies show. Made by `bake_once`.

use std::cell::RefCell;
use std::collections::HashMap;
use std::rc::Rc;

use bevy_ecs::prelude::*;
use lumbre_bake::BakeReport;
use lumbre_scene::{Lightmap, Mesh};

/// The lit objects of a baked scene, and the report of its bake.
pub struct SharedBake {
    /// Each entity with a lightmap, with what the bake gave it.
    pub lit: Vec<(Entity, Mesh, Lightmap)>,
    /// The report of the bake.
    pub report: BakeReport,
}

/// The shared bakes of a report, by scene and options.
#[derive(Default)]
pub struct SharedBakes(RefCell<HashMap<String, Rc<SharedBake>>>);

impl SharedBakes {
    /// Returns a bake that was kept.
    pub fn get(&self, key: &str) -> Option<Rc<SharedBake>> {
        self.0.borrow().get(key).map(Rc::clone)
    }

    /// Keeps a bake for later studies.
    pub fn keep(&self, key: String, bake: SharedBake) {
        self.0.borrow_mut().insert(key, Rc::new(bake));
    }
}
