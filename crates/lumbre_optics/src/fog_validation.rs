//! Which fogs are rejected, and why. This is checked when the scene is loaded; the equations themselves stay finite
//! for any finite input.

use thiserror::Error;

use crate::validation::{color_fault, fault};
use crate::{Fog, FogMode};

/// Why a fog is rejected.
#[derive(Clone, Debug, PartialEq, Error)]
#[error("fog of \"{scene}\": {field} is {value}, which is {reason}; give {allowed}")]
pub struct FogError {
    /// The scene's name.
    pub scene: String,
    /// The field, as in `Fog` and `FogMode`.
    pub field: &'static str,
    /// Its value.
    pub value: f32,
    /// What is wrong with the value.
    pub reason: &'static str,
    /// Which values are accepted.
    pub allowed: &'static str,
}

impl Fog {
    /// Checks that the fog can be evaluated at any distance. The error names the field, the value and the remedy.
    ///
    /// # Errors
    /// [`FogError`] with the first fault found.
    pub fn validate(&self, scene: &str) -> Result<(), FogError> {
        let not_negative = "a finite number that is at least 0";
        let refuse = |field, value, reason, allowed| {
            Err(FogError { scene: scene.to_owned(), field, value, reason, allowed })
        };
        let number = |field, value: f32| match fault(value) {
            Some(reason) => refuse(field, value, reason, not_negative),
            None => Ok(()),
        };
        let weight = |field, value: f32| {
            number(field, value)?;
            if value > 1.0 { refuse(field, value, "above 1", "a weight from 0 to 1") } else { Ok(()) }
        };
        match self.mode {
            FogMode::Linear { start, end } => {
                number("start", start)?;
                number("end", end)?;
            }
            FogMode::Exponential { density } | FogMode::ExponentialSquared { density } => {
                number("density", density)?;
            }
            FogMode::DepthCue { start, end, near_weight, far_weight } => {
                number("start", start)?;
                number("end", end)?;
                weight("near_weight", near_weight)?;
                weight("far_weight", far_weight)?;
            }
        }
        match color_fault(self.color) {
            Some((value, reason)) => refuse("color", value, reason, not_negative),
            None => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;

    #[test]
    fn faults_are_named() {
        let fog = |mode| Fog { mode, color: Vec3::ONE }.validate("hall");
        assert_eq!(fog(FogMode::Linear { start: 1.0, end: 1.0 }), Ok(()));
        let message = |mode| fog(mode).expect_err("has to be refused").to_string();
        assert!(
            message(FogMode::Exponential { density: -1.0 })
                .contains("\"hall\": density is -1, which is negative")
        );
        assert!(message(FogMode::Linear { start: f32::NAN, end: 1.0 }).contains("start"));
        let cue = FogMode::DepthCue { start: 0.0, end: 1.0, near_weight: 1.5, far_weight: 0.0 };
        assert!(message(cue).contains("near_weight is 1.5, which is above 1"));
        let color = Fog { mode: FogMode::Exponential { density: 0.0 }, color: Vec3::INFINITY };
        assert_eq!(color.validate("hall").map_err(|error| error.field), Err("color"));
    }
}
