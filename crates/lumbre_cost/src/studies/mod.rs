//! The studies, a file each: a question under given conditions in, points and findings out. Not their files and not their drawing.

mod bake;
mod effects;
mod lamps;
mod light_transport;
mod lightmaps;
mod precision;
mod reflection;
mod shading;

use crate::measured::Measured;
use crate::{Conditions, CostError};

/// A study that can be asked for.
#[derive(Clone, Copy, Debug)]
pub struct StudyKind {
    /// The name on the command line.
    pub name: &'static str,
    /// What it is about, in a few words.
    pub about: &'static str,
    /// Measures it.
    pub run: fn(&Conditions<'_>) -> Result<Measured, CostError>,
}

/// All studies, in the order of the page.
pub const STUDIES: &[StudyKind] = &[
    StudyKind { name: "shading", about: "flat, Gouraud and Phong shading", run: shading::run },
    StudyKind { name: "lamps", about: "many lights, and how they are found", run: lamps::run },
    StudyKind { name: "effects", about: "every effect of a scene, switched off in turn", run: effects::run },
    StudyKind { name: "bake", about: "the error that a bake is asked for", run: bake::run },
    StudyKind { name: "transport", about: "from the frame to the truth", run: light_transport::run },
    StudyKind { name: "reflection", about: "reflection models against Phong's", run: reflection::run },
    StudyKind { name: "lightmaps", about: "density and format of lightmaps", run: lightmaps::run },
    StudyKind { name: "precision", about: "f32 on the device against f64", run: precision::run },
];

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
