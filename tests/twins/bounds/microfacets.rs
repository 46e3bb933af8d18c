//! Bounds of the microfacet distributions and of Blinn's model of 1977.

use std::f64::consts::{LN_2, SQRT_2};

use glam::DVec3;
use lumbre_optics::{self as optics, Distribution, Fresnel};

use super::powers::{Off, exponential, grown};
use super::{Allowed, FLUSHED, Numbers, U, powers, refraction, vectors};

/// quarter_angle: 9 u.
pub fn quarter_angle(sine: f64, cosine: f64) -> f64 {
    9.0 * U * optics::quarter_angle(sine, cosine) + 2.0 * FLUSHED * (1.0 + 1.0 / sine.max(cosine).max(1e-30))
}

/// one_minus_exp: the series' 7 u and 10⁻⁸ up to 1/4; beyond that exp's error and a rounding. Both apply where x is
/// within its error of 1/4.
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
    // Beyond 80 the exponential is clamped.
    one_minus_exp(Off { value: x, error: 7.0 * U * x.min(80.0) })
}

/// half_value_angle: the tangent is off by the relative errors of the sine (half of its square's, and a root's 9 u)
/// and of the cosine (exp, and 7 u of its exponent); the angle by sin cos times that, and 9 u.
pub fn half_value_angle(shininess: f64) -> f64 {
    let square = optics::half_value_sine_squared(shininess);
    let x = (LN_2 / shininess.max(1e-6)).min(80.0);
    let of_sine = 0.5 * half_value_sine_squared(shininess) / square + 9.0 * U;
    let of_cosine = 7.0 * U * x + exponential(x);
    let slope = square.sqrt() * (-x).exp();
    slope * (of_sine + of_cosine) + 9.0 * U * optics::half_value_angle(shininess) + 2.0 * FLUSHED
}

/// distribution_gaussian: the exponent is off by twice the errors of the angle and the half-value angle, and 4 u;
/// then exp. The cosine and the squared sine may be off themselves, which moves the angle between two ends.
pub fn distribution_gaussian(cosine: Off, sine_squared: Off, shininess: f64) -> f64 {
    let angle_of =
        |square: f64, cosine: f64| optics::quarter_angle(square.max(0.0).sqrt(), cosine.clamp(0.0, 1.0));
    let angle = angle_of(sine_squared.value, cosine.value);
    let of_square = sine_squared.error + FLUSHED;
    let wide = angle_of(sine_squared.value + of_square, cosine.value - cosine.error);
    let narrow = angle_of(sine_squared.value - of_square, cosine.value + cosine.error);
    // The root's 9 u change the angle by sin cos times that; the angle has 9 u of its own.
    let own = 9.0 * U * (angle + angle.sin() * angle.cos()) + 2.0 * FLUSHED;
    let beta = optics::half_value_angle(shininess).max(1e-6);
    let of_beta = half_value_angle(shininess) / beta;
    let at = |angle: f64| {
        let exponent = LN_2 * (angle / beta).powi(2).min(100.0);
        ((-exponent).exp(), exponent)
    };
    let roundings = |angle: f64| {
        let (value, exponent) = at(angle);
        let of_ratio = own / angle.max(1e-30) + of_beta + 6.0 * U;
        value * grown(exponent * (2.0 * of_ratio.min(1.0) + 4.0 * U) + exponential(exponent))
    };
    let (value, high, low) = (at(angle).0, at(narrow).0, at(wide).0);
    (high - value).max(value - low) + roundings(angle).max(roundings(narrow)) + FLUSHED
}

/// distribution_trowbridge_reitz: q = A/(A + B), A = c₃², B = sin² (1 - A), is off by q (1 - q) times the relative
/// errors of A and B, and 6 u; D = q². The squared sine may be off itself.
pub fn distribution_trowbridge_reitz(sine_squared: Off, shininess: f64) -> f64 {
    let half_value = optics::half_value_sine_squared(shininess);
    let of_half_value = half_value_sine_squared(shininess) / half_value;
    let a = half_value / (SQRT_2 - 1.0 + half_value);
    // A depends little on the half value: it is off by (1 - A) times the half value's relative error.
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

/// cosine_to_half: 12 u, from half of the sum's 5 u and a root's 9 u.
pub fn cosine_to_half(sum: DVec3) -> f64 {
    12.0 * U * 0.5 * sum.length_squared().max(1e-30).sqrt() + FLUSHED
}

/// D for cosines that are themselves off.
fn density(distribution: Distribution, cosine: Off, sine_squared: Off, shininess: f64) -> Off {
    let (c, s) = (cosine.value, sine_squared.value);
    let (value, error) = match distribution {
        Distribution::CosinePower => (
            optics::distribution_cosine_power(c, s, shininess),
            powers::power_of_cosine(cosine, sine_squared, Off::exact(shininess)),
        ),
        Distribution::Gaussian => (
            optics::distribution_gaussian(c, s, shininess),
            distribution_gaussian(cosine, sine_squared, shininess),
        ),
        Distribution::TrowbridgeReitz => (
            optics::distribution_trowbridge_reitz(s, shininess),
            distribution_trowbridge_reitz(sine_squared, shininess),
        ),
    };
    Off { value, error }
}

/// |n x h|² with h the direction of a sum.
pub fn sine_squared_to_half(normal: DVec3, sum: DVec3) -> Off {
    let half = optics::safe_normalize(sum);
    let of_half = vectors::normalized_sum(sum);
    let of_cross = (2.0 * U * vectors::cross_size(normal, half) + vectors::cross_size(normal, of_half))
        .length()
        + FLUSHED;
    let sine = normal.cross(half).length();
    Off { value: sine * sine, error: of_cross * (2.0 * sine + of_cross) + 3.0 * U * sine * sine + FLUSHED }
}

/// D G / (n·v) without the conditions on n·l and n·v.
fn geometry(distribution: Distribution, [normal, light, viewer]: [DVec3; 3], shininess: f64) -> Off {
    let sum = light + viewer;
    let half = optics::safe_normalize(sum);
    let of_half = vectors::normalized_sum(sum);
    let n_half = Off { value: normal.dot(half), error: vectors::dot_of(normal, DVec3::ZERO, half, of_half) };
    let sine_squared = sine_squared_to_half(normal, sum);
    let density = density(distribution, n_half, sine_squared, shininess);
    let (n_light, n_viewer) = (normal.dot(light), normal.dot(viewer));
    let v_half = 0.5 * sum.length_squared().max(1e-30).sqrt();
    let attenuation = optics::geometric_attenuation(n_light, n_viewer, n_half.value, v_half);
    // At both ends of every cosine: the result decreases with n·v and v·h, and increases with n·l and n·h.
    let (of_light, of_viewer) = (vectors::dot(normal, light), vectors::dot(normal, viewer));
    let of_v_half = cosine_to_half(sum);
    let at = |sign: f64| {
        optics::geometric_attenuation(
            n_light + sign * of_light,
            n_viewer - sign * of_viewer,
            n_half.value + sign * n_half.error,
            v_half - sign * of_v_half,
        )
    };
    let (low, high) = (at(-1.0), at(1.0));
    let of_attenuation = (high - attenuation).max(attenuation - low) + 13.0 * U * high;
    let value = density.value * attenuation;
    let error = density.error * (attenuation + of_attenuation) + density.value * of_attenuation + U * value;
    Off { value, error: error + 1e8 * FLUSHED }
}

/// Returns whether rounding decides on n·l > 0 or n·v > 0, and whether both hold.
fn gates([normal, light, viewer]: [DVec3; 3]) -> (bool, bool) {
    let open = vectors::is_open(normal, light) || vectors::is_open(normal, viewer);
    (open, normal.dot(light) > 0.0 && normal.dot(viewer) > 0.0)
}

/// microfacet_lobe, and torrance_sparrow_geometry, which is that of Trowbridge and Reitz: D with the errors of its
/// cosine and sin², G with those of its cosines, and their product. Either side of n·l > 0 and n·v > 0.
pub fn microfacet_lobe(distribution: Distribution, directions: [DVec3; 3], shininess: f64) -> Allowed {
    let lobe = geometry(distribution, directions, shininess);
    let (open, in_front) = gates(directions);
    Allowed::from(lobe.error).or(open, || Numbers::from_slice(&[if in_front { 0.0 } else { lobe.value }]))
}

/// microfacet_reflection: the lobe's error times k_s F, the error of F times the other factors, and 2 u. F is for a
/// cosine that is off by 12 u.
pub fn microfacet_reflection(
    (distribution, fresnel): (Distribution, Fresnel),
    directions: [DVec3; 3],
    shininess: f64,
    specular: DVec3,
    ior: f64,
) -> Allowed {
    let lobe = geometry(distribution, directions, shininess);
    let sum = directions[1] + directions[2];
    let v_half = Off { value: 0.5 * sum.length_squared().max(1e-30).sqrt(), error: cosine_to_half(sum) };
    let (reflected, error) = match fresnel {
        Fresnel::Dielectric => {
            let error = refraction::fresnel_dielectric(v_half, Off::exact(ior));
            (specular * optics::fresnel_dielectric(v_half.value, ior), specular * error)
        }
        Fresnel::Conductor { eta, absorption } => {
            let (eta, absorption) = (eta.as_dvec3(), absorption.as_dvec3());
            let channel = |at: usize| refraction::fresnel_conductor(v_half, eta[at], absorption[at]);
            let error = DVec3::new(channel(0), channel(1), channel(2));
            (specular * optics::fresnel_conductor(v_half.value, eta, absorption), specular * error)
        }
        Fresnel::NormalReflectance => {
            let channel = |at: usize| refraction::fresnel_normal_reflectance(v_half, specular[at]);
            let error = DVec3::new(channel(0), channel(1), channel(2));
            (optics::fresnel_normal_reflectance(v_half.value, specular), error)
        }
    };
    let size = reflected.abs() + error;
    let error = size * lobe.error + error * lobe.value + 2.0 * U * reflected.abs() * lobe.value;
    let (open, in_front) = gates(directions);
    let other = reflected * if in_front { 0.0 } else { lobe.value };
    Allowed::from(error + DVec3::splat(FLUSHED)).or(open, || Numbers::from_slice(&other.to_array()))
}

/// torrance_sparrow: the same for a dielectric.
pub fn torrance_sparrow(directions: [DVec3; 3], shininess: f64, ior: f64) -> Allowed {
    let kind = (Distribution::TrowbridgeReitz, Fresnel::Dielectric);
    let all = microfacet_reflection(kind, directions, shininess, DVec3::X, ior);
    let other = all.other.map(|other| Numbers::from_slice(&other[..1]));
    Allowed { error: Numbers::from_slice(&all.error[..1]), other }
}
