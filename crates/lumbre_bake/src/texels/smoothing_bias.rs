//! What smoothing may have done to the light besides taking its noise away. Not the smoothing.

use glam::Vec3A;
use rayon::prelude::*;

use super::plane::HALF;
use super::smooth::Estimates;
use super::surroundings::Surroundings;

/// Texels around one over which differences are averaged with their sign, and then without it.
const BLOCK_RADIUS: i64 = 1;
const BIAS_RADIUS: i64 = 3;
/// The smoothed value of one half against the raw values of the other, which know nothing of it: the product of its differences
/// to two scrambles, each averaged over a block, has the square of the bias as its mean, and the smoothed value's own variance.
/// (A single texel's squared difference says the same with ten times the noise.) May be negative, by chance.
/// Blocks are of texels `step` apart.
pub(crate) fn squared_bias(
    surroundings: &Surroundings<'_>,
    step: i64,
    raw: &[Estimates],
    smoothed: &[Estimates],
) -> Vec<f32> {
    let half = |estimates: &Estimates, half: usize| [estimates[half * HALF], estimates[half * HALF + 1]];
    let differences: Vec<[[Vec3A; HALF]; 2]> = raw
        .par_iter()
        .zip(smoothed)
        .map(|(raw, smoothed)| {
            [0, 1].map(|side| {
                let [a, b] = half(smoothed, side);
                half(raw, 1 - side).map(|raw| Vec3A::from(0.5 * (a + b) - raw))
            })
        })
        .collect();
    let of_blocks: Vec<f32> = surroundings
        .texels
        .par_iter()
        .zip(smoothed)
        .map(|(texel, smoothed)| {
            let (mut sums, mut count) = ([[Vec3A::ZERO; HALF]; 2], 0u32);
            surroundings.around(texel, BLOCK_RADIUS, step, |other| {
                for (sums, differences) in sums.iter_mut().zip(&differences[other]) {
                    for (sum, difference) in sums.iter_mut().zip(differences) {
                        *sum += *difference;
                    }
                }
                count += 1;
            });
            let scale = 1.0 / (count.max(1) * count.max(1)) as f32;
            let of_half = |side: usize| {
                let [a, b] = half(smoothed, side);
                let own = 0.25 * ((a - b) * (a - b)).element_sum();
                (sums[side][0] * sums[side][1]).element_sum() * scale - own
            };
            (of_half(0) + of_half(1)) / 6.0
        })
        .collect();
    surroundings
        .texels
        .par_iter()
        .map(|texel| {
            let (mut sum, mut count) = (0.0, 0u32);
            surroundings.around(texel, BIAS_RADIUS, step, |other| {
                sum += of_blocks[other];
                count += 1;
            });
            sum / count.max(1) as f32
        })
        .collect()
}
