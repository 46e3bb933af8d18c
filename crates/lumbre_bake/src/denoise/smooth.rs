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
use crate::coverage::MapAxes;

/// The first pass reaches a few texels, almost whatever is near. Its `bias_noise`: a replicate has four times the
/// variance of the texel's mean, a block of 3 x 3 a ninth of that, and the radius of the bias holds 49 / 9 blocks,
/// twice for two halves: 4 / 9 / sqrt(2 * 49 / 9).
const FIRST: FilterPass = FilterPass { width: 2.5, near: 1.0, feature_steps: 1, bias_noise: 0.135 };
/// The second pass reaches far only where all other surfaces are far. Its input is correlated over some 20 texels, so
/// that its blocks hold only four independent values, and the radius of the bias four such blocks.
const SECOND: FilterPass = FilterPass { width: 9.0, near: 12.0, feature_steps: 0, bias_noise: 0.33 };

/// The smoothed estimates of every covered texel, and the squared bias that smoothing may have brought, mean of the
/// channels. `nearness` is, per texel, the mean of that of the surfaces or lights that its samples reached.
pub(crate) fn smooth(
    neighbourhoods: &Neighbourhoods<'_>,
    estimates: &[Estimates],
    nearness: impl Fn(usize) -> Nearness + Sync,
) -> (Vec<Estimates>, Vec<f32>) {
    let grid = neighbourhoods.grid();
    let nearness: ChannelRows<NEARNESS> =
        neighbourhoods.fill(|index| nearness_channels(nearness(index), &neighbourhoods.map_axes(index)));
    let mut smoothed: Smoothed = neighbourhoods.fill(|index| {
        let estimates = &estimates[index];
        std::array::from_fn(|place| if place < BIAS { estimates[place / 3][place % 3] } else { 0.0 })
    });
    smooth_rows(grid, nearness, &mut smoothed);
    let values = neighbourhoods.read(&smoothed).into_par_iter();
    let results =
        values.zip(&neighbourhoods.texels.list).zip(estimates).map(|((values, texel), estimates)| {
            let smoothed = std::array::from_fn(|replicate| Vec3::from_slice(&values[3 * replicate..]));
            if texel.is_hidden() { (*estimates, 0.0) } else { (smoothed, values[BIAS]) }
        });
    let (mut smoothed, biases): (Vec<Estimates>, Vec<f32>) = results.unzip();
    conserve_light(&neighbourhoods.texel_charts, estimates, &mut smoothed);
    (smoothed, biases)
}

/// Both passes, in place. `nearness` holds the channels of [`nearness_channels`].
fn smooth_rows(grid: &TexelRows, nearness: ChannelRows<NEARNESS>, estimates: &mut Smoothed) {
    let squared_nearness = grid.compute(&SquaredNearness(&nearness));
    drop(nearness);
    FIRST.smooth::<1, 7>(grid, estimates, &squared_nearness);
    SECOND.smooth::<3, 9>(grid, estimates, &squared_nearness);
}

impl FilterPass {
    /// Smooths the estimates, and adds the squared bias that this brings. A texel that gains more bias than it loses
    /// noise stays as it is.
    fn smooth<const STEP: usize, const COLUMNS: usize>(
        &self,
        grid: &TexelRows,
        estimates: &mut Smoothed,
        squared_nearness: &ChannelRows<3>,
    ) {
        let variances = grid.compute(&Variances(estimates));
        let features =
            grid.compute(&Features::<STEP> { steps: self.feature_steps, estimates, variances: &variances });
        drop(variances);
        let fit = Fit::<STEP, COLUMNS> { pass: self, estimates, squared_nearness, features: &features };
        let smoothed = grid.compute(&fit);
        let products = grid.compute(&Products::<STEP> { raw: estimates, smoothed: &smoothed });
        let choice =
            Choice::<STEP> { pass: self, smoothed: &smoothed, features: &features, products: &products };
        grid.update(estimates, &choice);
    }
}

/// Channels of a texel's nearness, and of its map's steps from one column and from one row to the next.
const NEARNESS: usize = 6;

/// The step from one column to the next has no part across itself.
fn nearness_channels(nearness: Nearness, axes: &MapAxes) -> [f32; NEARNESS] {
    let Nearness { xx, xy, yy } = nearness;
    [xx, xy, yy, axes.column_step.x, axes.row_step.x, axes.row_step.y]
}

/// The largest squared nearness: that of a surface in a millionth of a texel's side.
const MAX_SQUARED_NEARNESS: f32 = 1e12;

/// How near other surfaces are around a texel, for steps over its map: the matrix of which the value for a step of x
/// columns and y rows, `xx x² + 2 xy x y + yy y²`, is the square of the step's length across those surfaces over their
/// harmonic mean distance.
struct SquaredNearness<'a>(&'a ChannelRows<NEARNESS>);

impl Kernel<3> for SquaredNearness<'_> {
    #[inline(always)]
    fn at<S: Simd>(&self, block: &Block<'_, S>, _: &[f32x8<S>; 3]) -> [f32x8<S>; 3] {
        let [xx, xy, yy] = [0, 1, 2].map(
            #[inline(always)]
            |channel| block.mean(self.0, channel, NOISE_STEPS, 1),
        );
        let [column, row_along, row_across] = [3, 4, 5].map(
            #[inline(always)]
            |channel| block.center(self.0, channel),
        );
        // The products of the matrix with both steps; their products are the square.
        let (column_x, column_y) = (xx * column, xy * column);
        let (row_x, row_y) = (xx * row_along + xy * row_across, xy * row_along + yy * row_across);
        let squared = [
            column_x * column_x + column_y * column_y,
            column_x * row_x + column_y * row_y,
            row_x * row_x + row_y * row_y,
        ];
        let trace = squared[0] + squared[2];
        let zero = block.simd.splat_f32x8(0.0);
        let limit = block.simd.splat_f32x8(MAX_SQUARED_NEARNESS);
        let is_finite = trace.simd_lt(f32::INFINITY);
        let scale = limit / trace.max(limit);
        squared.map(
            #[inline(always)]
            |value| is_finite.select(value * scale, zero),
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
    use glam::Vec2;

    use super::super::neighbours_tests::{random_channels, random_grid};
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

    const COLUMNS: u32 = 256;

    /// A plane of `COLUMNS` x `rows` texels.
    fn plane(rows: u32) -> TexelRows {
        let surface = Surface { chart: 0, normal: Vec3::Z, group: 0 };
        let cells = std::iter::repeat_n(0, (COLUMNS * rows) as usize);
        TexelRows::new([(COLUMNS, rows)].into_iter(), cells, vec![surface])
    }

    /// The variance that smoothing leaves of noise in the top row of a plane, as a fraction, beside a wall along that row
    /// at a harmonic mean distance of one texel's side. `along` is the nearness along the wall.
    fn remaining_variance(along: f32) -> f32 {
        let grid = plane(24);
        let top_row = |estimates: &Smoothed| -> Vec<f32> {
            (0..COLUMNS as usize).map(|column| grid.get(estimates, 0, column)[0]).collect()
        };
        let mut estimates: Smoothed = random_channels(&grid, 7);
        let before = top_row(&estimates);
        let nearness = grid.fill(|row, _| match row {
            0..3 => [along, 0.0, 1.0, 1.0, 0.0, 1.0],
            _ => [0.0, 0.0, 0.0, 1.0, 0.0, 1.0],
        });
        smooth_rows(&grid, nearness, &mut estimates);
        variance(&top_row(&estimates)) / variance(&before)
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

    /// The squared nearness for a step of columns and rows of a texel that sees one surface.
    fn squared_for_step(nearness: Nearness, axes: &MapAxes, [x, y]: [f32; 2]) -> f32 {
        let grid = plane(1);
        let squared = grid.compute(&SquaredNearness(&grid.fill(|_, _| nearness_channels(nearness, axes))));
        let [xx, xy, yy] = grid.get(&squared, 0, 100);
        xx * x * x + 2.0 * xy * x * y + yy * y * y
    }

    /// However a map lies on its surface (turned, stretched, sheared or mirrored), only lengths on the surface count.
    #[test]
    fn nearness_is_that_of_the_surface_however_the_map_lies_on_it() {
        let inverse_distance = 4.0;
        for (turn, stretch, shear) in
            [(0.0, 1.0, 0.0), (20.0, 3.0, 0.0), (45.0, -0.3, 0.0), (110.0, 2.0, 0.7), (250.0, -1.0, -0.4)]
        {
            let (sin, cos) = f32::to_radians(turn).sin_cos();
            let along = Vec3::new(cos, sin, 0.0);
            let axes = MapAxes {
                along,
                across: Vec3::Z.cross(along),
                normal: Vec3::Z,
                column_step: Vec2::new(f32::abs(stretch), 0.0),
                row_step: Vec2::new(shear, 1.0 / stretch),
            };
            let wall = Nearness::of_surface(inverse_distance, Vec3::X, &axes);
            let ceiling = Nearness::of_surface(inverse_distance, Vec3::NEG_Z, &axes);
            let lamp = Nearness::of_lamp(inverse_distance);
            for step in [[1.0, 0.0], [0.0, 1.0], [2.0, 3.0], [-3.0, 1.0]] {
                let on_surface = axes.column_step * step[0] + axes.row_step * step[1];
                let on_surface = axes.along * on_surface.x + axes.across * on_surface.y;
                let lengths = [on_surface.x.abs(), on_surface.length(), on_surface.length()];
                for (nearness, length) in [wall, ceiling, lamp].into_iter().zip(lengths) {
                    let ratio = squared_for_step(nearness, &axes, step).sqrt();
                    // A part of .005 counts in all directions; the rest is rounding.
                    let everywhere = 0.005 * inverse_distance * on_surface.length();
                    let expected = inverse_distance * length;
                    assert!(
                        (expected - 1e-3..expected + everywhere + 1e-3).contains(&ratio),
                        "{turn} {stretch} {shear} {step:?}: {ratio} for {length}"
                    );
                }
            }
        }
    }

    #[test]
    fn squared_nearness_is_finite_and_negative_in_no_direction() {
        for inverse_distance in [0.0, 1e-30, 1.0, 1e9, 1e20, f32::MAX, f32::INFINITY, f32::NAN] {
            let nearness = Nearness { xx: inverse_distance, xy: inverse_distance, yy: inverse_distance };
            let axes = MapAxes {
                along: Vec3::X,
                across: Vec3::Y,
                normal: Vec3::Z,
                column_step: Vec2::new(5.0, 0.0),
                row_step: Vec2::new(0.1, 0.2),
            };
            let trace =
                squared_for_step(nearness, &axes, [1.0, 0.0]) + squared_for_step(nearness, &axes, [0.0, 1.0]);
            assert!((0.0..1.01 * MAX_SQUARED_NEARNESS).contains(&trace), "{inverse_distance}: {trace}");
            for step in [[1.0f32, 0.0], [12.0, -12.0], [3.0, 12.0]] {
                let squared = squared_for_step(nearness, &axes, step);
                // Each of the three terms is rounded to 2⁻²⁴ of at most this.
                let largest = trace * (step[0] * step[0] + step[1] * step[1]);
                assert!(squared >= -1e-6 * largest && squared <= 1.01 * largest, "{step:?}: {squared}");
            }
        }
    }
}
