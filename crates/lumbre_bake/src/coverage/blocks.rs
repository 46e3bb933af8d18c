//! Square blocks of texels of one chart, to be asked as a whole. Not what they are asked.

use std::collections::HashMap;

use super::footprint::Texel;

/// Blocks of texels that are not hidden.
pub(crate) struct Blocks {
    /// Of each block, its texels, by their place in the list.
    pub members: Vec<Vec<u32>>,
    /// Of each texel, its block; hidden ones are of some block too.
    pub of: Vec<u32>,
}

impl Blocks {
    /// Of `side` texels a side; `charts` tells the chart of each triangle.
    pub fn new(texels: &[Texel], charts: &[u32], side: u32) -> Self {
        let mut numbers: HashMap<(u32, u32, u32, u32), u32> = HashMap::new();
        let mut blocks = Self { members: Vec::new(), of: Vec::with_capacity(texels.len()) };
        for (index, texel) in texels.iter().enumerate() {
            let chart = charts[texel.triangle as usize];
            let number =
                *numbers.entry((texel.object, chart, texel.x / side, texel.y / side)).or_insert_with(|| {
                    blocks.members.push(Vec::new());
                    blocks.members.len() as u32 - 1
                });
            blocks.of.push(number);
            if !texel.is_hidden() {
                blocks.members[number as usize].push(index as u32);
            }
        }
        blocks
    }
}
