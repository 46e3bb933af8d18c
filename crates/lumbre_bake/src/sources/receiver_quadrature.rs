//! The mean over a receiver of light that nothing hides, by a few of its points, and what that leaves open. Not the light at a point: that is
//! `emitter_tree`'s and `punctual_irradiance`'s.

use glam::Vec3;

/// Exact unoccluded light at evenly spread points of a receiver, in pairs about its middle, so that what is left is of second order
/// in its size.
pub(crate) struct ReceiverQuadrature {
    sum: Vec3,
    least: f32,
    most: f32,
}

/// Points of a receiver at which it is, in the unit square: the first four where the light hardly changes, and sixteen more where it does.
/// Each coordinate takes every value once, and neither has to do with the other: a list of points, too, is read evenly.
const FEW: [u32; 4] = [1, 3, 0, 2];
const MANY: [u32; 16] = [5, 3, 15, 11, 7, 1, 13, 9, 6, 2, 14, 8, 4, 0, 12, 10];

/// Light that differs by this part of its mean over the first points calls for more: at a lamp's edge it changes within a texel.
const UNEVEN: f32 = 0.05;

impl ReceiverQuadrature {
    fn at<const N: usize>(points: [u32; N], light: impl Fn(f32, f32) -> Option<Vec3>) -> (Self, f32) {
        let mut found = Self { sum: Vec3::ZERO, least: f32::INFINITY, most: 0.0 };
        let mut count = 0.0;
        for (x, y) in points.into_iter().enumerate() {
            let middle = |place: u32| (place as f32 + 0.5) / N as f32;
            let Some(light) = light(middle(x as u32), middle(y)) else { continue };
            let grey = light.element_sum() / 3.0;
            found = Self { sum: found.sum + light, least: found.least.min(grey), most: found.most.max(grey) };
            count += 1.0;
        }
        (found, count)
    }

    /// The mean over a receiver, and its squared error: what differs by d of the mean within it leaves d² at second order, and a
    /// sixteenth of that for points four times as dense.
    pub fn mean(light: impl Fn(f32, f32) -> Option<Vec3>) -> (Vec3, f32) {
        let (mut found, mut count) = Self::at(FEW, &light);
        let mut dense = 1.0;
        if found.most - found.least > UNEVEN * found.most {
            (found, count) = Self::at(MANY, &light);
            dense = 16.0;
        }
        if count == 0.0 {
            return (Vec3::ZERO, 0.0);
        }
        let mean = found.sum / count;
        let grey = mean.element_sum() / 3.0;
        let apart = if grey > 0.0 { (found.most - found.least) / grey } else { 0.0 };
        (mean, (grey * 0.25 * apart.min(1.0).powi(2) / dense).powi(2))
    }
}
