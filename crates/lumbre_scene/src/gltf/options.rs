//! How files are read: what is repaired, and which other files they may name. Not the repairs.

use std::path::PathBuf;

use super::limits::LoadLimits;

/// Choices about reading a file.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct LoadOptions {
    /// Bounds on what is decoded.
    pub limits: LoadLimits,
    /// Repairs what other viewers repair, with a note that names the place, instead of refusing the file: nodes with two parents, textures
    /// that cannot be read or decoded (white stands in), padding that is missing at the end of a .glb, a missing `asset.version`, and indices
    /// of lights, cameras, samplers, textures and animated nodes that point at nothing.
    pub lenient: bool,
    /// URIs may lead out of the file's folder to files below this one.
    pub root: Option<PathBuf>,
}
