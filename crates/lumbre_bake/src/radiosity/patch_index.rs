//! The number of a patch. Not that of a region of the sampling guide, which is cut as patches are: `sampling_guide` has that.

use serde::{Deserialize, Serialize};

/// A patch, by its place among all of one cut of the scene. Lists "per patch", and the rows and columns of the exchange, are in this order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub(crate) struct PatchIndex(pub u32);

impl PatchIndex {
    /// Of the patch at this place of a list per patch, of which there are fewer than 2^32.
    pub fn new(place: usize) -> Self {
        Self(place as u32)
    }

    /// All of so many.
    pub fn all(count: usize) -> impl Iterator<Item = Self> + Clone {
        (0..count as u32).map(Self)
    }

    /// Its place in a list per patch.
    pub fn place(self) -> usize {
        self.0 as usize
    }
}
