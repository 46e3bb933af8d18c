//! How samples of a finished bake are written: without the weights, which follow from the rest once they are settled. Not what they are.

use glam::{Vec2, Vec3};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::texels::gather::{Gathered, REPLICATES, Weights};

/// Of serde's `with`.
pub(super) fn serialize<S: Serializer>(own: &Gathered, serializer: S) -> Result<S::Ok, S::Error> {
    Settled::from(own).serialize(serializer)
}

/// Of serde's `with`.
pub(super) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Gathered, D::Error> {
    Settled::deserialize(deserializer).map(Gathered::from)
}

/// What a texel has gathered, weights and rays apart.
#[derive(Serialize, Deserialize)]
struct Settled {
    sums: [Vec3; REPLICATES],
    patch_errors: Vec2,
    texel_variances: f32,
    texel_reads: u32,
    checks: u32,
    differences: Vec3,
    squared_differences: f32,
    inverse_distances: f32,
    samples: u32,
}

impl From<&Gathered> for Settled {
    fn from(own: &Gathered) -> Self {
        let Gathered {
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
        } = *own;
        Self {
            sums,
            patch_errors,
            texel_variances,
            texel_reads,
            checks,
            differences,
            squared_differences,
            inverse_distances,
            samples,
        }
    }
}

impl From<Settled> for Gathered {
    fn from(own: Settled) -> Self {
        let Settled {
            sums,
            patch_errors,
            texel_variances,
            texel_reads,
            checks,
            differences,
            squared_differences,
            inverse_distances,
            samples,
        } = own;
        let weights = sums.map(|sum| Weights::of_equal(sum, samples));
        Self {
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
        }
    }
}
