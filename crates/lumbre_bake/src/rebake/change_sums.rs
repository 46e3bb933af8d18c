//! Accumulates samples of a change that is known within bounds, and samples the cones that rays are aimed by. The
//! change itself is sampled in `indirect_change`.

use std::f32::consts::TAU;

use glam::{DVec3, Vec3};

use crate::sampling::frame;

/// A lower and an upper bound, by channel.
pub(super) type Range = [Vec3; 2];

/// Sums of samples of both bounds, for their means and standard errors.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct ChangeSums {
    sums: [DVec3; 2],
    squares: [DVec3; 2],
    count: f64,
    /// Whether some sample has no known bounds.
    pub unknown: bool,
}

impl ChangeSums {
    /// Adds a sample of both bounds.
    pub fn add(&mut self, range: Range, weight: f32) {
        for (bound, value) in range.into_iter().enumerate() {
            let value = (value * weight).as_dvec3();
            self.sums[bound] += value;
            self.squares[bound] += value * value;
        }
        self.count += 1.0;
    }

    /// The mean of each bound.
    pub fn means(&self) -> Range {
        self.sums.map(|sum| (sum / self.count.max(1.0)).as_vec3())
    }

    /// The largest absolute change within the bounds plus one standard error, root mean square of the channels;
    /// infinite if it is unknown.
    pub fn largest(&self) -> f32 {
        if self.unknown {
            return f32::INFINITY;
        }
        let count = self.count.max(1.0);
        let largest = self.sums.iter().zip(&self.squares).map(|(sum, squares)| {
            let mean = *sum / count;
            let variance = (*squares / count - mean * mean).max(DVec3::ZERO) / count;
            mean.abs() + DVec3::from_array(variance.to_array().map(f64::sqrt))
        });
        let largest = largest.fold(DVec3::ZERO, DVec3::max);
        (largest.length_squared() / 3.0).sqrt() as f32
    }
}

/// The cone of directions from a point to a sphere: its axis, and 1 - cos of half its angle, which is its solid angle
/// over 2π. From within the sphere, it contains all directions.
pub(super) fn cone_to_sphere(from: Vec3, center: Vec3, radius: f32) -> (Vec3, f32) {
    let to_center = center - from;
    let distance = to_center.length();
    if distance <= radius {
        return (Vec3::Z, 2.0);
    }
    let sine = radius / distance;
    let cosine = (1.0 - sine * sine).max(0.0).sqrt();
    (to_center / distance, sine * sine / (1.0 + cosine))
}

/// A direction in a cone, uniformly distributed over its solid angle.
pub(super) fn direction_in_cone(axis: Vec3, size: f32, u: f32, v: f32) -> Vec3 {
    let height = u * size;
    let cosine = 1.0 - height;
    let sine = (height * (2.0 - height)).max(0.0).sqrt();
    let (y, x) = (TAU * v).sin_cos();
    let [a, b] = frame(axis);
    (a * (x * sine) + b * (y * sine) + axis * cosine).normalize_or(axis)
}
