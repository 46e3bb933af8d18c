//! Fits a weighted plane to the neighbourhood of each texel, with weights that stop at edges larger than the noise. Not the sums.

use fearless_simd::{Select, Simd, f32x8, prelude::*};

use super::guides::{GUIDES, NOISE, own_values};
use super::lanes::{Kernel, Strips, lanes};
use super::neighbours::{Beside, Block, OWN};
use super::plane::{HALF, Planes, VALUES};
use super::smooth::{Level, Smoothed};

/// Squared differences of this many variances weigh e⁻¹.
const GUIDE_SIGMAS: f32 = 8.0;
/// The weighted planes, over so many texels a row, `STEP` apart, and as many rows.
pub(crate) struct Fit<'a, const STEP: usize, const COLUMNS: usize> {
    pub level: &'a Level,
    pub estimates: &'a Smoothed,
    pub nearness: &'a Strips<1>,
    pub guides: &'a Strips<GUIDES>,
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

/// (1 - x/16)^16: e^-x within .013, and nothing beyond 16.
#[inline(always)]
fn falloff<S: Simd>(simd: S, x: f32x8<S>) -> f32x8<S> {
    let mut power = (simd.splat_f32x8(1.0) - x * (1.0 / 16.0)).max(0.0);
    for _ in 0..4 {
        power *= power;
    }
    power
}
