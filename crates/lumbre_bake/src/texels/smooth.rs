//! Smooths the gathered light within charts: a weighted plane through each texel's neighbourhood, with weights that stop at
//! edges larger than the noise. The same weights for every scramble, so that their spread stays an estimate of the error.
//! In levels: the second takes what the first has made of every third texel, and so reaches three times as far for the same work
//! (Dammertz, Sewtz, Hanika and Lensch, "Edge-Avoiding À-Trous Wavelet Transform", 2010).

use glam::{Vec3, Vec4, Vec4Swizzles};
use rayon::prelude::*;

use super::footprint::Texel;
use super::gather::SCRAMBLES;
use super::plane::{HALF, Planes, Row, Values};
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
            let near = mean_around(surroundings, texel, 1, inverse_distances);
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
        let variances: Vec<f32> = estimates.par_iter().map(|e| variance(e).element_sum()).collect();
        let noise: Vec<f32> =
            texels.par_iter().map(|texel| mean_around(surroundings, texel, self.step, &variances)).collect();
        let guides = self.guides(surroundings, estimates);
        // Of a guide over a texel's mean: twice for a half, and the less the more texels.
        let guide_noise = 2.0 / ((2 * self.guide_steps + 1) as f32).powi(2);
        let values: Vec<Values> =
            estimates.par_iter().map(|estimates| estimates.map(|value| value.extend(1.0))).collect();
        let mut smoothed: Vec<Estimates> = (0..texels.len())
            .into_par_iter()
            .map(|index| {
                let texel = &texels[index];
                if texel.is_hidden() {
                    return estimates[index];
                }
                let narrow = self.width.powi(-2) + self.near * self.near * nearness[index];
                let (own_guide, own_noise) = (guides[index], noise[index]);
                let mut planes = Planes::default();
                surroundings.runs(texel, self.steps, self.step, |run| {
                    let mut row = Row::default();
                    let (y, mut x) = (run.down as f32, run.right as f32);
                    for other in (run.first..run.end).step_by(self.step as usize) {
                        let expected = GUIDE_SIGMAS * guide_noise * (own_noise + noise[other]);
                        let inverse = 1.0 / expected.max(f32::MIN_POSITIVE);
                        let apart = Vec4::splat((x * x + y * y) * narrow);
                        row.add(
                            x,
                            falloff(apart + guides[other].apart(&own_guide) * inverse),
                            &values[other],
                        );
                        x += self.step as f32;
                    }
                    planes.add(y, &row);
                });
                let mut smoothed = estimates[index];
                for half in 0..SCRAMBLES / HALF {
                    planes.at_center(half, &mut smoothed[half * HALF..][..HALF]);
                }
                smoothed
            })
            .collect();
        let mut bias = squared_bias(surroundings, self.step, estimates, &smoothed);
        let before = estimates.par_iter().zip(&noise);
        smoothed.par_iter_mut().zip(&mut bias).zip(before).for_each(
            |((smoothed, bias), (estimates, noise))| {
                let before = noise / 3.0;
                *bias = (*bias - self.chance * before).max(0.0);
                if *bias + variance(smoothed).element_sum() / 3.0 > before {
                    (*smoothed, *bias) = (*estimates, 0.0);
                }
            },
        );
        (smoothed, bias)
    }

    /// What tells edges at each texel: the means of both halves over the texels next to it. Each half's weights come from the other half: noise
    /// that shaped the weights would pull the mean towards what is most frequent, and light is lost (Rousselle, Knaus, Zwicker, "Adaptive
    /// Rendering with Non-Local Means", 2012).
    fn guides(&self, surroundings: &Surroundings<'_>, estimates: &[Estimates]) -> Vec<Guide> {
        let own: Vec<Guide> =
            estimates.par_iter().map(|[a, b, c, d]| Guide::of([*c + *d, *a + *b])).collect();
        let around = |texel: &Texel| {
            let (mut sum, mut count) = (Guide::default(), 0u32);
            surroundings.around(texel, self.guide_steps, self.step, |other| {
                sum.first += own[other].first;
                sum.second += own[other].second;
                count += HALF as u32;
            });
            let scale = 1.0 / count.max(1) as f32;
            Guide { first: sum.first * scale, second: sum.second * scale }
        };
        surroundings.texels.par_iter().map(around).collect()
    }
}

/// Light for the weights of each half: red and green of both, then blue.
#[derive(Clone, Copy, Default)]
struct Guide {
    first: Vec4,
    second: Vec4,
}

impl Guide {
    fn of([one, two]: [Vec3; 2]) -> Self {
        Self { first: Vec4::new(one.x, two.x, one.y, two.y), second: Vec4::new(one.z, two.z, 0.0, 0.0) }
    }

    /// Squared differences, for each half.
    #[inline(always)]
    fn apart(&self, other: &Self) -> Vec4 {
        let (first, second) = (self.first - other.first, self.second - other.second);
        let (first, second) = (first * first, second * second);
        first + first.zwzw() + second
    }
}

/// Squared differences of this many variances weigh e⁻¹.
const GUIDE_SIGMAS: f32 = 8.0;
/// Reach over which a texel's noise is averaged, in steps.
const NOISE_STEPS: i64 = 2;

/// Over a texel's neighbours.
fn mean_around(surroundings: &Surroundings<'_>, texel: &Texel, step: i64, values: &[f32]) -> f32 {
    let (mut sum, mut count) = (0.0, 0u32);
    surroundings.around(texel, NOISE_STEPS, step, |other| {
        sum += values[other];
        count += 1;
    });
    sum / count.max(1) as f32
}

/// (1 - x/16)^16: e^-x within .013, and nothing beyond 16.
#[inline(always)]
fn falloff(x: Vec4) -> Vec4 {
    let mut power = (Vec4::ONE - x * (1.0 / 16.0)).max(Vec4::ZERO);
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
