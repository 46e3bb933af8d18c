//! Which lights are rejected, and why. This is checked when lights are loaded; the equations themselves stay finite
//! for any finite input.

use thiserror::Error;

use crate::validation::{color_fault, fault};
use crate::{Attenuation, Light, LightKind, SpotCone};

/// Largest product of a colour channel and the light's largest distance factor: a hundred million lights of this
/// intensity still add up in f32.
pub const LARGEST_INTENSITY: f64 = 1e30_f32 as f64;

/// How far a half angle may exceed π/2: the rounding of 90 degrees in f32.
const ANGLE_ROUNDING: f32 = 1e-6;

/// Why a light is rejected.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum LightError {
    /// A number that has to be finite and at least 0 is not.
    #[error(
        "light \"{light}\": {field} is {value}, which is {reason}; give a finite number that is at least 0"
    )]
    Number {
        /// The light's name.
        light: String,
        /// The field, as in `Light`.
        field: &'static str,
        /// Its value.
        value: f32,
        /// What is wrong with the value.
        reason: &'static str,
    },
    /// Attenuation (0, 0, 0) divides by zero at every distance.
    #[error(
        "light \"{light}\": attenuation is (0, 0, 0), which divides by zero; give a constant, linear or quadratic term above 0 \
         ((0, 0, 1) is the inverse-square law, (1, 0, 0) none)"
    )]
    NoAttenuation {
        /// The light's name.
        light: String,
    },
    /// The range is not a distance.
    #[error(
        "light \"{light}\": attenuation.range is {value} m; give a distance above 0, or leave it out for no end"
    )]
    Range {
        /// The light's name.
        light: String,
        /// Its value in metres.
        value: f32,
    },
    /// A half angle of the cone, or the angle that a directional light subtends, is out of range.
    #[error("light \"{light}\": {field} is {value} rad; give {allowed}")]
    Cone {
        /// The light's name.
        light: String,
        /// The field, as in `SpotCone` or `Light`.
        field: &'static str,
        /// Its value in radians.
        value: f32,
        /// Which values are accepted.
        allowed: &'static str,
    },
    /// Colour times distance factor is so large that the sum over the lights may overflow f32.
    #[error(
        "light \"{light}\": {field} is up to {value:e} at the strongest distance factor, above 1e30, which overflows; \
         lower the colour or raise the attenuation's constant term"
    )]
    TooStrong {
        /// The light's name.
        light: String,
        /// The field, as in `Light`.
        field: &'static str,
        /// Largest channel times strongest distance factor.
        value: f64,
    },
}

impl Light {
    /// Checks that the light can be evaluated anywhere. The error names the light, the field, the value and the
    /// remedy.
    ///
    /// Lights that are off are checked too, as they may be switched on.
    ///
    /// # Errors
    /// [`LightError`] with the first fault found.
    pub fn validate(&self, name: &str) -> Result<(), LightError> {
        let strongest = match self.kind {
            LightKind::Point => {
                validate_attenuation(&self.attenuation, name)?;
                self.attenuation.strongest()
            }
            LightKind::Ambient | LightKind::Directional => 1.0,
        };
        for (field, color) in
            [("ambient", self.ambient), ("diffuse", self.diffuse), ("specular", self.specular)]
        {
            if let Some((value, reason)) = color_fault(color) {
                return Err(LightError::Number { light: name.to_owned(), field, value, reason });
            }
            let value = f64::from(color.max_element()) * strongest;
            if value > LARGEST_INTENSITY {
                return Err(LightError::TooStrong { light: name.to_owned(), field, value });
            }
        }
        validate_size(self, name)?;
        self.spot.map_or(Ok(()), |cone| validate_cone(&cone, name))
    }
}

fn validate_size(light: &Light, name: &str) -> Result<(), LightError> {
    for (field, value) in [("radius", light.radius), ("angle", light.angle)] {
        if let Some(reason) = fault(value) {
            return Err(LightError::Number { light: name.to_owned(), field, value, reason });
        }
    }
    if light.angle > std::f32::consts::FRAC_PI_2 + ANGLE_ROUNDING {
        let (field, allowed) = ("angle", "an angular diameter from 0 to π/2");
        return Err(LightError::Cone { light: name.to_owned(), field, value: light.angle, allowed });
    }
    Ok(())
}

fn validate_attenuation(attenuation: &Attenuation, name: &str) -> Result<(), LightError> {
    for (field, value) in [
        ("attenuation.constant", attenuation.constant),
        ("attenuation.linear", attenuation.linear),
        ("attenuation.quadratic", attenuation.quadratic),
    ] {
        if let Some(reason) = fault(value) {
            return Err(LightError::Number { light: name.to_owned(), field, value, reason });
        }
    }
    if attenuation.coefficients() == glam::Vec3::ZERO {
        return Err(LightError::NoAttenuation { light: name.to_owned() });
    }
    // Infinity is a valid range: no window.
    if attenuation.range > 0.0 {
        Ok(())
    } else {
        Err(LightError::Range { light: name.to_owned(), value: attenuation.range })
    }
}

fn validate_cone(cone: &SpotCone, name: &str) -> Result<(), LightError> {
    let right_angle = std::f32::consts::FRAC_PI_2 + ANGLE_ROUNDING;
    let angle = |field, value, largest: f32, allowed| {
        if (0.0..=largest).contains(&value) {
            Ok(())
        } else {
            Err(LightError::Cone { light: name.to_owned(), field, value, allowed })
        }
    };
    match *cone {
        SpotCone::Exponent { cutoff, exponent } => {
            if !cone.is_everywhere() {
                angle(
                    "spot.cutoff",
                    cutoff,
                    right_angle,
                    "a half angle from 0 to π/2, or π for a point light",
                )?;
            }
            match fault(exponent) {
                Some(reason) => Err(LightError::Number {
                    light: name.to_owned(),
                    field: "spot.exponent",
                    value: exponent,
                    reason,
                }),
                None => Ok(()),
            }
        }
        SpotCone::Smooth { inner, outer } => {
            angle("spot.outer", outer, right_angle, "a half angle from 0 to π/2")?;
            angle("spot.inner", inner, outer, "a half angle from 0 to the outer one")
        }
    }
}

#[cfg(test)]
mod tests {
    use std::f32::consts::{FRAC_PI_2, PI};

    use glam::Vec3;

    use super::*;

    fn message(light: &Light) -> String {
        light.validate("lamp").expect_err("has to be refused").to_string()
    }

    fn attenuated(constant: f32, linear: f32, quadratic: f32) -> Light {
        let attenuation = Attenuation { constant, linear, quadratic, ..Attenuation::NONE };
        Light { attenuation, ..Light::point(Vec3::ONE) }
    }

    #[test]
    fn what_the_constructors_make_is_accepted() {
        let cone = SpotCone::Smooth { inner: 0.0, outer: std::f32::consts::FRAC_PI_4 };
        for light in [
            Light::point(Vec3::ONE),
            Light::directional(Vec3::ONE),
            Light::ambient(Vec3::ONE),
            Light::spot(Vec3::ONE, cone),
            Light::point(Vec3::ZERO),
            Light::point(Vec3::splat(1e-30)),
            Light::directional(Vec3::splat(1e30)),
        ] {
            assert_eq!(light.validate("lamp"), Ok(()));
        }
    }

    #[test]
    fn attenuation() {
        assert_eq!(
            attenuated(0.0, 0.0, 0.0).validate("lamp"),
            Err(LightError::NoAttenuation { light: "lamp".to_owned() })
        );
        assert!(message(&attenuated(1.0, -1.0, 0.0)).contains("attenuation.linear is -1, which is negative"));
        assert!(message(&attenuated(1.0, 0.0, f32::NAN)).contains("attenuation.quadratic is NaN"));
        assert!(message(&attenuated(f32::INFINITY, 0.0, 0.0)).contains("infinite"));
        for range in [0.0, -1.0, f32::NAN] {
            let attenuation = Attenuation { range, ..Attenuation::NONE };
            let light = Light { attenuation, ..Light::point(Vec3::ONE) };
            assert!(message(&light).contains("attenuation.range"));
        }
        // Attenuation is not checked for lights that do not use it.
        let sun = Light {
            attenuation: Attenuation { constant: 0.0, ..Attenuation::NONE },
            ..Light::directional(Vec3::ONE)
        };
        assert_eq!(sun.validate("sun"), Ok(()));
    }

    #[test]
    fn colours() {
        let faults = [(f32::NAN, "not a number"), (f32::INFINITY, "infinite"), (-0.5, "negative")];
        for (value, reason) in faults {
            let color = Vec3::new(1.0, value, 1.0);
            assert!(message(&Light { ambient: color, ..Light::point(Vec3::ONE) }).contains(reason));
            assert!(message(&Light { diffuse: color, ..Light::point(Vec3::ONE) }).contains("diffuse"));
            assert!(message(&Light { specular: color, ..Light::point(Vec3::ONE) }).contains("\"lamp\""));
        }
    }

    #[test]
    fn sizes() {
        for value in [-1.0, f32::NAN, f32::INFINITY] {
            assert!(message(&Light { radius: value, ..Light::point(Vec3::ONE) }).contains("radius is"));
            assert!(message(&Light { angle: value, ..Light::directional(Vec3::ONE) }).contains("angle is"));
        }
        assert!(message(&Light { angle: 1.6, ..Light::directional(Vec3::ONE) }).contains("from 0 to π/2"));
        let sun = Light { angle: FRAC_PI_2, radius: 1e6, ..Light::directional(Vec3::ONE) };
        assert_eq!(sun.validate("sun"), Ok(()));
    }

    #[test]
    fn intensity_that_overflows() {
        // An inverse-square light of 10³⁰ reaches 10³⁴ at the minimum distance.
        assert!(matches!(
            Light::point(Vec3::splat(1e30)).validate("lamp"),
            Err(LightError::TooStrong { .. })
        ));
        assert!(matches!(
            Light::directional(Vec3::splat(2e30)).validate("lamp"),
            Err(LightError::TooStrong { .. })
        ));
        assert_eq!(Light::point(Vec3::splat(1e25)).validate("lamp"), Ok(()));
    }

    #[test]
    fn cones() {
        let exponent = |cutoff, exponent| Light::spot(Vec3::ONE, SpotCone::Exponent { cutoff, exponent });
        for cutoff in [0.0, 0.5, FRAC_PI_2, 90f32.to_radians(), PI, 180f32.to_radians()] {
            assert_eq!(exponent(cutoff, 0.0).validate("lamp"), Ok(()), "{cutoff}");
        }
        for cutoff in [-0.1, 1.6, 3.0, 3.2, f32::NAN, f32::INFINITY] {
            assert!(message(&exponent(cutoff, 0.0)).contains("spot.cutoff"), "{cutoff}");
        }
        assert_eq!(exponent(0.5, 128.0).validate("lamp"), Ok(()));
        assert!(message(&exponent(0.5, -1.0)).contains("spot.exponent is -1"));
        assert!(message(&exponent(0.5, f32::NAN)).contains("spot.exponent"));
        let smooth = |inner, outer| Light::spot(Vec3::ONE, SpotCone::Smooth { inner, outer });
        assert_eq!(smooth(0.5, 0.5).validate("lamp"), Ok(()));
        assert!(message(&smooth(0.6, 0.5)).contains("spot.inner"));
        assert!(message(&smooth(0.0, 1.7)).contains("spot.outer"));
        assert!(message(&smooth(f32::NAN, 0.5)).contains("spot.inner"));
    }
}
