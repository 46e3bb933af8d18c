//! How the gathered light of a finished bake is serialized: without the weights, which follow from the other fields
//! once samples are settled ([`GatherSums::settled`]), without the number of rays, and without what the guide had
//! missed, as the next bake has another guide.

use glam::Vec3;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::denoise::replicates::REPLICATES;
use crate::final_gather::gather_sums::{GatherSums, UnguidedLight, Weights};

/// For serde's `with`: writes the fields that are kept, in the order in which [`deserialize`] reads them.
pub(super) fn serialize<S: Serializer>(gathered: &GatherSums, serializer: S) -> Result<S::Ok, S::Error> {
    // Destructured without `..`, so that a new field forces a decision whether it is kept.
    let GatherSums {
        sums,
        weights: _,
        patch_errors,
        texel_variances,
        texel_reads,
        checks,
        differences,
        squared_differences,
        nearness,
        samples,
        rays: _,
        unguided: _,
    } = gathered;
    let rays = (patch_errors, texel_variances, texel_reads, nearness);
    (sums, samples, rays, (checks, differences, squared_differences)).serialize(serializer)
}

/// For serde's `with`.
pub(super) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<GatherSums, D::Error> {
    let (sums, samples, rays, of_checks) = Deserialize::deserialize(deserializer)?;
    let (patch_errors, texel_variances, texel_reads, nearness) = rays;
    let (checks, differences, squared_differences) = of_checks;
    let weights = <[Vec3; REPLICATES]>::map(sums, |sum| Weights::of_equal(sum, samples));
    Ok(GatherSums {
        sums,
        weights,
        patch_errors,
        texel_variances,
        texel_reads,
        checks,
        differences,
        squared_differences,
        nearness,
        samples,
        rays: 0,
        unguided: UnguidedLight::default(),
    })
}
