//! The index of a patch, as a type. Regions of the sampling guide, which are cut as patches are, have another: see
//! `sampling_guide`.

use serde::{Deserialize, Serialize};

/// The index of a patch among all patches of one division of the scene. Lists "per patch", and the rows and columns of
/// the exchange, are in this order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub(crate) struct PatchIndex(pub u32);

impl PatchIndex {
    /// The index for a place in a list per patch, of which there are fewer than 2^32.
    pub fn new(place: usize) -> Self {
        Self(place as u32)
    }

    /// The indices of `count` patches, in order.
    pub fn all(count: usize) -> impl Iterator<Item = Self> + Clone {
        (0..count as u32).map(Self)
    }

    /// Its place in a list per patch.
    pub fn place(self) -> usize {
        self.0 as usize
    }
}
