//! Weighted planes through the values of a neighbourhood, one for each half of the scrambles. Not the weights.

use glam::{Mat2, Vec2, Vec3, Vec4, Vec4Swizzles};

use super::gather::SCRAMBLES;

/// Scrambles of one half: the values of one plane.
pub(crate) const HALF: usize = SCRAMBLES / 2;

/// The values of both halves at a texel, with a 1 behind each: their sums count the weights by the way.
pub(crate) type Values = [Vec4; SCRAMBLES];

/// Weighted sums over neighbours in one row.
#[derive(Clone, Copy, Default)]
pub(crate) struct Row {
    /// Of the values, and of those times x.
    sums: [Values; 2],
    /// Of x², of each half.
    squares: Vec4,
}

impl Row {
    /// Some eighty values of about one size: single precision keeps six digits of them. `weights` are those of the halves.
    #[inline(always)]
    pub fn add(&mut self, x: f32, weights: Vec4, values: &Values) {
        let [sums, with_x] = &mut self.sums;
        self.squares += weights * (x * x);
        let weights = [weights.xxxx(), weights.yyyy()];
        for (place, value) in values.iter().enumerate() {
            let term = *value * weights[place / HALF];
            sums[place] += term;
            with_x[place] += term * x;
        }
    }
}

/// Weighted sums of planes a + b x + c y through the values of each half.
#[derive(Clone, Copy, Default)]
pub(crate) struct Planes {
    /// Of the values, and of those times x and y.
    sums: [Values; 3],
    /// Of x², x y, y²: of each half.
    squares: [Vec4; 3],
}

/// Square texels of spread below which a slope counts as unknown.
const RIDGE: f32 = 0.002;

impl Planes {
    /// A row at y.
    #[inline(always)]
    pub fn add(&mut self, y: f32, row: &Row) {
        let [sums, with_x] = &row.sums;
        for (place, (sum, with_x)) in sums.iter().zip(with_x).enumerate() {
            self.sums[0][place] += *sum;
            self.sums[1][place] += *with_x;
            self.sums[2][place] += *sum * y;
        }
        let of_halves = |values: &Values| Vec4::new(values[0].w, values[HALF].w, 0.0, 0.0);
        self.squares[0] += row.squares;
        self.squares[1] += of_halves(with_x) * y;
        self.squares[2] += of_halves(sums) * (y * y);
    }

    /// Writes a half's values of its plane at (0, 0); leaves what is there if they are not finite.
    pub fn at_center(&self, half: usize, values: &mut [Vec3]) {
        let [weight, sx, sy] = self.sums.map(|sums| sums[half * HALF].w);
        let (sx, sy) = (sx / weight, sy / weight);
        let [sxx, sxy, syy] = self.squares.map(|squares| squares[half] / weight);
        let spread = Mat2::from_cols(
            Vec2::new(sxx - sx * sx + RIDGE, sxy - sx * sy),
            Vec2::new(sxy - sx * sy, syy - sy * sy + RIDGE),
        );
        let towards = spread.inverse() * Vec2::new(-sx, -sy);
        for (k, value) in values.iter_mut().enumerate() {
            let [mean, with_x, with_y] = self.sums.map(|sums| sums[half * HALF + k].xyz() / weight);
            let fitted = mean + (with_x - mean * sx) * towards.x + (with_y - mean * sy) * towards.y;
            if fitted.is_finite() {
                *value = fitted.max(Vec3::ZERO);
            }
        }
    }
}
