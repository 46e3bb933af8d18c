//! Weighted planes fitted to the values of a neighbourhood, one for each half of the replicates, for eight texels at
//! once. The weights are in `weighted_fit`.

use fearless_simd::{Select, Simd, f32x8, prelude::*};

use super::neighbours::CENTER;
use super::replicates::REPLICATES;
use super::texel_rows::{WINDOW, lanes};

/// Replicates in a half.
pub(crate) const REPLICATES_PER_HALF: usize = REPLICATES / 2;
/// Values of a texel: three channels of all replicates, and of the replicates of a half.
pub(crate) const VALUES: usize = 3 * REPLICATES;
pub(crate) const VALUES_PER_HALF: usize = 3 * REPLICATES_PER_HALF;

/// The weighted sums from which planes a + b x + c y through the values of each half are fitted.
pub(crate) struct Planes<S: Simd> {
    /// Weighted sums of the values, and of the values times x and times y.
    sums: [[f32x8<S>; VALUES]; 3],
    /// Weighted sums of 1, x, y, x², x y and y², for each half.
    weights: [[f32x8<S>; 2]; 6],
    simd: S,
}

/// Variance of the neighbours' positions, in square texels, below which their slope counts as unknown: the ridge of the
/// regression.
const RIDGE: f32 = 0.002;

impl<S: Simd> Planes<S> {
    #[inline(always)]
    pub fn new(simd: S) -> Self {
        let zero = simd.splat_f32x8(0.0);
        Self { sums: [[zero; VALUES]; 3], weights: [[zero; 2]; 6], simd }
    }

    /// Adds the weights of a half's neighbours in the row at y: `step` texels apart, with the middle one at x = 0.
    #[inline(always)]
    pub fn add_weights<const COLUMNS: usize>(
        &mut self,
        half: usize,
        step: usize,
        y: f32,
        weights: &[f32x8<S>; COLUMNS],
    ) {
        let zero = self.simd.splat_f32x8(0.0);
        let (mut sum, mut with_x, mut with_xx) = (zero, zero, zero);
        for (place, weight) in weights.iter().enumerate() {
            let x = place as f32 * step as f32 - (COLUMNS / 2 * step) as f32;
            sum += *weight;
            with_x += *weight * x;
            with_xx += *weight * (x * x);
        }
        self.weights[0][half] += sum;
        self.weights[1][half] += with_x;
        self.weights[2][half] += sum * y;
        self.weights[3][half] += with_xx;
        self.weights[4][half] += with_x * y;
        self.weights[5][half] += sum * (y * y);
    }

    /// Adds the values of a replicate at these neighbours. Single precision keeps six digits of a sum of some eighty
    /// values of similar size.
    #[inline(always)]
    pub fn add_values<const COLUMNS: usize>(
        &mut self,
        replicate: usize,
        step: usize,
        y: f32,
        weights: &[f32x8<S>; COLUMNS],
        values: [&[f32; WINDOW]; 3],
    ) {
        let zero = self.simd.splat_f32x8(0.0);
        let (mut sums, mut with_x) = ([zero; 3], [zero; 3]);
        for (place, weight) in weights.iter().enumerate() {
            let x = place as f32 * step as f32 - (COLUMNS / 2 * step) as f32;
            let at = CENTER - COLUMNS / 2 * step + place * step;
            for channel in 0..3 {
                let term = *weight * lanes::<S, f32x8<S>>(self.simd, values[channel], at);
                sums[channel] += term;
                with_x[channel] += term * x;
            }
        }
        for channel in 0..3 {
            let place = 3 * replicate + channel;
            self.sums[0][place] += sums[channel];
            self.sums[1][place] += with_x[channel];
            self.sums[2][place] += sums[channel] * y;
        }
    }

    /// Writes the planes' values at (0, 0), but keeps the colour that is there if the plane's is not finite.
    #[inline(always)]
    pub fn at_center(&self, values: &mut [f32x8<S>; VALUES]) {
        let (simd, zero) = (self.simd, self.simd.splat_f32x8(0.0));
        for half in 0..2 {
            let weight = self.weights[0][half];
            let (sx, sy) = (self.weights[1][half] / weight, self.weights[2][half] / weight);
            let (sxx, sxy) = (self.weights[3][half] / weight, self.weights[4][half] / weight);
            let syy = self.weights[5][half] / weight;
            // The covariances of the neighbours' positions, with the ridge.
            let (xx, xy, yy) = (sxx - sx * sx + RIDGE, sxy - sx * sy, syy - sy * sy + RIDGE);
            let inverse = simd.splat_f32x8(1.0) / (xx * yy - xy * xy);
            let (xx, xy, yy) = (xx * inverse, -(xy * inverse), yy * inverse);
            let (right, down) = (yy * -sx + xy * -sy, xy * -sx + xx * -sy);
            for replicate in half * REPLICATES_PER_HALF..(half + 1) * REPLICATES_PER_HALF {
                let mut fitted = [zero; 3];
                let mut finite = simd.splat_mask32x8(true);
                for (channel, fitted) in fitted.iter_mut().enumerate() {
                    let place = 3 * replicate + channel;
                    let mean = self.sums[0][place] / weight;
                    let (with_x, with_y) = (self.sums[1][place] / weight, self.sums[2][place] / weight);
                    *fitted = mean + (with_x - mean * sx) * right + (with_y - mean * sy) * down;
                    finite &= fitted.abs().simd_lt(f32::INFINITY);
                }
                for (channel, fitted) in fitted.into_iter().enumerate() {
                    let value = &mut values[3 * replicate + channel];
                    *value = finite.select(fitted.max(zero), *value);
                }
            }
        }
    }
}
