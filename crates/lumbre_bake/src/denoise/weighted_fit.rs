//! Fits a weighted plane to the neighbourhood of each texel, with weights that stop at edges larger than the noise. The
//! sums of the fit are in `plane`.

use fearless_simd::{Select, Simd, f32x8, prelude::*};

use super::filter_features::{FEATURES, NOISE, center_values};
use super::filter_pass::{FilterPass, Smoothed};
use super::kernel::Kernel;
use super::neighbours::{Block, CENTER, NeighbourRow};
use super::plane::{Planes, REPLICATES_PER_HALF, VALUES};
use super::texel_rows::{ChannelRows, lanes};

/// Squared differences of features that amount to this many variances give a weight of e⁻¹.
const FEATURE_VARIANCES: f32 = 8.0;

/// Fits planes over `COLUMNS` columns and as many rows, `STEP` texels apart.
pub(crate) struct Fit<'a, const STEP: usize, const COLUMNS: usize> {
    pub pass: &'a FilterPass,
    pub estimates: &'a Smoothed,
    /// Per texel, the matrix of its squared nearness for steps of columns and rows.
    pub squared_nearness: &'a ChannelRows<3>,
    pub features: &'a ChannelRows<FEATURES>,
}

impl<const STEP: usize, const COLUMNS: usize> Kernel<VALUES> for Fit<'_, STEP, COLUMNS> {
    #[inline(always)]
    fn at<S: Simd>(&self, block: &Block<'_, S>, _: &[f32x8<S>; VALUES]) -> [f32x8<S>; VALUES] {
        let simd = block.simd;
        let zero = simd.splat_f32x8(0.0);
        let mut features = [zero; FEATURES];
        for (place, feature) in features.iter_mut().enumerate() {
            *feature = block.center(self.features, place);
        }
        let near = self.pass.near * self.pass.near;
        let width = self.pass.width.powi(-2);
        let distance_scales = [
            block.center(self.squared_nearness, 0) * near + width,
            block.center(self.squared_nearness, 1) * (2.0 * near),
            block.center(self.squared_nearness, 2) * near + width,
        ];
        // The variance of a feature relative to that of a texel's mean: twice as much for a half, divided by the texels
        // averaged.
        let feature_noise = FEATURE_VARIANCES * 2.0 / ((2 * self.pass.feature_steps + 1) as f32).powi(2);
        let texels = CenterTexels { features, distance_scales, feature_noise };
        let mut weights = [[zero; COLUMNS]; 2];
        let mut planes = Planes::new(simd);
        for row in block.rows(COLUMNS / 2, STEP) {
            let y = row.down as f32;
            if block.all_on_surface(&row, COLUMNS / 2 * STEP) {
                self.weigh::<true, S>(block, &row, &texels, &mut weights);
            } else {
                self.weigh::<false, S>(block, &row, &texels, &mut weights);
            }
            for (half, weights) in weights.iter().enumerate() {
                planes.add_weights(half, STEP, y, weights);
                for replicate in half * REPLICATES_PER_HALF..(half + 1) * REPLICATES_PER_HALF {
                    let first = 3 * replicate;
                    let [r, g, b] = [first, first + 1, first + 2];
                    let values = [r, g, b].map(
                        #[inline(always)]
                        |channel| self.estimates.window(&row, channel),
                    );
                    planes.add_values(replicate, STEP, y, weights, values);
                }
            }
        }
        let mut values = center_values(block, self.estimates);
        planes.at_center(&mut values);
        values
    }
}

/// The properties of the center texels that the weights depend on.
struct CenterTexels<S: Simd> {
    features: [f32x8<S>; FEATURES],
    /// The factors of x², x y and y² of a distance of x columns and y rows.
    distance_scales: [f32x8<S>; 3],
    /// The factor of the noise of two texels, by which squared differences of their features are divided.
    feature_noise: f32,
}

impl<const STEP: usize, const COLUMNS: usize> Fit<'_, STEP, COLUMNS> {
    /// Computes the weights of both halves' neighbours in a row; `ON_SURFACE` if all texels there are known to be
    /// neighbours.
    #[inline(always)]
    fn weigh<const ON_SURFACE: bool, S: Simd>(
        &self,
        block: &Block<'_, S>,
        row: &NeighbourRow<'_>,
        texels: &CenterTexels<S>,
        weights: &mut [[f32x8<S>; COLUMNS]; 2],
    ) {
        let simd = block.simd;
        let zero = simd.splat_f32x8(0.0);
        let CenterTexels { features: center, distance_scales: [xx, xy, yy], feature_noise } = texels;
        let y = row.down as f32;
        let mut features = [self.features.window(row, NOISE); FEATURES];
        for (place, window) in features.iter_mut().enumerate() {
            *window = self.features.window(row, place);
        }
        for place in 0..COLUMNS {
            let at = CENTER - COLUMNS / 2 * STEP + place * STEP;
            let x = place as f32 * STEP as f32 - (COLUMNS / 2 * STEP) as f32;
            let noise: f32x8<S> = lanes(simd, features[NOISE], at);
            let expected = (center[NOISE] + noise) * *feature_noise;
            let inverse = simd.splat_f32x8(1.0) / expected.max(f32::MIN_POSITIVE);
            // Rounding may make it negative along a surface that is very near.
            let distance_term = (*xx * (x * x) + *xy * (x * y) + *yy * (y * y)).max(zero);
            let mask = if ON_SURFACE { simd.splat_mask32x8(true) } else { block.neighbour_mask(row, at) };
            for (half, weights) in weights.iter_mut().enumerate() {
                let mut squares = [zero; 3];
                for (channel, square) in squares.iter_mut().enumerate() {
                    let feature: f32x8<S> = lanes(simd, features[3 * half + channel], at);
                    let difference = feature - center[3 * half + channel];
                    *square = difference * difference;
                }
                let squared_difference = squares[0] + squares[1] + squares[2];
                let weight = falloff(simd, distance_term + squared_difference * inverse);
                weights[place] = if ON_SURFACE { weight } else { mask.select(weight, zero) };
            }
        }
    }
}

/// (1 - x/16)^16: e^-x to within .013, and zero beyond 16.
#[inline(always)]
fn falloff<S: Simd>(simd: S, x: f32x8<S>) -> f32x8<S> {
    let mut power = (simd.splat_f32x8(1.0) - x * (1.0 / 16.0)).max(0.0);
    for _ in 0..4 {
        power *= power;
    }
    power
}

#[cfg(test)]
mod tests {
    use fearless_simd::Level;

    use super::super::neighbours_tests::{random_channels, random_grid};
    use super::super::texel_rows::{LANES, MARGIN};
    use super::*;
    use crate::denoise::surface::{NONE, is_continuous};

    /// The value at (0, 0) of the plane a + b x + c y that minimises the sum of w ((value - plane)² + .002 (b² + c²)),
    /// by elimination in the normal equations, in double precision. Points are weight, x, y, value.
    fn least_squares(points: &[[f64; 4]]) -> f64 {
        let mut rows = [[0.0; 4]; 3];
        for &[weight, x, y, value] in points {
            let terms = [1.0, x, y, value];
            for (row, first) in rows.iter_mut().zip(terms) {
                for (sum, second) in row.iter_mut().zip(terms) {
                    *sum += weight * first * second;
                }
            }
            rows[1][1] += weight * 0.002;
            rows[2][2] += weight * 0.002;
        }
        // Eliminate the slopes, so that the value at (0, 0) is left.
        for pivot in [2, 1] {
            let eliminated = rows[pivot];
            for row in &mut rows[..pivot] {
                let factor = row[pivot] / eliminated[pivot];
                for (value, other) in row.iter_mut().zip(eliminated) {
                    *value -= factor * other;
                }
            }
        }
        rows[0][3] / rows[0][0]
    }

    #[test]
    fn the_fit_is_the_plane_of_weighted_least_squares() {
        let grid = random_grid(Level::new());
        let pass = FilterPass { width: 9.0, near: 0.5, feature_steps: 0, bias_noise: 0.0 };
        let estimates = random_channels(&grid, 1);
        let numbers = random_channels(&grid, 2);
        // A square of a matrix is negative in no direction.
        let nearness = grid.fill(|row, column| {
            let [xx, xy, yy] = grid.get(&numbers, row, column);
            [xx, (2.0 * xy - 1.0) * (xx * yy).sqrt(), yy]
        });
        let features: ChannelRows<FEATURES> = random_channels(&grid, 3);
        let fit: Fit<'_, 3, 9> =
            Fit { pass: &pass, estimates: &estimates, squared_nearness: &nearness, features: &features };
        let fitted = grid.compute(&fit);
        let (mut texels, mut largest) = (0, 0.0f64);
        for row in 0..grid.rows.len() {
            let width = grid.rows[row].stride - MARGIN - (LANES - 1);
            let surface =
                |row: usize, column: usize| grid.cell_surfaces[grid.rows[row].start + MARGIN + column];
            for column in (0..width).filter(|&column| surface(row, column) != NONE) {
                let center = grid.get(&features, row, column).map(f64::from);
                let near = grid.get(&nearness, row, column).map(f64::from);
                let mut points: [Vec<[f64; 4]>; VALUES] = Default::default();
                for (down, right) in
                    (-4..=4).flat_map(|down| (-4..=4).map(move |right| (3 * down, 3 * right)))
                {
                    let range = -i64::from(grid.rows[row].before)..=i64::from(grid.rows[row].after);
                    let place = usize::try_from(column as i64 + right).ok().filter(|&place| place < width);
                    let (Some(place), true) = (place, range.contains(&down)) else { continue };
                    let other_row = (row as i64 + down) as usize;
                    let [here, there] = [surface(row, column), surface(other_row, place)];
                    if there == NONE || !(here == there || is_continuous(&grid.surfaces, here, there)) {
                        continue;
                    }
                    let (x, y) = (right as f64, down as f64);
                    let other = grid.get(&features, other_row, place).map(f64::from);
                    let values = grid.get(&estimates, other_row, place).map(f64::from);
                    for k in 0..VALUES {
                        let half = k / (3 * REPLICATES_PER_HALF);
                        let squared_difference =
                            (0..3).map(|c| (center[3 * half + c] - other[3 * half + c]).powi(2)).sum::<f64>();
                        let nearness = near[0] * x * x + 2.0 * near[1] * x * y + near[2] * y * y;
                        let distance_term = (x * x + y * y) / 81.0 + 0.25 * nearness;
                        // A feature has twice the variance, and eight variances have weight e⁻¹.
                        let exponent =
                            distance_term + squared_difference / (8.0 * 2.0 * (center[NOISE] + other[NOISE]));
                        let weight = (1.0 - exponent / 16.0).max(0.0).powi(16);
                        points[k].push([weight, x, y, values[k]]);
                    }
                }
                for (fitted, points) in grid.get(&fitted, row, column).into_iter().zip(&points) {
                    let expected = least_squares(points).max(0.0);
                    largest = largest.max((f64::from(fitted) - expected).abs());
                }
                texels += 1;
            }
        }
        assert!(texels > 3000, "{texels}");
        // Sums of 81 values below 1 in single precision, each rounded to 2⁻²⁴.
        assert!(largest < 5e-6, "{largest}");
    }
}
