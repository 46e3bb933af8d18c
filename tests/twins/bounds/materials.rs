//! Bounds of normal maps, of occlusion, and of glTF's highlights.

use glam::{DVec3, DVec4};
use lumbre_optics::{self as optics, SHORTEST_BENT_SQUARED, TINY_LENGTH_SQUARED};

use super::powers::Off;
use super::{Allowed, FLUSHED, Numbers, U, microfacets, refraction, vectors};

/// map_normal: the sum is off by 10 u of its terms' magnitudes, its direction by twice that over its length, and by
/// 8 u.
pub fn map_normal(texel: DVec3, scale: f64, tangent: DVec4, normal: DVec3) -> Allowed {
    let slope = 2.0 * texel - DVec3::ONE;
    let along = tangent.truncate();
    let across = vectors::cross_size(normal, along) * tangent.w.abs();
    let terms = (slope.x * scale * along).abs() + (slope.y * scale).abs() * across + (slope.z * normal).abs();
    let of_sum = 10.0 * U * terms + DVec3::splat(16.0 * FLUSHED * (1.0 + scale.abs()));
    let bent = slope.x * scale * along + slope.y * scale * normal.cross(along) * tangent.w + slope.z * normal;
    let direction = |sum: DVec3, off: DVec3| {
        let length = sum.length().max(1e-15);
        off / length
            + optics::safe_normalize(sum).abs() * (off.length() / length)
            + vectors::safe_normalize(sum)
            + DVec3::splat(U)
    };
    let squared = normal.length_squared();
    let (own, threshold) = (bent.length_squared(), SHORTEST_BENT_SQUARED * squared);
    let slack = 2.0 * of_sum.length() * bent.length()
        + of_sum.length_squared()
        + 8.0 * U * (own + threshold)
        + 6.0 * FLUSHED;
    let open = (own - threshold).abs() <= slack || (squared - TINY_LENGTH_SQUARED).abs() <= 8.0 * U * squared;
    let is_bent = squared > TINY_LENGTH_SQUARED && own > threshold;
    let (error, other) = match is_bent {
        true => (direction(bent, of_sum), normal),
        false => (vectors::safe_normalize(normal) + DVec3::splat(FLUSHED), bent),
    };
    Allowed::from(error).or(open, || Numbers::from_slice(&optics::safe_normalize(other).to_array()))
}

/// transformed_tangent: 12 u of the magnitudes of |T| + |N x T|; either sign where the determinant is within its
/// rounding of 0.
pub fn transformed_tangent(u: DVec3, v: DVec3, tangent: DVec4, normal: DVec3) -> Allowed {
    let along = tangent.truncate();
    let size = along.abs() + vectors::cross_size(normal, along) * tangent.w.abs();
    let error = (12.0 * U * size + DVec3::splat(8.0 * FLUSHED)).extend(0.0);
    let (first, second) = (u.x * v.y, u.y * v.x);
    let open = (first - second).abs() <= 3.0 * U * (first.abs() + second.abs()) + 2.0 * FLUSHED;
    let own = optics::transformed_tangent(u, v, tangent, normal);
    Allowed::from(&error.to_array()[..]).or(open, || Numbers::from_slice(&(-own).to_array()))
}

/// normal_map_widening: 2 u.
pub fn normal_map_widening(spread: f64, scale: f64) -> f64 {
    3.0 * U * optics::normal_map_widening(spread, scale) + 2.0 * FLUSHED
}

/// occlusion: 3 u of 1 + 2 |strength|.
pub fn occlusion(sample: f64, strength: f64) -> f64 {
    3.0 * U * (1.0 + 2.0 * strength.abs()) * (1.0 + sample.abs()) + FLUSHED
}

/// lobe_peak: u, for the sum; the factor is a power of two.
pub fn lobe_peak(shininess: f64) -> f64 {
    U * optics::lobe_peak(shininess) + FLUSHED
}

/// distribution_ggx: for q = A/(A + B) with B = sin² (1 - A) it is (1 - q) times the relative errors of A and B,
/// and 6 u; D = q². Evaluated at both ends of the arguments' errors.
pub fn distribution_ggx(sine_squared: Off, alpha_squared: Off) -> f64 {
    let at = |sine: f64, alpha: f64| optics::distribution_ggx(sine.max(0.0), alpha.clamp(0.0, 1.0));
    let value = at(sine_squared.value, alpha_squared.value);
    let low = at(sine_squared.value + sine_squared.error, alpha_squared.value - alpha_squared.error);
    let high = at(sine_squared.value - sine_squared.error, alpha_squared.value + alpha_squared.error);
    // 1 - A is off by u/(1 - A) relative, which only matters where it is multiplied by a large sin².
    (high - value).max(value - low) + 24.0 * U * high + FLUSHED
}

/// smith_attenuation: 24 u, and the effect of the errors of its cosines and α²: it increases with n·l and decreases
/// with the other two.
pub fn smith_attenuation(n_light: Off, n_viewer: Off, alpha_squared: Off) -> f64 {
    let at = |sign: f64| {
        optics::smith_attenuation(
            n_light.value + sign * n_light.error,
            n_viewer.value - sign * n_viewer.error,
            (alpha_squared.value - sign * alpha_squared.error).clamp(0.0, 1.0),
        )
    };
    let value = optics::smith_attenuation(n_light.value, n_viewer.value, alpha_squared.value);
    let (low, high) = (at(-1.0), at(1.0));
    (high - value).max(value - low) + 24.0 * U * high + 1e12 * FLUSHED
}

/// gltf_reflection: its three factors, each with the errors of its arguments, and 8 u.
pub fn gltf_reflection(directions: [DVec3; 3], shininess: f64, specular: DVec3) -> Allowed {
    let [normal, light, viewer] = directions;
    let sum = light + viewer;
    let sine_squared = microfacets::sine_squared_to_half(normal, sum);
    let alpha = 2.0 / (shininess.max(0.0) + 2.0);
    let alpha_squared = Off { value: alpha, error: 6.0 * U * alpha };
    let cosine = |other: DVec3| Off { value: normal.dot(other), error: vectors::dot(normal, other) };
    let (n_light, n_viewer) = (cosine(light), cosine(viewer));
    let density = optics::distribution_ggx(sine_squared.value, alpha);
    let of_density = distribution_ggx(sine_squared, alpha_squared);
    let geometry = optics::smith_attenuation(n_light.value, n_viewer.value, alpha);
    let of_geometry = smith_attenuation(n_light, n_viewer, alpha_squared);
    let v_half = 0.5 * sum.length_squared().max(1e-30).sqrt();
    let fresnel = optics::fresnel_schlick(v_half, specular);
    let of_v_half = microfacets::cosine_to_half(sum);
    let at = |cosine: f64| optics::fresnel_schlick(cosine, specular);
    let of_fresnel = (at(v_half - of_v_half) - fresnel).abs().max((at(v_half + of_v_half) - fresnel).abs())
        + refraction::fresnel_schlick(v_half, specular);
    let peak = optics::lobe_peak(shininess);
    // The factor is clamped to 1.3e5.
    let lobe = (peak * density * geometry).min(1.3e5);
    let of_lobe = peak * (of_density * (geometry + of_geometry) + density * of_geometry) + 4.0 * U * lobe;
    let error = fresnel.abs() * of_lobe
        + of_fresnel * (lobe + of_lobe)
        + 2.0 * U * fresnel.abs() * lobe
        + DVec3::splat(FLUSHED * 1e12);
    let open = vectors::is_open(normal, light) || vectors::is_open(normal, viewer);
    let in_front = n_light.value > 0.0 && n_viewer.value > 0.0;
    let other = fresnel * if in_front { 0.0 } else { lobe };
    Allowed::from(error).or(open, || Numbers::from_slice(&other.to_array()))
}

/// lobe_albedo: 20 u. α is off by 12 u (a sum, a quotient and a root), where the polynomial's slope is at most .75;
/// its steps are below 2.3 in size, and each is multiplied by α.
pub fn lobe_albedo() -> f64 {
    20.0 * U
}

/// metal_reflectance: that of the albedo, and 5 u of the coefficient; .04 is off by 1 u of itself, before 1/.96. A smaller
/// 1 - k_d is off by u.
pub fn metal_reflectance(specular: DVec3, shininess: f64) -> Allowed {
    let value = optics::metal_reflectance(DVec3::ZERO, specular, shininess).max(DVec3::ONE);
    Allowed::from(value * (5.0 * U) + (specular.abs() / 0.96) * (lobe_albedo() + U) + FLUSHED)
}
