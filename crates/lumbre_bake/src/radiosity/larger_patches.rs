//! Patches put together in larger ones, cut as patches are: which are in which, and what the larger ones exchange. Not what is read of it: that
//! is `size_error` and `sampling_guide`.

use rayon::prelude::*;

use super::form_factors::FormFactors;
use super::patch_index::PatchIndex;
use super::patches::Patches;
use crate::scene::BakeScene;

/// The larger patches, and those that each is made of.
pub(crate) struct LargerPatches {
    pub patches: Patches,
    /// For each of the smaller ones, the one in which its middle lies.
    pub of: Vec<PatchIndex>,
    /// Ascending.
    pub members: Vec<Vec<PatchIndex>>,
}

impl LargerPatches {
    /// Of about `side` canonical units; `None` if nobody waits for them any more.
    pub fn new(scene: &BakeScene, smaller: &Patches, side: f32) -> Option<Self> {
        let patches = Patches::outlines(scene, side);
        if scene.stop.is_cancelled() {
            return None;
        }
        let around = |patch| {
            let middle = smaller.point(patch, (1.0 / 3.0, 1.0 / 3.0));
            patches.at(patch.triangle, patch.side, middle).unwrap_or(PatchIndex(0))
        };
        let of: Vec<PatchIndex> = smaller.list.iter().map(around).collect();
        let mut members = vec![Vec::new(); patches.list.len()];
        for (patch, larger) in PatchIndex::all(of.len()).zip(&of) {
            members[larger.place()].push(patch);
        }
        Some(Self { patches, of, members })
    }

    /// What `row` makes of each one's members and its row of exchange areas, ascending: sums over the pairs of their members, of which the
    /// smaller ones' `factors` tell.
    pub fn rows<T: Send>(
        &self,
        factors: &FormFactors,
        row: impl Fn(&[PatchIndex], Vec<(PatchIndex, f64)>) -> T + Sync,
    ) -> Vec<T> {
        let of_members = |exchange: &mut Vec<f64>, members: &Vec<PatchIndex>| {
            let mut touched = Vec::new();
            for (other, g) in members.iter().flat_map(|&member| factors.row(member)) {
                if factors.stop.is_cancelled() {
                    break;
                }
                let larger = self.of[other.place()];
                let sum = &mut exchange[larger.place()];
                if *sum == 0.0 && g > 0.0 {
                    touched.push(larger);
                }
                *sum += g;
            }
            touched.sort_unstable();
            let sum = |larger: PatchIndex| (larger, std::mem::take(&mut exchange[larger.place()]));
            row(members, touched.into_iter().map(sum).collect())
        };
        let room = || vec![0.0f64; self.members.len()];
        self.members.par_iter().map_init(room, of_members).collect()
    }
}
