//! Bounds of highlights: the lobes of Phong and Blinn, their widening, the exponent of a roughness.

use glam::DVec3;

use super::powers::{self, Off};
use super::{Allowed, FLUSHED, Numbers, U, vectors};

/// A vector and how much each of its components may be off.
#[derive(Clone, Copy)]
pub struct OffVector {
    pub value: DVec3,
    pub error: DVec3,
}

impl OffVector {
    pub fn exact(value: DVec3) -> Self {
        Self { value, error: DVec3::ZERO }
    }
}

/// cosine_lobe: the cosine and the squared sine with their roundings and the errors of the vectors, then
/// `power_of_cosine`. Without SHARP_HIGHLIGHTS it is the power of the cosine, which depends on the vectors'
/// lengths, so the difference between the two forms is added.
pub fn cosine_lobe(axis: OffVector, direction: OffVector, exponent: Off, sharp: bool) -> f64 {
    let (a, b) = (axis.value, direction.value);
    let value = a.dot(b);
    let cosine = Off { value, error: vectors::dot_of(a, axis.error, b, direction.error) };
    if !sharp {
        let forms = lumbre_optics::cosine_lobe(a, b, exponent.value)
            - lumbre_optics::safe_pow(cosine.value, exponent.value);
        return forms.abs() + powers::safe_pow(cosine, exponent);
    }
    let brought = vectors::cross_size(axis.error, b) + vectors::cross_size(a, direction.error);
    let of_cross = (2.0 * U * vectors::cross_size(a, b) + brought).length() + 4.0 * FLUSHED;
    let sine = a.cross(b).length();
    let of_square = of_cross * (2.0 * sine + of_cross) + 3.0 * U * sine * sine + 6.0 * FLUSHED;
    powers::power_of_cosine(cosine, Off { value: sine * sine, error: of_square }, exponent)
}

/// Accepts either side of the condition n·l > 0 if n·l is within its rounding of 0.
fn gated(error: f64, normal: DVec3, light: DVec3, lobe: impl FnOnce() -> f64) -> Allowed {
    Allowed::from(error).or(vectors::is_open(normal, light), || {
        let other = if normal.dot(light) > 0.0 { 0.0 } else { lobe() };
        Numbers::from_slice(&[other])
    })
}

/// phong: the lobe around a reflected direction that is itself off.
pub fn phong(normal: DVec3, light: DVec3, viewer: DVec3, shininess: f64, sharp: bool) -> Allowed {
    let value = lumbre_optics::reflected_direction(normal, light);
    let axis = OffVector { value, error: vectors::reflected_direction(normal, light) };
    let error = cosine_lobe(axis, OffVector::exact(viewer), Off::exact(shininess), sharp);
    gated(error, normal, light, || lumbre_optics::cosine_lobe(value, viewer, shininess))
}

/// The half-vector lobe for an exponent that may be off; h is off by 9 u per component.
fn blinn(normal: DVec3, light: DVec3, viewer: DVec3, exponent: Off, sharp: bool) -> Allowed {
    let value = lumbre_optics::half_vector(light, viewer);
    let half = OffVector { value, error: vectors::normalized_sum(light + viewer) };
    let error = cosine_lobe(OffVector::exact(normal), half, exponent, sharp);
    gated(error, normal, light, || lumbre_optics::cosine_lobe(normal, value, exponent.value))
}

pub fn blinn_phong(normal: DVec3, light: DVec3, viewer: DVec3, shininess: f64, sharp: bool) -> Allowed {
    blinn(normal, light, viewer, Off::exact(shininess), sharp)
}

/// blinn_phong_4n: 4 n is exact.
pub fn blinn_phong_4n(normal: DVec3, light: DVec3, viewer: DVec3, shininess: f64, sharp: bool) -> Allowed {
    blinn(normal, light, viewer, Off::exact(4.0 * shininess), sharp)
}

/// blinn_phong_matched: 4 n cos θ_i has the cosine's error and one rounding.
pub fn blinn_phong_matched(
    normal: DVec3,
    light: DVec3,
    viewer: DVec3,
    shininess: f64,
    sharp: bool,
) -> Allowed {
    let value = 4.0 * shininess * lumbre_optics::lambert(normal, light);
    let error = 4.0 * shininess * vectors::dot(normal, light) + U * value;
    blinn(normal, light, viewer, Off { value, error }, sharp)
}

/// phong_normalization: u, for the sum.
pub fn phong_normalization(shininess: f64) -> f64 {
    U * lumbre_optics::phong_normalization(shininess)
}

/// blinn_phong_normalization: 9 u, and exp2's error in the sum 2^(-n/2) + n.
pub fn blinn_phong_normalization(shininess: f64) -> f64 {
    let n = shininess.max(0.0);
    let half = 0.5 * n.min(200.0);
    let power = (-half).exp2();
    let relative = 9.0 * U + powers::exponential(half) * power / (power + n);
    lumbre_optics::blinn_phong_normalization(shininess) * relative
}

/// A plain lobe times its constant and n·l: the lobe's error and the cosine's error times the other factors, and
/// two products.
fn normalized(
    bare: Allowed,
    lobe: f64,
    (constant, error): (f64, f64),
    cosine: f64,
    of_cosine: f64,
) -> Allowed {
    let of_lobe = bare.error[0];
    let size = constant * (lobe + of_lobe) * (cosine + of_cosine);
    let own = constant * (of_lobe * (cosine + of_cosine) + lobe * of_cosine);
    let roundings = (error / constant + 2.0 * U) * size;
    let other = bare.other.map(|other| Numbers::from_slice(&[constant * other[0] * cosine]));
    Allowed { error: Numbers::from_slice(&[own + roundings + constant * FLUSHED + FLUSHED]), other }
}

/// normalized_phong.
pub fn normalized_phong(normal: DVec3, light: DVec3, viewer: DVec3, shininess: f64, sharp: bool) -> Allowed {
    let lobe = lumbre_optics::phong(normal, light, viewer, shininess);
    let constant = (lumbre_optics::phong_normalization(shininess), phong_normalization(shininess));
    let cosine = lumbre_optics::lambert(normal, light);
    let bare = phong(normal, light, viewer, shininess, sharp);
    normalized(bare, lobe, constant, cosine, vectors::dot(normal, light))
}

/// normalized_blinn_phong.
pub fn normalized_blinn_phong(
    normal: DVec3,
    light: DVec3,
    viewer: DVec3,
    shininess: f64,
    sharp: bool,
) -> Allowed {
    let lobe = lumbre_optics::blinn_phong(normal, light, viewer, shininess);
    let constant =
        (lumbre_optics::blinn_phong_normalization(shininess), blinn_phong_normalization(shininess));
    let cosine = lumbre_optics::lambert(normal, light);
    let bare = blinn_phong(normal, light, viewer, shininess, sharp);
    normalized(bare, lobe, constant, cosine, vectors::dot(normal, light))
}

/// lobe_widening: two roundings; the constant .18 is rounded once.
pub fn lobe_widening(squared_change_x: f64, squared_change_y: f64) -> f64 {
    2.0 * U * lumbre_optics::lobe_widening(squared_change_x, squared_change_y) + FLUSHED
}

/// filtered_lobe: 15 u of the exponent and 16 u / scale, because of the difference of α'² from 1; 20 u of the peak.
pub fn filtered_lobe(shininess: f64, scale: f64, widening: f64) -> [f64; 2] {
    let lobe = lumbre_optics::filtered_lobe(shininess, scale, widening);
    [15.0 * U * lobe.shininess + 16.0 * U / scale + FLUSHED, 20.0 * U * lobe.peak]
}

/// shininess_from_roughness: 9 u of n + 2, which is 2/α².
pub fn shininess_from_roughness(shininess: f64) -> f64 {
    9.0 * U * (shininess + 2.0)
}
