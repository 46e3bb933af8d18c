//! Specular antialiasing: highlights that do not sparkle, from the lobe of a pixel whose normals vary.
//! Multisampling does not help here, as it only samples edges. This is not a filter for normal maps.
//!
//! A pixel of a curved or distant surface contains many normals. The highlight of the one at its centre is narrower
//! and brighter than the pixel's mean, and flickers as things move. Under a pixel filter of standard deviation σ
//! the normals have the variance σ² (|∂N/∂x|² + |∂N/∂y|²) / 2 along each axis, and a lobe of width α convolved with
//! them has α'² = α² + σ² (|∂N/∂x|² + |∂N/∂y|²) (Kaplanyan, Hill, Patney and Lefohn 2016, section 4; Tokuyoshi and
//! Kaplanyan 2019, section 5), where α² = 2/(m + 2) for the exponent m of n·h. The widening is clamped to
//! [`LARGEST_WIDENING`], because a derivative across a crease says nothing about the pixel.
//!
//! The specular factors of this crate are 1 at their peak, so that a wider lobe would gain energy: the peak is
//! therefore multiplied by α²/α'².
//!
//! This is for Phong shading only, as flat and Gouraud shading evaluate no highlight per pixel. It is off unless a
//! scene asks for it, because it deliberately deviates from the plain equation.
//!
//! Error: the sum of the two derivatives stands for both axes, which is exact where the surface bends equally in
//! both directions and too wide across a cylinder by up to a factor of √2 in α. The convolution is exact for
//! Gaussian lobes, which cos^m is to O(1/m).

/// Variance of the pixel filter in square pixels: σ = ½.
pub const FILTER_VARIANCE: f64 = 0.25;

/// The largest amount by which α² is widened.
pub const LARGEST_WIDENING: f64 = 0.18;

/// A lobe after filtering over a pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FilteredLobe {
    /// The exponent that replaces the material's, and is never larger.
    pub shininess: f64,
    /// Factor on the highlight, in (0, 1].
    pub peak: f64,
}

/// Returns by how much α² widens where the unit normal changes by vectors of these squared lengths between
/// neighbouring pixels in x and y. In [0, 0.18].
///
/// # Error of the f32 twin
///
/// 2 u: a sum and a product with a power of two, or the rounded constant of the clamp.
pub fn lobe_widening(squared_change_x: f64, squared_change_y: f64) -> f64 {
    (FILTER_VARIANCE * (squared_change_x + squared_change_y)).clamp(0.0, LARGEST_WIDENING)
}

/// Returns the exponent and peak of a lobe whose α² is widened by `widening` (at least 0).
///
/// `half_vector_scale` is the ratio of the equivalent exponent of n·h to `shininess`: 4 for exponents of r·v
/// (Phong's and its two fits, since r turns twice as far as n), 1 for exponents of n·h. Exponents are at least 0;
/// the widest lobe has exponent 0.
///
/// # Error of the f32 twin
///
/// Exponent: 15 u of itself and 16 u / `half_vector_scale` absolute. α² is off by 7 u (a sum and a division) and
/// α'² by 8 u, which becomes absolute in the difference from 1; then a product and a division follow. Peak: 20 u,
/// from the two α² and a division.
pub fn filtered_lobe(shininess: f64, half_vector_scale: f64, widening: f64) -> FilteredLobe {
    let alpha_squared = 2.0 / (half_vector_scale * shininess.max(0.0) + 2.0);
    let widened = (alpha_squared + widening.max(0.0)).min(1.0);
    // 2/α'² - 2, written as 2 (1 - α'²)/α'² so that it is exact at α' = 1.
    FilteredLobe {
        shininess: 2.0 * (1.0 - widened) / (widened * half_vector_scale),
        peak: alpha_squared / widened,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plane_changes_nothing() {
        for shininess in [0.0, 1.0, 128.0, 1e6] {
            for scale in [1.0, 4.0] {
                let lobe = filtered_lobe(shininess, scale, lobe_widening(0.0, 0.0));
                // Two divisions and a difference from 1, amplified by the exponent at small α.
                assert!((lobe.shininess - shininess).abs() <= 1e-15 * (1.0 + scale * shininess * shininess));
                assert_eq!(lobe.peak, 1.0);
            }
        }
    }

    #[test]
    fn it_never_sharpens_and_never_brightens() {
        for shininess in [0.0, 0.5, 3.0, 1e3, 1e6] {
            for change in [0.0, 1e-12, 1e-3, 0.1, 4.0, 1e30, f64::INFINITY] {
                let widening = lobe_widening(change, change);
                assert!((0.0..=LARGEST_WIDENING).contains(&widening));
                let lobe = filtered_lobe(shininess, 4.0, widening);
                assert!(lobe.shininess >= 0.0 && lobe.shininess <= shininess * (1.0 + 1e-9), "{lobe:?}");
                assert!(lobe.peak > 0.0 && lobe.peak <= 1.0, "{lobe:?}");
            }
        }
    }

    #[test]
    fn the_energy_of_the_lobe_stays() {
        // The lobe cos^m has the solid angle 2π/(m + 1), and weighted by the cosine 2π/(m + 2), which is π α². The
        // old one equals the new one times the peak.
        for shininess in [10.0, 1e3, 1e5] {
            let lobe = filtered_lobe(shininess, 1.0, 0.01);
            let (before, after) = (1.0 / (shininess + 2.0), lobe.peak / (lobe.shininess + 2.0));
            assert!((after / before - 1.0).abs() < 1e-9, "{shininess}: {before} {after}");
        }
    }

    #[test]
    fn it_is_the_mean_over_normals_of_a_gaussian_pixel() {
        // (n·h)^m at the angle a, averaged over normals with variance s² along each axis, is compared with a sum
        // over a grid. The closed form is exact for Gaussians; cos^m differs from one by O(1/m).
        let (exponent, spread) = (400.0, 0.05f64);
        // α² widens by twice the variance along one axis.
        let lobe = filtered_lobe(exponent, 1.0, 2.0 * spread * spread);
        for angle in [0.0f64, 0.03, 0.06, 0.1] {
            let (mut sum, mut weight) = (0.0, 0.0);
            for i in -60..=60 {
                for j in -60..=60 {
                    let (x, y) = (f64::from(i) * spread / 12.0, f64::from(j) * spread / 12.0);
                    let density = (-(x * x + y * y) / (2.0 * spread * spread)).exp();
                    let normal = glam::DVec3::new(x, y, 1.0).normalize();
                    let half = glam::DVec3::new(angle.sin(), 0.0, angle.cos());
                    sum += density * normal.dot(half).max(0.0).powf(exponent);
                    weight += density;
                }
            }
            let filtered = lobe.peak * angle.cos().powf(lobe.shininess);
            assert!((filtered - sum / weight).abs() < 0.01, "{angle}: {filtered} {}", sum / weight);
        }
    }
}
