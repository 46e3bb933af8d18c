//! The half-vector highlight (n·h)ⁿ and two ways to fit it to Phong's exponent. Blinn's full model of 1977 is in
//! `torrance_sparrow`.

use glam::DVec3;

use crate::half_vector::half_vector;
use crate::lambert::lambert;
use crate::power::cosine_lobe;

/// Returns (n·h)ⁿ where n·l > 0, else 0, with the exponent used as it is, like OpenGL 2.1 §2.14.1. All directions
/// are unit vectors.
///
/// Where l = -v there is no half vector and the result is 0, or 1 for exponent 0.
///
/// # Error of the f32 twin
///
/// That of [`cosine_lobe`] with a half vector that is off by 9 u per component. Where |n·l| is at most 3 u Σ|n l|,
/// the result may be that of either side of the test n·l > 0. For exponents near 0 and a half vector perpendicular
/// to the normal within rounding, (n·h)ⁿ may be anything from 0 to 1.
pub fn blinn_phong(normal: DVec3, light: DVec3, viewer: DVec3, shininess: f64) -> f64 {
    if normal.dot(light) <= 0.0 {
        return 0.0;
    }
    cosine_lobe(normal, half_vector(light, viewer), shininess)
}

/// Returns (n·h)^(4n), document \[E\]. It takes Phong's exponent and approaches Phong in the plane of incidence as
/// n grows; out of that plane it has only about cos θ_i of Phong's energy.
///
/// # Error of the f32 twin
///
/// That of [`blinn_phong`]; multiplying n by 4 is exact.
pub fn blinn_phong_4n(normal: DVec3, light: DVec3, viewer: DVec3, shininess: f64) -> f64 {
    blinn_phong(normal, light, viewer, 4.0 * shininess)
}

/// Returns (n·h)^(4 n cos θ_i), the fit of document \[I\]. It takes Phong's exponent and keeps Phong's energy at
/// every angle of incidence.
///
/// # Error of the f32 twin
///
/// That of [`blinn_phong`] with an exponent that is off by 4 n (3 u Σ|n l| + u n·l), which is relatively more at
/// grazing angles.
pub fn blinn_phong_matched(normal: DVec3, light: DVec3, viewer: DVec3, shininess: f64) -> f64 {
    blinn_phong(normal, light, viewer, 4.0 * shininess * lambert(normal, light))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::phong;

    fn at(degrees: f64) -> DVec3 {
        let (sine, cosine) = degrees.to_radians().sin_cos();
        DVec3::new(sine, cosine, 0.0)
    }

    #[test]
    fn the_angle_to_the_half_vector_is_half_of_phongs() {
        // l at 30, v at 90 degrees: h at 60, so (n·h)ⁿ = 2⁻ⁿ.
        for exponent in [1.0, 4.0, 16.0] {
            let got = blinn_phong(DVec3::Y, at(30.0), at(90.0), exponent);
            assert!((got - 0.5f64.powf(exponent)).abs() < 1e-15 * (1.0 + exponent));
        }
    }

    #[test]
    fn corners() {
        // l = -v with the light in front.
        let grazing = DVec3::new(1.0, 1e-3, 0.0).normalize();
        assert_eq!(blinn_phong(DVec3::Y, grazing, -grazing, 10.0), 0.0);
        assert_eq!(blinn_phong(DVec3::Y, grazing, -grazing, 0.0), 1.0);
        // A light exactly in the plane, behind it, and a zero normal.
        assert_eq!(blinn_phong(DVec3::Y, DVec3::X, DVec3::Y, 0.0), 0.0);
        assert_eq!(blinn_phong(DVec3::Y, -DVec3::Y, DVec3::Y, 1.0), 0.0);
        assert_eq!(blinn_phong(DVec3::ZERO, DVec3::Y, DVec3::Y, 0.0), 0.0);
    }

    /// The largest difference from Phong in the plane of incidence, for a viewer within 60 degrees of the mirror
    /// direction.
    fn worst_in_plane(exponent: f64) -> f64 {
        (-6000i32..=6000)
            .map(|step| {
                let viewer = at(f64::from(step) / 100.0);
                let difference = blinn_phong_4n(DVec3::Y, DVec3::Y, viewer, exponent)
                    - phong(DVec3::Y, DVec3::Y, viewer, exponent);
                difference.abs()
            })
            .fold(0.0, f64::max)
    }

    #[test]
    fn four_n_meets_phong_in_the_plane() {
        // The largest of |cos⁴ⁿ(x/2) - cosⁿ(x)|: .030, .014, .0069, .0027, .0014, published results of numerical
        // integration with two digits, so the tolerance is half a unit of the second.
        for (exponent, error) in
            [(5.0, 0.030), (10.0, 0.014), (20.0, 0.0069), (50.0, 0.0027), (100.0, 0.0014)]
        {
            let got = worst_in_plane(exponent);
            assert!((got / error - 1.0).abs() < 0.05, "n = {exponent}: {got}");
        }
    }

    /// ∫ f dω over the viewer's hemisphere, by the midpoint rule in the cosine and the azimuth.
    fn energy(model: fn(DVec3, DVec3, DVec3, f64) -> f64, light: DVec3, exponent: f64) -> f64 {
        let (rows, columns) = (200u32, 400u32);
        let mut sum = 0.0;
        for row in 0..rows {
            let cosine = (f64::from(row) + 0.5) / f64::from(rows);
            let sine = (1.0 - cosine * cosine).sqrt();
            for column in 0..columns {
                let (y, x) =
                    ((f64::from(column) + 0.5) / f64::from(columns) * std::f64::consts::TAU).sin_cos();
                sum += model(DVec3::Y, light, DVec3::new(sine * x, cosine, sine * y), exponent);
            }
        }
        sum * std::f64::consts::TAU / f64::from(rows * columns)
    }

    #[test]
    fn the_matched_exponent_keeps_phongs_energy_and_4n_loses_the_cosine() {
        for degrees in [0.0, 30.0, 45.0] {
            let reference = energy(phong, at(degrees), 50.0);
            let matched = energy(blinn_phong_matched, at(degrees), 50.0) / reference;
            let four = energy(blinn_phong_4n, at(degrees), 50.0) / reference;
            // First order in 1/n on both sides: 1/50, doubled for the tilt.
            assert!((matched - 1.0).abs() < 0.04, "{degrees}: {matched}");
            assert!((four / f64::to_radians(degrees).cos() - 1.0).abs() < 0.04, "{degrees}: {four}");
        }
    }
}
