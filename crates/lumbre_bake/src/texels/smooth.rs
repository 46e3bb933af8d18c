//! Smooths the gathered light within charts: a weighted plane through each texel's neighbourhood, with weights that stop at
//! edges larger than the noise. The same weights for every scramble, so that their spread stays an estimate of the error.
//! In levels: the second takes what the first has made of every third texel, and so reaches three times as far for the same work
//! (Dammertz, Sewtz, Hanika and Lensch, "Edge-Avoiding À-Trous Wavelet Transform", 2010).

use fearless_simd::{Select, Simd, f32x8, prelude::*};
use glam::Vec3;
use rayon::prelude::*;

use super::gather::SCRAMBLES;
use super::lanes::{Beside, Block, Grid, Kernel, OWN, Strips, lanes};
use super::plane::{HALF, OF_HALF, Planes, Row, VALUES};
use super::smoothing_bias::{Products, squared_bias};
use super::surroundings::Surroundings;

/// What a texel has, before and after.
pub(crate) type Estimates = [Vec3; SCRAMBLES];
/// The channels of the estimates, and the squared bias, mean of the channels.
pub(crate) type Smoothed = Strips<{ VALUES + 1 }>;
const BIAS: usize = VALUES;

/// One pass over all texels.
struct Level {
    /// Texels from one neighbour to the next, and how many neighbours each way.
    step: usize,
    steps: usize,
    /// Texels at which a neighbour weighs e⁻¹; and where things are near, the share of their harmonic mean distance, inverted.
    width: f32,
    near: f32,
    /// Reach of the means that tell edges, in steps.
    guide_steps: usize,
    /// Of the variance of what goes in, the part that chance leaves in the squared bias.
    chance: f32,
}
/// The most neighbours in a row.
const COLUMNS: usize = 9;

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
    let grid = surroundings.grid();
    let things: Strips<2> = surroundings
        .fill(|index| [inverse_distances[index], surroundings.texel_side(&surroundings.texels[index])]);
    let nearness = grid.compute(&Nearness(&things));
    drop(things);
    let mut smoothed: Smoothed = surroundings.fill(|index| {
        let estimates = &estimates[index];
        std::array::from_fn(|place| if place < BIAS { estimates[place / 3][place % 3] } else { 0.0 })
    });
    for level in &LEVELS {
        smoothed = level.smooth(grid, &smoothed, &nearness);
    }
    let texels = surroundings.texels.par_iter().zip(estimates);
    let smoothed = texels.map(|(texel, estimates)| {
        let Some((row, column)) = surroundings.place(texel) else { return (*estimates, 0.0) };
        let found = grid.get(&smoothed, row, column);
        (std::array::from_fn(|scramble| Vec3::from_slice(&found[3 * scramble..])), found[BIAS])
    });
    smoothed.unzip()
}

impl Level {
    /// The estimates smoothed, and the squared bias with what this brought; a texel to which it brings more than it takes away stays as it is.
    fn smooth(&self, grid: &Grid, estimates: &Smoothed, nearness: &Strips<1>) -> Smoothed {
        let variances = grid.compute(&Variances(estimates));
        let guides = grid.compute(&Guides { level: self, estimates, variances: &variances });
        drop(variances);
        let smoothed = grid.compute(&Fit { level: self, estimates, nearness, guides: &guides });
        let products = grid.compute(&Products { step: self.step, raw: estimates, smoothed: &smoothed });
        grid.compute(&Choice {
            level: self,
            estimates,
            smoothed: &smoothed,
            guides: &guides,
            products: &products,
        })
    }
}

/// How near the things are that a texel sees: its side over their harmonic mean distance, squared.
struct Nearness<'a>(&'a Strips<2>);

impl Kernel<1> for Nearness<'_> {
    #[inline(always)]
    fn at<S: Simd>(&self, block: &Block<'_, S>) -> [f32x8<S>; 1] {
        let near = block.mean(self.0, 0, NOISE_STEPS, 1);
        let steps = near * block.own(self.0, 1);
        let finite = steps.abs().simd_lt(f32::INFINITY);
        [finite.select(steps * steps, block.simd.splat_f32x8(0.0))]
    }
}

/// Variance of the scrambles' mean, sum of the channels.
struct Variances<'a>(&'a Smoothed);

impl Kernel<1> for Variances<'_> {
    #[inline(always)]
    fn at<S: Simd>(&self, block: &Block<'_, S>) -> [f32x8<S>; 1] {
        [sum_of_variances(block.simd, &own_values(block, self.0))]
    }
}

/// The channels of all scrambles of the texels themselves.
#[inline(always)]
pub(crate) fn own_values<const N: usize, S: Simd>(
    block: &Block<'_, S>,
    strips: &Strips<N>,
) -> [f32x8<S>; VALUES] {
    let mut values = [block.simd.splat_f32x8(0.0); VALUES];
    for (place, value) in values.iter_mut().enumerate() {
        *value = block.own(strips, place);
    }
    values
}

/// As [`variance`], sum of the channels.
#[inline(always)]
fn sum_of_variances<S: Simd>(simd: S, values: &[f32x8<S>; VALUES]) -> f32x8<S> {
    let mut sum = simd.splat_f32x8(0.0);
    for channel in 0..3 {
        let [a, b, c, d] = [values[channel], values[3 + channel], values[6 + channel], values[9 + channel]];
        let mean = (a + b + c + d) / SCRAMBLES as f32;
        let [a, b, c, d] = [a - mean, b - mean, c - mean, d - mean];
        sum += (a * a + b * b + c * c + d * d) / (SCRAMBLES * (SCRAMBLES - 1)) as f32;
    }
    sum
}

/// A texel's noise: its own spread of four is itself noise, the neighbourhood's mean is not. And what tells edges: the means of both halves
/// over the texels next to it. Each half's weights come from the other half: noise that shaped the weights would pull the mean towards
/// what is most frequent, and light is lost (Rousselle, Knaus, Zwicker, "Adaptive Rendering with Non-Local Means", 2012).
struct Guides<'a> {
    level: &'a Level,
    estimates: &'a Smoothed,
    variances: &'a Strips<1>,
}
/// The channels for the weights of each half, and the noise.
const GUIDES: usize = 2 * 3 + 1;
const NOISE: usize = 2 * 3;

impl Kernel<GUIDES> for Guides<'_> {
    #[inline(always)]
    fn at<S: Simd>(&self, block: &Block<'_, S>) -> [f32x8<S>; GUIDES] {
        let Level { step, guide_steps, .. } = *self.level;
        let simd = block.simd;
        let (sums, count) = block.sums(
            guide_steps,
            step,
            #[inline(always)]
            |beside, at| {
                let mut sums = [simd.splat_f32x8(0.0); 2 * 3];
                for (place, sum) in sums.iter_mut().enumerate() {
                    let (half, channel) = (1 - place / 3, place % 3);
                    let first = 3 * HALF * half + channel;
                    let one: f32x8<S> = lanes(simd, self.estimates.beside(beside, first), at);
                    let two: f32x8<S> = lanes(simd, self.estimates.beside(beside, first + 3), at);
                    *sum = one + two;
                }
                sums
            },
        );
        let scale = simd.splat_f32x8(1.0) / (count * HALF as f32).max(1.0);
        let mut guides = [block.mean(self.variances, 0, NOISE_STEPS, step); GUIDES];
        for (guide, sum) in guides.iter_mut().zip(sums) {
            *guide = sum * scale;
        }
        guides
    }
}

/// The weighted planes.
struct Fit<'a> {
    level: &'a Level,
    estimates: &'a Smoothed,
    nearness: &'a Strips<1>,
    guides: &'a Strips<GUIDES>,
}

impl Kernel<VALUES> for Fit<'_> {
    #[inline(always)]
    fn at<S: Simd>(&self, block: &Block<'_, S>) -> [f32x8<S>; VALUES] {
        let Level { step, steps, .. } = *self.level;
        let simd = block.simd;
        let zero = simd.splat_f32x8(0.0);
        let mut own = [zero; GUIDES];
        for (place, own) in own.iter_mut().enumerate() {
            *own = block.own(self.guides, place);
        }
        let near = self.level.near * self.level.near;
        let narrow = block.own(self.nearness, 0) * near + self.level.width.powi(-2);
        // Of a guide over a texel's mean: twice for a half, and the less the more texels.
        let guide_noise = GUIDE_SIGMAS * 2.0 / ((2 * self.level.guide_steps + 1) as f32).powi(2);
        let mut planes = Planes::new(simd);
        for beside in block.rows(steps, step) {
            let y = beside.down as f32;
            let mut guides = [self.guides.beside(&beside, NOISE); GUIDES];
            for (place, guide) in guides.iter_mut().enumerate() {
                *guide = self.guides.beside(&beside, place);
            }
            let mut weights = [[zero; 2]; COLUMNS];
            for (place, weights) in weights.iter_mut().enumerate().take(2 * steps + 1) {
                let at = OWN - steps * step + place * step;
                let x = at as f32 - OWN as f32;
                let noise: f32x8<S> = lanes(simd, guides[NOISE], at);
                let expected = (own[NOISE] + noise) * guide_noise;
                let inverse = simd.splat_f32x8(1.0) / expected.max(f32::MIN_POSITIVE);
                let far = narrow * (x * x + y * y);
                let counts = block.counts(&beside, at);
                for (half, weight) in weights.iter_mut().enumerate() {
                    let mut apart = zero;
                    for channel in 0..3 {
                        let guide: f32x8<S> = lanes(simd, guides[3 * half + channel], at);
                        let difference = guide - own[3 * half + channel];
                        apart += difference * difference;
                    }
                    *weight = counts.select(falloff(simd, far + apart * inverse), zero);
                }
            }
            planes.add(y, &self.row(block, &beside, &weights));
        }
        let mut values = own_values(block, self.estimates);
        planes.at_center(&mut values);
        values
    }
}

impl Fit<'_> {
    /// The weighted sums of a row. Some eighty values of about one size: single precision keeps six digits of them.
    #[inline(always)]
    fn row<S: Simd>(
        &self,
        block: &Block<'_, S>,
        beside: &Beside<'_>,
        weights: &[[f32x8<S>; 2]; COLUMNS],
    ) -> Row<S> {
        let Level { step, steps, .. } = *self.level;
        let (simd, first) = (block.simd, OWN - steps * step);
        let zero = simd.splat_f32x8(0.0);
        let mut row = Row { sums: [[zero; VALUES]; 2], weights: [[zero; 2]; 3] };
        for half in 0..2 {
            let mut windows = [self.estimates.beside(beside, 0); OF_HALF];
            for (place, window) in windows.iter_mut().enumerate() {
                *window = self.estimates.beside(beside, half * OF_HALF + place);
            }
            let (mut sums, mut with_x, mut of_weights) = ([zero; OF_HALF], [zero; OF_HALF], [zero; 3]);
            for (place, weight) in weights.iter().enumerate().take(2 * steps + 1) {
                let at = first + place * step;
                let (x, weight) = (at as f32 - OWN as f32, weight[half]);
                of_weights[0] += weight;
                of_weights[1] += weight * x;
                of_weights[2] += weight * (x * x);
                for k in 0..OF_HALF {
                    let term = weight * lanes::<S, f32x8<S>>(simd, windows[k], at);
                    sums[k] += term;
                    with_x[k] += term * x;
                }
            }
            row.sums[0][half * OF_HALF..][..OF_HALF].copy_from_slice(&sums);
            row.sums[1][half * OF_HALF..][..OF_HALF].copy_from_slice(&with_x);
            for k in 0..3 {
                row.weights[k][half] = of_weights[k];
            }
        }
        row
    }
}

/// What was smoothed where that helps; and the squared bias of both levels together.
struct Choice<'a> {
    level: &'a Level,
    estimates: &'a Smoothed,
    smoothed: &'a Strips<VALUES>,
    guides: &'a Strips<GUIDES>,
    products: &'a Strips<1>,
}

impl Kernel<{ VALUES + 1 }> for Choice<'_> {
    #[inline(always)]
    fn at<S: Simd>(&self, block: &Block<'_, S>) -> [f32x8<S>; VALUES + 1] {
        let zero = block.simd.splat_f32x8(0.0);
        let before = block.own(self.guides, NOISE) / 3.0;
        let bias = squared_bias(block, self.level.step, self.products);
        let bias = (bias - before * self.level.chance).max(zero);
        let smoothed = own_values(block, self.smoothed);
        let worse = (bias + sum_of_variances(block.simd, &smoothed) / 3.0).simd_gt(before);
        let brought = worse.select(zero, bias);
        let mut chosen = [zero; VALUES + 1];
        for place in 0..VALUES {
            chosen[place] = worse.select(block.own(self.estimates, place), smoothed[place]);
        }
        // Both levels flatten what is curved, and so in the same direction.
        let both = block.own(self.estimates, BIAS).sqrt() + brought.sqrt();
        chosen[BIAS] = both * both;
        chosen
    }
}

/// Squared differences of this many variances weigh e⁻¹.
const GUIDE_SIGMAS: f32 = 8.0;
/// Reach over which a texel's noise is averaged, in steps.
const NOISE_STEPS: usize = 2;

/// (1 - x/16)^16: e^-x within .013, and nothing beyond 16.
#[inline(always)]
fn falloff<S: Simd>(simd: S, x: f32x8<S>) -> f32x8<S> {
    let mut power = (simd.splat_f32x8(1.0) - x * (1.0 / 16.0)).max(0.0);
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
