//! The result of a bake as plain data: maps, meshes with the coordinates to read them by, probes, report and samples.
//! Not how maps are made of texels: that is `finish`; nor how they get into a World: that is `apply`.

use lumbre_scene::{IrradianceVolume, Transform};

use crate::finish::baked_maps::{BakedMap, BakedObject};
use crate::{BakeReport, Samples};

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
    /// The samples for [`Bake::former`](crate::Bake::former) of the next bake, if they were requested and there was
    /// something to keep.
    pub samples: Option<Samples>,
}
