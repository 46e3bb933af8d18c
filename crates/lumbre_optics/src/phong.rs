//! Phong's specular factor (r·v)ⁿ, Phong 1975. This is the plain factor of documents \[I\], \[E\] and \[M\], not
//! multiplied by k_s, the light's colour or n·l.

use glam::DVec3;

use crate::normalization::try_normalize;
use crate::power::cosine_lobe;

/// Returns r = 2 (l·n) n - l: the direction in which a mirror with the unit normal n reflects light that comes from
/// l. A zero normal gives -l, a zero light direction zero.
///
/// # Error of the f32 twin
///
/// 2 u |n| (3 Σ|l n| + |l·n|) + u |r| for each component: three roundings of each product in l·n, two of the
/// product with n, and one of the difference.
pub fn reflected_direction(normal: DVec3, light: DVec3) -> DVec3 {
    2.0 * light.dot(normal) * normal - light
}

/// Returns the unit [`reflected_direction`] of vectors of any length, or `None` if either has no direction.
pub fn try_reflected_direction(normal: DVec3, light: DVec3) -> Option<DVec3> {
    Some(reflected_direction(try_normalize(normal)?, try_normalize(light)?))
}

/// Returns (r·v)ⁿ where the light is in front of the surface (n·l > 0), else 0. All directions are unit vectors
/// away from the surface.
///
/// Exponent 0 makes it a step function of n·l > 0.
///
/// # Error of the f32 twin
///
/// That of [`cosine_lobe`] around a [`reflected_direction`] that is itself off, which is about 9 u n times the
/// tangent of the angle from the peak, relative. Where |n·l| is at most 3 u Σ|n l|, either 0 or the lobe may be
/// returned.
pub fn phong(normal: DVec3, light: DVec3, viewer: DVec3, shininess: f64) -> f64 {
    if normal.dot(light) <= 0.0 {
        return 0.0;
    }
    cosine_lobe(reflected_direction(normal, light), viewer, shininess)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(degrees: f64) -> DVec3 {
        let (sine, cosine) = degrees.to_radians().sin_cos();
        DVec3::new(sine, cosine, 0.0)
    }

    #[test]
    fn it_peaks_in_the_mirror_direction() {
        assert!((reflected_direction(DVec3::Y, at(40.0)) - at(-40.0)).length() < 1e-15);
        assert!((phong(DVec3::Y, at(40.0), at(-40.0), 100.0) - 1.0).abs() < 1e-13);
    }

    #[test]
    fn without_a_direction_there_is_no_reflection() {
        assert_eq!(try_reflected_direction(DVec3::ZERO, DVec3::Y), None);
        assert_eq!(try_reflected_direction(DVec3::Y, DVec3::NAN), None);
        assert_eq!(reflected_direction(DVec3::ZERO, at(40.0)), -at(40.0));
        let long = try_reflected_direction(3.0 * DVec3::Y, 0.1 * at(40.0)).expect("both have one");
        assert!((long - at(-40.0)).length() < 1e-15);
    }

    #[test]
    fn sixty_degrees_off_the_mirror_direction_is_a_half_to_the_n() {
        for exponent in [1.0, 2.0, 10.0] {
            let expected = 0.5f64.powf(exponent);
            // Rounding of the cosine, 2⁻⁵³ or two, times n.
            assert!(
                (phong(DVec3::Y, at(30.0), at(30.0), exponent) - expected).abs() < 1e-15 * (1.0 + exponent)
            );
        }
    }

    #[test]
    fn the_light_must_be_in_front() {
        assert_eq!(phong(DVec3::Y, at(90.1), at(-89.0), 1.0), 0.0);
        assert_eq!(phong(DVec3::Y, -DVec3::Y, -DVec3::Y, 0.0), 0.0);
        assert_eq!(phong(DVec3::ZERO, DVec3::Y, DVec3::Y, 0.0), 0.0);
    }

    #[test]
    fn exponent_zero_is_a_step() {
        assert_eq!(phong(DVec3::Y, at(10.0), at(80.0), 0.0), 1.0);
        // Even where r·v is negative: 0⁰ = 1.
        assert_eq!(phong(DVec3::Y, at(80.0), at(80.0), 0.0), 1.0);
    }
}
