//! What a texel has gathered, as sums over its samples, and the estimates that follow from them. Not the gathering:
//! that is `gather`.

use glam::{Vec2, Vec3};
use serde::{Deserialize, Serialize};

use crate::color::channel_mean;
use crate::denoise::{Nearness, REPLICATES};
use crate::radiosity::PatchIndex;

/// Sums of the weights of a replicate's samples. The expected weight is 1, so the effect of a mean weight that differs
/// from 1 can be removed from the estimate: the weight is a control variate, with its coefficient by regression (Owen
/// and Zhou, "Safe and Effective Importance Sampling", 2000). Under light that is the same from all directions, the
/// weights are all the noise.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub(crate) struct Weights {
    pub sum: f32,
    pub squares: f32,
    /// Sum of each weight times the light of its sample.
    pub products: Vec3,
    /// Sum of the squared light of the samples, mean of the channels.
    pub light_squares: f32,
}

impl Weights {
    pub fn add(&mut self, weight: f32, light: Vec3) {
        self.sum += weight;
        self.squares += weight * weight;
        self.products += weight * light;
        self.light_squares += channel_mean(light).powi(2);
    }
}

/// The brightest light that a sample brought although the guide would hardly have led there.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub(crate) struct UnguidedLight {
    /// The patch that it came from.
    pub patch: PatchIndex,
    /// What it added to the sums, W/m², mean of the channels; 0 if there was none.
    pub light: f32,
}

/// What a texel has gathered: sums for its irradiance by bounces.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub(crate) struct GatherSums {
    /// Sum of the samples of each replicate.
    pub sums: [Vec3; REPLICATES],
    /// Sums of the weights of those samples.
    pub weights: [Weights; REPLICATES],
    /// Sum over all samples of the patches' errors that they read, each with its sign.
    pub patch_errors: Vec2,
    /// Sum over all samples of the variance that comes from the uncertain light of the texels that they read.
    pub texel_variances: f32,
    /// Samples that read a texel instead of a patch.
    pub texel_reads: u32,
    /// Samples that met the sky, and so read neither.
    pub sky_reads: u32,
    /// Samples whose patch was checked against a real bounce; the sum of the differences and that of their squares.
    pub checks: u32,
    pub differences: Vec3,
    pub squared_differences: f32,
    /// Weighted sum over all samples of the nearness of the surface that was hit.
    pub nearness: Nearness,
    /// Samples of each replicate.
    pub samples: u32,
    /// Rays cast.
    pub rays: u64,
    /// Of the samples since the guide last learned.
    pub unguided: UnguidedLight,
}

/// Variance of the weights below which they count as equal.
const MIN_WEIGHT_VARIANCE: f32 = 1e-4;
/// Fewer samples than this say nothing about how light depends on the weights: a line through three points explains
/// most of their scatter by chance. Six points are explained so well by chance in one case of fourteen.
const MIN_REGRESSION_SAMPLES: f32 = 6.0;
/// The weights' effect is removed only where it explains more than this share of the light's variance.
const MIN_EXPLAINED: f32 = 0.6;

impl GatherSums {
    /// The estimate of each replicate.
    pub fn estimates(&self) -> [Vec3; REPLICATES] {
        if self.samples == 0 {
            return [Vec3::ZERO; REPLICATES];
        }
        let count = self.samples as f32;
        std::array::from_fn(|replicate| {
            // The slope of light over weight comes from the other replicates, so that it leaves the expected value as
            // it is.
            let (mut light, mut weights) = (Vec3::ZERO, Weights::default());
            for other in (0..REPLICATES).filter(|&other| other != replicate) {
                light += self.sums[other];
                weights.sum += self.weights[other].sum;
                weights.squares += self.weights[other].squares;
                weights.products += self.weights[other].products;
                weights.light_squares += self.weights[other].light_squares;
            }
            let others = count * (REPLICATES - 1) as f32;
            // Sums of squares and products about the means.
            let weight_scatter = weights.squares - weights.sum * weights.sum / others;
            let cross_scatter = weights.products - light * (weights.sum / others);
            let light_scatter = weights.light_squares - channel_mean(light).powi(2) / others;
            // With few samples the slope itself is noise: it has to explain most of the scatter.
            let is_explained =
                channel_mean(cross_scatter).powi(2) > MIN_EXPLAINED * weight_scatter * light_scatter;
            let slope = cross_scatter / weight_scatter;
            let is_known = others >= MIN_REGRESSION_SAMPLES
                && weight_scatter > MIN_WEIGHT_VARIANCE * others
                && is_explained
                && slope.is_finite();
            let slope = if is_known { slope } else { Vec3::ZERO };
            self.sums[replicate] / count - slope * (self.weights[replicate].sum / count - 1.0)
        })
    }

    /// Mean nearness of the surfaces that light comes from.
    pub fn mean_nearness(&self) -> Nearness {
        self.nearness.scaled(1.0 / self.count() as f32)
    }

    /// The sum of all samples of all replicates, W/m², mean of the channels.
    pub fn total(&self) -> f32 {
        channel_mean(self.sums.iter().sum())
    }

    /// The share of the samples that read a texel gathered in an earlier round, in [0, 1].
    pub fn texel_share(&self) -> f64 {
        (f64::from(self.texel_reads) / self.count()).min(1.0)
    }

    /// The share of the samples that read a patch, in [0, 1]. Those that went into darkness are counted in, although what
    /// is subtracted for the patches is then too much by their share: without them the stated errors of a held-out room
    /// were too low more often.
    pub fn patch_share(&self) -> f64 {
        (1.0 - f64::from(self.texel_reads + self.sky_reads) / self.count()).max(0.0)
    }

    /// The patches' errors in the mean of the replicates, each with its sign.
    pub fn patch_error(&self) -> Vec2 {
        self.patch_errors / self.count() as f32
    }

    /// Samples of all replicates together, and never 0, to be divided by.
    pub fn count(&self) -> f64 {
        f64::from(self.samples.max(1)) * REPLICATES as f64
    }

    /// The squared error in the mean of the replicates that comes from what was read: patches, and texels gathered in
    /// an earlier round.
    pub fn squared_read_error(&self) -> f32 {
        self.patch_error().length_squared() + self.texel_variance()
    }

    /// The variance in the mean of the replicates that comes from the texels that were read.
    pub fn texel_variance(&self) -> f32 {
        self.texel_variances / self.count() as f32
    }
}
