//! Options for reading files: which faults are repaired, and which external files may be read.

use std::path::PathBuf;

use super::limits::LoadLimits;

/// Options for loading a file.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct LoadOptions {
    /// Limits on what is decoded.
    pub limits: LoadLimits,
    /// Repair faults that other viewers repair, with a note that names the place, instead of refusing the
    /// file: nodes with two parents, textures that cannot be read or decoded (replaced by white), missing
    /// padding at the end of a .glb, a missing `asset.version`, and dangling indices of lights, cameras,
    /// samplers, textures and animated nodes.
    pub lenient: bool,
    /// URIs may leave the file's folder and refer to files below this folder.
    pub root: Option<PathBuf>,
}
