//! The samples of every texel of a bake, before they became a map, from which the next bake of a changed scene can keep
//! some. The file format is in `samples_file`.

use glam::Vec3;
use serde::{Deserialize, Serialize};

use super::fingerprints::fingerprint;
use crate::bounds::Bounds;
use crate::color::channel_mean;
use crate::content_hash::ContentHash;
use crate::final_gather::{GatherSums, LitTexels, UnguidedLight, Weights};
use crate::scene::Canonical;
use crate::sources::Direct;

/// The samples of a finished bake, to be given to [`Bake::former`](crate::Bake::former) when the scene has changed.
#[derive(Clone, Debug)]
pub struct Samples(pub(crate) Content);

/// The contents of [`Samples`].
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Content {
    /// Hash of what was baked.
    pub content: ContentHash,
    /// Hash of that and of all former samples that were kept for it.
    pub identity: ContentHash,
    /// Hash of the options and of the baker's version.
    pub sampling: ContentHash,
    pub lights: ContentHash,
    /// Irradiance of an unhidden sky, W/m².
    pub sky: Vec3,
    pub space: Canonical,
    /// Texels per canonical unit.
    pub density: f64,
    pub objects: Vec<ObjectSamples>,
}

/// The samples of an object, and what tells whether it has changed.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct ObjectSamples {
    pub hash: ContentHash,
    pub name: String,
    /// Bounding box, canonical units.
    pub bounds: Bounds<Vec3>,
    /// Hash of its emitters; 0 if it has none.
    pub emission: u32,
    /// Light that leaves it, without its emission, W/m²: the least and the most of its patches, by channel.
    pub exitance: [Vec3; 2],
    /// Hash of where its texels are on it.
    pub layout: u32,
    /// Ascending by cell.
    pub texels: Vec<TexelSamples>,
}

/// The samples of a texel that is not hidden.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub(crate) struct TexelSamples {
    /// Index of the texel in its map: row times width plus column.
    pub cell: u32,
    /// Hash of what it shows of its object.
    pub footprint: u32,
    pub direct: Direct,
    pub gathered: GatherSums,
    /// Irradiance by bounces that the map showed, W/m².
    pub bounced: Vec3,
    /// By how much that may differ from the true light because of changes since it was gathered, W/m².
    pub reuse_error: f32,
}

impl TexelSamples {
    /// Whether all values are finite and in their ranges, so that a bake can use them.
    pub fn is_sound(&self) -> bool {
        let Self { cell: _, footprint: _, direct, gathered, bounced, reuse_error } = self;
        let GatherSums {
            sums,
            patch_errors,
            texel_variances,
            differences,
            squared_differences,
            nearness,
            ..
        } = gathered;
        let finite = (direct.baked + direct.mixed + *bounced + *differences).is_finite()
            && (direct.variance + *squared_differences).is_finite()
            && nearness.is_finite()
            && patch_errors.is_finite()
            && texel_variances.is_finite()
            && sums.iter().all(|sum| sum.is_finite());
        finite
            && direct.caution >= 0.0
            && direct.caution <= direct.variance
            && *texel_variances >= 0.0
            && direct.variance >= 0.0
            && *reuse_error >= 0.0
            && reuse_error.is_finite()
    }
}

impl Samples {
    /// The hash of what was baked and of all samples that were kept from former bakes.
    pub fn identity(&self) -> &ContentHash {
        &self.0.identity
    }

    /// Number of texels with samples.
    pub fn texels(&self) -> usize {
        self.0.objects.iter().map(|object| object.texels.len()).sum()
    }
}

impl GatherSums {
    /// The same estimates, as if every sample had had the weight 1; samples that are gathered later add to them. What
    /// the guide had missed is forgotten: the next bake has other patches.
    pub fn settled(&self) -> Self {
        let count = self.samples as f32;
        let sums = self.estimates().map(|estimate| estimate * count);
        let weights = sums.map(|sum| Weights::of_equal(sum, self.samples));
        Self { sums, weights, rays: 0, unguided: UnguidedLight::default(), ..*self }
    }
}

impl Weights {
    /// For samples of weight 1 that all brought the same light.
    pub fn of_equal(sum: Vec3, samples: u32) -> Self {
        let count = samples as f32;
        let light_squares = channel_mean(sum).powi(2) / count.max(1.0);
        Self { sum: count, squares: count, products: sum, light_squares }
    }
}

impl TexelSamples {
    /// The samples of a bake, by object. `first` holds each object's first triangle; `reuse_error` is per covered
    /// texel, and empty if nothing was kept.
    pub fn by_object(lit: &LitTexels<'_>, first: &[u32], reuse_error: &[f32]) -> Vec<Vec<Self>> {
        let LitTexels { texels, direct, indirect, .. } = lit;
        let mut by_object: Vec<Vec<Self>> = vec![Vec::new(); texels.layout.maps.len()];
        for (covered, texel) in texels.open() {
            let (index, object) = (covered.place(), texel.map.place());
            let samples = Self {
                cell: texel.y * texels.layout.maps[object].width + texel.x,
                footprint: fingerprint(texel, first[object]),
                direct: direct.texels[index],
                gathered: indirect.gathered.get(index).map_or_else(GatherSums::default, GatherSums::settled),
                bounced: indirect.light.get(index).copied().unwrap_or_default(),
                reuse_error: reuse_error.get(index).copied().unwrap_or_default(),
            };
            // Values that overflowed are not worth keeping.
            if samples.is_sound() {
                by_object[object].push(samples);
            }
        }
        by_object
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn settled_samples_have_the_same_estimates() {
        let light = |s: usize| Vec3::new(1.0 + s as f32, 2.0, 0.5 * s as f32);
        let weigh = |s: usize| Weights {
            sum: 3.0 + 0.5 * s as f32,
            squares: 4.5,
            products: light(s) * 1.3,
            light_squares: 2.0,
        };
        let gathered = GatherSums {
            sums: std::array::from_fn(light),
            weights: std::array::from_fn(weigh),
            samples: 4,
            rays: 99,
            ..GatherSums::default()
        };
        let settled = gathered.settled();
        for (a, b) in gathered.estimates().iter().zip(settled.estimates()) {
            assert!((*a - b).length() <= 1e-6 * a.length(), "{a} {b}");
        }
        assert_eq!(settled.rays, 0);
        assert!(GatherSums::default().settled().estimates().iter().all(|e| *e == Vec3::ZERO));
    }
}
