//! Energy-conserving highlights: the specular term of glTF's metallic-roughness materials (glTF 2.0, appendix
//! B.3), and the lobes of Phong and Blinn with the same brightness. In the documents' highlights, which are bare
//! powers of a cosine, k_s is the brightness at the peak; here it is the fraction of the light that a surface
//! reflects when it is lit along its normal.
//!
//! The exponent n = 2/α² - 2 of n·h stands for the roughness throughout. A highlight of that width that reflects
//! the fraction k_s of the light is 1/(4 α²) = (n + 2)/8 times as bright at its peak, and is proportional to n·l.
//!
//! **Which exponents.** Blinn's lobe takes n as it is. The angle of Phong's r·v is twice that of n·h, so Phong's
//! lobe takes n/4, and so do the two half-vector forms of Phong's exponent. Compared with appendix B under a point
//! light, on balls of six roughnesses from .15 to 1 and three metalnesses, the best factors of the exponent are
//! 0.98 (Blinn), .273 (Phong) and .274 (matched Blinn). Using 1 and 1/4 instead costs a hundredth of the error. The
//! test `gltf_materials` prints the table.
//!
//! **The constant.** (n + 2)/8 is the constant of microfacets, whose projected areas add up to that of the surface.
//! The constants that conserve each lobe's own energy
//! ([`blinn_phong_normalization`](crate::blinn_phong_normalization)) are three times as far from appendix B, whose
//! rough surfaces lose the light that is scattered between microfacets: a metal of roughness 1 reflects half as
//! much as they predict.

use glam::DVec3;

use crate::fresnel::fresnel_schlick;
use crate::normalization::{TINY_LENGTH_SQUARED, safe_normalize};

/// Upper limit of a highlight's factor: its value at the peak of the largest exponent. At grazing angles the
/// specification goes up to 700 times as high, which would overflow f32 with two strong lamps.
const LARGEST_LOBE: f64 = 1.3e5;

/// Smallest number that the Smith term divides by.
const TINY_DIVISOR: f64 = 1e-30;
/// The α² that belongs to an exponent of 10⁶.
const SMOOTHEST: f64 = 1.998e-6;
/// A lower limit below the α² of any exponent.
const TINY_ALPHA_SQUARED: f64 = 1e-37;

/// Returns (n + 2)/8: the factor at the peak of a highlight with the exponent n of n·h that reflects all light.
///
/// # Error of the f32 twin
///
/// u, for the sum.
pub fn lobe_peak(shininess: f64) -> f64 {
    0.125 * (shininess.max(0.0) + 2.0)
}

/// Returns Trowbridge and Reitz's distribution ("GGX") scaled to 1 at the peak: (α²/(α² + sin² (1 - α²)))².
///
/// # Error of the f32 twin
///
/// 2 (1 - q) 8 u + 14 u relative, with q its root.
pub fn distribution_ggx(sine_squared: f64, alpha_squared: f64) -> f64 {
    let alpha = alpha_squared.clamp(TINY_ALPHA_SQUARED, 1.0);
    let ratio = alpha / (alpha + sine_squared.clamp(0.0, 1.0) * (1.0 - alpha));
    ratio * ratio
}

/// Returns Smith's height-correlated masking and shadowing (Heitz 2014), divided by n·v: 2 n·l/(n·l √(α² + (1 -
/// α²)(n·v)²) + n·v √(α² + (1 - α²)(n·l)²)). It is in [0, 2/α]. Negative cosines count as 0, and α² is clamped to
/// [1.998·10⁻⁶, 1], which are exponents of 10⁶ and 0.
///
/// # Error of the f32 twin
///
/// 24 u: two roots of sums of positive terms (11 u), products, a sum and a division.
pub fn smith_attenuation(n_light: f64, n_viewer: f64, alpha_squared: f64) -> f64 {
    let (light, viewer) = (n_light.clamp(0.0, 1.0), n_viewer.clamp(0.0, 1.0));
    let alpha = alpha_squared.clamp(SMOOTHEST, 1.0);
    let root = |cosine: f64| (alpha + (1.0 - alpha) * cosine * cosine).sqrt();
    2.0 * light / (light * root(viewer) + viewer * root(light)).max(TINY_DIVISOR)
}

/// Returns the specular term of a glTF material, linear RGB: Schlick's Fresnel, GGX and Smith, times the cosine
/// n·l. It is zero where the light or the viewer is behind the surface. Like every specular factor it is multiplied
/// by the light's colour, which is irradiance/π.
///
/// ```
/// use glam::DVec3;
/// use lumbre_optics::gltf_reflection;
///
/// // A plastic of roughness .5, lit and seen along its normal: .04/(4 α²) with α = 1/4.
/// let (up, plastic) = (DVec3::Y, DVec3::splat(0.04));
/// assert!((gltf_reflection(up, up, up, 30.0, plastic) - 0.16).length() < 1e-15);
/// ```
///
/// # Error of the f32 twin
///
/// D is off by the effect of the error of sin² and of 6 u of α², G by that of its cosines and of α², F by that of
/// 12 u of its cosine, and the product by 8 u more. Near n·l = 0 and n·v = 0 the result may be that of either side
/// of the test.
pub fn gltf_reflection(normal: DVec3, light: DVec3, viewer: DVec3, shininess: f64, specular: DVec3) -> DVec3 {
    let (n_light, n_viewer) = (normal.dot(light), normal.dot(viewer));
    if n_light <= 0.0 || n_viewer <= 0.0 {
        return DVec3::ZERO;
    }
    let sum = light + viewer;
    let half = safe_normalize(sum);
    let alpha_squared = 2.0 / (shininess.max(0.0) + 2.0);
    let density = distribution_ggx(normal.cross(half).length_squared(), alpha_squared);
    let geometry = smith_attenuation(n_light, n_viewer, alpha_squared);
    // v·h = |l + v|/2, without the cancellation of v·(l + v).
    let v_half = 0.5 * sum.length_squared().max(TINY_LENGTH_SQUARED).sqrt();
    fresnel_schlick(v_half, specular) * (lobe_peak(shininess) * density * geometry).min(LARGEST_LOBE)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The fraction of the light that is reflected, by the midpoint rule over directions.
    fn reflected(shininess: f64, light_angle: f64) -> f64 {
        let light = DVec3::new(light_angle.sin(), light_angle.cos(), 0.0);
        let steps = 400;
        let mut sum = 0.0;
        for i in 0..steps {
            for j in 0..steps {
                // Uniform in sin² and azimuth means uniform in cosine-weighted solid angle.
                let sine = ((f64::from(i) + 0.5) / f64::from(steps)).sqrt();
                let azimuth = (f64::from(j) + 0.5) / f64::from(steps) * std::f64::consts::TAU;
                let viewer =
                    DVec3::new(sine * azimuth.cos(), (1.0 - sine * sine).sqrt(), sine * azimuth.sin());
                sum += gltf_reflection(DVec3::Y, light, viewer, shininess, DVec3::ONE).x / light.y;
            }
        }
        sum / f64::from(steps * steps)
    }

    #[test]
    fn no_light_is_gained_and_smooth_metals_reflect_all() {
        for shininess in [0.0, 1.0, 30.0, 300.0] {
            for angle in [0.0, 0.8, 1.3] {
                let part = reflected(shininess, angle);
                assert!(part < 1.001, "{shininess} {angle}: {part}");
            }
        }
        assert!(reflected(300.0, 0.3) > 0.97);
        // The part that single scattering reflects at roughness 1, lit along the normal: D = 1/π and G/(4 n·l
        // n·v) = 1/(2 (1 + n·v)), whose integral over n·v is 1 - ln 2.
        let rough = reflected(0.0, 0.0);
        assert!((rough - (1.0 - std::f64::consts::LN_2)).abs() < 1e-4, "{rough}");
    }

    #[test]
    fn it_is_the_same_both_ways_but_for_the_cosine() {
        let at = |degrees: f64| {
            let (sine, cosine) = degrees.to_radians().sin_cos();
            DVec3::new(sine, cosine, 0.0)
        };
        for (light, viewer) in [(10.0, -40.0), (70.0, -20.0), (85.0, 60.0)] {
            let (light, viewer) = (at(light), at(viewer));
            let reflectance = |light: DVec3, viewer: DVec3| {
                gltf_reflection(DVec3::Y, light, viewer, 12.0, DVec3::splat(0.3)).x / light.y
            };
            assert!((reflectance(light, viewer) / reflectance(viewer, light) - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn hard_directions_give_numbers() {
        let all = [DVec3::Y, -DVec3::Y, DVec3::X, DVec3::ZERO, DVec3::new(1.0, 1e-9, 0.0)];
        for normal in all {
            for light in all {
                for viewer in all {
                    for shininess in [0.0, 1e6] {
                        let value = gltf_reflection(normal, light, viewer, shininess, DVec3::ONE);
                        assert!(value.is_finite() && value.min_element() >= 0.0, "{normal} {light} {viewer}");
                    }
                }
            }
        }
    }
}
