//! What the sampling guide learns between rounds: a small and bright region that the rays of the form factors have missed
//! is found by some ray of the gather in the end, which then brings a texel more light than all its other rays together.
//! The rays of later rounds are led there, from the whole region around that texel (as in path guiding: Müller, Gross and
//! Novák, "Practical Path Guiding for Efficient Light-Transport Simulation", 2017). The guide itself is in
//! `radiosity::sampling_guide`.

use std::borrow::Cow;
use std::collections::BTreeMap;

use rayon::prelude::*;

use super::gather_sums::{GatherSums, UnguidedLight};
use super::radiance_cache::RadianceCache;
use crate::coverage::footprint::Texel;
use crate::radiosity::patch_index::PatchIndex;
use crate::radiosity::sampling_guide::{Discovery, Region};
use crate::scene::material::Side;

/// A sample counts as a discovery if it brought more than this multiple of the mean sample of its texel.
const OUTSTANDING: f64 = 8.0;

/// Adds to the guide what the rays of the last round have found beside it, and forgets it in `gathered`.
pub(crate) fn learn(cache: &mut RadianceCache<'_>, texels: &[Texel], gathered: &mut [GatherSums]) {
    let is_discovery = |sums: &GatherSums| {
        f64::from(sums.unguided.light) * sums.count() > OUTSTANDING * f64::from(sums.total())
    };
    if !gathered.iter().any(is_discovery) {
        return;
    }
    // Per receiving region, all its light, and the light by patch that was discovered.
    let mut light_of_regions: BTreeMap<Region, (f64, BTreeMap<PatchIndex, f64>)> = BTreeMap::new();
    let region = |texel: &Texel| region_of(cache, texel);
    let regions: Vec<Option<Region>> = texels.par_iter().map(region).collect();
    for (region, sums) in regions.into_iter().zip(&mut *gathered) {
        let Some(region) = region else { continue };
        let (total, discovered) = light_of_regions.entry(region).or_default();
        *total += f64::from(sums.total());
        if is_discovery(sums) {
            *discovered.entry(sums.unguided.patch).or_default() += f64::from(sums.unguided.light);
        }
    }
    let discoveries: Vec<Discovery> = light_of_regions
        .into_iter()
        .flat_map(|(receiver, (total, discovered))| {
            let share = move |(patch, light)| Discovery { receiver, patch, share: light / total };
            discovered.into_iter().map(share)
        })
        .collect();
    gathered.par_iter_mut().for_each(|sums| sums.unguided = UnguidedLight::NONE);
    cache.guide = Cow::Owned(cache.guide.with(&discoveries));
}

/// The region of the guide in which the middle of a texel lies.
fn region_of(cache: &RadianceCache<'_>, texel: &Texel) -> Option<Region> {
    if texel.is_hidden() {
        return None;
    }
    let point = texel.point(cache.scene, 0.5, 0.5)?;
    cache.guide.region_of(cache.patches.at(point.triangle, Side::Front, point.at)?)
}
