//! Distance attenuation of a positional light. The spot cone is in `spot`.

use glam::{DVec3, Vec3};

/// How a positional light weakens with the distance d, in metres.
///
/// The factor is `1 / (constant + linear d + quadratic d²)`, OpenGL 2.1 §2.14.1 and document \[I\],
/// optionally clamped to 1 (document \[M\]) and optionally faded out at `range` with the window of
/// KHR_lights_punctual. `(0, 0, 1)` is the inverse-square law.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Attenuation {
    /// Constant term a, dimensionless, at least 0.
    pub constant: f32,
    /// Linear term b, in 1/m, at least 0.
    pub linear: f32,
    /// Quadratic term c, in 1/m², at least 0.
    pub quadratic: f32,
    /// Clamp the factor to 1, as document \[M\] does and OpenGL does not.
    pub clamp: bool,
    /// Distance in metres at which the light ends: the factor is multiplied by `clamp(1 - (d/range)⁴, 0, 1)`
    /// (KHR_lights_punctual, "range property"). Infinity means no window.
    pub range: f32,
}

impl Attenuation {
    /// No attenuation: factor 1 at every distance.
    pub const NONE: Self =
        Self { constant: 1.0, linear: 0.0, quadratic: 0.0, clamp: false, range: f32::INFINITY };
    /// The inverse-square law, 1/d².
    pub const INVERSE_SQUARE: Self =
        Self { constant: 0.0, linear: 0.0, quadratic: 1.0, clamp: false, range: f32::INFINITY };

    /// The three coefficients (a, b, c) as one vector.
    pub fn coefficients(&self) -> Vec3 {
        Vec3::new(self.constant, self.linear, self.quadratic)
    }

    /// The range as shaders get it, at most [`UNLIMITED_RANGE`], because WGSL does not guarantee infinities.
    pub fn shader_range(&self) -> f32 {
        self.range.min(UNLIMITED_RANGE as f32)
    }

    /// The factor at a distance in metres: [`attenuate`] with these coefficients.
    pub fn factor(&self, distance: f64) -> f64 {
        attenuate(self.coefficients().as_dvec3(), self.clamp, f64::from(self.range), distance)
    }

    /// Returns the factor at a distance, or `None` where the formula itself has no value: 1/0 at the light,
    /// coefficients (0, 0, 0), a negative or non-finite coefficient, a range that is not above 0, or a distance
    /// that is negative or not finite.
    pub fn try_factor(&self, distance: f64) -> Option<f64> {
        try_attenuate(self.coefficients().as_dvec3(), self.clamp, f64::from(self.range), distance)
    }

    /// The largest factor that [`attenuate`] gives, which it does at distance 0.
    pub fn strongest(&self) -> f64 {
        self.factor(0.0)
    }

    /// Returns the distance in metres beyond which the factor is below `threshold`: the range if it never is
    /// (infinity without a window), 0 if it always is. This is an upper bound on how far a light reaches, so it
    /// ignores how the window weakens the light before its range.
    pub fn reach(&self, threshold: f64) -> f64 {
        let [constant, linear, quadratic] = self.coefficients().as_dvec3().to_array();
        let range = f64::from(self.range).max(0.0);
        let excess = 1.0 / threshold - constant;
        if threshold <= 0.0 {
            return range;
        }
        if excess < 0.0 || (self.clamp && threshold > 1.0) {
            return 0.0;
        }
        // The positive root of c d² + b d - excess, in the form that avoids cancellation.
        let divisor = linear + (linear * linear + 4.0 * quadratic * excess).sqrt();
        if divisor > 0.0 { (2.0 * excess / divisor).min(range) } else { range }
    }
}

/// Distance in metres below which a light without a constant term gets no stronger: 1 cm.
///
/// With a = b = 0 the law has no value at the light itself. Below this distance the denominator keeps the value
/// that it has here, so that an inverse-square light is at most 10⁴ times its intensity. The floor never takes
/// effect if the constant term is above b/100 + c/10⁴.
pub const MINIMUM_DISTANCE: f64 = 0.01;
/// Distances are clamped to 10¹⁸ m, a hundred light years, whose square is still an f32.
pub const MAXIMUM_DISTANCE: f64 = 1e18;
/// The finite value that stands for an infinite range: far enough beyond [`MAXIMUM_DISTANCE`] for the window to be
/// exactly 1.
pub const UNLIMITED_RANGE: f64 = 1e30;
/// Smallest denominator. Only coefficients that are rejected on loading can reach it.
const MINIMUM_DENOMINATOR: f64 = 1e-30;

/// Returns `1 / (a + b d + c d²)` for `coefficients` (a, b, c) and a distance d in metres, clamped to 1 if
/// `clamp_to_one`, times the window `1 - (d/range)⁴`. The result is finite, at least 0, and never increases with
/// the distance.
///
/// The denominator is at least what b and c alone give at [`MINIMUM_DISTANCE`]. Constant attenuation (a, 0, 0) is
/// exactly 1/a at any distance, even at the light's own position, just as OpenGL skips the distance there.
///
/// # Error of the f32 twin
///
/// At most 13 u of the factor, plus 28 u (d/range)⁴ of the factor without its window. The denominator is a sum of
/// positive terms, off by 6 u with its rounded constants; the division adds 5 u, window and product 2 u. The ratio
/// d/range, a division by a rounded range, is off by 6 u and its fourth power by 27 u. The difference from 1 turns
/// that into an absolute error: close to its range a light is off by much of the little that is left of it. Nothing
/// else cancels.
pub fn attenuate(coefficients: DVec3, clamp_to_one: bool, range: f64, distance: f64) -> f64 {
    let limited = distance.clamp(0.0, MAXIMUM_DISTANCE);
    let full = coefficients.x + (coefficients.y + coefficients.z * limited) * limited;
    let floor = (coefficients.y + coefficients.z * MINIMUM_DISTANCE) * MINIMUM_DISTANCE;
    let factor = 1.0 / full.max(floor).max(MINIMUM_DENOMINATOR);
    let end = range.clamp(MINIMUM_DENOMINATOR, UNLIMITED_RANGE);
    let ratio = limited.min(end) / end;
    let ratio_squared = ratio * ratio;
    let window = (1.0 - ratio_squared * ratio_squared).max(0.0);
    window * if clamp_to_one { factor.min(1.0) } else { factor }
}

/// Returns c times [`attenuate`] for coefficients (a, 0, c), not clamped to 1; `constant` is a/c in m², 0 for the
/// inverse-square law. It takes `inverse_range_squared` in 1/m² and the squared distance in m², which are what a
/// loop over many lights has at hand. For ranges from 10⁻⁹ to 10¹⁵ m.
///
/// # Error of the f32 twin
///
/// At most 9 u of the factor, plus 4 u (d/range)⁴ of the factor without its window: the division is off by 5 u, the
/// difference before it and the sum in the divisor by 1 u each, and below a centimetre the divisor, the square of a
/// rounded constant, by 2 u; the fourth power is off by 3 u of itself.
pub fn attenuate_quadratic(constant: f64, inverse_range_squared: f64, distance_squared: f64) -> f64 {
    let ratio_squared = (distance_squared * inverse_range_squared).clamp(0.0, 1.0);
    let window = 1.0 - ratio_squared * ratio_squared;
    window / (constant + distance_squared).max(MINIMUM_DISTANCE * MINIMUM_DISTANCE)
}

/// Returns [`attenuate`], or `None` where the formula itself has no value: 1/0 at the light or for coefficients
/// that are all 0, a negative or non-finite coefficient, a range that is not above 0, or a distance that is
/// negative or not finite.
pub fn try_attenuate(coefficients: DVec3, clamp_to_one: bool, range: f64, distance: f64) -> Option<f64> {
    let usable = coefficients.is_finite() && coefficients.min_element() >= 0.0 && range > 0.0;
    let defined = distance.is_finite()
        && distance >= 0.0
        && coefficients.dot(DVec3::new(1.0, distance, distance * distance)) > 0.0;
    (usable && defined).then(|| attenuate(coefficients, clamp_to_one, range, distance))
}

impl Default for Attenuation {
    fn default() -> Self {
        Self::NONE
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn triple(constant: f32, linear: f32, quadratic: f32) -> Attenuation {
        Attenuation { constant, linear, quadratic, ..Attenuation::NONE }
    }

    #[test]
    fn the_formula() {
        assert_eq!(triple(1.0, 2.0, 3.0).factor(2.0), 1.0 / 17.0);
        assert_eq!(triple(0.0, 2.0, 0.0).factor(4.0), 0.125);
        assert_eq!(Attenuation::INVERSE_SQUARE.factor(10.0), 0.01);
    }

    #[test]
    fn document_m_clamps_and_opengl_does_not() {
        let clamped = Attenuation { clamp: true, ..Attenuation::INVERSE_SQUARE };
        assert_eq!(clamped.factor(0.5), 1.0);
        assert_eq!(clamped.factor(2.0), 0.25);
        assert_eq!(Attenuation::INVERSE_SQUARE.factor(0.5), 4.0);
    }

    #[test]
    fn at_the_light() {
        // OpenGL's constant term sets the factor here; without one it is the value at a centimetre.
        assert_eq!(triple(1.0, 1.0, 1.0).factor(0.0), 1.0);
        assert_eq!(triple(0.5, 0.0, 0.0).factor(0.0), 2.0);
        assert!((Attenuation::INVERSE_SQUARE.factor(0.0) / 1e4 - 1.0).abs() < 1e-15);
        assert_eq!(triple(0.0, 2.0, 0.0).factor(0.0), 50.0);
        assert_eq!(Attenuation::INVERSE_SQUARE.factor(0.01), Attenuation::INVERSE_SQUARE.factor(0.0));
        assert_eq!(Attenuation::INVERSE_SQUARE.try_factor(0.0), None);
        assert_eq!(triple(0.5, 0.0, 0.0).try_factor(0.0), Some(2.0));
    }

    #[test]
    fn constant_attenuation_ignores_the_distance() {
        for distance in [0.0, 1.0, 1e30, f64::MAX, f64::INFINITY] {
            assert_eq!(Attenuation::NONE.factor(distance), 1.0);
            assert_eq!(triple(4.0, 0.0, 0.0).factor(distance), 0.25);
        }
    }

    #[test]
    fn the_window_ends_the_light() {
        let light = Attenuation { range: 2.0, ..Attenuation::INVERSE_SQUARE };
        assert_eq!(light.factor(1.0), 1.0 - 1.0 / 16.0);
        assert_eq!(light.factor(2.0), 0.0);
        assert_eq!(light.factor(1e300), 0.0);
    }

    #[test]
    fn the_quadratic_law_is_the_general_one() {
        for (range, constant, quadratic) in [1e-3f32, 0.02, 3.0, 1e9]
            .into_iter()
            .flat_map(|range| [(range, 0.0, 1.0), (range, 1.0, 1.2), (range, 1e-6, 40.0)])
        {
            let unlimited = triple(constant, 0.0, quadratic);
            let general = Attenuation { range, ..unlimited };
            let inverse_range_squared = f64::from(range).powi(-2);
            let (constant, quadratic) = (f64::from(constant), f64::from(quadratic));
            for part in [0.0, 1e-6, 0.1, 0.5, 0.9, 0.999, 1.0, 1.001, 5.0] {
                let distance = part * f64::from(range);
                let expected = general.factor(distance);
                let got =
                    attenuate_quadratic(constant / quadratic, inverse_range_squared, distance * distance)
                        / quadratic;
                // A few roundings of 2⁻⁵³ of the factor without its window, since 1 - (d/range)⁴ cancels.
                let unwindowed = unlimited.factor(distance);
                assert!((got - expected).abs() <= 2e-15 * unwindowed, "{general:?} {part}: {got} {expected}");
            }
        }
    }

    #[test]
    fn what_is_refused_on_loading_is_still_finite() {
        for (constant, linear, quadratic) in
            [(0.0, 0.0, 0.0), (-1.0, 0.0, 0.0), (0.0, -1.0, -1.0), (1e-38, 0.0, 0.0)]
        {
            for range in [f32::INFINITY, 0.0, -1.0, 1.0] {
                let light = Attenuation { range, ..triple(constant, linear, quadratic) };
                for distance in [0.0, 1e-300, 1.0, 1e300] {
                    let factor = light.factor(distance);
                    assert!(factor.is_finite() && factor >= 0.0, "{light:?} at {distance}: {factor}");
                }
            }
        }
        assert_eq!(triple(0.0, 0.0, 0.0).try_factor(1.0), None);
        assert_eq!(triple(f32::NAN, 0.0, 0.0).try_factor(1.0), None);
        assert_eq!(try_attenuate(DVec3::ZERO, true, f64::INFINITY, 1.0), None);
        assert_eq!(try_attenuate(DVec3::Z, false, -1.0, 1.0), None);
        assert_eq!(try_attenuate(DVec3::Z, false, f64::NAN, 1.0), None);
        assert_eq!(try_attenuate(DVec3::Z, false, f64::INFINITY, 2.0), Some(0.25));
    }

    #[test]
    fn reach_is_where_the_factor_crosses_the_threshold() {
        assert_eq!(Attenuation::INVERSE_SQUARE.reach(0.01), 10.0);
        assert_eq!(triple(1.0, 2.0, 3.0).reach(1.0 / 17.0), 2.0);
        assert_eq!(Attenuation::NONE.reach(0.5), f64::INFINITY);
        assert_eq!(Attenuation::NONE.reach(2.0), 0.0);
        assert_eq!(Attenuation { range: 5.0, ..Attenuation::INVERSE_SQUARE }.reach(1e-6), 5.0);
    }
}
