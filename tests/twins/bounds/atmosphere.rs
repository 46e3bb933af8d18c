//! Bounds of fog.

use glam::DVec3;

use super::powers::{exponential, grown};
use super::{Allowed, FLUSHED, Numbers, U};

const MAXIMUM_DISTANCE: f64 = 1e18;

fn limited(distance: f64) -> f64 {
    distance.abs().min(MAXIMUM_DISTANCE)
}

/// fog_fraction: 7 u relative, from two differences and a division. Distances beyond 10¹⁸ m are clamped to that
/// number, which is rounded.
fn fraction(start: f64, end: f64, distance: f64, fraction: f64) -> f64 {
    let limit = if distance.abs() >= MAXIMUM_DISTANCE {
        U * MAXIMUM_DISTANCE / (end - start).abs().max(1e-30)
    } else {
        0.0
    };
    7.0 * U * fraction + limit.min(1.0) + FLUSHED * (1.0 + 1.0 / (end - start).abs().max(1e-30))
}

/// Returns true if rounding decides whether the point is before or behind a wall of fog, or whether the fog is a
/// wall at all.
fn is_open(start: f64, end: f64, distance: f64) -> bool {
    let span = (end - start).abs();
    let nearly_a_wall = (span - 1e-30).abs() <= 2.0 * U * 1e-30;
    nearly_a_wall || (span < 1e-30 && (limited(distance) - end).abs() <= FLUSHED && distance.abs() != end)
}

/// fog_linear: the fraction's 7 u, plus u of the weight.
pub fn fog_linear(start: f64, end: f64, distance: f64) -> Allowed {
    let weight = lumbre_optics::fog_linear(start, end, distance);
    let error = fraction(start, end, distance, 1.0 - weight) + U * weight;
    Allowed::from(error).or(is_open(start, end, distance), || Numbers::from_slice(&[1.0 - weight.round()]))
}

/// exp(-x) where x is off by this many u of itself.
fn weight(x: f64, roundings: f64) -> f64 {
    (-x).exp() * grown(roundings * U * x + exponential(x)) + FLUSHED
}

/// fog_exponential: one rounding of the exponent, and exp.
pub fn fog_exponential(density: f64, distance: f64) -> f64 {
    weight((density * limited(distance)).clamp(0.0, 80.0), 2.0)
}

/// fog_exponential_squared: three roundings of the exponent, and exp.
pub fn fog_exponential_squared(density: f64, distance: f64) -> f64 {
    weight((density * limited(distance)).clamp(0.0, 80f64.sqrt()).powi(2), 4.0)
}

/// fog_depth_cue: 7 u of the fraction f times the difference of the weights, then 2 u of the near part, u of the
/// far one, and the sum's u.
pub fn fog_depth_cue(start: f64, end: f64, near_weight: f64, far_weight: f64, distance: f64) -> Allowed {
    let far = lumbre_optics::fog_fraction(start, end, limited(distance));
    let of_fraction = fraction(start, end, distance, far);
    let (near_part, far_part) = ((near_weight * (1.0 - far)).abs(), (far_weight * far).abs());
    let error = (near_weight - far_weight).abs() * of_fraction
        + U * (3.0 * near_part + 2.0 * far_part + far * near_weight.abs())
        + 2.0 * FLUSHED;
    let other = if far < 0.5 { far_weight } else { near_weight };
    Allowed::from(error).or(is_open(start, end, distance), || Numbers::from_slice(&[other]))
}

/// apply_fog: 2 u of the lit part, 3 u of the fog's.
pub fn apply_fog(weight: f64, lit: DVec3, fog_color: DVec3) -> DVec3 {
    let size = 2.0 * (weight * lit).abs() + 3.0 * ((1.0 - weight) * fog_color).abs();
    U * size + DVec3::splat(3.0 * FLUSHED)
}

/// fog_fraction: as in `fraction`.
pub fn fog_fraction(start: f64, end: f64, distance: f64) -> Allowed {
    let value = lumbre_optics::fog_fraction(start, end, distance);
    Allowed::from(fraction(start, end, distance, value))
        .or(is_open(start, end, distance), || Numbers::from_slice(&[1.0 - value.round()]))
}
