//! Groups of neighbouring texels that are handled as a whole: square blocks of one chart, and tiles of one triangle.
//! Not what is computed for them.

use std::collections::HashMap;

use super::footprint::Texel;
use crate::texel_index::CoveredTexel;

/// Texels along a tile's side.
const TILE_SIDE: u32 = 8;

/// Object, chart or triangle, column and row that the texels of a group have in common.
type Key = [u32; 4];

/// Covered texels divided into groups, which are numbered in the order in which the texels first name them.
pub(crate) struct TexelGroups {
    /// The members of each group.
    pub members: Vec<Vec<CoveredTexel>>,
    /// The group of each texel.
    pub group_of: Vec<u32>,
}

impl TexelGroups {
    /// Blocks of `side` x `side` texels of one chart; `charts` holds the chart of each triangle. Hidden texels have a
    /// block too, but are not among its members: the members of a block of hidden texels are an empty list.
    pub fn blocks(texels: &[Texel], charts: &[u32], side: u32) -> Self {
        let key =
            |texel: &Texel| [texel.map.0, charts[texel.triangle as usize], texel.x / side, texel.y / side];
        Self::new(texels, key, |texel| !texel.is_hidden())
    }

    /// Tiles of at most 8 x 8 texels that show the same triangle. Hidden texels are members of their tile like all
    /// others.
    pub fn tiles(texels: &[Texel]) -> Self {
        let key = |texel: &Texel| [texel.map.0, texel.triangle, texel.x / TILE_SIDE, texel.y / TILE_SIDE];
        Self::new(texels, key, |_| true)
    }

    /// Groups of equal `key`; only texels for which `is_member` holds are listed as members.
    fn new(texels: &[Texel], key: impl Fn(&Texel) -> Key, is_member: impl Fn(&Texel) -> bool) -> Self {
        let mut numbers: HashMap<Key, u32> = HashMap::new();
        let mut groups = Self { members: Vec::new(), group_of: Vec::with_capacity(texels.len()) };
        // Texels come row by row, so that most are in the group of the one before: this saves the look-up.
        let mut previous: Option<(Key, u32)> = None;
        for (index, texel) in CoveredTexel::all(texels.len()).zip(texels) {
            let key = key(texel);
            let group = match previous {
                Some((previous_key, group)) if previous_key == key => group,
                _ => *numbers.entry(key).or_insert_with(|| {
                    groups.members.push(Vec::new());
                    groups.members.len() as u32 - 1
                }),
            };
            previous = Some((key, group));
            groups.group_of.push(group);
            if is_member(texel) {
                groups.members[group as usize].push(index);
            }
        }
        groups
    }
}
