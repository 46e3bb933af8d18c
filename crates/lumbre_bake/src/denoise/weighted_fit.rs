//! Fits a weighted plane to the neighbourhood of each texel, with weights that stop at edges larger than the noise. Not the sums.

use fearless_simd::{Select, Simd, f32x8, prelude::*};

use super::filter_features::{FEATURES, NOISE, own_values};
use super::neighbours::{Beside, Block, OWN};
use super::plane::{HALF, Planes, VALUES};
use super::texel_rows::{ChannelRows, lanes};
use crate::denoise::filter_pass::{FilterPass, Smoothed};
use crate::denoise::kernel::Kernel;

/// Squared differences of this many variances weigh e⁻¹.
const GUIDE_SIGMAS: f32 = 8.0;
/// The weighted planes, over so many texels a row, `STEP` apart, and as many rows.
pub(crate) struct Fit<'a, const STEP: usize, const COLUMNS: usize> {
    pub level: &'a FilterPass,
    pub estimates: &'a Smoothed,
    pub nearness: &'a ChannelRows<1>,
    pub features: &'a ChannelRows<FEATURES>,
}

impl<const STEP: usize, const COLUMNS: usize> Kernel<VALUES> for Fit<'_, STEP, COLUMNS> {
    #[inline(always)]
    fn at<S: Simd>(&self, block: &Block<'_, S>, _: &[f32x8<S>; VALUES]) -> [f32x8<S>; VALUES] {
        let simd = block.simd;
        let zero = simd.splat_f32x8(0.0);
        let mut own = [zero; FEATURES];
        for (place, own) in own.iter_mut().enumerate() {
            *own = block.own(self.features, place);
        }
        let near = self.level.near * self.level.near;
        let narrow = block.own(self.nearness, 0) * near + self.level.width.powi(-2);
        // Of a guide over a texel's mean: twice for a half, and the less the more texels.
        let guide_noise = GUIDE_SIGMAS * 2.0 / ((2 * self.level.guide_steps + 1) as f32).powi(2);
        let texels = Texels { own, narrow, guide_noise };
        let mut weights = [[zero; COLUMNS]; 2];
        let mut planes = Planes::new(simd);
        for beside in block.rows(COLUMNS / 2, STEP) {
            let y = beside.down as f32;
            if block.all_count(&beside, COLUMNS / 2 * STEP) {
                self.weigh::<true, S>(block, &beside, &texels, &mut weights);
            } else {
                self.weigh::<false, S>(block, &beside, &texels, &mut weights);
            }
            for (half, weights) in weights.iter().enumerate() {
                planes.add_weights(half, STEP, y, weights);
                for replicate in half * HALF..(half + 1) * HALF {
                    let first = 3 * replicate;
                    let [r, g, b] = [first, first + 1, first + 2];
                    let values = [r, g, b].map(
                        #[inline(always)]
                        |channel| self.estimates.beside(&beside, channel),
                    );
                    planes.add_values(replicate, STEP, y, weights, values);
                }
            }
        }
        let mut values = own_values(block, self.estimates);
        planes.at_center(&mut values);
        values
    }
}

/// What the weights depend on of the texels themselves.
struct Texels<S: Simd> {
    own: [f32x8<S>; FEATURES],
    /// Of a squared distance in texels.
    narrow: f32x8<S>,
    /// Of the noise of two texels, by which squared differences of their features are divided.
    guide_noise: f32,
}

impl<const STEP: usize, const COLUMNS: usize> Fit<'_, STEP, COLUMNS> {
    /// Weighs both halves' neighbours in a row.
    #[inline(always)]
    fn weigh<const ALL_COUNT: bool, S: Simd>(
        &self,
        block: &Block<'_, S>,
        beside: &Beside<'_>,
        texels: &Texels<S>,
        weights: &mut [[f32x8<S>; COLUMNS]; 2],
    ) {
        let simd = block.simd;
        let zero = simd.splat_f32x8(0.0);
        let Texels { own, narrow, guide_noise } = texels;
        let y = beside.down as f32;
        let mut features = [self.features.beside(beside, NOISE); FEATURES];
        for (place, guide) in features.iter_mut().enumerate() {
            *guide = self.features.beside(beside, place);
        }
        for place in 0..COLUMNS {
            let at = OWN - COLUMNS / 2 * STEP + place * STEP;
            let x = place as f32 * STEP as f32 - (COLUMNS / 2 * STEP) as f32;
            let noise: f32x8<S> = lanes(simd, features[NOISE], at);
            let expected = (own[NOISE] + noise) * *guide_noise;
            let inverse = simd.splat_f32x8(1.0) / expected.max(f32::MIN_POSITIVE);
            let far = *narrow * (x * x + y * y);
            let counts = if ALL_COUNT { simd.splat_mask32x8(true) } else { block.counts(beside, at) };
            for (half, weights) in weights.iter_mut().enumerate() {
                let mut squares = [zero; 3];
                for (channel, square) in squares.iter_mut().enumerate() {
                    let guide: f32x8<S> = lanes(simd, features[3 * half + channel], at);
                    let difference = guide - own[3 * half + channel];
                    *square = difference * difference;
                }
                let apart = squares[0] + squares[1] + squares[2];
                let weight = falloff(simd, far + apart * inverse);
                weights[place] = if ALL_COUNT { weight } else { counts.select(weight, zero) };
            }
        }
    }
}

/// (1 - x/16)^16: e^-x within .013, and nothing beyond 16.
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
    use fearless_simd::Level as Instructions;

    use super::super::neighbours::tests::{random_grid, random_strips};
    use super::super::texel_rows::{LANES, MARGIN};
    use super::*;
    use crate::denoise::surface::{NONE, goes_on};

    /// The value at the middle of the plane a + b x + c y that makes the sum of w ((value - plane)² + .002 (b² + c²)) least, in double
    /// precision: by elimination in the normal equations. Points are weight, x, y, value.
    fn least_squares(points: &[[f64; 4]]) -> f64 {
        let mut rows = [[0.0; 4]; 3];
        for &[weight, x, y, value] in points {
            let terms = [1.0, x, y, value];
            for (row, own) in rows.iter_mut().zip(terms) {
                for (sum, other) in row.iter_mut().zip(terms) {
                    *sum += weight * own * other;
                }
            }
            rows[1][1] += weight * 0.002;
            rows[2][2] += weight * 0.002;
        }
        // Slopes first, so that the middle's value is left.
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
        let grid = random_grid(Instructions::new());
        let level = FilterPass { width: 9.0, near: 0.5, guide_steps: 0, chance: 0.0 };
        let (estimates, nearness) = (random_strips(&grid, 1), random_strips(&grid, 2));
        let features: ChannelRows<FEATURES> = random_strips(&grid, 3);
        let fit: Fit<'_, 3, 9> =
            Fit { level: &level, estimates: &estimates, nearness: &nearness, features: &features };
        let found = grid.compute(&fit);
        let (mut texels, mut largest) = (0, 0.0f64);
        for row in 0..grid.rows.len() {
            let width = grid.rows[row].stride - MARGIN - (LANES - 1);
            let surface = |row: usize, column: usize| grid.ground[grid.rows[row].start + MARGIN + column];
            for column in (0..width).filter(|&column| surface(row, column) != NONE) {
                let own = grid.get(&features, row, column).map(f64::from);
                let near = f64::from(grid.get(&nearness, row, column)[0]);
                let mut points: [Vec<[f64; 4]>; VALUES] = Default::default();
                for (down, right) in
                    (-4..=4).flat_map(|down| (-4..=4).map(move |right| (3 * down, 3 * right)))
                {
                    let range = -i64::from(grid.rows[row].before)..=i64::from(grid.rows[row].after);
                    let place = usize::try_from(column as i64 + right).ok().filter(|&place| place < width);
                    let (Some(place), true) = (place, range.contains(&down)) else { continue };
                    let beside = (row as i64 + down) as usize;
                    let [here, there] = [surface(row, column), surface(beside, place)];
                    if there == NONE || !(here == there || goes_on(&grid.surfaces, here, there)) {
                        continue;
                    }
                    let (x, y) = (right as f64, down as f64);
                    let other = grid.get(&features, beside, place).map(f64::from);
                    let values = grid.get(&estimates, beside, place).map(f64::from);
                    for k in 0..VALUES {
                        let half = k / (3 * HALF);
                        let apart =
                            (0..3).map(|c| (own[3 * half + c] - other[3 * half + c]).powi(2)).sum::<f64>();
                        let far = (x * x + y * y) * (1.0 / 81.0 + 0.25 * near);
                        // Variances: twice for a guide, eight of them weigh e⁻¹.
                        let exponent = far + apart / (8.0 * 2.0 * (own[NOISE] + other[NOISE]));
                        let weight = (1.0 - exponent / 16.0).max(0.0).powi(16);
                        points[k].push([weight, x, y, values[k]]);
                    }
                }
                for (found, points) in grid.get(&found, row, column).into_iter().zip(&points) {
                    let expected = least_squares(points).max(0.0);
                    largest = largest.max((f64::from(found) - expected).abs());
                }
                texels += 1;
            }
        }
        assert!(texels > 3000, "{texels}");
        // Single precision sums 81 values below 1, each to 2⁻²⁴.
        assert!(largest < 5e-6, "{largest}");
    }
}
