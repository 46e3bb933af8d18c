//! Blinn's model of 1977 after Torrance and Sparrow: D G F / (n·v), for microfacets that are mirrors and shadow one
//! another. The simpler `blinn_phong` only uses its half vector.

use glam::DVec3;

use crate::fresnel::fresnel_dielectric;
use crate::microfacets::distribution_trowbridge_reitz;
use crate::normalization::{TINY_LENGTH_SQUARED, safe_normalize};

/// Smallest n·v that is divided by. It limits the factor to 10⁴ where light and viewer both graze the surface.
pub const MINIMUM_VIEW_COSINE: f64 = 1e-4;

/// Returns G/(n·v) with G = min(1, 2 n·h n·v / v·h, 2 n·h n·l / v·h), from n·l, n·v, n·h of the half vector h, and
/// v·h.
///
/// Each term is divided by n·v separately, which cancels the n·v of the second. The result is clamped to [0, 10⁴].
///
/// # Error of the f32 twin
///
/// 13 u relative: two divisions, a product, two rounded clamps, and no differences.
pub fn geometric_attenuation(n_light: f64, n_viewer: f64, n_half: f64, v_half: f64) -> f64 {
    let viewer = n_viewer.max(MINIMUM_VIEW_COSINE);
    let ratio = 2.0 * n_half.max(0.0) / v_half.max(MINIMUM_VIEW_COSINE);
    (1.0 / viewer).min(ratio).min(ratio * n_light.max(0.0) / viewer)
}

/// Returns D G / (n·v) with the distribution of Trowbridge and Reitz, in [0, 10⁴]; 0 unless both light and viewer
/// are in front. This is the model without its Fresnel factor, for conductors. All directions are unit vectors.
///
/// # Error of the f32 twin
///
/// D: that of [`distribution_trowbridge_reitz`] for a sine that is off by about 12 u (of n × h, with h off by 9 u):
/// 10⁻³ relative at n = 10⁶, where the lobe is .002 wide. G/(n·v): 13 u, plus its changes over the errors of its
/// cosines, 3 u Σ|n l|, 3 u Σ|n v|, 12 u Σ|n h| and 12 u of v·h; those are divided by n·v, so they matter where the
/// viewer grazes the surface. Where n·l or n·v is within rounding of 0, the result may be that of either side.
pub fn torrance_sparrow_geometry(normal: DVec3, light: DVec3, viewer: DVec3, shininess: f64) -> f64 {
    let (n_light, n_viewer) = (normal.dot(light), normal.dot(viewer));
    if n_light <= 0.0 || n_viewer <= 0.0 {
        return 0.0;
    }
    let sum = light + viewer;
    let half = safe_normalize(sum);
    let sine_squared = normal.cross(half).length_squared();
    let distribution = distribution_trowbridge_reitz(sine_squared, shininess);
    distribution * geometric_attenuation(n_light, n_viewer, normal.dot(half), cosine_to_half(sum))
}

/// Returns v·h = l·h = |l + v|/2 for unit l and v, which avoids the cancellation of v·(l + v) near l = -v.
fn cosine_to_half(sum: DVec3) -> f64 {
    0.5 * sum.length_squared().max(TINY_LENGTH_SQUARED).sqrt()
}

/// Returns D G F / (n·v) for a dielectric of index `ior` in air; 0 unless both light and viewer are in front of the
/// surface.
///
/// `shininess` is the exponent of n·h at whose half-value angle D falls to a half. Like the other specular factors
/// it is multiplied by k_s and the light's colour, and not by n·l. As a reflectance it is reciprocal: its product
/// with n·v is symmetric in l and v.
///
/// # Error of the f32 twin
///
/// [`torrance_sparrow_geometry`]'s error times F, [`fresnel_dielectric`]'s for a cosine that is off by 12 u times
/// the other factors, and u.
pub fn torrance_sparrow(normal: DVec3, light: DVec3, viewer: DVec3, shininess: f64, ior: f64) -> f64 {
    let fresnel = fresnel_dielectric(cosine_to_half(light + viewer), ior);
    torrance_sparrow_geometry(normal, light, viewer, shininess) * fresnel
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::microfacets::half_value_angle;

    fn at(angle: f64) -> DVec3 {
        DVec3::new(angle.sin(), angle.cos(), 0.0)
    }

    #[test]
    fn straight_down_it_is_fresnel_alone() {
        for shininess in [0.0, 1.0, 1e6] {
            assert!((torrance_sparrow(DVec3::Y, DVec3::Y, DVec3::Y, shininess, 1.5) - 0.04).abs() < 1e-15);
        }
    }

    #[test]
    fn in_the_mirror_direction() {
        // D = 1; n·h = 1 and v·h = cos θ, so G = min(1, 2) = 1.
        for degrees in [10.0, 45.0, 80.0] {
            let angle = f64::to_radians(degrees);
            let expected = fresnel_dielectric(angle.cos(), 1.5) / angle.cos();
            let got = torrance_sparrow(DVec3::Y, at(angle), at(-angle), 50.0, 1.5);
            // n × h is a rounding, 2⁻⁵³; the rest are five operations and a division by a cosine of .17.
            assert!((got / expected - 1.0).abs() < 1e-14, "{degrees}: {got} {expected}");
        }
    }

    #[test]
    fn off_the_mirror_direction_by_the_half_value_angle() {
        // Light and viewer both at β: h = l = v, n·h = cos β, v·h = 1, so G = min(1, 2 cos² β).
        let beta = half_value_angle(3.0);
        let got = torrance_sparrow(DVec3::Y, at(beta), at(beta), 3.0, 1.5);
        let expected = 0.5 * 0.04 * (2.0 * beta.cos().powi(2)).min(1.0) / beta.cos();
        assert!((got / expected - 1.0).abs() < 1e-13, "{got} {expected}");
    }

    #[test]
    fn masking_takes_over_when_it_grazes() {
        // n·v = cos 85 degrees, the light straight above: v·h = cos 42.5 degrees = n·h, so G = 2 n·v and G/(n·v) =
        // 2.
        let viewer = f64::to_radians(85.0);
        let got = geometric_attenuation(1.0, viewer.cos(), (0.5 * viewer).cos(), (0.5 * viewer).cos());
        assert!((got - 2.0).abs() < 1e-15, "{got}");
    }

    #[test]
    fn grazing_stays_bounded() {
        for light_height in [1e-300, 1e-12, 1e-6, 1e-3, 1.0] {
            for viewer_height in [1e-300, 1e-12, 1e-6, 1e-3, 1.0] {
                let light = DVec3::new(1.0, light_height, 0.0).normalize();
                let viewer = DVec3::new(-1.0, viewer_height, 0.0).normalize();
                for shininess in [0.0, 1.0, 1e6] {
                    let value = torrance_sparrow(DVec3::Y, light, viewer, shininess, 1.5);
                    assert!((0.0..=1.0 / MINIMUM_VIEW_COSINE).contains(&value), "{light} {viewer}: {value}");
                }
            }
        }
    }

    #[test]
    fn behind_the_surface_there_is_nothing() {
        assert_eq!(torrance_sparrow(DVec3::Y, -DVec3::Y, DVec3::Y, 1.0, 1.5), 0.0);
        assert_eq!(torrance_sparrow(DVec3::Y, DVec3::Y, -DVec3::Y, 1.0, 1.5), 0.0);
        assert_eq!(torrance_sparrow(DVec3::ZERO, DVec3::Y, DVec3::Y, 1.0, 1.5), 0.0);
        assert_eq!(torrance_sparrow(DVec3::Y, DVec3::Y, DVec3::ZERO, 1.0, 1.5), 0.0);
    }
}
