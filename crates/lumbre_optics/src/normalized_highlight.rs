//! Normalized highlights: factors on the specular term with which a surface with k_s = 1 reflects at most the light
//! that it receives, for every exponent. The plain models, whose highlights are 1 at the peak and gain or lose
//! energy with the exponent, are in their own modules.
//!
//! The documents' models, OpenGL and this renderer's frames use the plain factors, where k_s is a brightness. Use
//! the functions here where k_s has to be the reflected fraction of the light: to set materials by measured
//! reflectance, to keep an object's brightness when its exponent changes, to compare with a path tracer or a
//! physically based renderer, or as the reflectance for a photon or a ray.
//!
//! As everywhere in this crate a light's colour is irradiance/π, so a factor f stands for the BRDF f/(π n·l). The
//! constants are therefore those of the literature times π, and the Phong and Blinn-Phong forms contain the cosine
//! n·l, which the plain factors lack.

use std::f64::consts::{FRAC_PI_2, LN_2};

use glam::DVec3;

use crate::blinn_phong::blinn_phong;
use crate::lambert::lambert;
use crate::microfacet_reflection::Distribution;
use crate::microfacets::{half_value_angle, trowbridge_reitz_width_squared};
use crate::phong::phong;

/// Beyond this exponent 2^(-n/2) is negligible beside n, and f32's exp2 is not evaluated further.
const LARGEST_EXPONENT: f64 = 200.0;

/// Returns (n + 2)/2: Phong's lobe as a BRDF is (n + 2)/(2 π) (r·v)ⁿ (Lewis 1994). It is exact at normal incidence;
/// at other angles less light is reflected, as part of the lobe is behind the surface.
///
/// # Error of the f32 twin
///
/// u, for the sum.
pub fn phong_normalization(shininess: f64) -> f64 {
    0.5 * (shininess.max(0.0) + 2.0)
}

/// Returns (n + 2)(n + 4)/(8 (2^(-n/2) + n)), which is exact at normal incidence, where the lobe of the half vector
/// is cut off at 45 degrees.
///
/// The common (n + 8)/8 approximates it and gains up to 7.5 % (at n = 9).
///
/// # Error of the f32 twin
///
/// 9 u, plus exp2's 2 u (3 + n) 2^(-n/2)/(2^(-n/2) + n): at most 15 u.
pub fn blinn_phong_normalization(shininess: f64) -> f64 {
    let n = shininess.max(0.0);
    (n + 2.0) * ((n + 4.0) / (8.0 * ((-0.5 * n.min(LARGEST_EXPONENT)).exp2() + n)))
}

/// Returns [`phong`] normalized: (n + 2)/2 (r·v)ⁿ (n·l). Like the plain factor it is multiplied by k_s and the
/// light's colour.
///
/// # Error of the f32 twin
///
/// [`phong`]'s error times the other factors, 3 u Σ|n l| of the factor on the cosine, and 3 u.
pub fn normalized_phong(normal: DVec3, light: DVec3, viewer: DVec3, shininess: f64) -> f64 {
    phong_normalization(shininess) * phong(normal, light, viewer, shininess) * lambert(normal, light)
}

/// Returns [`blinn_phong`] normalized, with the cosine n·l.
///
/// # Error of the f32 twin
///
/// [`blinn_phong`]'s error times the other factors, 3 u Σ|n l| of the factor on the cosine, and 17 u.
pub fn normalized_blinn_phong(normal: DVec3, light: DVec3, viewer: DVec3, shininess: f64) -> f64 {
    let factor = blinn_phong(normal, light, viewer, shininess);
    blinn_phong_normalization(shininess) * factor * lambert(normal, light)
}

/// Returns π/(4 ∫ D cos dω), the factor for D G F/(n·v) of [`microfacet_lobe`](crate::microfacet_lobe) and of
/// Torrance and Sparrow's model. With it the projected areas of the microfacets add up to that of the surface, and
/// with Blinn's G no light is gained (the cavities of Torrance and Sparrow conserve it; Heitz 2014).
///
/// It is (n + 2)/8 for cosine powers and 1/(4 c₃²) for Trowbridge and Reitz; the Gaussian's integral has no closed
/// form and is computed numerically. Below exponents of 6 (cosine power) to 10 (Trowbridge and Reitz) it is less
/// than 1: there the plain model may reflect more light than it receives.
///
/// The factor depends on the material and not on the point, and is meant to be multiplied into k_s, so it has no
/// WGSL twin.
pub fn microfacet_normalization(distribution: Distribution, shininess: f64) -> f64 {
    match distribution {
        Distribution::CosinePower => 0.125 * (shininess.max(0.0) + 2.0),
        Distribution::Gaussian => 0.25 / gaussian_area(half_value_angle(shininess).max(SMALLEST_ANGLE)),
        Distribution::TrowbridgeReitz => 0.25 / trowbridge_reitz_width_squared(shininess),
    }
}

/// Smallest half-value angle of a Gaussian, as in `microfacets`.
const SMALLEST_ANGLE: f64 = 1e-6;

/// Returns ∫ D cos dω/π = ∫ exp(-ln 2 (α/β)²) sin 2α dα from 0 to π/2, by Simpson's rule up to ten half-value
/// angles, beyond which nothing is left. The relative error is 10⁻⁸.
fn gaussian_area(beta: f64) -> f64 {
    const STEPS: u32 = 512;
    let end = FRAC_PI_2.min(10.0 * beta);
    let width = end / f64::from(STEPS);
    let sum: f64 = (0..=STEPS)
        .map(|step| {
            let angle = width * f64::from(step);
            let weight = match step {
                0 | STEPS => 1.0,
                _ if step % 2 == 1 => 4.0,
                _ => 2.0,
            };
            weight * (-LN_2 * (angle / beta).powi(2)).exp() * (2.0 * angle).sin()
        })
        .sum();
    sum * width / 3.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exponent_zero_is_lambert() {
        // With exponent 0 the lobe is 1 everywhere, and reflects k_s of the light evenly.
        assert_eq!(phong_normalization(0.0), 1.0);
        assert_eq!(blinn_phong_normalization(0.0), 1.0);
        let light = DVec3::new(0.6, 0.8, 0.0);
        assert_eq!(normalized_phong(DVec3::Y, light, DVec3::Y, 0.0), 0.8);
        assert_eq!(normalized_blinn_phong(DVec3::Y, light, DVec3::Y, 0.0), 0.8);
    }

    #[test]
    fn sharp_lobes_grow_as_known() {
        // Half and an eighth of n, as the half vector turns by half the angle.
        assert!((phong_normalization(1e6) / 5e5 - 1.0).abs() < 3e-6);
        assert!((blinn_phong_normalization(1e6) / 1.25e5 - 1.0).abs() < 7e-6);
        // Four times the exponent gives a highlight of the same width: n/2 and 4 n/8.
        assert!((blinn_phong_normalization(4e6) / phong_normalization(1e6) - 1.0).abs() < 1e-5);
    }

    #[test]
    fn the_usual_constant_gains_seven_and_a_half_per_cent() {
        let gain = |n: f64| (n + 8.0) / 8.0 / blinn_phong_normalization(n);
        let (at, most) = (0..2000).map(|step| f64::from(step) * 0.01).map(|n| (n, gain(n))).fold(
            (0.0, 0.0),
            |most, one| {
                if one.1 > most.1 { one } else { most }
            },
        );
        assert!((most - 1.0752).abs() < 1e-4 && (at - 9.0).abs() < 0.5, "{at} {most}");
    }

    /// ∫ D cos dω by the midpoint rule in sin².
    fn projected_area(density: impl Fn(f64, f64) -> f64) -> f64 {
        let steps = 1_000_000;
        let sum: f64 = (0..steps)
            .map(|step| {
                let sine_squared = (f64::from(step) + 0.5) / f64::from(steps);
                density((1.0 - sine_squared).sqrt(), sine_squared)
            })
            .sum();
        sum * std::f64::consts::PI / f64::from(steps)
    }

    #[test]
    fn microfacets_cover_the_surface_once() {
        use crate::microfacets::{
            distribution_cosine_power, distribution_gaussian, distribution_trowbridge_reitz,
        };
        for n in [0.0, 1.0, 10.0, 300.0] {
            let covered = |distribution, area: f64| {
                4.0 * microfacet_normalization(distribution, n) * area / std::f64::consts::PI
            };
            let power = projected_area(|c, s| distribution_cosine_power(c, s, n));
            let tail = projected_area(|_, s| distribution_trowbridge_reitz(s, n));
            let bell = projected_area(|c, s| distribution_gaussian(c, s, n));
            // The rule's error is (1/steps)² times a curvature of up to n², over an area of 1/n.
            assert!((covered(Distribution::CosinePower, power) - 1.0).abs() < 1e-6, "{n}");
            assert!((covered(Distribution::TrowbridgeReitz, tail) - 1.0).abs() < 1e-6, "{n}");
            assert!((covered(Distribution::Gaussian, bell) - 1.0).abs() < 1e-6, "{n}");
        }
    }
}
