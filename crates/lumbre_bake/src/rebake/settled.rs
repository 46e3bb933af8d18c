//! How samples of a finished bake are written: without the weights, which follow from the rest once they are settled, and without the rays. Not what they are.

use glam::Vec3;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::denoise::replicates::REPLICATES;
use crate::final_gather::gather_sums::{GatherSums, Weights};

/// Of serde's `with`: the fields that are kept, in the order in which [`deserialize`] takes them.
pub(super) fn serialize<S: Serializer>(own: &GatherSums, serializer: S) -> Result<S::Ok, S::Error> {
    // Whoever adds a field decides here whether it is kept.
    let GatherSums {
        sums,
        weights: _,
        patch_errors,
        texel_variances,
        texel_reads,
        checks,
        differences,
        squared_differences,
        inverse_distances,
        samples,
        rays: _,
    } = own;
    let rays = (patch_errors, texel_variances, texel_reads, inverse_distances);
    (sums, samples, rays, (checks, differences, squared_differences)).serialize(serializer)
}

/// Of serde's `with`.
pub(super) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<GatherSums, D::Error> {
    let (sums, samples, rays, of_checks) = Deserialize::deserialize(deserializer)?;
    let (patch_errors, texel_variances, texel_reads, inverse_distances) = rays;
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
        inverse_distances,
        samples,
        rays: 0,
    })
}
