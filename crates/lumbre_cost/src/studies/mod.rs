//! The studies, each in a file of its own: it answers a question under given conditions with points and
//! findings.

mod bake;
mod documents;
mod effects;
mod lamps;
mod light_transport;
mod lightmaps;
mod precision;
mod preprocessing;
mod reflection;
mod scan;
mod shading;
mod shading_by_need;
mod shadows;
mod tour;

use bevy_ecs::world::World;

use crate::measured::Measured;
use crate::scene_file::SceneFile;
use crate::scenes::{Air, room};
use crate::{Conditions, CostError, Study};

/// A study that can be requested.
#[derive(Clone, Copy, Debug)]
pub struct StudyKind {
    /// Its name on the command line.
    pub name: &'static str,
    /// What it measures, in a few words.
    pub about: &'static str,
    /// Version of the way of measuring. It must be increased when the meaning of points, times or errors
    /// changes: `--resume` does not keep studies measured by another method, and `--compare` does not compare
    /// them.
    pub method: u32,
    /// Runs the study.
    pub run: fn(&Conditions<'_>) -> Result<Measured, CostError>,
}

/// All studies, in the order of the page.
pub const STUDIES: &[StudyKind] = &[
    StudyKind { name: "shading", about: "flat, Gouraud and Phong shading", method: 2, run: shading::run },
    StudyKind {
        name: "scan",
        about: "flat, Gouraud and Phong shading of a scan at several resolutions",
        method: 2,
        run: scan::run,
    },
    StudyKind {
        name: "need",
        about: "shading by need over the allowed error",
        method: 2,
        run: shading_by_need::run,
    },
    StudyKind { name: "lamps", about: "many lights, and how they are found", method: 2, run: lamps::run },
    StudyKind {
        name: "shadows",
        about: "shadow maps by size and filter, compared with rays",
        method: 2,
        run: shadows::run,
    },
    StudyKind {
        name: "effects",
        about: "every effect of a scene, switched off in turn",
        method: 3,
        run: effects::run,
    },
    StudyKind { name: "bake", about: "bakes over the requested error", method: 3, run: bake::run },
    StudyKind {
        name: "preprocessing",
        about: "interreflected light, baked before the game",
        method: 4,
        run: preprocessing::run,
    },
    StudyKind {
        name: "transport",
        about: "frames compared with all light by path tracing",
        method: 4,
        run: light_transport::run,
    },
    StudyKind {
        name: "tour",
        about: "the frames of all cameras, compared with the ray tree",
        method: 3,
        run: tour::run,
    },
    StudyKind {
        name: "reflection",
        about: "reflection models, compared with Phong's",
        method: 3,
        run: reflection::run,
    },
    StudyKind { name: "lightmaps", about: "density and format of lightmaps", method: 3, run: lightmaps::run },
    StudyKind {
        name: "precision",
        about: "f32 on the device, compared with f64",
        method: 3,
        run: precision::run,
    },
    StudyKind {
        name: "documents",
        about: "what the documents say about cost, where no other study measures it",
        method: 2,
        run: documents::run,
    },
];

/// Runs `of_scene` for each file that was passed or, if there is none, for the room with this air, under the
/// name `name`. `of_scene` gets the fractions of the study that are done before and after the scene.
fn over_scenes(
    conditions: &Conditions<'_>,
    study: Study,
    (name, air): (&str, Air),
    of_scene: impl Fn(&SceneFile, [f64; 2], &mut Measured) -> Result<(), CostError>,
) -> Result<Measured, CostError> {
    over_scenes_made(conditions, study, (name, || room(air)), of_scene)
}

/// Does what [`over_scenes`] does, with any scene in place of the room.
fn over_scenes_made(
    conditions: &Conditions<'_>,
    study: Study,
    (name, make): (&str, impl FnOnce() -> World),
    of_scene: impl Fn(&SceneFile, [f64; 2], &mut Measured) -> Result<(), CostError>,
) -> Result<Measured, CostError> {
    let scenes = match conditions.files.is_empty() {
        true => vec![SceneFile::made(conditions, name, make())?],
        false => SceneFile::given(conditions)?,
    };
    let mut measured = Measured::of(study);
    let count = scenes.len() as f64;
    for (place, scene) in scenes.iter().enumerate() {
        of_scene(scene, [place, place + 1].map(|place| place as f64 / count), &mut measured)?;
    }
    Ok(measured)
}

/// Returns the studies with these names in the order of the page, or all studies if there are no names.
///
/// # Errors
/// [`CostError::UnknownStudy`].
pub fn studies_named(names: &[String]) -> Result<Vec<StudyKind>, CostError> {
    let known = |name: &String| STUDIES.iter().any(|study| study.name == name);
    if let Some(name) = names.iter().find(|name| !known(name)) {
        let known: Vec<&str> = STUDIES.iter().map(|study| study.name).collect();
        return Err(CostError::UnknownStudy { name: name.clone(), known: known.join(", ") });
    }
    let wanted = |study: &&StudyKind| names.is_empty() || names.iter().any(|name| name == study.name);
    Ok(STUDIES.iter().filter(wanted).copied().collect())
}
