//! One light cut for each block of texels: all texels of a block have the same cut, so that the estimates from their
//! shared samples can be smoothed together. The cut itself is in `light_cut`.

use std::collections::HashMap;

use rayon::prelude::*;

use crate::coverage::{CoveredTexels, TexelGroups, receiver};
use crate::scene::Receiver;
use crate::sources::{LightCut, Sources};
use crate::texel_index::CoveredTexel;

/// Texels along a block's side.
pub(crate) const BLOCK_SIDE: u32 = 16;

/// The light cuts of all blocks.
pub(crate) struct LightCuts {
    cuts: Vec<LightCut>,
    /// For each block with texels in the open, a receiver in the middle of the block and the distance to the block's
    /// farthest point.
    anchors: Vec<Option<(Receiver, f32)>>,
    pub blocks: TexelGroups,
}

impl LightCuts {
    /// Cuts of all blocks.
    pub fn new(sources: &Sources<'_>, texels: &CoveredTexels<'_>) -> Self {
        let blocks = TexelGroups::blocks(&texels.list, &texels.charts, BLOCK_SIDE);
        let texels = &texels.list;
        let anchor = |members: &Vec<CoveredTexel>| {
            let middle_of = |member: &CoveredTexel| -> Option<Receiver> {
                let texel = &texels[member.place()];
                Some(receiver(sources.scene, &texel.point(sources.scene, 0.5, 0.5)?))
            };
            let anchor = members.get(members.len() / 2).and_then(middle_of)?;
            let distance = |other: Receiver| other.position.distance(anchor.position);
            let farthest = members.iter().filter_map(middle_of).map(distance).fold(0.0, f32::max);
            // The middles do not reach to the edges of the block: add a texel.
            let side = texels[members[0].place()].side(sources.scene);
            Some((anchor, farthest + if side.is_finite() { side } else { 0.0 }))
        };
        let anchors: Vec<Option<(Receiver, f32)>> = blocks.members.par_iter().map(anchor).collect();
        let cut = |anchor: &Option<(Receiver, f32)>| {
            anchor.map_or_else(LightCut::default, |(anchor, reach)| sources.cut(&anchor, reach, &[]))
        };
        let cuts = anchors.par_iter().map(cut).collect();
        Self { cuts, anchors, blocks }
    }

    /// Makes lamps share samples: each pair is a texel, which stands for its whole block, and the lamp
    /// that shares samples there.
    pub fn share(&mut self, sources: &Sources<'_>, lamps: &[(CoveredTexel, u32)]) {
        let mut lamps_by_block: Vec<(u32, u32)> =
            lamps.iter().map(|&(texel, lamp)| (self.block(texel), lamp)).collect();
        lamps_by_block.sort_unstable();
        lamps_by_block.dedup();
        let groups: Vec<&[(u32, u32)]> = lamps_by_block.chunk_by(|a, b| a.0 == b.0).collect();
        let cut = |group: &&[(u32, u32)]| {
            let block = group[0].0;
            let lamps: Vec<u32> = group.iter().map(|(_, lamp)| *lamp).collect();
            let (anchor, reach) = self.anchors[block as usize]?;
            Some((block, sources.cut(&anchor, reach, &lamps)))
        };
        let new_cuts: Vec<(u32, LightCut)> = groups.par_iter().filter_map(cut).collect();
        for (block, cut) in new_cuts {
            self.cuts[block as usize] = cut;
        }
    }

    /// The cut of a covered texel.
    pub fn of(&self, texel: CoveredTexel) -> &LightCut {
        &self.cuts[self.block(texel) as usize]
    }

    /// The number of a covered texel's block.
    pub fn block(&self, texel: CoveredTexel) -> u32 {
        self.blocks.group_of[texel.place()]
    }

    /// Whether any texel has sources that share samples.
    pub fn share_samples(&self) -> bool {
        self.cuts.iter().any(|cut| !cut.shared.is_empty())
    }

    /// For each covered texel, a number that identifies the set of sources with samples of their own there.
    pub fn keys(&self) -> Vec<u32> {
        let mut numbers: HashMap<u64, u32> = HashMap::new();
        let mut number = |cut: &LightCut| {
            let next = numbers.len() as u32;
            *numbers.entry(cut.key()).or_insert(next)
        };
        let block_keys: Vec<u32> = self.cuts.iter().map(&mut number).collect();
        self.blocks.group_of.iter().map(|&block| block_keys[block as usize]).collect()
    }
}
