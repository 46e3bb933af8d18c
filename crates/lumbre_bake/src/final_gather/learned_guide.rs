//! What the sampling guide learns between rounds. A small and bright region that the rays of the form factors have missed
//! is found by some ray of the gather in the end, and that ray then brings its texel far more light than the others. The
//! rays of later rounds are led there, from the whole region around that texel (as in path guiding: Müller, Gross and
//! Novák, "Practical Path Guiding for Efficient Light-Transport Simulation", 2017). The guide itself is in
//! `radiosity::sampling_guide`.

use std::collections::BTreeMap;
use std::sync::Arc;

use rayon::prelude::*;

use super::gather_sums::{GatherSums, UnguidedLight};
use super::radiance_cache::RadianceCache;
use crate::coverage::Texel;
use crate::radiosity::{Discovery, PatchIndex, RegionIndex};
use crate::scene::Side;

/// A sample counts as a discovery if it brought more than this multiple of the mean sample of its texel.
const OUTSTANDING: f64 = 8.0;

/// Adds to the guide what rays have found that it had missed, and forgets it in `gathered`.
pub(crate) fn learn(cache: &mut RadianceCache<'_>, texels: &[Texel], gathered: &mut [GatherSums]) {
    if !gathered.iter().any(has_discovery) {
        return;
    }
    // Per receiving region, all its light, and the light by patch that was discovered.
    let mut light_of_regions: BTreeMap<RegionIndex, (f64, BTreeMap<PatchIndex, f64>)> = BTreeMap::new();
    let region = |texel: &Texel| region_of(cache, texel);
    let regions: Vec<Option<RegionIndex>> = texels.par_iter().map(region).collect();
    for (region, sums) in regions.into_iter().zip(&mut *gathered) {
        let Some(region) = region else { continue };
        let (total, discovered) = light_of_regions.entry(region).or_default();
        *total += f64::from(sums.total()).max(0.0);
        if has_discovery(sums) {
            *discovered.entry(sums.unguided.patch).or_default() += f64::from(sums.unguided.light);
        }
    }
    for (receiver, (total, discovered)) in light_of_regions {
        let discovery = |(patch, light)| Discovery { receiver, patch, share: light / total };
        cache.discoveries.extend(discovered.into_iter().map(discovery));
    }
    cache.discoveries.sort_by_key(|discovery| discovery.receiver);
    gathered.par_iter_mut().for_each(|sums| sums.unguided = UnguidedLight::default());
    cache.guide = Arc::new(cache.exchange.guide.with(&cache.discoveries));
}

/// Whether one of a texel's samples outweighs the others, and the guide would hardly have led to it.
fn has_discovery(sums: &GatherSums) -> bool {
    let UnguidedLight { light, .. } = sums.unguided;
    light > 0.0 && f64::from(light) * sums.count() > OUTSTANDING * f64::from(sums.total())
}

/// The region of the guide in which the middle of a texel lies.
fn region_of(cache: &RadianceCache<'_>, texel: &Texel) -> Option<RegionIndex> {
    if texel.is_hidden() {
        return None;
    }
    let point = texel.point(cache.scene, 0.5, 0.5)?;
    cache.guide.region_of(cache.exchange.patches.at(point.triangle, Side::Front, point.at)?)
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::denoise::REPLICATES;

    #[test]
    fn only_a_sample_that_outweighs_the_others_is_a_discovery() {
        // 16 samples, whose mean is 2.
        let sums = |light: f32| GatherSums {
            sums: [Vec3::splat(8.0); REPLICATES],
            samples: 4,
            unguided: UnguidedLight { light, ..UnguidedLight::default() },
            ..GatherSums::default()
        };
        assert!(has_discovery(&sums(16.1)));
        assert!(!has_discovery(&sums(15.9)));
        // Nothing was found, although an estimate of hardly any light may be negative.
        assert!(!has_discovery(&GatherSums { sums: [Vec3::splat(-1e-3); REPLICATES], ..sums(0.0) }));
    }
}
