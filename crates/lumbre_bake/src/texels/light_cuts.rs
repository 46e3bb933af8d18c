//! The light cuts of blocks of texels: neighbours have the same, so that what they sample together can be smoothed together. Not the cut
//! itself: that is `light_cut`.

use std::collections::HashMap;

use rayon::prelude::*;

use super::blocks::Blocks;
use super::footprint::{Texel, receiver};
use crate::transport::direct::{Receiver, Sources};
use crate::transport::light_cut::LightCut;

/// Texels along a block's side.
const BLOCK: u32 = 16;

/// The light cuts of all blocks.
pub(crate) struct LightCuts {
    cuts: Vec<LightCut>,
    blocks: Blocks,
}

impl LightCuts {
    /// `charts` tells the chart of each triangle.
    pub fn new(sources: &Sources<'_>, texels: &[Texel], charts: &[u32]) -> Self {
        let blocks = Blocks::new(texels, charts, BLOCK);
        let cut = |members: &Vec<u32>| {
            let middle = |&place: &u32| -> Option<Receiver> {
                let texel = &texels[place as usize];
                Some(receiver(sources.scene, &texel.point(sources.scene, 0.5, 0.5)?))
            };
            // Of the one in the middle of the list, with what reaches from there to the farthest.
            let Some(anchor) = members.get(members.len() / 2).and_then(middle) else {
                return LightCut::default();
            };
            let apart = |other: Receiver| other.position.distance(anchor.position);
            let farthest = members.iter().filter_map(middle).map(apart).fold(0.0, f32::max);
            let texel = texels[members[0] as usize].side(sources.scene);
            let reach = farthest + if texel.is_finite() { texel } else { 0.0 };
            sources.cut(&anchor, reach)
        };
        let cuts = blocks.members.par_iter().map(cut).collect();
        Self { cuts, blocks }
    }

    /// That of a covered texel.
    pub fn of(&self, place: usize) -> &LightCut {
        &self.cuts[self.blocks.of[place] as usize]
    }

    /// Whether some texel has sources that share samples.
    pub fn share_samples(&self) -> bool {
        self.cuts.iter().any(|cut| !cut.rest.is_empty())
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
