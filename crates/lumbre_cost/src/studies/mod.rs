//! The studies, a file each: a question under given conditions in, points and findings out. Not their files and not their drawing.

mod bake;
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

/// A study that can be asked for.
#[derive(Clone, Copy, Debug)]
pub struct StudyKind {
    /// The name on the command line.
    pub name: &'static str,
    /// What it is about, in a few words.
    pub about: &'static str,
    /// Which way of measuring it that is. Whoever changes what its points, times or errors mean raises it: `--resume` keeps no study of another method, and `--compare` says so.
    pub method: u32,
    /// Measures it.
    pub run: fn(&Conditions<'_>) -> Result<Measured, CostError>,
}

/// All studies, in the order of the page.
pub const STUDIES: &[StudyKind] = &[
    StudyKind { name: "shading", about: "flat, Gouraud and Phong shading", method: 2, run: shading::run },
    StudyKind { name: "scan", about: "the same on a scan at several resolutions", method: 2, run: scan::run },
    StudyKind {
        name: "need",
        about: "shading by need over the error allowed",
        method: 2,
        run: shading_by_need::run,
    },
    StudyKind { name: "lamps", about: "many lights, and how they are found", method: 2, run: lamps::run },
    StudyKind {
        name: "shadows",
        about: "shadow maps by size and filter, against rays",
        method: 2,
        run: shadows::run,
    },
    StudyKind {
        name: "effects",
        about: "every effect of a scene, switched off in turn",
        method: 2,
        run: effects::run,
    },
    StudyKind { name: "bake", about: "the error that a bake is asked for", method: 2, run: bake::run },
    StudyKind {
        name: "preprocessing",
        about: "light that bounces, before the game or in it",
        method: 2,
        run: preprocessing::run,
    },
    StudyKind {
        name: "transport",
        about: "from the frame to the truth",
        method: 2,
        run: light_transport::run,
    },
    StudyKind { name: "tour", about: "every camera's frame against the ray tree", method: 2, run: tour::run },
    StudyKind {
        name: "reflection",
        about: "reflection models against Phong's",
        method: 2,
        run: reflection::run,
    },
    StudyKind { name: "lightmaps", about: "density and format of lightmaps", method: 2, run: lightmaps::run },
    StudyKind { name: "precision", about: "f32 on the device against f64", method: 2, run: precision::run },
];

/// A study of each file that was given, or, without one, of the room in this air under this name. `of_scene` is told which share of the study, from 0 to 1, a
/// scene begins and ends with.
fn over_scenes(
    conditions: &Conditions<'_>,
    study: Study,
    (name, air): (&str, Air),
    of_scene: impl Fn(&SceneFile, [f64; 2], &mut Measured) -> Result<(), CostError>,
) -> Result<Measured, CostError> {
    over_scenes_made(conditions, study, (name, || room(air)), of_scene)
}

/// The same with any other scene in the room's place.
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
    let mut measured = Measured { study, ..Measured::default() };
    let count = scenes.len() as f64;
    for (place, scene) in scenes.iter().enumerate() {
        of_scene(scene, [place, place + 1].map(|place| place as f64 / count), &mut measured)?;
    }
    Ok(measured)
}

/// The studies of these names, in the order of the page; all without a name.
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
