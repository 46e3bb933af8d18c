//! The number of a patch. Regions of the sampling guide are numbered apart, by `sampling_guide::Region`.

use serde::{Deserialize, Serialize};

/// A patch, by its place among all patches of one subdivision of the scene. Lists "per patch", and the rows and columns
/// of the form factors, are in this order.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub(crate) struct PatchIndex(pub u32);

impl PatchIndex {
    /// The patch at this place of a list per patch, which is shorter than 2^32.
    pub fn new(place: usize) -> Self {
        Self(place as u32)
    }

    /// All of `count` patches, in order.
    pub fn all(count: usize) -> impl Iterator<Item = Self> + Clone {
        (0..count as u32).map(Self)
    }

    /// Its place in a list per patch.
    pub fn place(self) -> usize {
        self.0 as usize
    }
}
