//! Smooths the gathered light within charts: a weighted plane through each texel's neighbourhood, with weights that stop at
//! edges larger than the noise. The same weights for every scramble, so that their spread stays an estimate of the error.
//! In levels: the second takes what the first has made of every third texel, and so reaches three times as far for the same work
//! (Dammertz, Sewtz, Hanika and Lensch, "Edge-Avoiding À-Trous Wavelet Transform", 2010).

use fearless_simd::{Select, Simd, f32x8, prelude::*};
use glam::Vec3;
use rayon::prelude::*;

use super::gather::SCRAMBLES;
use super::lanes::{Beside, Block, Grid, Kernel, OWN, Strips, lanes};
use super::plane::{HALF, Planes, VALUES};
use super::smoothing_bias::{Products, squared_bias};
use super::surroundings::Surroundings;

/// What a texel has, before and after.
pub(crate) type Estimates = [Vec3; SCRAMBLES];
/// The channels of the estimates, and the squared bias, mean of the channels.
pub(crate) type Smoothed = Strips<{ VALUES + 1 }>;
const BIAS: usize = VALUES;

/// One pass over all texels.
struct Level {
    /// Texels at which a neighbour weighs e⁻¹; and where things are near, the share of their harmonic mean distance, inverted.
    width: f32,
    near: f32,
    /// Reach of the means that tell edges, in steps.
    guide_steps: usize,
    /// Of the variance of what goes in, the part that chance leaves in the squared bias.
    chance: f32,
}

/// The first reaches little further than a texel's own size, whatever is near; the second only where everything is far. `chance`, for
/// the first: four times the variance of a texel for one scramble, a ninth of it in a block, of which the radius holds 49/9, twice for
/// two halves: 4 / 9 / sqrt(2 * 49 / 9). What the second takes in goes together over some 20 texels: its blocks hold four
/// that do not, and the radius as many blocks.
const FIRST: Level = Level { width: 2.5, near: 1.0, guide_steps: 1, chance: 0.135 };
const SECOND: Level = Level { width: 9.0, near: 12.0, guide_steps: 0, chance: 0.33 };

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
    FIRST.smooth::<1, 7>(grid, &mut smoothed, &nearness);
    SECOND.smooth::<3, 9>(grid, &mut smoothed, &nearness);
    let texels = surroundings.texels.par_iter().zip(estimates);
    let smoothed = texels.map(|(texel, estimates)| {
        let Some((row, column)) = surroundings.place(texel) else { return (*estimates, 0.0) };
        let found = grid.get(&smoothed, row, column);
        (std::array::from_fn(|scramble| Vec3::from_slice(&found[3 * scramble..])), found[BIAS])
    });
    smoothed.unzip()
}

impl Level {
    /// Smooths the estimates, and adds the squared bias that this brought; a texel to which it brings more than it takes away stays as it is.
    fn smooth<const STEP: usize, const COLUMNS: usize>(
        &self,
        grid: &Grid,
        estimates: &mut Smoothed,
        nearness: &Strips<1>,
    ) {
        let variances = grid.compute(&Variances(estimates));
        let guides = grid.compute(&Guides::<STEP> { level: self, estimates, variances: &variances });
        drop(variances);
        let fit = Fit::<STEP, COLUMNS> { level: self, estimates, nearness, guides: &guides };
        let smoothed = grid.compute(&fit);
        let products = grid.compute(&Products::<STEP> { raw: estimates, smoothed: &smoothed });
        let choice =
            Choice::<STEP> { level: self, smoothed: &smoothed, guides: &guides, products: &products };
        grid.change(estimates, &choice);
    }
}

/// How near the things are that a texel sees: its side over their harmonic mean distance, squared.
struct Nearness<'a>(&'a Strips<2>);

impl Kernel<1> for Nearness<'_> {
    #[inline(always)]
    fn at<S: Simd>(&self, block: &Block<'_, S>, _: &[f32x8<S>; 1]) -> [f32x8<S>; 1] {
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
    fn at<S: Simd>(&self, block: &Block<'_, S>, _: &[f32x8<S>; 1]) -> [f32x8<S>; 1] {
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
struct Guides<'a, const STEP: usize> {
    level: &'a Level,
    estimates: &'a Smoothed,
    variances: &'a Strips<1>,
}
/// The channels for the weights of each half, and the noise.
const GUIDES: usize = 2 * 3 + 1;
const NOISE: usize = 2 * 3;

impl<const STEP: usize> Kernel<GUIDES> for Guides<'_, STEP> {
    #[inline(always)]
    fn at<S: Simd>(&self, block: &Block<'_, S>, _: &[f32x8<S>; GUIDES]) -> [f32x8<S>; GUIDES] {
        let simd = block.simd;
        let (sums, count) = block.sums(
            self.level.guide_steps,
            STEP,
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
        let mut guides = [block.mean(self.variances, 0, NOISE_STEPS, STEP); GUIDES];
        for (guide, sum) in guides.iter_mut().zip(sums) {
            *guide = sum * scale;
        }
        guides
    }
}

/// The weighted planes, over so many texels a row, `STEP` apart, and as many rows.
struct Fit<'a, const STEP: usize, const COLUMNS: usize> {
    level: &'a Level,
    estimates: &'a Smoothed,
    nearness: &'a Strips<1>,
    guides: &'a Strips<GUIDES>,
}

impl<const STEP: usize, const COLUMNS: usize> Kernel<VALUES> for Fit<'_, STEP, COLUMNS> {
    #[inline(always)]
    fn at<S: Simd>(&self, block: &Block<'_, S>, _: &[f32x8<S>; VALUES]) -> [f32x8<S>; VALUES] {
        let simd = block.simd;
        let mut own = [simd.splat_f32x8(0.0); GUIDES];
        for (place, own) in own.iter_mut().enumerate() {
            *own = block.own(self.guides, place);
        }
        let near = self.level.near * self.level.near;
        let narrow = block.own(self.nearness, 0) * near + self.level.width.powi(-2);
        let mut planes = Planes::new(simd);
        for beside in block.rows(COLUMNS / 2, STEP) {
            let y = beside.down as f32;
            let weights = if block.all_count(&beside, COLUMNS / 2 * STEP) {
                self.weights::<true, S>(block, &beside, &own, narrow)
            } else {
                self.weights::<false, S>(block, &beside, &own, narrow)
            };
            for (half, weights) in weights.iter().enumerate() {
                planes.add_weights(half, STEP, y, weights);
                for scramble in half * HALF..(half + 1) * HALF {
                    let first = 3 * scramble;
                    let [r, g, b] = [first, first + 1, first + 2];
                    let values = [r, g, b].map(
                        #[inline(always)]
                        |channel| self.estimates.beside(&beside, channel),
                    );
                    planes.add_values(scramble, STEP, y, weights, values);
                }
            }
        }
        let mut values = own_values(block, self.estimates);
        planes.at_center(&mut values);
        values
    }
}

impl<const STEP: usize, const COLUMNS: usize> Fit<'_, STEP, COLUMNS> {
    /// Of both halves' neighbours in a row.
    #[inline(always)]
    fn weights<const ALL_COUNT: bool, S: Simd>(
        &self,
        block: &Block<'_, S>,
        beside: &Beside<'_>,
        own: &[f32x8<S>; GUIDES],
        narrow: f32x8<S>,
    ) -> [[f32x8<S>; COLUMNS]; 2] {
        let simd = block.simd;
        let zero = simd.splat_f32x8(0.0);
        // Of a guide over a texel's mean: twice for a half, and the less the more texels.
        let guide_noise = GUIDE_SIGMAS * 2.0 / ((2 * self.level.guide_steps + 1) as f32).powi(2);
        let y = beside.down as f32;
        let mut guides = [self.guides.beside(beside, NOISE); GUIDES];
        for (place, guide) in guides.iter_mut().enumerate() {
            *guide = self.guides.beside(beside, place);
        }
        let mut weights = [[zero; COLUMNS]; 2];
        for place in 0..COLUMNS {
            let at = OWN - COLUMNS / 2 * STEP + place * STEP;
            let x = place as f32 * STEP as f32 - (COLUMNS / 2 * STEP) as f32;
            let noise: f32x8<S> = lanes(simd, guides[NOISE], at);
            let expected = (own[NOISE] + noise) * guide_noise;
            let inverse = simd.splat_f32x8(1.0) / expected.max(f32::MIN_POSITIVE);
            let far = narrow * (x * x + y * y);
            let counts = if ALL_COUNT { simd.splat_mask32x8(true) } else { block.counts(beside, at) };
            for (half, weights) in weights.iter_mut().enumerate() {
                let mut squares = [zero; 3];
                for (channel, square) in squares.iter_mut().enumerate() {
                    let guide: f32x8<S> = lanes(simd, guides[3 * half + channel], at);
                    let difference = guide - own[3 * half + channel];
                    *square = difference * difference;
                }
                let apart = squares[0] + squares[1] + squares[2];
                let weight = falloff(simd, far + apart * inverse);
                weights[place] = if ALL_COUNT { weight } else { counts.select(weight, zero) };
            }
        }
        weights
    }
}

/// What was smoothed where that helps; and the squared bias of both levels together.
struct Choice<'a, const STEP: usize> {
    level: &'a Level,
    smoothed: &'a Strips<VALUES>,
    guides: &'a Strips<GUIDES>,
    products: &'a Strips<1>,
}

impl<const STEP: usize> Kernel<{ VALUES + 1 }> for Choice<'_, STEP> {
    #[inline(always)]
    fn at<S: Simd>(
        &self,
        block: &Block<'_, S>,
        estimates: &[f32x8<S>; VALUES + 1],
    ) -> [f32x8<S>; VALUES + 1] {
        let zero = block.simd.splat_f32x8(0.0);
        let before = block.own(self.guides, NOISE) / 3.0;
        let bias = squared_bias(block, STEP, self.products);
        let bias = (bias - before * self.level.chance).max(zero);
        let smoothed = own_values(block, self.smoothed);
        let worse = (bias + sum_of_variances(block.simd, &smoothed) / 3.0).simd_gt(before);
        let brought = worse.select(zero, bias);
        let mut chosen = *estimates;
        for (chosen, smoothed) in chosen.iter_mut().zip(smoothed) {
            *chosen = worse.select(*chosen, smoothed);
        }
        // Both levels flatten what is curved, and so in the same direction.
        let both = estimates[BIAS].sqrt() + brought.sqrt();
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
