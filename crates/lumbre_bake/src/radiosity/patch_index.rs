//! The numbers of a patch and of a region of several patches, as types that cannot be confused.

use serde::{Deserialize, Serialize};

/// A patch, by its place among all patches of one subdivision of the scene. Lists "per patch", and the rows and columns
/// of the form factors, are in this order.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub(crate) struct PatchIndex(pub u32);

/// A region of the scene, which contains several patches, by its place among all regions of one [`LargerPatches`].
///
/// [`LargerPatches`]: super::larger_patches::LargerPatches
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) struct RegionIndex(pub u32);

impl RegionIndex {
    /// All of `count` regions, in order.
    pub fn all(count: usize) -> impl Iterator<Item = Self> + Clone {
        (0..count as u32).map(Self)
    }

    /// Its place in a list per region.
    pub fn place(self) -> usize {
        self.0 as usize
    }
}

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
