//! Smooths the gathered light within charts: a weighted plane through each texel's neighbourhood, with weights that stop at
//! edges larger than the noise. The same weights for every replicate, so that their spread stays an estimate of the error.
//! In levels: the second takes what the first has made of every third texel, and so reaches three times as far for the same work
//! (Dammertz, Sewtz, Hanika and Lensch, "Edge-Avoiding À-Trous Wavelet Transform", 2010).

use crate::denoise::filter_pass::{BIAS, FilterPass, Smoothed};
use fearless_simd::{Select, Simd, f32x8, prelude::*};
use glam::Vec3;
use rayon::prelude::*;

use super::filter_features::{
    FEATURES, Features, NOISE, NOISE_STEPS, Variances, own_values, sum_of_variances,
};
use super::neighbourhoods::Neighbourhoods;
use super::neighbours::Block;
use super::plane::VALUES;
use super::replicates::Estimates;
use super::smoothing_bias::{Products, squared_bias};
use super::texel_rows::{ChannelRows, TexelRows};
use super::weighted_fit::Fit;
use crate::denoise::kernel::Kernel;

/// The first reaches little further than a texel's own size, whatever is near; the second only where everything is far. `chance`, for
/// the first: four times the variance of a texel for one replicate, a ninth of it in a block, of which the radius holds 49/9, twice for
/// two halves: 4 / 9 / sqrt(2 * 49 / 9). What the second takes in goes together over some 20 texels: its blocks hold four
/// that do not, and the radius as many blocks.
const FIRST: FilterPass = FilterPass { width: 2.5, near: 1.0, guide_steps: 1, chance: 0.135 };
const SECOND: FilterPass = FilterPass { width: 9.0, near: 12.0, guide_steps: 0, chance: 0.33 };

/// The estimates of every covered texel, smoothed, and the squared bias that the smoothing may have brought, mean of the channels.
/// `inverse_distances` tells how near to each texel the things are that it gathered from.
pub(crate) fn smooth(
    neighbourhoods: &Neighbourhoods<'_>,
    estimates: &[Estimates],
    inverse_distances: &[f32],
) -> (Vec<Estimates>, Vec<f32>) {
    let grid = neighbourhoods.grid();
    let things: ChannelRows<2> = neighbourhoods
        .fill(|index| [inverse_distances[index], neighbourhoods.texel_side(&neighbourhoods.texels[index])]);
    let mut smoothed: Smoothed = neighbourhoods.fill(|index| {
        let estimates = &estimates[index];
        std::array::from_fn(|place| if place < BIAS { estimates[place / 3][place % 3] } else { 0.0 })
    });
    smooth_strips(grid, things, &mut smoothed);
    let found = neighbourhoods.read(&smoothed).into_par_iter();
    let of_texels = found.zip(neighbourhoods.texels).zip(estimates).map(|((found, texel), estimates)| {
        let smoothed = std::array::from_fn(|replicate| Vec3::from_slice(&found[3 * replicate..]));
        if texel.is_hidden() { (*estimates, 0.0) } else { (smoothed, found[BIAS]) }
    });
    of_texels.unzip()
}

/// The same of strips: `things` holds how near things are and the texels' sides.
fn smooth_strips(grid: &TexelRows, things: ChannelRows<2>, estimates: &mut Smoothed) {
    let nearness = grid.compute(&Nearness(&things));
    drop(things);
    FIRST.smooth::<1, 7>(grid, estimates, &nearness);
    SECOND.smooth::<3, 9>(grid, estimates, &nearness);
}

impl FilterPass {
    /// Smooths the estimates, and adds the squared bias that this brought; a texel to which it brings more than it takes away stays as it is.
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
        let fit = Fit::<STEP, COLUMNS> { level: self, estimates, nearness, features: &features };
        let smoothed = grid.compute(&fit);
        let products = grid.compute(&Products::<STEP> { raw: estimates, smoothed: &smoothed });
        let choice =
            Choice::<STEP> { level: self, smoothed: &smoothed, features: &features, products: &products };
        grid.change(estimates, &choice);
    }
}

/// How near the things are that a texel sees: its side over their harmonic mean distance, squared.
struct Nearness<'a>(&'a ChannelRows<2>);

impl Kernel<1> for Nearness<'_> {
    #[inline(always)]
    fn at<S: Simd>(&self, block: &Block<'_, S>, _: &[f32x8<S>; 1]) -> [f32x8<S>; 1] {
        let near = block.mean(self.0, 0, NOISE_STEPS, 1);
        let steps = near * block.own(self.0, 1);
        let finite = steps.abs().simd_lt(f32::INFINITY);
        [finite.select(steps * steps, block.simd.splat_f32x8(0.0))]
    }
}

/// What was smoothed where that helps; and the squared bias of both levels together.
struct Choice<'a, const STEP: usize> {
    level: &'a FilterPass,
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
        let before = block.own(self.features, NOISE) / 3.0;
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

#[cfg(test)]
mod tests {
    use fearless_simd::Level as Instructions;

    use super::super::neighbours::tests::{random_grid, random_strips};
    use super::*;

    #[test]
    fn every_set_of_instructions_smooths_to_the_same_bits() {
        let smoothed = |level| {
            let grid = random_grid(level);
            let mut estimates = random_strips(&grid, 3);
            smooth_strips(&grid, random_strips(&grid, 4), &mut estimates);
            estimates.values
        };
        let (best, baseline) = (smoothed(Instructions::new()), smoothed(Instructions::baseline()));
        let bits = |values: &[f32]| values.iter().map(|value| value.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(&best), bits(&baseline));
        assert!(best.iter().all(|value| value.is_finite()));
        // Smoothing does something.
        let grid = random_grid(Instructions::new());
        let before: Smoothed = random_strips(&grid, 3);
        let changed = before.values.iter().zip(&best).filter(|(before, after)| before != after).count();
        assert!(2 * changed > best.iter().filter(|value| **value != 0.0).count(), "{changed}");
    }
}
