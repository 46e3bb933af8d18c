//! Bounds of distance attenuation, cones, and a light as it reaches a point.

use glam::{DVec3, DVec4};
use lumbre_optics::{MAXIMUM_DISTANCE, MINIMUM_COSINE_DIFFERENCE, UNLIMITED_RANGE};

use super::powers::{self, Off};
use super::{Allowed, FLUSHED, Numbers, U, vectors};

/// attenuate: 13 u relative, plus 28 u (d/range)⁴ times the factor without its window. If the distance itself is
/// off by `roundings` u, that adds twice that to the first and four times that to the second.
pub fn attenuate(coefficients: DVec3, clamp_to_one: bool, range: f64, distance: f64, roundings: f64) -> f64 {
    let factor = lumbre_optics::attenuate(coefficients, clamp_to_one, UNLIMITED_RANGE, distance);
    let end = range.clamp(1e-30, UNLIMITED_RANGE);
    let ratio = distance.clamp(0.0, MAXIMUM_DISTANCE).min(end) / end;
    let window = 1.0 - ratio.powi(4);
    U * factor * ((13.0 + 2.0 * roundings) * window + (28.0 + 4.0 * roundings) * ratio.powi(4)) + FLUSHED
}

/// attenuate_quadratic: 9 u relative, plus 4 u (d/range)⁴ times the factor without its window.
pub fn attenuate_quadratic(constant: f64, inverse_range_squared: f64, distance_squared: f64) -> f64 {
    let factor = lumbre_optics::attenuate_quadratic(constant, 0.0, distance_squared);
    let fourth_power = (distance_squared * inverse_range_squared).min(1.0).powi(2);
    U * factor * (9.0 * (1.0 - fourth_power) + 4.0 * fourth_power) + FLUSHED
}

/// spot_factor for a cosine that may be off. Smooth: 15 u, and twice the cosine's error over the width. Exponent:
/// that of `safe_pow`, and either side of the edge where the cosine is within its error of it.
pub fn spot_factor(smooth_cone: bool, outer: f64, inner_or_exponent: f64, cosine: Off) -> Allowed {
    let value = lumbre_optics::spot_factor(smooth_cone, outer, inner_or_exponent, cosine.value);
    if smooth_cone {
        let width = (inner_or_exponent - outer).max(MINIMUM_COSINE_DIFFERENCE);
        // The largest possible value of the linear function.
        let angular = value.sqrt() + cosine.error / width;
        return Allowed::from(15.0 * U * value + 2.0 * angular.min(1.0) * cosine.error / width + FLUSHED);
    }
    let clamped = Off { value: cosine.value.clamp(-1.0, 1.0), ..cosine };
    let inside = lumbre_optics::safe_pow(clamped.value, inner_or_exponent);
    let open = cosine.error > 0.0 && (outer - clamped.value).abs() <= cosine.error;
    let error =
        if value > 0.0 || open { powers::safe_pow(clamped, Off::exact(inner_or_exponent)) } else { 0.0 };
    let other = if outer < clamped.value { 0.0 } else { inside };
    Allowed::from(error).or(open, || Numbers::from_slice(&[other]))
}

/// smooth_spot_factor: the linear function is off by 6 u of its terms' magnitudes, its square by twice that times
/// the function, plus 1 u.
pub fn smooth_spot_factor(cone: DVec4, to_light: DVec3) -> f64 {
    let value = lumbre_optics::smooth_spot_factor(cone, to_light);
    let sizes = cone.w.abs() + cone.truncate().abs().dot(to_light.abs());
    let angular = 6.0 * U * sizes;
    angular * (2.0 * value.sqrt() + angular) + U * value + FLUSHED
}

/// evaluate_light: direction, attenuation and spot factor. The direction is a normalized difference, the distance
/// the length of that, off by 12 u, and the cosine of the cone a dot product with the direction.
pub fn evaluate_light(light: &PlacedLight, point: DVec3) -> Allowed {
    let to_light = if light.directional { -light.axis } else { light.position - point };
    let direction = lumbre_optics::safe_normalize(to_light);
    let of_direction = match light.directional {
        true => vectors::safe_normalize(to_light),
        false => vectors::normalized_sum(to_light),
    };
    let of_attenuation = match light.directional {
        true => 0.0,
        false => attenuate(light.attenuation, false, light.range, to_light.length(), 12.0),
    };
    let value = -direction.dot(light.axis);
    let error = vectors::dot_of(direction, of_direction, light.axis, DVec3::ZERO);
    let spot = match light.cone {
        None => Allowed::from(0.0),
        Some((smooth, outer, second)) => spot_factor(smooth, outer, second, Off { value, error }),
    };
    let exact = light.expected(point);
    let other = spot.other.map(|spot| Numbers::from_iter(exact[..4].iter().copied().chain(spot)));
    let error = of_direction.to_array().into_iter().chain([of_attenuation, spot.error[0]]).collect();
    Allowed { error, other }
}

/// A light as the shader gets it.
pub struct PlacedLight {
    pub directional: bool,
    pub range: f64,
    pub position: DVec3,
    pub axis: DVec3,
    pub attenuation: DVec3,
    /// Whether the cone is smooth, its outer cosine, and its inner cosine or exponent.
    pub cone: Option<(bool, f64, f64)>,
}

impl PlacedLight {
    /// Returns direction, attenuation and spot factor from the f64 functions that `evaluate_light` consists of,
    /// with cosines in place of angles.
    pub fn expected(&self, point: DVec3) -> [f64; 5] {
        let to_light = if self.directional { -self.axis } else { self.position - point };
        let direction = lumbre_optics::safe_normalize(to_light);
        let attenuation = match self.directional {
            true => 1.0,
            false => {
                let distance = lumbre_optics::safe_length(to_light);
                lumbre_optics::attenuate(self.attenuation, false, self.range, distance)
            }
        };
        let spot = self.cone.map_or(1.0, |(smooth, outer, second)| {
            lumbre_optics::spot_factor(smooth, outer, second, -direction.dot(self.axis))
        });
        [direction.x, direction.y, direction.z, attenuation, spot]
    }
}
