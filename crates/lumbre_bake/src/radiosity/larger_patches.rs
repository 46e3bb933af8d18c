//! A coarser subdivision of the scene into patches: which of the smaller patches each larger one contains, and the
//! exchange areas between the larger ones. It is used by `size_error` and `sampling_guide`.

use rayon::prelude::*;

use super::form_factors::FormFactors;
use super::patch_index::{PatchIndex, RegionIndex};
use super::patches::Patches;
use super::subdivision::Subdivision;
use crate::scene::BakeScene;

/// The larger patches, which are regions of the smaller ones.
pub(crate) struct LargerPatches {
    pub patches: Patches,
    /// For each smaller patch, the region in which its middle lies.
    pub of: Vec<RegionIndex>,
    /// For each region, the smaller patches whose middle lies in it, ascending.
    pub members: Vec<Vec<PatchIndex>>,
}

impl LargerPatches {
    /// Patches of about `side` canonical units; `None` if the bake was cancelled.
    pub fn new(scene: &BakeScene, smaller: &Patches, side: f32) -> Option<Self> {
        let patches = Patches::outlines(scene, &Subdivision { side, ..smaller.subdivision.clone() });
        if scene.stop.is_cancelled() {
            return None;
        }
        let containing = |patch| {
            let (triangle, centroid) = smaller.middle(patch);
            patches.at(triangle, patch.side, centroid).map_or(RegionIndex(0), |larger| RegionIndex(larger.0))
        };
        let of: Vec<RegionIndex> = smaller.list.iter().map(containing).collect();
        let mut members = vec![Vec::new(); patches.list.len()];
        for (patch, region) in PatchIndex::all(of.len()).zip(&of) {
            members[region.place()].push(patch);
        }
        Some(Self { patches, of, members })
    }

    /// Calls `row` for each region with its members and its row of exchange areas, ascending, and returns the
    /// results. An exchange area of two regions is the sum over all pairs of their members, from the smaller
    /// patches' `factors`.
    pub fn rows<T: Send>(
        &self,
        factors: &FormFactors,
        row: impl Fn(&[PatchIndex], Vec<(RegionIndex, f64)>) -> T + Sync,
    ) -> Vec<T> {
        // `exchange` is a dense row of sums, all 0 between calls.
        let row_of = |exchange: &mut Vec<f64>, members: &Vec<PatchIndex>| {
            let mut columns = Vec::new();
            for (other, g) in members.iter().flat_map(|&member| factors.row(member)) {
                if factors.stop.is_cancelled() {
                    break;
                }
                let region = self.of[other.place()];
                let sum = &mut exchange[region.place()];
                if *sum == 0.0 && g > 0.0 {
                    columns.push(region);
                }
                *sum += g;
            }
            columns.sort_unstable();
            let sum = |region: RegionIndex| (region, std::mem::take(&mut exchange[region.place()]));
            row(members, columns.into_iter().map(sum).collect())
        };
        let zeros = || vec![0.0f64; self.members.len()];
        self.members.par_iter().map_init(zeros, row_of).collect()
    }
}
