//! The two numbers of a texel, which are not each other's: its place in the row of all maps, and its place among those that show a surface.

/// A texel of a map, by its place in the row of all maps: map by map, row by row. Lists "per texel of all maps" are in this order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) struct MapTexel(pub u32);

/// A texel that shows a surface, by its place among all that do. Lists "of the covered texels" are in this order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) struct CoveredTexel(pub u32);

impl MapTexel {
    /// None of any map.
    pub const NONE: Self = Self(u32::MAX);

    /// Of the texel at this place of a list per texel of all maps, of which there are at most 2^26.
    pub fn new(place: usize) -> Self {
        Self(place as u32)
    }

    /// Its place in a list per texel of all maps.
    pub fn place(self) -> usize {
        self.0 as usize
    }
}

impl CoveredTexel {
    /// Of the texel at this place of a list of the covered texels, of which there are no more than texels.
    pub fn new(place: usize) -> Self {
        Self(place as u32)
    }

    /// All of so many.
    pub fn all(count: usize) -> impl Iterator<Item = Self> + Clone {
        (0..count as u32).map(Self)
    }

    /// Its place in a list of the covered texels.
    pub fn place(self) -> usize {
        self.0 as usize
    }
}
