//! The light cuts of blocks of texels: neighbours have the same, so that what they sample together can be smoothed together. Not the cut
//! itself: that is `light_cut`.

use std::collections::HashMap;

use rayon::prelude::*;

use crate::coverage::blocks::Blocks;
use crate::coverage::footprint::{Texel, receiver};
use crate::scene::Receiver;
use crate::sources::light_cut::LightCut;
use crate::sources::light_sources::Sources;

/// Texels along a block's side.
const BLOCK: u32 = 16;

/// The light cuts of all blocks.
pub(crate) struct LightCuts {
    cuts: Vec<LightCut>,
    /// Of each block that shows something, a receiver in its middle, and how far its others are.
    anchors: Vec<Option<(Receiver, f32)>>,
    blocks: Blocks,
}

impl LightCuts {
    /// `charts` tells the chart of each triangle.
    pub fn new(sources: &Sources<'_>, texels: &[Texel], charts: &[u32]) -> Self {
        let blocks = Blocks::new(texels, charts, BLOCK);
        let anchor = |members: &Vec<u32>| {
            let middle = |&place: &u32| -> Option<Receiver> {
                let texel = &texels[place as usize];
                Some(receiver(sources.scene, &texel.point(sources.scene, 0.5, 0.5)?))
            };
            let anchor = members.get(members.len() / 2).and_then(middle)?;
            let apart = |other: Receiver| other.position.distance(anchor.position);
            let farthest = members.iter().filter_map(middle).map(apart).fold(0.0, f32::max);
            let texel = texels[members[0] as usize].side(sources.scene);
            Some((anchor, farthest + if texel.is_finite() { texel } else { 0.0 }))
        };
        let anchors: Vec<Option<(Receiver, f32)>> = blocks.members.par_iter().map(anchor).collect();
        let cut = |anchor: &Option<(Receiver, f32)>| {
            anchor.map_or_else(LightCut::default, |(anchor, reach)| sources.cut(&anchor, reach, &[]))
        };
        let cuts = anchors.par_iter().map(cut).collect();
        Self { cuts, anchors, blocks }
    }

    /// Some lamps share samples in the blocks of some texels: those are named by a texel's place and the lamp.
    pub fn share(&mut self, sources: &Sources<'_>, lamps: &[(u32, u32)]) {
        let mut of_blocks: Vec<(u32, u32)> =
            lamps.iter().map(|&(place, lamp)| (self.blocks.of[place as usize], lamp)).collect();
        of_blocks.sort_unstable();
        of_blocks.dedup();
        let groups: Vec<&[(u32, u32)]> = of_blocks.chunk_by(|a, b| a.0 == b.0).collect();
        let cut = |group: &&[(u32, u32)]| {
            let block = group[0].0;
            let lamps: Vec<u32> = group.iter().map(|(_, lamp)| *lamp).collect();
            let (anchor, reach) = self.anchors[block as usize]?;
            Some((block, sources.cut(&anchor, reach, &lamps)))
        };
        let found: Vec<(u32, LightCut)> = groups.par_iter().filter_map(cut).collect();
        for (block, cut) in found {
            self.cuts[block as usize] = cut;
        }
    }

    /// That of a covered texel.
    pub fn of(&self, place: usize) -> &LightCut {
        &self.cuts[self.blocks.of[place] as usize]
    }

    /// The number of a covered texel's block.
    pub fn block(&self, place: usize) -> u32 {
        self.blocks.of[place]
    }

    /// Whether some texel has sources that share samples.
    pub fn share_samples(&self) -> bool {
        self.cuts.iter().any(|cut| !cut.shared.is_empty())
    }

    /// Of each covered texel a number for the sources that have samples of their own there.
    pub fn keys(&self) -> Vec<u32> {
        let mut numbers: HashMap<u64, u32> = HashMap::new();
        let mut number = |cut: &LightCut| {
            let next = numbers.len() as u32;
            *numbers.entry(cut.key()).or_insert(next)
        };
        let of_cuts: Vec<u32> = self.cuts.iter().map(&mut number).collect();
        self.blocks.of.iter().map(|&block| of_cuts[block as usize]).collect()
    }
}
