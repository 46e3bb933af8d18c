//! Refraction: the direction of transmitted light, and when there is none. How much light is transmitted is in
//! `fresnel`.
//!
//! eta is always η_t/η_i, the index behind the surface over the index in front. Document \[I\]'s derivation mixes
//! eta and 1/eta; here sin θ_t = sin θ_i / eta, and no light is transmitted where sin θ_i > eta.

use glam::DVec3;

use crate::normalization::safe_normalize;
use crate::power::cosine_lobe;

/// eta is clamped to this range. No pair of real media comes near its ends, and below the smallest the direction
/// would be lost in the rounding of η² - sin².
const SMALLEST_INDEX: f64 = 1e-2_f32 as f64;
const LARGEST_INDEX: f64 = 1e4;

/// Returns true under total internal reflection: sin θ_i > eta. At the critical angle itself light still leaves,
/// along the surface.
///
/// # Error of the f32 twin
///
/// None: it compares its arguments. The sine of a direction is off by u or more, so callers decide by the cosine.
pub fn is_totally_reflected(sin_incident: f64, eta: f64) -> bool {
    sin_incident > eta.max(SMALLEST_INDEX)
}

/// Returns the critical angle in radians, where sin θ_i = eta; `None` towards a denser medium (eta ≥ 1) or if eta
/// is not positive.
pub fn critical_angle(eta: f64) -> Option<f64> {
    (eta > 0.0 && eta < 1.0).then(|| eta.asin())
}

/// Returns cos θ_t = sqrt(1 - (sin θ_i / eta)²), and 0 under total internal reflection.
///
/// The difference of squares is computed as a product, which keeps its digits near the critical angle.
///
/// # Error of the f32 twin
///
/// The root of a value that is off by u (14 s² + 3 |1 - s²|) with s = sin/eta (a division, 7 u), plus 9 u: 9 u far
/// from the critical angle, 7.5 u/cos near it, and 10⁻³ at it.
pub fn transmitted_cosine(sin_incident: f64, eta: f64) -> f64 {
    let sine = sin_incident.max(0.0) / eta.max(SMALLEST_INDEX);
    ((1.0 - sine) * (1.0 + sine)).max(0.0).sqrt()
}

/// Returns [`transmitted_cosine`], or `None` under total internal reflection, for a sine outside [0, 1], or for an
/// eta outside [0.01, 10⁴].
pub fn try_transmitted_cosine(sin_incident: f64, eta: f64) -> Option<f64> {
    let usable = (0.0..=1.0).contains(&sin_incident) && (SMALLEST_INDEX..=LARGEST_INDEX).contains(&eta);
    (usable && !is_totally_reflected(sin_incident, eta)).then(|| transmitted_cosine(sin_incident, eta))
}

/// Returns t = -(1/eta) l - (cos θ_t - cos θ_i / eta) n: the unit direction, pointing away from the light, in which
/// light from l (a unit vector on the side of the unit normal n) continues behind the surface. It is the zero
/// vector under total internal reflection.
///
/// eta cos θ_t is computed from the cosine, as in [`fresnel_dielectric`](crate::fresnel_dielectric). The rounding
/// of the sine would be multiplied by 1/cos θ_t at grazing angles. The normalization supplies the factor 1/eta.
///
/// # Error of the f32 twin
///
/// With g = eta cos θ_t: g² is off by u (3 |η² - 1| + cos² + g²) and 6 u |cos| Σ|n l|, g by the root of that and 9
/// u, cos θ_i - g by both and u. The sum is off by that and two roundings; normalizing divides it by its length
/// eta, doubles it for the change of direction, and adds 7 u. For eta from 1/3 to 3 away from the critical angle
/// that is some 40 u; near it it grows as in [`transmitted_cosine`]; for the smallest index it is .006. For eta ≥ 1
/// nothing cancels. Where g² is within its error of 0 the result may be either the direction along the surface or
/// the zero vector.
pub fn transmitted_direction(normal: DVec3, light: DVec3, eta: f64) -> DVec3 {
    let index = eta.clamp(SMALLEST_INDEX, LARGEST_INDEX);
    let cos_incident = normal.dot(light);
    let g_squared = (index - 1.0) * (index + 1.0) + cos_incident * cos_incident;
    if g_squared < 0.0 {
        return DVec3::ZERO;
    }
    safe_normalize((cos_incident - g_squared.sqrt()) * normal - light)
}

/// Returns [`transmitted_direction`], or `None` under total internal reflection, with the light behind the surface,
/// or for an eta that is not positive and finite.
pub fn try_transmitted_direction(normal: DVec3, light: DVec3, eta: f64) -> Option<DVec3> {
    let usable = eta.is_finite() && eta > 0.0 && normal.dot(light) > 0.0;
    let direction = if usable { transmitted_direction(normal, light, eta) } else { DVec3::ZERO };
    (direction != DVec3::ZERO).then_some(direction)
}

/// Returns (t·v)ⁿ of document \[I\]: the highlight of light that shines through, for a viewer behind the surface
/// (n·v < 0) and a light in front of it (n·l > 0); else 0.
///
/// # Error of the f32 twin
///
/// That of [`cosine_lobe`] around a [`transmitted_direction`]. Within rounding of n·l = 0, n·v = 0 and total
/// reflection, the result may be that of either side.
pub fn transmitted_highlight(normal: DVec3, light: DVec3, viewer: DVec3, shininess: f64, eta: f64) -> f64 {
    let direction = transmitted_direction(normal, light, eta);
    if normal.dot(light) <= 0.0 || normal.dot(viewer) >= 0.0 || direction.length_squared() < 0.5 {
        return 0.0;
    }
    cosine_lobe(direction, viewer, shininess)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(angle: f64) -> DVec3 {
        DVec3::new(angle.sin(), angle.cos(), 0.0)
    }

    #[test]
    fn snells_law() {
        for eta in [0.7, 1.0, 1.33, 1.5, 2.42] {
            for degrees in [0.0, 10.0, 30.0, 44.0] {
                let incident = f64::to_radians(degrees);
                let transmitted = (incident.sin() / eta).asin();
                let expected = -at(transmitted);
                let got = transmitted_direction(DVec3::Y, at(incident), eta);
                // At 44 degrees into 0.7 the cosine is .12, so its rounding is at most 2⁻⁵³/.12².
                assert!((got - expected).length() < 1e-14, "{eta} at {degrees}: {got} {expected}");
                assert!((transmitted_cosine(incident.sin(), eta) - transmitted.cos()).abs() < 1e-14);
            }
        }
    }

    #[test]
    fn no_boundary_does_not_bend() {
        assert!((transmitted_direction(DVec3::Y, at(1.2), 1.0) + at(1.2)).length() < 1e-15);
    }

    #[test]
    fn the_critical_angle() {
        let eta = 1.0 / 1.5;
        let critical = critical_angle(eta).expect("glass to air has one");
        assert!((critical.to_degrees() - 41.810_314_895_778_6).abs() < 1e-12);
        assert_eq!(critical_angle(1.0), None);
        assert_eq!(critical_angle(1.5), None);
        assert_eq!(critical_angle(f64::NAN), None);
        // At the critical angle the direction is along the surface; slightly beyond there is none.
        assert!(!is_totally_reflected(eta, eta));
        assert_eq!(transmitted_cosine(eta, eta), 0.0);
        assert_eq!(transmitted_direction(DVec3::Y, at(critical + 1e-12), eta), DVec3::ZERO);
        assert_eq!(try_transmitted_direction(DVec3::Y, at(critical + 1e-12), eta), None);
        assert_eq!(try_transmitted_cosine(eta, eta), Some(0.0));
        assert_eq!(try_transmitted_cosine(eta.next_up(), eta), None);
        for (sine, eta) in [(-0.1, 1.5), (1.1, 1.5), (0.5, 0.0), (0.5, f64::NAN), (f64::NAN, 1.5)] {
            assert_eq!(try_transmitted_cosine(sine, eta), None, "{sine} {eta}");
        }
        let inside = transmitted_direction(DVec3::Y, at(critical - 1e-12), eta);
        // cos θ_t = sqrt(2 δ cos θ_i / eta) = 1.5e-6 at δ = 10⁻¹².
        assert!((inside.x + 1.0).abs() < 1e-11 && inside.y < 0.0 && inside.y > -2e-6, "{inside}");
    }

    #[test]
    fn the_highlight_follows_the_bent_light() {
        let (incident, eta) = (0.6f64, 1.5);
        let transmitted = (incident.sin() / eta).asin();
        let peak = transmitted_highlight(DVec3::Y, at(incident), -at(transmitted), 100.0, eta);
        assert!((peak - 1.0).abs() < 1e-12);
        let beside = transmitted_highlight(DVec3::Y, at(incident), -at(transmitted + 0.1), 100.0, eta);
        assert!((beside - 0.1f64.cos().powi(100)).abs() < 1e-12);
        assert_eq!(transmitted_highlight(DVec3::Y, at(incident), at(0.1), 0.0, eta), 0.0);
        assert_eq!(transmitted_highlight(DVec3::Y, -at(incident), -at(0.1), 0.0, eta), 0.0);
        assert_eq!(transmitted_highlight(DVec3::Y, at(1.0), -at(1.5), 0.0, 1.0 / 1.5), 0.0);
    }

    #[test]
    fn degenerate_input_is_finite() {
        for eta in [0.0, -1.0, 1e-300, 1e300] {
            for light in [DVec3::Y, DVec3::X, DVec3::ZERO, at(1.57)] {
                assert!(transmitted_direction(DVec3::Y, light, eta).is_finite(), "{eta} {light}");
                assert!(transmitted_direction(DVec3::ZERO, light, eta).is_finite(), "{eta} {light}");
            }
        }
        assert_eq!(try_transmitted_direction(DVec3::Y, DVec3::Y, 0.0), None);
        assert_eq!(try_transmitted_direction(DVec3::Y, -DVec3::Y, 1.5), None);
    }
}
