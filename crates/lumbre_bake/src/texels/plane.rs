//! A weighted plane through the values of a neighbourhood. Not the weights.

use glam::{Mat2, Vec2, Vec3, Vec4, Vec4Swizzles};

use super::gather::SCRAMBLES;

/// Scrambles of one half: the values of one plane.
pub(crate) const HALF: usize = SCRAMBLES / 2;

/// The values of one half at a texel, with a 1 behind each: their sums count the weights by the way.
pub(crate) type Values = [Vec4; HALF];

/// Weighted sums of a plane a + b x + c y through the values of one half.
#[derive(Default)]
pub(crate) struct Plane {
    /// Of the values, and of those times x and y.
    sums: [Values; 3],
    /// Of x², x y, y².
    squares: Vec4,
}

/// Square texels of spread below which a slope counts as unknown.
const RIDGE: f32 = 0.002;

impl Plane {
    /// Some eighty values of about one size: single precision keeps six digits of them.
    #[inline(always)]
    pub fn add(&mut self, x: f32, y: f32, weight: f32, values: &Values) {
        self.squares += weight * Vec4::new(x * x, x * y, y * y, 0.0);
        for (sums, term) in self.sums.iter_mut().zip([weight, weight * x, weight * y]) {
            for (sum, value) in sums.iter_mut().zip(values) {
                *sum += *value * term;
            }
        }
    }

    /// Writes the plane's values at (0, 0); leaves what is there if they are not finite.
    pub fn at_center(&self, values: &mut [Vec3]) {
        let [weight, sx, sy] = self.sums.map(|sums| sums[0].w);
        let (sx, sy) = (sx / weight, sy / weight);
        let [sxx, sxy, syy] = (self.squares.xyz() / weight).to_array();
        let spread = Mat2::from_cols(
            Vec2::new(sxx - sx * sx + RIDGE, sxy - sx * sy),
            Vec2::new(sxy - sx * sy, syy - sy * sy + RIDGE),
        );
        let towards = spread.inverse() * Vec2::new(-sx, -sy);
        for (k, value) in values.iter_mut().enumerate() {
            let [mean, with_x, with_y] = self.sums.map(|sums| sums[k].xyz() / weight);
            let fitted = mean + (with_x - mean * sx) * towards.x + (with_y - mean * sy) * towards.y;
            if fitted.is_finite() {
                *value = fitted.max(Vec3::ZERO);
            }
        }
    }
}
