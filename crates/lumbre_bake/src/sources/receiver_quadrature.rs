//! The mean of unoccluded light over a receiver, from a few of its points, and the error of that mean. The light at a
//! point comes from `emitter_tree` and `punctual_irradiance`.

use glam::Vec3;

use crate::color::channel_mean;

/// Sum and range of the exact unoccluded light at evenly distributed points of a receiver. The points come in pairs
/// about its middle, so that the error of the mean is of second order in the receiver's size.
pub(crate) struct ReceiverQuadrature {
    sum: Vec3,
    least: f32,
    most: f32,
}

/// Rows of the points in a grid of 4 x 4 cells, by column; used where the light hardly varies. Each row and each column
/// has one point, and the two are uncorrelated, so that a receiver that is a list of points is sampled evenly too.
const FEW: [u32; 4] = [1, 3, 0, 2];
/// The same for 16 x 16 cells, used where the light varies.
const MANY: [u32; 16] = [5, 3, 15, 11, 7, 1, 13, 9, 6, 2, 14, 8, 4, 0, 12, 10];

/// Variation over the few points, relative to their maximum, above which many points are used. At a lamp's edge, the
/// light varies strongly within a texel.
const UNEVEN: f32 = 0.05;

impl ReceiverQuadrature {
    /// Evaluates `light` at the points; also returns how many of them exist.
    fn at<const N: usize>(points: [u32; N], light: impl Fn(f32, f32) -> Option<Vec3>) -> (Self, f32) {
        let mut samples = Self { sum: Vec3::ZERO, least: f32::INFINITY, most: 0.0 };
        let mut count = 0.0;
        for (x, y) in points.into_iter().enumerate() {
            let middle = |place: u32| (place as f32 + 0.5) / N as f32;
            let Some(light) = light(middle(x as u32), middle(y)) else { continue };
            let mean = channel_mean(light);
            samples = Self {
                sum: samples.sum + light,
                least: samples.least.min(mean),
                most: samples.most.max(mean),
            };
            count += 1.0;
        }
        (samples, count)
    }

    /// The mean over a receiver by the few points alone.
    pub fn of_few(light: impl Fn(f32, f32) -> Option<Vec3>) -> Vec3 {
        let (samples, count) = Self::at(FEW, light);
        if count > 0.0 { samples.sum / count } else { Vec3::ZERO }
    }

    /// The mean over a receiver, and its squared error. Where the light varies by a fraction d of the mean, the
    /// second-order error is of the order of d²; four times as many points in each direction reduce it to a sixteenth.
    pub fn mean(light: impl Fn(f32, f32) -> Option<Vec3>) -> (Vec3, f32) {
        let (mut samples, mut count) = Self::at(FEW, &light);
        let mut error_divisor = 1.0;
        if samples.most - samples.least > UNEVEN * samples.most {
            (samples, count) = Self::at(MANY, &light);
            error_divisor = 16.0;
        }
        if count == 0.0 {
            return (Vec3::ZERO, 0.0);
        }
        let mean = samples.sum / count;
        let magnitude = channel_mean(mean);
        let variation = if magnitude > 0.0 { (samples.most - samples.least) / magnitude } else { 0.0 };
        (mean, (magnitude * 0.25 * variation.min(1.0).powi(2) / error_divisor).powi(2))
    }
}
