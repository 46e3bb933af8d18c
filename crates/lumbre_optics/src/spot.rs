//! Spot cones: how a light narrows around its axis. The attenuation with distance is in `attenuation`.

use glam::{DVec3, DVec4};

use crate::normalization::try_normalize;
use crate::power::safe_pow;

/// The cone of a spotlight around the -Z axis of its entity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SpotCone {
    /// OpenGL's spot: `cos(angle)^exponent` inside `cutoff`, nothing outside.
    Exponent {
        /// Half angle in radians, 0 to π/2; π makes it a point light.
        cutoff: f32,
        /// Concentration exponent, at least 0.
        exponent: f32,
    },
    /// KHR_lights_punctual's spot: full inside `inner`, nothing outside `outer`, and in between the square of a
    /// function that is linear in the cosine of the angle.
    Smooth {
        /// Half angle in radians where the fall-off begins, 0 to `outer`.
        inner: f32,
        /// Half angle in radians where the light ends, up to π/2.
        outer: f32,
    },
}

/// A cone as cosines, computed once on the CPU because WGSL's cos is only good to 2⁻¹¹.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpotCosines {
    /// Whether this is the smooth cone of KHR_lights_punctual rather than OpenGL's.
    pub smooth_cone: bool,
    /// Cosine of the half angle at which the light ends, at least 0; -2 for a cutoff of π, where the light does not
    /// end at all.
    pub outer: f64,
    /// Cosine of the inner half angle of a smooth cone, or the exponent of OpenGL's.
    pub inner_or_exponent: f64,
}

/// Minimum difference between the two cosines of a smooth cone, as in KHR_lights_punctual's example code.
pub const MINIMUM_COSINE_DIFFERENCE: f64 = 0.001;

/// How far from π a cutoff may be and still mean 180 degrees: the rounding in f32 of π, and of degrees times π/180.
const CUTOFF_ROUNDING: f64 = 1e-6;

impl SpotCone {
    /// The half angle in radians beyond which there is no light.
    pub fn outer_angle(&self) -> f32 {
        match *self {
            Self::Exponent { cutoff, .. } => cutoff,
            Self::Smooth { outer, .. } => outer,
        }
    }

    /// Returns true for OpenGL's cutoff of 180 degrees, which makes a spotlight a point light.
    pub fn is_everywhere(&self) -> bool {
        matches!(*self, Self::Exponent { cutoff, .. }
            if (f64::from(cutoff) - std::f64::consts::PI).abs() <= CUTOFF_ROUNDING)
    }

    /// The cone as [`spot_factor`] takes it. The cosine of a cutoff of 90 degrees is exactly 0, although f32's π/2
    /// is slightly more than π/2.
    pub fn cosines(&self) -> SpotCosines {
        // No cone opens backwards: the clamp undoes the rounding of π/2.
        let cosine = |angle: f32| f64::from(angle).cos().max(0.0);
        match *self {
            Self::Exponent { .. } if self.is_everywhere() => {
                SpotCosines { smooth_cone: false, outer: -2.0, inner_or_exponent: 0.0 }
            }
            Self::Exponent { cutoff, exponent } => SpotCosines {
                smooth_cone: false,
                outer: cosine(cutoff),
                inner_or_exponent: f64::from(exponent),
            },
            Self::Smooth { inner, outer } => {
                SpotCosines { smooth_cone: true, outer: cosine(outer), inner_or_exponent: cosine(inner) }
            }
        }
    }
}

/// Returns the factor of a spotlight, in [0, 1], for the cosine between its axis and the direction from the light
/// to the point.
///
/// OpenGL's cone (`smooth_cone` false) is `cosine^exponent` where `outer < cosine`. As in Mesa the comparison is
/// strict, so a cutoff of 0 lights nothing and a cutoff of 90 degrees excludes the plane through the light. The
/// smooth cone is the square of `clamp((cosine - outer)/max(inner - outer, 0.001), 0, 1)`.
///
/// # Error of the f32 twin
///
/// Smooth cone: 15 u of the factor; difference, width and division are 7 u, then squared. Exponent: that of
/// [`safe_pow`] inside, none outside. The edge is exact, as the cosines are given. If the cosine itself is off by
/// e, as in [`evaluate_light`](crate::evaluate_light), that adds 2 e over the width (of at least .001), or moves
/// base and edge by e: within e of the edge the value of either side is right.
pub fn spot_factor(smooth_cone: bool, outer: f64, inner_or_exponent: f64, cosine: f64) -> f64 {
    let cosine = cosine.clamp(-1.0, 1.0);
    if smooth_cone {
        let width = (inner_or_exponent - outer).max(MINIMUM_COSINE_DIFFERENCE);
        let angular = ((cosine - outer) / width).clamp(0.0, 1.0);
        return angular * angular;
    }
    if outer < cosine { safe_pow(cosine, inner_or_exponent) } else { 0.0 }
}

/// Returns the [`spot_factor`] of a smooth cone, from [`SpotCosines::smooth_cone_about`] its axis and the unit
/// direction from the point to the light, which is what a loop over many lights has at hand.
///
/// # Error of the f32 twin
///
/// The linear function is off by 6 u times the sum of its terms' magnitudes, which is at most 2/width + 1 for a
/// width of .001 or more; its square by twice that times the function, and by 1 u.
pub fn smooth_spot_factor(cone: DVec4, to_light: DVec3) -> f64 {
    let angular = (cone.w - cone.truncate().dot(to_light)).clamp(0.0, 1.0);
    angular * angular
}

impl SpotCosines {
    /// Returns a smooth cone about the unit axis along which it shines, as [`smooth_spot_factor`] takes it: the
    /// axis divided by the width between the two cosines, and the value of the linear function at a right angle to
    /// the axis. `None` for OpenGL's cone.
    pub fn smooth_cone_about(&self, axis: DVec3) -> Option<DVec4> {
        let scale = (self.inner_or_exponent - self.outer).max(MINIMUM_COSINE_DIFFERENCE).recip();
        self.smooth_cone.then(|| (axis * scale).extend(-self.outer * scale))
    }
}

impl SpotCone {
    /// Returns the factor, in the direction `from_light`, of a light that shines along `axis` (both of any length),
    /// or `None` where it is undefined: an axis or direction of length 0, angles outside [0, π/2] (a cutoff of π is
    /// allowed), an inner angle beyond the outer one, or an exponent that is negative or not finite. Without a
    /// direction, [`evaluate_light`](crate::evaluate_light) passes a cosine of 0 to [`spot_factor`].
    pub fn try_factor(&self, axis: DVec3, from_light: DVec3) -> Option<f64> {
        // f32's π/2 is slightly more than π/2.
        let right_angle = 0.0..=std::f32::consts::FRAC_PI_2;
        let usable = match *self {
            Self::Exponent { cutoff, exponent } => {
                (right_angle.contains(&cutoff) || self.is_everywhere())
                    && exponent.is_finite()
                    && exponent >= 0.0
            }
            Self::Smooth { inner, outer } => right_angle.contains(&outer) && (0.0..=outer).contains(&inner),
        };
        let cosine = try_normalize(axis)?.dot(try_normalize(from_light)?);
        let SpotCosines { smooth_cone, outer, inner_or_exponent } = self.cosines();
        usable.then(|| spot_factor(smooth_cone, outer, inner_or_exponent, cosine))
    }
}

#[cfg(test)]
mod tests {
    use std::f32::consts::{FRAC_PI_2, FRAC_PI_3, PI};

    use super::*;

    fn factor(cone: SpotCone, cosine: f64) -> f64 {
        let SpotCosines { smooth_cone, outer, inner_or_exponent } = cone.cosines();
        spot_factor(smooth_cone, outer, inner_or_exponent, cosine)
    }

    #[test]
    fn a_smooth_cone_about_its_axis_is_the_same_cone() {
        let axis = DVec3::new(0.6, -0.8, 0.0);
        for (inner, outer) in [(0.0, 0.4), (0.3, 0.3), (0.2, FRAC_PI_2), (0.0, 0.0)] {
            let cone = SpotCone::Smooth { inner, outer };
            let linear = cone.cosines().smooth_cone_about(axis).unwrap();
            for step in 0..=200 {
                let angle = PI as f64 * f64::from(step) / 200.0;
                let from_light = axis * angle.cos() + DVec3::Z * angle.sin();
                let expected = factor(cone, axis.dot(from_light));
                let got = smooth_spot_factor(linear, -from_light);
                assert!((got - expected).abs() < 1e-12, "{inner} {outer} at {angle}: {got} {expected}");
            }
        }
        assert_eq!(SpotCone::Exponent { cutoff: 0.5, exponent: 2.0 }.cosines().smooth_cone_about(axis), None);
    }

    #[test]
    fn inside_the_power_outside_nothing() {
        let cone = SpotCone::Exponent { cutoff: FRAC_PI_3, exponent: 3.0 };
        assert!((factor(cone, 0.8) - 0.512).abs() < 1e-15);
        assert_eq!(factor(cone, 1.0), 1.0);
        assert_eq!(factor(cone, 0.4999), 0.0);
    }

    #[test]
    fn cutoff_0_90_180() {
        let zero = SpotCone::Exponent { cutoff: 0.0, exponent: 0.0 };
        assert_eq!(factor(zero, 1.0), 0.0);
        assert_eq!(factor(zero, 1.0 + 1e-7), 0.0);
        let right = SpotCone::Exponent { cutoff: FRAC_PI_2, exponent: 0.0 };
        assert_eq!(factor(right, 0.0), 0.0);
        assert_eq!(factor(right, -1e-9), 0.0);
        assert_eq!(factor(right, 1e-9), 1.0);
        for cutoff in [PI, 180f32.to_radians(), PI.next_down().next_down(), PI.next_up()] {
            let everywhere = SpotCone::Exponent { cutoff, exponent: 64.0 };
            for cosine in [-1.0, 0.0, 0.3, 1.0] {
                assert_eq!(factor(everywhere, cosine), 1.0);
            }
        }
    }

    #[test]
    fn exponent_0_and_128() {
        assert_eq!(factor(SpotCone::Exponent { cutoff: FRAC_PI_3, exponent: 0.0 }, 0.6), 1.0);
        let sharp = factor(SpotCone::Exponent { cutoff: FRAC_PI_3, exponent: 128.0 }, 0.9);
        assert!((sharp / 0.9f64.powi(128) - 1.0).abs() < 1e-13);
    }

    #[test]
    fn the_smooth_cone_is_the_square_of_a_linear_function() {
        let cone = SpotCone::Smooth { inner: 0.0, outer: FRAC_PI_2 };
        assert_eq!(factor(cone, 0.5), 0.25);
        assert_eq!(factor(cone, 1.0), 1.0);
        assert_eq!(factor(cone, -0.5), 0.0);
    }

    #[test]
    fn equal_angles_leave_an_edge_a_thousandth_wide() {
        let cone = SpotCone::Smooth { inner: FRAC_PI_3, outer: FRAC_PI_3 };
        let outer = cone.cosines().outer;
        assert_eq!(factor(cone, outer), 0.0);
        assert!((factor(cone, outer + 0.0005) - 0.25).abs() < 1e-12);
        assert_eq!(factor(cone, outer + 0.0011), 1.0);
    }

    #[test]
    fn a_light_without_a_direction_is_off() {
        // With an axis of length 0 the cosine is 0.
        assert_eq!(factor(SpotCone::Exponent { cutoff: 1.0, exponent: 0.0 }, 0.0), 0.0);
        assert_eq!(factor(SpotCone::Smooth { inner: 0.1, outer: 1.0 }, 0.0), 0.0);
        let cone = SpotCone::Smooth { inner: 0.1, outer: 1.0 };
        assert_eq!(cone.try_factor(DVec3::ZERO, DVec3::Y), None);
        assert_eq!(cone.try_factor(DVec3::Y, DVec3::ZERO), None);
        assert_eq!(cone.try_factor(DVec3::Y * 5.0, DVec3::Y * 0.1), Some(1.0));
    }

    #[test]
    fn cones_that_are_none() {
        let bad = [
            SpotCone::Exponent { cutoff: -0.1, exponent: 1.0 },
            SpotCone::Exponent { cutoff: 2.0, exponent: 1.0 },
            SpotCone::Exponent { cutoff: 1.0, exponent: -1.0 },
            SpotCone::Exponent { cutoff: f32::NAN, exponent: 1.0 },
            SpotCone::Smooth { inner: 1.0, outer: 0.5 },
            SpotCone::Smooth { inner: 0.0, outer: 3.0 },
        ];
        for cone in bad {
            assert_eq!(cone.try_factor(DVec3::Y, DVec3::Y), None, "{cone:?}");
        }
        for cutoff in [0.0, FRAC_PI_2, PI] {
            assert!(SpotCone::Exponent { cutoff, exponent: 0.0 }.try_factor(DVec3::Y, DVec3::X).is_some());
        }
    }
}
