//! Smooths the gathered light within charts: a weighted plane through each texel's neighbourhood, with weights that stop at
//! edges larger than the noise. The same weights for every scramble, so that their spread stays an estimate of the error.
//! In levels: the second takes what the first has made of every third texel, and so reaches three times as far for the same work
//! (Dammertz, Sewtz, Hanika and Lensch, "Edge-Avoiding À-Trous Wavelet Transform", 2010).

use glam::{Vec3, Vec3A};
use rayon::prelude::*;

use super::footprint::Texel;
use super::gather::SCRAMBLES;
use super::plane::{HALF, Plane, Values};
use super::smoothing_bias::squared_bias;
use super::surroundings::Surroundings;

/// What a texel has, before and after.
pub(crate) type Estimates = [Vec3; SCRAMBLES];

/// One pass over all texels.
pub(crate) struct Level {
    /// Texels from one neighbour to the next, and how many neighbours each way.
    pub step: i64,
    steps: i64,
    /// Texels at which a neighbour weighs e⁻¹; and where things are near, the share of their harmonic mean distance, inverted.
    width: f32,
    near: f32,
    /// Reach of the means that tell edges, in steps.
    guide_steps: i64,
    /// Of the variance of what goes in, the part that chance leaves in the squared bias.
    pub chance: f32,
}

/// The first reaches little further than a texel's own size, whatever is near; the second only where everything is far. `chance`, for
/// the first: four times the variance of a texel for one scramble, a ninth of it in a block, of which the radius holds 49/9, twice for
/// two halves: 4 / 9 / sqrt(2 * 49 / 9). What the second takes in goes together over some 20 texels: its blocks hold four
/// that do not, and the radius as many blocks.
const LEVELS: [Level; 2] = [
    Level { step: 1, steps: 3, width: 2.5, near: 1.0, guide_steps: 1, chance: 0.135 },
    Level { step: 3, steps: 4, width: 9.0, near: 12.0, guide_steps: 0, chance: 0.33 },
];

/// The estimates of every covered texel, smoothed, and the squared bias that the smoothing may have brought, mean of the channels.
/// `inverse_distances` tells how near to each texel the things are that it gathered from.
pub(crate) fn smooth(
    surroundings: &Surroundings<'_>,
    estimates: &[Estimates],
    inverse_distances: &[f32],
) -> (Vec<Estimates>, Vec<f32>) {
    let nearness: Vec<f32> = surroundings
        .texels
        .par_iter()
        .map(|texel| {
            let near =
                mean_of(surroundings.of(texel, NOISE_STEPS).map(|(.., other)| inverse_distances[other]));
            let steps = near * surroundings.texel_side(texel);
            if steps.is_finite() { steps * steps } else { 0.0 }
        })
        .collect();
    let mut smoothed = estimates.to_vec();
    let mut bias = vec![0.0f32; estimates.len()];
    for level in &LEVELS {
        let (next, brought) = level.smooth(surroundings, &smoothed, &nearness);
        for (bias, brought) in bias.iter_mut().zip(brought) {
            // Both levels flatten what is curved, and so in the same direction.
            *bias = (bias.sqrt() + brought.sqrt()).powi(2);
        }
        smoothed = next;
    }
    (smoothed, bias)
}

impl Level {
    /// The estimates smoothed, and the squared bias that this brought; a texel to which it brings more than it takes away stays as it is.
    fn smooth(
        &self,
        surroundings: &Surroundings<'_>,
        estimates: &[Estimates],
        nearness: &[f32],
    ) -> (Vec<Estimates>, Vec<f32>) {
        let texels = surroundings.texels;
        // A single texel's spread of four is itself noise: the neighbourhood's mean is not.
        let variances: Vec<f32> = estimates.iter().map(|e| variance(e).element_sum()).collect();
        let noise: Vec<f32> = texels
            .par_iter()
            .map(|texel| {
                let around = surroundings.every(texel, NOISE_STEPS, self.step);
                mean_of(around.map(|(.., other)| variances[other]))
            })
            .collect();
        // Each half's weights come from the other half: noise that shaped the weights would pull the mean towards what is
        // most frequent, and light is lost (Rousselle, Knaus, Zwicker, "Adaptive Rendering with Non-Local Means", 2012).
        let guides: Vec<[Vec3A; 2]> =
            texels.par_iter().map(|texel| self.guide(surroundings, texel, estimates)).collect();
        // Of a guide over a texel's mean: twice for a half, and the less the more texels.
        let guide_noise = 2.0 / ((2 * self.guide_steps + 1) as f32).powi(2);
        let values: Vec<[Values; 2]> = estimates
            .par_iter()
            .map(|&[a, b, c, d]| [[a, b], [c, d]].map(|half| half.map(|value| value.extend(1.0))))
            .collect();
        let mut smoothed: Vec<Estimates> = (0..texels.len())
            .into_par_iter()
            .map(|index| {
                let texel = &texels[index];
                if texel.is_hidden() {
                    return estimates[index];
                }
                let narrow = self.width.powi(-2) + self.near * self.near * nearness[index];
                let own_guides = guides[index];
                let mut planes = [Plane::default(), Plane::default()];
                // Of iterators within iterators, the loop that the iterator itself runs is the quick one.
                surroundings.every(texel, self.steps, self.step).for_each(|(dx, dy, other)| {
                    let apart = (dx * dx + dy * dy) * narrow;
                    let expected = GUIDE_SIGMAS * guide_noise * (noise[index] + noise[other]);
                    let inverse = 1.0 / expected.max(f32::MIN_POSITIVE);
                    for (half, (plane, values)) in planes.iter_mut().zip(&values[other]).enumerate() {
                        let difference = guides[other][1 - half] - own_guides[1 - half];
                        let weight = falloff(apart + difference.length_squared() * inverse);
                        plane.add(dx, dy, weight, values);
                    }
                });
                let mut smoothed = estimates[index];
                for (half, plane) in planes.iter().enumerate() {
                    plane.at_center(&mut smoothed[half * HALF..][..HALF]);
                }
                smoothed
            })
            .collect();
        let mut bias = squared_bias(surroundings, self.step, estimates, &smoothed);
        for (index, bias) in bias.iter_mut().enumerate() {
            let before = noise[index] / 3.0;
            *bias = (*bias - self.chance * before).max(0.0);
            if *bias + variance(&smoothed[index]).element_sum() / 3.0 > before {
                (smoothed[index], *bias) = (estimates[index], 0.0);
            }
        }
        (smoothed, bias)
    }

    /// The means of both halves over the texels next to one.
    fn guide(&self, surroundings: &Surroundings<'_>, texel: &Texel, estimates: &[Estimates]) -> [Vec3A; 2] {
        let (mut sums, mut count) = ([Vec3::ZERO; 2], 0u32);
        surroundings.every(texel, self.guide_steps, self.step).for_each(|(.., other)| {
            for (half, sum) in sums.iter_mut().enumerate() {
                *sum += estimates[other][half * HALF..][..HALF].iter().sum::<Vec3>();
            }
            count += HALF as u32;
        });
        sums.map(|sum| Vec3A::from(sum / count.max(1) as f32))
    }
}

/// Squared differences of this many variances weigh e⁻¹.
const GUIDE_SIGMAS: f32 = 8.0;
/// Reach over which a texel's noise is averaged, in steps.
const NOISE_STEPS: i64 = 2;

fn mean_of(values: impl Iterator<Item = f32>) -> f32 {
    let (sum, count) = values.fold((0.0, 0u32), |(sum, count), value| (sum + value, count + 1));
    sum / count.max(1) as f32
}

/// (1 - x/16)^16: e^-x within .013, and nothing beyond 16.
#[inline(always)]
fn falloff(x: f32) -> f32 {
    let mut power = (1.0 - x * (1.0 / 16.0)).max(0.0);
    for _ in 0..4 {
        power *= power;
    }
    power
}

/// Mean of the scrambles.
pub(crate) fn mean(estimates: &Estimates) -> Vec3 {
    estimates.iter().sum::<Vec3>() / SCRAMBLES as f32
}

/// Variance of that mean.
pub(crate) fn variance(estimates: &Estimates) -> Vec3 {
    let mean = mean(estimates);
    let squares: Vec3 = estimates.iter().map(|&e| (e - mean) * (e - mean)).sum();
    squares / (SCRAMBLES * (SCRAMBLES - 1)) as f32
}
