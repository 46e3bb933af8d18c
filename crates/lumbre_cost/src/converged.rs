//! Converged bakes, which the studies of a report share.

use std::cell::RefCell;
use std::collections::{BTreeMap, HashMap};
use std::rc::Rc;
use std::sync::Arc;

use lumbre_bake::BakeReport;
use lumbre_scene::LightmapImage;

use crate::picture::Picture;

/// Lightmaps with the standard error of every texel, by name.
pub type Maps = BTreeMap<String, (Arc<LightmapImage>, Arc<[f32]>)>;

/// A converged bake.
pub struct Converged {
    /// Its lightmaps.
    pub maps: Maps,
    /// The frame that it lights.
    pub picture: Picture,
    /// The report of the bake.
    pub report: BakeReport,
}

/// The converged bakes of a report, by scene and options.
#[derive(Default)]
pub struct ConvergedBakes(RefCell<HashMap<String, Rc<Converged>>>);

impl ConvergedBakes {
    /// Returns a bake that was kept.
    pub fn get(&self, key: &str) -> Option<Rc<Converged>> {
        self.0.borrow().get(key).map(Rc::clone)
    }

    /// Keeps a bake for later studies.
    pub fn keep(&self, key: String, bake: Converged) -> Rc<Converged> {
        let bake = Rc::new(bake);
        self.0.borrow_mut().insert(key, Rc::clone(&bake));
        bake
    }
}
