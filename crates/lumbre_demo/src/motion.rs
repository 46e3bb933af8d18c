//! Motions of lights and props, as stored in `extras.lumbre_demo.motion` of a glTF node, and their
//! evaluation. The system that applies them is in `moving`.

use std::f64::consts::TAU;

use bevy_ecs::prelude::*;
use glam::{DQuat, DVec3};
use serde::{Deserialize, Serialize};

/// Motions relative to the transform that the file gives; all that are present add up. Each is a function of
/// the time alone, so that the same time always shows the same picture, whatever the frame rate.
#[derive(Component, Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Motion {
    /// A circular orbit.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub orbit: Option<Orbit>,
    /// An oscillation along a line.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bob: Option<Bob>,
    /// A pendulum.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub swing: Option<Swing>,
    /// A rotation about itself.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub spin: Option<Spin>,
    /// Along a closed curve through points.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub path: Option<Path>,
    /// A flickering light.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub flicker: Option<Flicker>,
}

/// A circle about the resting position.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Orbit {
    /// Metres.
    pub radius: f64,
    /// Seconds per revolution; negative reverses the direction.
    pub period: f64,
    /// Fraction of a revolution that it is ahead.
    #[serde(default)]
    pub phase: f64,
    /// The axis of the circle.
    #[serde(default = "up")]
    pub axis: DVec3,
}

/// A sinusoidal oscillation along a line.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Bob {
    /// From the centre to one end, metres.
    pub reach: DVec3,
    /// Seconds per oscillation.
    pub period: f64,
    /// Fraction of an oscillation that it is ahead.
    #[serde(default)]
    pub phase: f64,
}

/// A pendulum's oscillating rotation about a pivot.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Swing {
    /// Largest angle, radians.
    pub angle: f64,
    /// Seconds per oscillation.
    pub period: f64,
    /// Fraction of an oscillation that it is ahead.
    #[serde(default)]
    pub phase: f64,
    /// The pivot, metres from the resting position.
    #[serde(default)]
    pub pivot: DVec3,
    /// The axis of rotation.
    pub axis: DVec3,
}

/// A rotation at constant speed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Spin {
    /// Seconds per revolution; negative reverses the direction.
    pub period: f64,
    /// The axis of rotation.
    #[serde(default = "up")]
    pub axis: DVec3,
}

/// A closed Catmull-Rom curve, with the same time from each point to the next.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Path {
    /// Two points or more, metres in the parent's space; the resting position has no effect.
    pub points: Vec<DVec3>,
    /// Seconds per round.
    pub period: f64,
    /// Fraction of a round that it is ahead.
    #[serde(default)]
    pub phase: f64,
}

/// A factor on the light's colours that varies between `1 - depth` and 1.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Flicker {
    /// Depth of the variation, in [0, 1].
    pub depth: f64,
    /// Period of the slowest wave, seconds.
    pub period: f64,
    /// Fraction of a wave that it is ahead.
    #[serde(default)]
    pub phase: f64,
}

fn up() -> DVec3 {
    DVec3::Y
}

/// Displacement from the resting transform, and brightness.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// Added to the resting translation, metres.
    pub offset: DVec3,
    /// Replaces the resting translation, if given, before the offset is added.
    pub place: Option<DVec3>,
    /// Applied after the resting rotation, in the parent's space.
    pub rotation: DQuat,
    /// Factor on the light's colours, [0, 1].
    pub brightness: f64,
}

/// A motion with a number out of range.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("motion.{field} of node \"{node}\" must be {expected}")]
pub struct MotionError {
    /// The name of the node.
    pub node: String,
    /// The field.
    pub field: &'static str,
    /// What its value must be.
    pub expected: &'static str,
}

impl Motion {
    /// Checks that all numbers are finite, periods are a millisecond or more, axes have a direction, and
    /// paths have two points or more.
    ///
    /// # Errors
    /// [`MotionError`] for the first number that fails; it names the node.
    pub fn validate(&self, node: &str) -> Result<(), MotionError> {
        let check = |ok: bool, field, expected| {
            if ok { Ok(()) } else { Err(MotionError { node: node.to_owned(), field, expected }) }
        };
        let turns = |period: f64, phase: f64| period.is_finite() && period.abs() >= 1e-3 && phase.is_finite();
        const PERIOD: &str = "finite, with a period of a millisecond or more";
        let is_axis = |axis: DVec3| axis.is_finite() && axis.try_normalize().is_some();
        const AXIS: &str = "a finite vector other than zero";
        if let Some(orbit) = &self.orbit {
            check(turns(orbit.period, orbit.phase) && orbit.radius.is_finite(), "orbit", PERIOD)?;
            check(is_axis(orbit.axis), "orbit.axis", AXIS)?;
        }
        if let Some(bob) = &self.bob {
            check(turns(bob.period, bob.phase) && bob.reach.is_finite(), "bob", PERIOD)?;
        }
        if let Some(swing) = &self.swing {
            let numbers = swing.angle.is_finite() && swing.pivot.is_finite();
            check(turns(swing.period, swing.phase) && numbers, "swing", PERIOD)?;
            check(is_axis(swing.axis), "swing.axis", AXIS)?;
        }
        if let Some(spin) = &self.spin {
            check(turns(spin.period, 0.0), "spin", PERIOD)?;
            check(is_axis(spin.axis), "spin.axis", AXIS)?;
        }
        if let Some(path) = &self.path {
            check(turns(path.period, path.phase), "path", PERIOD)?;
            let points = path.points.len() >= 2 && path.points.iter().all(|point| point.is_finite());
            check(points, "path.points", "two finite points or more")?;
        }
        if let Some(flicker) = &self.flicker {
            check(turns(flicker.period, flicker.phase), "flicker", PERIOD)?;
            check((0.0..=1.0).contains(&flicker.depth), "flicker.depth", "in [0, 1]")?;
        }
        Ok(())
    }

    /// Returns the pose at a time in seconds.
    pub fn pose(&self, seconds: f64) -> Pose {
        let turn = |period: f64, phase: f64| TAU * (seconds / period + phase).rem_euclid(1.0);
        let mut pose = Pose { offset: DVec3::ZERO, place: None, rotation: DQuat::IDENTITY, brightness: 1.0 };
        if let Some(path) = &self.path {
            pose.place =
                Some(closed_curve(&path.points, (seconds / path.period + path.phase).rem_euclid(1.0)));
        }
        if let Some(orbit) = &self.orbit {
            let axis = orbit.axis.normalize_or(DVec3::Y);
            let start = axis.any_orthonormal_vector();
            pose.offset +=
                DQuat::from_axis_angle(axis, turn(orbit.period, orbit.phase)) * start * orbit.radius;
        }
        if let Some(bob) = &self.bob {
            pose.offset += bob.reach * turn(bob.period, bob.phase).sin();
        }
        if let Some(swing) = &self.swing {
            let angle = swing.angle * turn(swing.period, swing.phase).sin();
            let rotation = DQuat::from_axis_angle(swing.axis.normalize_or(DVec3::X), angle);
            pose.offset += swing.pivot - rotation * swing.pivot;
            pose.rotation = rotation;
        }
        if let Some(spin) = &self.spin {
            pose.rotation *= DQuat::from_axis_angle(spin.axis.normalize_or(DVec3::Y), turn(spin.period, 0.0));
        }
        if let Some(flicker) = &self.flicker {
            pose.brightness = flicker.brightness(seconds);
        }
        pose
    }
}

impl Flicker {
    /// Sums three waves whose periods have no small common multiple, so that the pattern never seems to
    /// repeat.
    fn brightness(&self, seconds: f64) -> f64 {
        let wave =
            |speed: f64| 0.5 + 0.5 * (TAU * (seconds / self.period * speed + self.phase * speed)).sin();
        1.0 - self.depth * (0.5 * wave(1.0) + 0.3 * wave(2.659) + 0.2 * wave(7.243))
    }
}

/// Returns the point on a closed uniform Catmull-Rom curve at a fraction of its round, [0, 1).
pub fn closed_curve(points: &[DVec3], part: f64) -> DVec3 {
    if points.is_empty() {
        return DVec3::ZERO;
    }
    let position = part * points.len() as f64;
    let first = (position.floor() as usize).min(points.len() - 1);
    let at = |step: usize| points[(first + step + points.len() - 1) % points.len()];
    catmull_rom([at(0), at(1), at(2), at(3)], position - first as f64)
}

/// Interpolates between the second and the third of four points (Catmull and Rom 1974, tension 1/2).
pub fn catmull_rom([a, b, c, d]: [DVec3; 4], t: f64) -> DVec3 {
    let linear = c - a;
    let quadratic = 2.0 * a - 5.0 * b + 4.0 * c - d;
    let cubic = 3.0 * b - a - 3.0 * c + d;
    0.5 * (2.0 * b + (linear + (quadratic + cubic * t) * t) * t)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_orbit_is_a_circle_and_comes_round() {
        let orbit = Orbit { radius: 2.0, period: 8.0, phase: 0.25, axis: DVec3::new(0.0, 3.0, 0.0) };
        let motion = Motion { orbit: Some(orbit), ..Motion::default() };
        for step in 0..16 {
            let offset = motion.pose(f64::from(step) * 0.7).offset;
            assert!((offset.length() - 2.0).abs() < 1e-12 && offset.y.abs() < 1e-12);
        }
        assert!(motion.pose(1.0).offset.distance(motion.pose(9.0).offset) < 1e-12);
        assert!(motion.pose(1.0).offset.distance(-motion.pose(5.0).offset) < 1e-12);
    }

    #[test]
    fn a_pendulum_keeps_its_distance_from_the_pivot() {
        let pivot = DVec3::new(0.0, 1.5, 0.0);
        let swing = Swing { angle: 0.6, period: 2.0, phase: 0.0, pivot, axis: DVec3::X };
        let motion = Motion { swing: Some(swing), ..Motion::default() };
        for step in 0..20 {
            assert!((motion.pose(f64::from(step) * 0.13).offset.distance(pivot) - 1.5).abs() < 1e-12);
        }
        // At a quarter of the period the angle is largest.
        let height = motion.pose(0.5).offset.y;
        assert!((height - 1.5 * (1.0 - 0.6f64.cos())).abs() < 1e-12);
    }

    #[test]
    fn a_path_goes_through_its_points() {
        let points = vec![DVec3::ZERO, DVec3::X, DVec3::new(1.0, 0.0, 2.0), DVec3::Z];
        let path = Path { points: points.clone(), period: 4.0, phase: 0.0 };
        let motion = Motion { path: Some(path), ..Motion::default() };
        for (second, point) in points.iter().enumerate() {
            assert!(motion.pose(second as f64 + 4.0).place.unwrap().distance(*point) < 1e-12);
        }
        // Catmull-Rom reproduces straight lines.
        let line = [0.0, 1.0, 2.0, 3.0].map(|x| DVec3::X * x);
        assert!(catmull_rom(line, 0.3).distance(DVec3::X * 1.3) < 1e-12);
    }

    #[test]
    fn a_flicker_stays_in_its_depth_and_moves() {
        let flicker = Flicker { depth: 0.4, period: 0.8, phase: 0.1 };
        let values: Vec<f64> = (0..500).map(|step| flicker.brightness(f64::from(step) * 0.01)).collect();
        assert!(values.iter().all(|value| (0.6..=1.0).contains(value)));
        let least = values.iter().copied().fold(f64::INFINITY, f64::min);
        let most = values.iter().copied().fold(0.0, f64::max);
        assert!(most - least > 0.2);
    }

    #[test]
    fn bad_numbers_are_refused_by_name() {
        let motion = |text: &str| serde_json::from_str::<Motion>(text).unwrap();
        let refused = |text: &str| motion(text).validate("lamp").unwrap_err().to_string();
        assert!(refused(r#"{"orbit":{"radius":1,"period":0}}"#).contains("motion.orbit of node \"lamp\""));
        assert!(refused(r#"{"spin":{"period":1,"axis":[0,0,0]}}"#).contains("spin.axis"));
        assert!(refused(r#"{"path":{"period":1,"points":[]}}"#).contains("path.points"));
        assert!(refused(r#"{"flicker":{"depth":2,"period":1}}"#).contains("flicker.depth"));
        assert!(refused(r#"{"bob":{"reach":[0,1e999,0],"period":1}}"#.replace("1e999", "1e308").as_str().replace("\"period\":1", "\"period\":1e-9").as_str()).contains("bob"));
        assert!(motion(r#"{"spin":{"period":-3}}"#).validate("lamp").is_ok());
    }
}
