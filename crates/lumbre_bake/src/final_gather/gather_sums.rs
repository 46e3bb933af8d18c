//! What a texel has gathered, as sums, and the estimates that follow from them. Not the gathering.

use glam::{Vec2, Vec3};
use serde::{Deserialize, Serialize};

use crate::denoise::replicates::REPLICATES;

/// The weights of a replicate's samples: their mean is 1 in the long run, so that what they are beside it can be taken out of what was
/// gathered (regression; Owen and Zhou, "Safe and Effective Importance Sampling", 2000). Under light that is the same all around nothing
/// else differs.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub(crate) struct Weights {
    pub sum: f32,
    pub squares: f32,
    /// Of each weight with the light that it brought.
    pub products: Vec3,
    /// And of that light, mean of the channels, with itself.
    pub light_squares: f32,
}

impl Weights {
    pub fn add(&mut self, weight: f32, light: Vec3) {
        self.sum += weight;
        self.squares += weight * weight;
        self.products += weight * light;
        self.light_squares += (light.element_sum() / 3.0).powi(2);
    }
}

/// What a texel has gathered: irradiance by bounces.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub(crate) struct GatherSums {
    /// Sum of the samples of each replicate.
    pub sums: [Vec3; REPLICATES],
    /// What tells how far their weights alone made them so.
    pub weights: [Weights; REPLICATES],
    /// Sum over all samples of what the patches' errors add.
    pub patch_errors: Vec2,
    /// Sum over all samples of the variance that they add since the texels that they read are themselves uncertain.
    pub texel_variances: f32,
    /// Samples that read such a texel, and no patch.
    pub texel_reads: u32,
    /// Samples that asked a real bounce beside the patch, the sum of the differences and of their squares.
    pub checks: u32,
    pub differences: Vec3,
    pub squared_differences: f32,
    /// Sum over all samples of 1 / distance to what was met, canonical units.
    pub inverse_distances: f32,
    /// Samples of each replicate.
    pub samples: u32,
    /// Rays cast.
    pub rays: u64,
}

/// Variance of weights below which they are all the same.
const MIN_SPREAD: f32 = 1e-4;
/// Samples below which nothing can be said about how light depends on their weights: a line through three explains most of what differs by chance.
const ENOUGH: f32 = 9.0;
/// Share of the light's variance that goes with the weights where they are taken out.
const EXPLAINED: f32 = 0.6;

impl GatherSums {
    /// The estimate of each replicate.
    pub fn estimates(&self) -> [Vec3; REPLICATES] {
        if self.samples == 0 {
            return [Vec3::ZERO; REPLICATES];
        }
        let count = self.samples as f32;
        std::array::from_fn(|own| {
            // How light goes with weight is taken from the other replicates: so the mean stays what it is.
            let (mut light, mut weights) = (Vec3::ZERO, Weights::default());
            for other in (0..REPLICATES).filter(|&other| other != own) {
                light += self.sums[other];
                weights.sum += self.weights[other].sum;
                weights.squares += self.weights[other].squares;
                weights.products += self.weights[other].products;
                weights.light_squares += self.weights[other].light_squares;
            }
            let all = count * (REPLICATES - 1) as f32;
            let spread = weights.squares - weights.sum * weights.sum / all;
            let together = weights.products - light * (weights.sum / all);
            let grey = |light: Vec3| light.element_sum() / 3.0;
            let light_spread = weights.light_squares - grey(light).powi(2) / all;
            // From few samples the slope is noise itself: it has to explain most of what differs.
            let explained = grey(together).powi(2) > EXPLAINED * spread * light_spread;
            let slope = together / spread;
            let known = all >= ENOUGH && spread > MIN_SPREAD * all && explained && slope.is_finite();
            let slope = if known { slope } else { Vec3::ZERO };
            self.sums[own] / count - slope * (self.weights[own].sum / count - 1.0)
        })
    }

    /// Mean of 1 / distance to what light comes from: the irradiance changes over lengths of its inverse (Ward, Rubinstein and Clear,
    /// "A Ray Tracing Solution for Diffuse Interreflection", 1988).
    pub fn inverse_distance(&self) -> f32 {
        self.inverse_distances / (self.samples.max(1) * REPLICATES as u32) as f32
    }

    /// The share of the samples that read a texel that was gathered before, in [0, 1].
    pub fn texel_share(&self) -> f64 {
        (f64::from(self.texel_reads) / self.count()).min(1.0)
    }

    /// What the patches' errors add to the mean of the replicates, each with its sign.
    pub fn patch_error(&self) -> Vec2 {
        self.patch_errors / self.count() as f32
    }

    /// Samples of all replicates; at least one.
    pub fn count(&self) -> f64 {
        f64::from(self.samples.max(1)) * REPLICATES as f64
    }

    /// The squared error that what was read adds to the mean of the replicates: the patches', and that of texels that were gathered before.
    pub fn squared_read_error(&self) -> f32 {
        self.patch_error().length_squared() + self.texel_variance()
    }

    /// The variance that the texels that were read add to the mean of the replicates.
    pub fn texel_variance(&self) -> f32 {
        self.texel_variances / self.count() as f32
    }
}
