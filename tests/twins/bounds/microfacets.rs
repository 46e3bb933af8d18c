//! Bounds of the distributions of microfacets and of Blinn's model of 1977.

use std::f64::consts::{FRAC_PI_4, LN_2, SQRT_2};

use glam::DVec3;
use lumbre_optics as optics;

use super::powers::{Off, exponential, grown};
use super::{Allowed, FLUSHED, Numbers, U, refraction, vectors};

/// quarter_angle: 9 u.
pub fn quarter_angle(sine: f64, cosine: f64) -> f64 {
    9.0 * U * optics::quarter_angle(sine, cosine) + 2.0 * FLUSHED * (1.0 + 1.0 / sine.max(cosine).max(1e-30))
}

/// one_minus_exp: the series' 7 u and 10⁻⁸ up to 1/4; beyond, exp's error and a rounding. Both where x is within its error of 1/4.
pub fn one_minus_exp(x: Off) -> f64 {
    let value = -(-x.value).exp_m1();
    let series = value * (7.0 * U + 1e-8);
    let difference = (-x.value).exp() * exponential(x.value) + U * value;
    let own = if x.value + x.error < 0.25 {
        series
    } else if x.value - x.error >= 0.25 {
        difference
    } else {
        series.max(difference)
    };
    own + (-x.value).exp() * x.error + FLUSHED
}

/// half_value_sine_squared: 2 ln 2/n is off by 7 u.
pub fn half_value_sine_squared(shininess: f64) -> f64 {
    let x = 2.0 * LN_2 / shininess.max(1e-6);
    // Beyond 80 the exponential is held.
    one_minus_exp(Off { value: x, error: 7.0 * U * x.min(80.0) })
}

/// half_value_angle: the tangent by the sine's relative error (half of its square's, and a root's 9 u) and the cosine's (exp, and
/// 7 u of its exponent); the angle by sin cos of that, and 9 u.
pub fn half_value_angle(shininess: f64) -> f64 {
    let square = optics::half_value_sine_squared(shininess);
    let x = (LN_2 / shininess.max(1e-6)).min(80.0);
    let of_sine = 0.5 * half_value_sine_squared(shininess) / square + 9.0 * U;
    let of_cosine = 7.0 * U * x + exponential(x);
    let slope = square.sqrt() * (-x).exp();
    slope * (of_sine + of_cosine) + 9.0 * U * optics::half_value_angle(shininess) + 2.0 * FLUSHED
}

/// distribution_gaussian: the angle's and the half-value angle's errors twice, and 20 u, of the exponent; exp.
pub fn distribution_gaussian(cosine: f64, sine_squared: f64, shininess: f64) -> f64 {
    let sine = sine_squared.max(0.0).sqrt();
    let cosine = cosine.clamp(0.0, 1.0);
    let angle = optics::quarter_angle(sine, cosine);
    // The root's 9 u move the angle by sin cos of it over sin² + cos².
    let moved = 9.0 * U * sine * cosine / (sine_squared.max(0.0) + cosine * cosine).max(1e-30);
    let of_angle =
        (quarter_angle(sine, cosine) + moved.min(9.0 * U * angle.max(FRAC_PI_4))) / angle.max(1e-30);
    let beta = optics::half_value_angle(shininess).max(1e-6);
    let of_ratio = of_angle + half_value_angle(shininess) / beta + 6.0 * U;
    let exponent = LN_2 * (angle / beta).powi(2).min(100.0);
    let value = (-exponent).exp();
    let flushed = if sine_squared.abs() < 4.0 * FLUSHED { 1e-7 } else { 0.0 };
    value * grown(exponent * (2.0 * of_ratio + 4.0 * U) + exponential(exponent)) + flushed + FLUSHED
}

/// distribution_trowbridge_reitz: q = A/(A + B), A = c₃², B = sin² (1 - A), off by q (1 - q) times the relative errors of A and B, and
/// 6 u; D = q². The squared sine may be off itself.
pub fn distribution_trowbridge_reitz(sine_squared: Off, shininess: f64) -> f64 {
    let half_value = optics::half_value_sine_squared(shininess);
    let of_half_value = half_value_sine_squared(shininess) / half_value;
    let a = half_value / (SQRT_2 - 1.0 + half_value);
    // A is flat in the half value: by (1 - A) of its relative error.
    let of_a = (1.0 - a) * of_half_value + 8.0 * U;
    let s = sine_squared.value.clamp(0.0, 1.0);
    let b = s * (1.0 - a);
    let q = a / (a + b);
    let of_rest = a * of_a / (1.0 - a) + 2.0 * U;
    let moved = q * q * (1.0 - a) / a * sine_squared.error;
    let error = q * (1.0 - q) * (of_a + of_rest) + moved + 6.0 * U * q;
    error * (2.0 * q + error) + U * q * q
}

/// geometric_attenuation: 13 u.
pub fn geometric_attenuation(n_light: f64, n_viewer: f64, n_half: f64, v_half: f64) -> f64 {
    13.0 * U * optics::geometric_attenuation(n_light, n_viewer, n_half, v_half) + 1e8 * FLUSHED
}

/// cosine_to_half: 12 u: a sum's 5 u halved, and a root's 9 u.
pub fn cosine_to_half(sum: DVec3) -> f64 {
    12.0 * U * 0.5 * sum.length_squared().max(1e-30).sqrt() + FLUSHED
}

/// torrance_sparrow_geometry: D with the error of sin², G with those of its cosines; the product. Either side of n·l > 0 and n·v > 0.
pub fn torrance_sparrow_geometry(normal: DVec3, light: DVec3, viewer: DVec3, shininess: f64) -> Allowed {
    let (value, other, error) = geometry(normal, light, viewer, shininess);
    let open = vectors::is_open(normal, light) || vectors::is_open(normal, viewer);
    let here = optics::torrance_sparrow_geometry(normal, light, viewer, shininess);
    debug_assert!(here == 0.0 || (here - value).abs() <= 1e-9 * value);
    Allowed::from(error).or(open, || Numbers::from_slice(&[if here > 0.0 { 0.0 } else { other }]))
}

/// The value without its gates, the same once more, and its error.
fn geometry(normal: DVec3, light: DVec3, viewer: DVec3, shininess: f64) -> (f64, f64, f64) {
    let sum = light + viewer;
    let half = optics::safe_normalize(sum);
    let of_half = vectors::normalized_sum(sum);
    let of_cross = (2.0 * U * vectors::cross_size(normal, half) + vectors::cross_size(normal, of_half))
        .length()
        + FLUSHED;
    let sine = normal.cross(half).length();
    let of_square = of_cross * (2.0 * sine + of_cross) + 3.0 * U * sine * sine + FLUSHED;
    let distribution = optics::distribution_trowbridge_reitz(sine * sine, shininess);
    let of_distribution =
        distribution_trowbridge_reitz(Off { value: sine * sine, error: of_square }, shininess);
    let (n_light, n_viewer, n_half) = (normal.dot(light), normal.dot(viewer), normal.dot(half));
    let v_half = 0.5 * sum.length_squared().max(1e-30).sqrt();
    let attenuation = optics::geometric_attenuation(n_light, n_viewer, n_half, v_half);
    // At both ends of every cosine: it falls with n·v and v·h, and rises with n·l and n·h.
    let (of_light, of_viewer) = (vectors::dot(normal, light), vectors::dot(normal, viewer));
    let of_n_half = vectors::dot_of(normal, DVec3::ZERO, half, of_half);
    let of_v_half = cosine_to_half(sum);
    let at = |sign: f64| {
        optics::geometric_attenuation(
            n_light + sign * of_light,
            n_viewer - sign * of_viewer,
            n_half + sign * of_n_half,
            v_half - sign * of_v_half,
        )
    };
    let (low, high) = (at(-1.0), at(1.0));
    let of_attenuation = (high - attenuation).max(attenuation - low) + 13.0 * U * high;
    let value = distribution * attenuation;
    let error = of_distribution * (attenuation + of_attenuation) + distribution * of_attenuation + U * value;
    (value, value, error + 1e8 * FLUSHED)
}

/// torrance_sparrow: the geometry's error times F, F's times the geometry, and a rounding.
pub fn torrance_sparrow(normal: DVec3, light: DVec3, viewer: DVec3, shininess: f64, ior: f64) -> Allowed {
    let v_half = 0.5 * (light + viewer).length_squared().max(1e-30).sqrt();
    let reflectance = optics::fresnel_dielectric(v_half, ior);
    let of_reflectance =
        refraction::fresnel_dielectric(Off { value: v_half, error: cosine_to_half(light + viewer) }, ior);
    let (value, _, _) = geometry(normal, light, viewer, shininess);
    let geometry = torrance_sparrow_geometry(normal, light, viewer, shininess);
    let error = geometry.error[0] * (reflectance + of_reflectance)
        + (value + geometry.error[0]) * of_reflectance
        + U * value * reflectance;
    let other = geometry.other.map(|other| Numbers::from_slice(&[other[0] * reflectance]));
    Allowed { error: Numbers::from_slice(&[error + FLUSHED]), other }
}
