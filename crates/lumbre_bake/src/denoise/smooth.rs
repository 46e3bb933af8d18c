//! Smooths sampled light within charts, by a weighted plane through each texel's neighbourhood, with weights that stop
//! at edges larger than the noise. The replicates of a half are smoothed with the same weights, so that their spread
//! stays an estimate of the error. There are two passes: the second reads every third texel of the first one's result,
//! and so reaches three times as far for the same work (Dammertz, Sewtz, Hanika and Lensch, "Edge-Avoiding À-Trous
//! Wavelet Transform", 2010).

use fearless_simd::{Select, Simd, f32x8, prelude::*};
use glam::Vec3;
use rayon::prelude::*;

use super::conserve_light::conserve_light;
use super::filter_features::{
    FEATURES, Features, NOISE, NOISE_STEPS, Variances, center_values, sum_of_variances,
};
use super::filter_pass::{BIAS, FilterPass, Smoothed};
use super::kernel::Kernel;
use super::neighbourhoods::Neighbourhoods;
use super::neighbours::Block;
use super::plane::VALUES;
use super::replicates::Estimates;
use super::smoothing_bias::{Products, squared_bias};
use super::texel_rows::{ChannelRows, TexelRows};
use super::weighted_fit::Fit;

/// The first pass reaches a few texels, almost whatever is near. Its `bias_noise`: a replicate has four times the
/// variance of the texel's mean, a block of 3 x 3 a ninth of that, and the radius of the bias holds 49 / 9 blocks,
/// twice for two halves: 4 / 9 / sqrt(2 * 49 / 9).
const FIRST: FilterPass = FilterPass { width: 2.5, near: 1.0, guide_steps: 1, bias_noise: 0.135 };
/// The second pass reaches far only where all other surfaces are far. Its input is correlated over some 20 texels, so
/// that its blocks hold only four independent values, and the radius of the bias four such blocks.
const SECOND: FilterPass = FilterPass { width: 9.0, near: 12.0, guide_steps: 0, bias_noise: 0.33 };

/// The smoothed estimates of every covered texel, and the squared bias that smoothing may have brought, mean of the
/// channels. `inverse_distances` holds, per texel, the mean of 1 / distance to the surfaces or lights that its samples
/// reached.
pub(crate) fn smooth(
    neighbourhoods: &Neighbourhoods<'_>,
    estimates: &[Estimates],
    inverse_distances: &[f32],
) -> (Vec<Estimates>, Vec<f32>) {
    let grid = neighbourhoods.grid();
    let distances_and_sides: ChannelRows<2> = neighbourhoods
        .fill(|index| [inverse_distances[index], neighbourhoods.texel_side(&neighbourhoods.texels[index])]);
    let mut smoothed: Smoothed = neighbourhoods.fill(|index| {
        let estimates = &estimates[index];
        std::array::from_fn(|place| if place < BIAS { estimates[place / 3][place % 3] } else { 0.0 })
    });
    smooth_rows(grid, distances_and_sides, &mut smoothed);
    let values = neighbourhoods.read(&smoothed).into_par_iter();
    let results = values.zip(neighbourhoods.texels).zip(estimates).map(|((values, texel), estimates)| {
        let smoothed = std::array::from_fn(|replicate| Vec3::from_slice(&values[3 * replicate..]));
        if texel.is_hidden() { (*estimates, 0.0) } else { (smoothed, values[BIAS]) }
    });
    let (mut smoothed, biases): (Vec<Estimates>, Vec<f32>) = results.unzip();
    conserve_light(&neighbourhoods.texel_charts, estimates, &mut smoothed);
    (smoothed, biases)
}

/// Both passes, in place. `distances_and_sides` holds the inverse distances and the texels' side lengths.
fn smooth_rows(grid: &TexelRows, distances_and_sides: ChannelRows<2>, estimates: &mut Smoothed) {
    let nearness = grid.compute(&Nearness(&distances_and_sides));
    drop(distances_and_sides);
    FIRST.smooth::<1, 7>(grid, estimates, &nearness);
    SECOND.smooth::<3, 9>(grid, estimates, &nearness);
}

impl FilterPass {
    /// Smooths the estimates, and adds the squared bias that this brings. A texel that gains more bias than it loses
    /// noise stays as it is.
    fn smooth<const STEP: usize, const COLUMNS: usize>(
        &self,
        grid: &TexelRows,
        estimates: &mut Smoothed,
        nearness: &ChannelRows<1>,
    ) {
        let variances = grid.compute(&Variances(estimates));
        let features =
            grid.compute(&Features::<STEP> { steps: self.guide_steps, estimates, variances: &variances });
        drop(variances);
        let fit = Fit::<STEP, COLUMNS> { pass: self, estimates, nearness, features: &features };
        let smoothed = grid.compute(&fit);
        let products = grid.compute(&Products::<STEP> { raw: estimates, smoothed: &smoothed });
        let choice =
            Choice::<STEP> { pass: self, smoothed: &smoothed, features: &features, products: &products };
        grid.update(estimates, &choice);
    }
}

/// How near other surfaces are to a texel: the square of its side over their harmonic mean distance.
struct Nearness<'a>(&'a ChannelRows<2>);

impl Kernel<1> for Nearness<'_> {
    #[inline(always)]
    fn at<S: Simd>(&self, block: &Block<'_, S>, _: &[f32x8<S>; 1]) -> [f32x8<S>; 1] {
        let inverse_distance = block.mean(self.0, 0, NOISE_STEPS, 1);
        let ratio = inverse_distance * block.center(self.0, 1);
        let is_finite = ratio.abs().simd_lt(f32::INFINITY);
        [is_finite.select(ratio * ratio, block.simd.splat_f32x8(0.0))]
    }
}

/// The smoothed estimates where smoothing helps, the input elsewhere, and the squared bias of all passes so far.
struct Choice<'a, const STEP: usize> {
    pass: &'a FilterPass,
    smoothed: &'a ChannelRows<VALUES>,
    features: &'a ChannelRows<FEATURES>,
    products: &'a ChannelRows<1>,
}

impl<const STEP: usize> Kernel<{ VALUES + 1 }> for Choice<'_, STEP> {
    #[inline(always)]
    fn at<S: Simd>(
        &self,
        block: &Block<'_, S>,
        estimates: &[f32x8<S>; VALUES + 1],
    ) -> [f32x8<S>; VALUES + 1] {
        let zero = block.simd.splat_f32x8(0.0);
        let variance = block.center(self.features, NOISE) / 3.0;
        let bias = squared_bias(block, STEP, self.products);
        let bias = (bias - variance * self.pass.bias_noise).max(zero);
        let smoothed = center_values(block, self.smoothed);
        let is_worse = (bias + sum_of_variances(block.simd, &smoothed) / 3.0).simd_gt(variance);
        let added_bias = is_worse.select(zero, bias);
        let mut chosen = *estimates;
        for (chosen, smoothed) in chosen.iter_mut().zip(smoothed) {
            *chosen = is_worse.select(*chosen, smoothed);
        }
        // Both passes flatten what is curved, so that their biases have the same sign and add up.
        let total_bias = estimates[BIAS].sqrt() + added_bias.sqrt();
        chosen[BIAS] = total_bias * total_bias;
        chosen
    }
}

#[cfg(test)]
mod tests {
    use fearless_simd::Level;

    use super::super::neighbours::tests::{random_channels, random_grid};
    use super::*;

    #[test]
    fn every_simd_level_smooths_to_the_same_bits() {
        let smoothed = |level| {
            let grid = random_grid(level);
            let mut estimates = random_channels(&grid, 3);
            smooth_rows(&grid, random_channels(&grid, 4), &mut estimates);
            estimates.values
        };
        let (best, baseline) = (smoothed(Level::new()), smoothed(Level::baseline()));
        let bits = |values: &[f32]| values.iter().map(|value| value.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(&best), bits(&baseline));
        assert!(best.iter().all(|value| value.is_finite()));
        // Smoothing changes most values.
        let grid = random_grid(Level::new());
        let before: Smoothed = random_channels(&grid, 3);
        let changed = before.values.iter().zip(&best).filter(|(before, after)| before != after).count();
        assert!(2 * changed > best.iter().filter(|value| **value != 0.0).count(), "{changed}");
    }
}
