//! Samples of a change between bounds, put together, and the cones that they are aimed by. Not what is sampled: that is `indirect_change`.

use std::f32::consts::TAU;

use glam::{DVec3, Vec3};

use crate::sampling::frame;

/// The least and the most of something, by channel.
pub(super) type Range = [Vec3; 2];

/// Means of samples of both bounds and their standard errors.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Estimate {
    sums: [DVec3; 2],
    squares: [DVec3; 2],
    count: f64,
    /// Some sample may be anything.
    pub unknown: bool,
}

impl Estimate {
    pub fn add(&mut self, range: Range, weight: f32) {
        for (bound, value) in range.into_iter().enumerate() {
            let value = (value * weight).as_dvec3();
            self.sums[bound] += value;
            self.squares[bound] += value * value;
        }
        self.count += 1.0;
    }

    pub fn means(&self) -> Range {
        self.sums.map(|sum| (sum / self.count.max(1.0)).as_vec3())
    }

    /// The largest change within the bounds, with one standard error: root mean square of the channels.
    pub fn most(&self) -> f32 {
        if self.unknown {
            return f32::INFINITY;
        }
        let count = self.count.max(1.0);
        let most = self.sums.iter().zip(&self.squares).map(|(sum, squares)| {
            let mean = *sum / count;
            let variance = (*squares / count - mean * mean).max(DVec3::ZERO) / count;
            mean.abs() + DVec3::from_array(variance.to_array().map(f64::sqrt))
        });
        let most = most.fold(DVec3::ZERO, DVec3::max);
        (most.length_squared() / 3.0).sqrt() as f32
    }
}

/// The cone from a point about a sphere: its axis, and 1 - cos of half its angle, which is its solid angle over 2π. All directions from within.
pub(super) fn cap(from: Vec3, center: Vec3, radius: f32) -> (Vec3, f32) {
    let apart = center - from;
    let distance = apart.length();
    if distance <= radius {
        return (Vec3::Z, 2.0);
    }
    let sine = radius / distance;
    let cosine = (1.0 - sine * sine).max(0.0).sqrt();
    (apart / distance, sine * sine / (1.0 + cosine))
}

/// A direction of a cone, spread evenly over its solid angle.
pub(super) fn in_cap(axis: Vec3, size: f32, u: f32, v: f32) -> Vec3 {
    let height = u * size;
    let cosine = 1.0 - height;
    let sine = (height * (2.0 - height)).max(0.0).sqrt();
    let (y, x) = (TAU * v).sin_cos();
    let [a, b] = frame(axis);
    (a * (x * sine) + b * (y * sine) + axis * cosine).normalize_or(axis)
}
