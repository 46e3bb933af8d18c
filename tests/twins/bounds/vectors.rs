//! Bounds of dot products, unit vectors and half vectors.

use glam::DVec3;

use super::{FLUSHED, U};

/// Σ|a b|, to which the roundings of a dot product are relative.
pub fn dot_size(a: DVec3, b: DVec3) -> f64 {
    a.abs().dot(b.abs())
}

/// 3 u Σ|a b|: each product is rounded and passes through two sums.
pub fn dot(a: DVec3, b: DVec3) -> f64 {
    3.0 * U * dot_size(a, b) + 6.0 * FLUSHED
}

/// The dot product of vectors that are themselves off by these amounts.
pub fn dot_of(a: DVec3, a_error: DVec3, b: DVec3, b_error: DVec3) -> f64 {
    dot(a, b) + dot_size(a_error, b) + dot_size(a, b_error) + dot_size(a_error, b_error)
}

/// Returns true if |n·l| is below its rounding, so that its sign is undetermined.
pub fn is_open(a: DVec3, b: DVec3) -> bool {
    dot_size(a, b) > 0.0 && a.dot(b).abs() <= dot(a, b)
}

/// The magnitudes to which the roundings of a cross product are relative, per component.
pub fn cross_size(a: DVec3, b: DVec3) -> DVec3 {
    let (a, b) = (a.abs(), b.abs());
    DVec3::new(a.y * b.z + a.z * b.y, a.z * b.x + a.x * b.z, a.x * b.y + a.y * b.x)
}

/// safe_normalize: 7 u of each component: half of the square's 3 u, inverseSqrt's 4 u, the product.
pub fn safe_normalize(v: DVec3) -> DVec3 {
    scaled(v, 7.0)
}

/// A normalized difference or sum, which was rounded once per component: 9 u of each component.
pub fn normalized_sum(sum: DVec3) -> DVec3 {
    scaled(sum, 9.0)
}

fn scaled(v: DVec3, roundings: f64) -> DVec3 {
    let unit = lumbre_optics::safe_normalize(v);
    // A component that is flushed is off by up to FLUSHED over the length, which is taken as at least 10⁻¹⁵.
    let flushed = 2.0 * FLUSHED / v.length().max(1e-15);
    roundings * U * unit.abs() + DVec3::splat(flushed)
}

/// reflected_direction: the dot product's error and two roundings, times the normal; and the difference's rounding.
pub fn reflected_direction(normal: DVec3, light: DVec3) -> DVec3 {
    let cosine = 2.0 * (dot(normal, light) + U * normal.dot(light).abs());
    normal.abs() * cosine
        + U * lumbre_optics::reflected_direction(normal, light).abs()
        + DVec3::splat(2.0 * FLUSHED)
}
