//! The result of a bake as plain data: maps, meshes with the coordinates to read them by, probes and report.
//! Not how maps are made of texels: that is `finish`; nor how they get into a World: that is `apply`.

use lumbre_scene::{IrradianceVolume, Transform};

use crate::BakeReport;
use crate::finish::{BakedMap, BakedObject};
use crate::report::StageNotes;

/// What a bake has made of a [`StaticScene`](crate::StaticScene).
#[derive(Debug)]
#[non_exhaustive]
pub struct BakedScene {
    /// One per object of the scene, in the scene's order; empty where there was nothing to bake.
    pub objects: Vec<BakedObject>,
    /// The maps that objects show.
    pub maps: Vec<BakedMap>,
    /// The light for moving objects, with its place in the world, if it was requested.
    pub volume: Option<(Transform, IrradianceVolume)>,
    /// What was done, what it cost, and how accurate the result is.
    pub report: BakeReport,
}

impl BakedScene {
    /// Of a scene that has nothing to bake.
    pub(crate) fn dark(why: &str, triangles: usize, mut notes: StageNotes) -> Self {
        notes.skipped.push(format!("everything: {why}"));
        let mut report = BakeReport { triangles, error_reached: true, ..BakeReport::default() };
        report.set_notes(notes);
        Self { objects: Vec::new(), maps: Vec::new(), volume: None, report }
    }
}
