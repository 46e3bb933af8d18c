//! Bounds of Fresnel's reflectance and Snell's law.

use glam::DVec3;

use super::lobes::{OffVector, cosine_lobe};
use super::powers::Off;
use super::{Allowed, FLUSHED, Numbers, U, vectors};

/// The smallest index that the functions for Snell's law use.
const SMALLEST_INDEX: f64 = 1e-2_f32 as f64;

/// The square root of a number that is off by `error`, with 9 u of its own: 1/inverseSqrt.
fn root(square: f64, error: f64) -> Off {
    let value = square.max(0.0).sqrt();
    let (low, high) = ((square - error).max(0.0).sqrt(), (square + error).max(0.0).sqrt());
    Off { value, error: (high - value).max(value - low) + 9.0 * U * high + FLUSHED.sqrt() * 1e-8 }
}

/// g² = (η - 1)(η + 1) + cos²: 3 u of the first term, u of the second, u of the sum, and the effect of the cosine's
/// error.
fn g(index: Off, cosine: Off) -> (f64, Off) {
    let difference = (index.value - 1.0) * (index.value + 1.0);
    let square = cosine.value * cosine.value;
    let value = difference + square;
    let brought = cosine.error * (2.0 * cosine.value.abs() + cosine.error)
        + index.error * (2.0 * index.value + index.error);
    let error = U * (3.0 * difference.abs() + square + value.abs()) + brought + 2.0 * FLUSHED;
    (error, root(value, error))
}

/// fresnel_dielectric: each amplitude (x - y)/(x + y) is off by 2 (y δx + x δy)/(x + y)² and 7 u of itself; F is
/// off by the amplitudes times their errors, and 2 u. Cosine and index may be off themselves.
pub fn fresnel_dielectric(cosine: Off, eta: Off) -> f64 {
    let cosine = Off { value: cosine.value.clamp(0.0, 1.0), ..cosine };
    let index = eta.value.clamp(1e-4, 1e4);
    let (_, g) = g(Off { value: index, ..eta }, cosine);
    let part = |x: Off| {
        let least = ((x.value - x.error).max(0.0) + (g.value - g.error).max(0.0)).max(1e-15);
        let sum = (x.value + g.value).max(1e-15);
        let amplitude = (x.value - g.value) / sum;
        let moved = 2.0 * (g.value + g.error) * x.error + 2.0 * (x.value + x.error) * g.error;
        let error = (moved / (least * least.max(sum * 0.5))).min(2.0) + 7.0 * U * amplitude.abs();
        amplitude.abs() * error + 0.5 * error * error
    };
    let along = index * index * cosine.value;
    let reflectance = lumbre_optics::fresnel_dielectric(cosine.value, eta.value);
    let of_index = eta.error * (2.0 * index + eta.error) * cosine.value;
    let along = Off { value: along, error: 3.0 * U * along + index * index * cosine.error + of_index };
    (part(cosine) + part(along) + 2.0 * U * reflectance).min(1.0)
}

/// fresnel_normal_reflectance, one channel: the index (1 + r)/(1 - r) of a root r that is off by 9 u, with 7 u for
/// its own sum, difference and quotient.
pub fn fresnel_normal_reflectance(cosine: Off, reflectance: f64) -> f64 {
    let root = reflectance.max(0.0).sqrt().min(f64::from(0.9998f32));
    let index = (1.0 + root) / (1.0 - root);
    // Reflectances below the normal numbers may be flushed to zero.
    let of_root = 9.0 * U * root + if reflectance.abs() < 2.0 * FLUSHED { FLUSHED.sqrt() * 2.0 } else { 0.0 };
    let of_index = index * 7.0 * U + 2.0 * of_root / ((1.0 - root) * (1.0 - root));
    fresnel_dielectric(cosine, Off { value: index, error: of_index })
}

/// fresnel_conductor, one channel: the complex root's parts a and b with the errors of what they are roots of, then
/// two quotients of sums of squares.
pub fn fresnel_conductor(cosine: Off, eta: f64, absorption: f64) -> f64 {
    let of_cosine = cosine.error;
    let (c, n, k) = (cosine.value.clamp(0.0, 1.0), eta.clamp(0.0, 1e4), absorption.clamp(0.0, 1e4));
    let sine_squared = (1.0 - c) * (1.0 + c);
    let difference = (n - k) * (n + k);
    let real = difference - sine_squared;
    let of_sine_squared = 3.0 * U * sine_squared + of_cosine * (2.0 * c + of_cosine);
    let of_real = U * (3.0 * difference.abs() + real.abs()) + of_sine_squared + FLUSHED;
    let product = n * k;
    let modulus_squared = real * real + 4.0 * product * product;
    let of_square =
        2.0 * real.abs() * of_real + of_real * of_real + 5.0 * U * modulus_squared + 4.0 * FLUSHED;
    let modulus = root(modulus_squared, of_square);
    let larger_squared = 0.5 * (modulus.value + real.abs());
    let larger = root(larger_squared, 0.5 * (modulus.error + of_real) + U * larger_squared);
    let smaller = product / larger.value.max(1e-30);
    let least = (larger.value - larger.error).max(1e-30);
    let smaller = Off {
        value: smaller,
        error: (product / least - smaller).abs() + 7.0 * U * smaller + FLUSHED / least,
    };
    // Which of the two is the larger changes where the real part changes sign; there they are nearly equal.
    let swap = if real.abs() <= of_real { (larger.value - smaller.value).abs() } else { 0.0 };
    let (a, b) = if real > 0.0 { (larger, smaller) } else { (smaller, larger) };
    let (of_a, of_b) = (a.error + swap, b.error + swap);
    let (a, b) = (a.value, b.value);
    // (x² + y²)/(z² + w²), with the errors of x and z, and of y and w.
    let quotient = |x: f64, of_x: f64, z: f64, of_z: f64, y: f64, of_y: f64| {
        let square = |x: f64, e: f64| 2.0 * x.abs() * e + e * e + 2.0 * U * x * x;
        let (above, below) = (x * x + y * y, z * z + y * y);
        let of_above = square(x, of_x) + square(y, of_y) + U * above + 2.0 * FLUSHED;
        let of_below = square(z, of_z) + square(y, of_y) + U * below + 2.0 * FLUSHED;
        let value = above / below.max(1e-30);
        let error = (of_above + value * of_below) / (below - of_below).max(1e-30) + 5.0 * U * value;
        (value, error.min(1.0))
    };
    let (across, of_across) =
        quotient(c - a, of_a + of_cosine + U * (c - a).abs(), c + a, of_a + of_cosine + U * (c + a), b, of_b);
    let ca = c * a;
    let of_ca = c * of_a + a * of_cosine + U * ca;
    let (minus, plus) = (ca - sine_squared, ca + sine_squared);
    let of_sum = |sum: f64| of_ca + of_sine_squared + U * sum.abs();
    let (along, of_along) =
        quotient(minus, of_sum(minus), plus, of_sum(plus), c * b, c * of_b + b * of_cosine + U * c * b);
    let reflectance = 0.5 * across * (1.0 + along);
    0.5 * of_across * (1.0 + along + of_along) + 0.5 * across * of_along + 3.0 * U * reflectance
}

/// fresnel_schlick: 10 u of (1 - f0)(1 - cos)⁵, and u of the sum.
pub fn fresnel_schlick(cosine: f64, f0: DVec3) -> DVec3 {
    let away = (1.0 - cosine.clamp(0.0, 1.0)).powi(5);
    let sum = lumbre_optics::fresnel_schlick(cosine, f0).abs();
    10.0 * U * away * (DVec3::ONE - f0).abs() + U * sum + DVec3::splat(2.0 * FLUSHED)
}

/// transmitted_cosine: s = sin/eta is off by 7 u of itself, so 1 - s² by 14 u s² and 3 u of itself; then its root.
pub fn transmitted_cosine(sine: f64, eta: f64) -> f64 {
    let s = sine.max(0.0) / eta.max(SMALLEST_INDEX);
    let square = (1.0 - s) * (1.0 + s);
    root(square, U * (14.0 * s * s + 3.0 * square.abs())).error
}

/// transmitted_direction: cos - g with their errors, times n; minus l; normalized from the length eta. Either side
/// of total reflection where g² is within its error of 0.
pub fn transmitted_direction(normal: DVec3, light: DVec3, eta: f64) -> Allowed {
    let index = eta.clamp(SMALLEST_INDEX, 1e4);
    let cosine = Off { value: normal.dot(light), error: vectors::dot(normal, light) };
    let (of_square, g) = g(Off::exact(index), cosine);
    let square = (index - 1.0) * (index + 1.0) + cosine.value * cosine.value;
    let bent = cosine.value - g.value;
    let of_bent = cosine.error + g.error + U * bent.abs();
    let sum = bent * normal - light;
    let of_sum =
        of_bent * normal.abs() + U * ((bent * normal).abs() + sum.abs()) + DVec3::splat(3.0 * FLUSHED);
    let unit = lumbre_optics::safe_normalize(sum);
    // An error along the direction itself is normalized away, and one across it remains. Their sum bounds both.
    let moved = (2.0 * of_sum.length() / sum.length().max(1e-15)).min(2.0);
    let error = vectors::safe_normalize(sum) + DVec3::splat(moved);
    let other = if square < 0.0 { unit } else { DVec3::ZERO };
    Allowed::from(error).or(square.abs() <= of_square, || Numbers::from_slice(&other.to_array()))
}

/// transmitted_highlight: the lobe around that direction. Either side of its three conditions.
pub fn transmitted_highlight(
    normal: DVec3,
    light: DVec3,
    viewer: DVec3,
    shininess: f64,
    eta: f64,
    sharp: bool,
) -> Allowed {
    let index = eta.clamp(SMALLEST_INDEX, 1e4);
    let direction = transmitted_direction(normal, light, eta);
    let cosine = normal.dot(light);
    let g_squared = ((index - 1.0) * (index + 1.0) + cosine * cosine).max(0.0);
    let value = lumbre_optics::safe_normalize((cosine - g_squared.sqrt()) * normal - light);
    let axis = OffVector { value, error: DVec3::from_slice(&direction.error) };
    let error = cosine_lobe(axis, OffVector::exact(viewer), Off::exact(shininess), sharp);
    let open =
        direction.other.is_some() || vectors::is_open(normal, light) || vectors::is_open(normal, viewer);
    let here = lumbre_optics::transmitted_highlight(normal, light, viewer, shininess, eta);
    Allowed::from(error).or(open, || {
        let lobe = lumbre_optics::cosine_lobe(value, viewer, shininess);
        Numbers::from_slice(&[if here > 0.0 { 0.0 } else { lobe }])
    })
}
