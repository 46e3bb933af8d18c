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
use super::nearness::Nearness;
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
/// channels. `nearness` holds, per texel, the mean of that of the surfaces or lights that its samples reached.
pub(crate) fn smooth(
    neighbourhoods: &Neighbourhoods<'_>,
    estimates: &[Estimates],
    nearness: &[Nearness],
) -> (Vec<Estimates>, Vec<f32>) {
    let grid = neighbourhoods.grid();
    let nearness: ChannelRows<3> = neighbourhoods.fill(|index| {
        let side = neighbourhoods.texel_side(&neighbourhoods.texels[index]);
        let Nearness { xx, xy, yy } = nearness[index].scaled(side);
        [xx, xy, yy]
    });
    let mut smoothed: Smoothed = neighbourhoods.fill(|index| {
        let estimates = &estimates[index];
        std::array::from_fn(|place| if place < BIAS { estimates[place / 3][place % 3] } else { 0.0 })
    });
    smooth_rows(grid, nearness, &mut smoothed);
    let values = neighbourhoods.read(&smoothed).into_par_iter();
    let results = values.zip(neighbourhoods.texels).zip(estimates).map(|((values, texel), estimates)| {
        let smoothed = std::array::from_fn(|replicate| Vec3::from_slice(&values[3 * replicate..]));
        if texel.is_hidden() { (*estimates, 0.0) } else { (smoothed, values[BIAS]) }
    });
    let (mut smoothed, biases): (Vec<Estimates>, Vec<f32>) = results.unzip();
    conserve_light(&neighbourhoods.texel_charts, estimates, &mut smoothed);
    (smoothed, biases)
}

/// Both passes, in place. `nearness` holds that of each texel, times the texel's side.
fn smooth_rows(grid: &TexelRows, nearness: ChannelRows<3>, estimates: &mut Smoothed) {
    let reach = grid.compute(&SquaredNearness(&nearness));
    drop(nearness);
    FIRST.smooth::<1, 7>(grid, estimates, &reach);
    SECOND.smooth::<3, 9>(grid, estimates, &reach);
}

impl FilterPass {
    /// Smooths the estimates, and adds the squared bias that this brings. A texel that gains more bias than it loses
    /// noise stays as it is.
    fn smooth<const STEP: usize, const COLUMNS: usize>(
        &self,
        grid: &TexelRows,
        estimates: &mut Smoothed,
        nearness: &ChannelRows<3>,
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

/// How near other surfaces are around a texel, by direction: the square of the matrix of nearness, so that its value in
/// a direction is the square of the texel's side over the harmonic mean distance.
struct SquaredNearness<'a>(&'a ChannelRows<3>);

impl Kernel<3> for SquaredNearness<'_> {
    #[inline(always)]
    fn at<S: Simd>(&self, block: &Block<'_, S>, _: &[f32x8<S>; 3]) -> [f32x8<S>; 3] {
        let [xx, xy, yy] = [0, 1, 2].map(
            #[inline(always)]
            |channel| block.mean(self.0, channel, NOISE_STEPS, 1),
        );
        let squared = [xx * xx + xy * xy, xy * (xx + yy), xy * xy + yy * yy];
        let is_finite = (squared[0] + squared[2]).simd_lt(f32::INFINITY);
        squared.map(
            #[inline(always)]
            |value| is_finite.select(value, block.simd.splat_f32x8(0.0)),
        )
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
    use super::super::surface::Surface;
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

    /// The variance of the smoothed values of the top row over that of the noise, on a plane beside a wall along that
    /// row. The harmonic mean distance to the wall is a texel's side; `along` is the nearness along the wall.
    fn remaining_variance(along: f32) -> f32 {
        let size = (256, 24);
        let surface = Surface { chart: 0, normal: Vec3::Z, group: 0 };
        let cells = std::iter::repeat_n(0, (size.0 * size.1) as usize);
        let grid = TexelRows::new([size].into_iter(), cells, vec![surface]);
        let mut estimates: Smoothed = random_channels(&grid, 7);
        let before = top_row(&grid, &estimates);
        let nearness = grid.fill(|row, _| match row {
            0..3 => [along, 0.0, 1.0],
            _ => [0.0; 3],
        });
        smooth_rows(&grid, nearness, &mut estimates);
        variance(&top_row(&grid, &estimates)) / variance(&before)
    }

    fn top_row(grid: &TexelRows, estimates: &Smoothed) -> Vec<f32> {
        (0..256).map(|column| grid.get(estimates, 0, column)[0]).collect()
    }

    fn variance(values: &[f32]) -> f32 {
        let mean = values.iter().sum::<f32>() / values.len() as f32;
        values.iter().map(|value| (value - mean).powi(2)).sum::<f32>() / values.len() as f32
    }

    #[test]
    fn beside_a_joint_noise_is_smoothed_along_it() {
        let (along, nowhere) = (remaining_variance(0.005), remaining_variance(1.0));
        assert!(along < 0.1, "{along}");
        assert!(nowhere > 0.3, "{nowhere}: nothing here keeps smoothing from reaching along the wall");
    }
}
