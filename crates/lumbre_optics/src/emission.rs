//! Emission: light that a surface adds regardless of the light that falls on it. In real time it lights nothing
//! else; in the baker it does.

use glam::DVec3;

/// Returns the lit colour plus the surface's own radiance, all linear RGB.
///
/// # Error of the f32 twin
///
/// u of the sum.
pub fn add_emission(lit: DVec3, emission: DVec3) -> DVec3 {
    lit + emission
}

/// Returns the exitance E = π L in W/m² of a surface that emits the radiance L in W/(m² sr) evenly in all
/// directions. The baker starts from it.
///
/// # Error of the f32 twin
///
/// 1.5 u: the product, and π itself.
pub fn exitance(emission: DVec3) -> DVec3 {
    emission * std::f64::consts::PI
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn emission_is_added_not_multiplied() {
        assert_eq!(add_emission(DVec3::ZERO, DVec3::new(1.0, 2.0, 3.0)), DVec3::new(1.0, 2.0, 3.0));
        assert_eq!(add_emission(DVec3::ONE, DVec3::ZERO), DVec3::ONE);
    }

    #[test]
    fn exitance_is_the_cosine_integral_of_constant_radiance() {
        // ∫ L cos θ dω over the hemisphere by the midpoint rule in cos² θ, which is exact for a constant.
        let integral: f64 = (0..100).map(|_| std::f64::consts::PI / 100.0).sum();
        assert!((exitance(DVec3::ONE).x - integral).abs() < 1e-13);
    }
}
