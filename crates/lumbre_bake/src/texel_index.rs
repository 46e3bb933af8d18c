//! The indices of a texel, as types that cannot be confused: its index among the texels of all maps, its index among
//! the covered texels, which show a surface, and the index of its map.

/// The index of a texel among those of all maps, map by map and row by row. Lists "per texel of all maps" are in this
/// order.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) struct MapTexel(pub u32);

/// The index of a texel among the covered texels. Lists "of the covered texels" are in this order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) struct CoveredTexel(pub u32);

/// The index of a map of the layout, which is also that of the object that the map belongs to. Objects share images
/// only in finished maps (`finish::pages`).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) struct MapIndex(pub u32);

impl MapIndex {
    /// Its place in a list per map, or per object.
    pub fn place(self) -> usize {
        self.0 as usize
    }
}

impl MapTexel {
    /// The index for a place in a list per texel of all maps, of which there are at most 2^26.
    pub fn new(place: usize) -> Self {
        Self(place as u32)
    }

    /// Its place in a list per texel of all maps.
    pub fn place(self) -> usize {
        self.0 as usize
    }
}

impl CoveredTexel {
    /// The index for a place in a list of the covered texels, which are no more than all texels.
    pub fn new(place: usize) -> Self {
        Self(place as u32)
    }

    /// The indices of `count` texels, in order.
    pub fn all(count: usize) -> impl Iterator<Item = Self> + Clone {
        (0..count as u32).map(Self)
    }

    /// Its place in a list of the covered texels.
    pub fn place(self) -> usize {
        self.0 as usize
    }
}
