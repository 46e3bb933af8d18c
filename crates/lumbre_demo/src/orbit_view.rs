//! A view that orbits a target, as in viewers of glTF files. `game` applies it to a camera.

use glam::{DQuat, DVec2, DVec3};
use lumbre_scene::{Bounds, Transform};

/// Largest angle of the view above or below the horizon, radians; slightly less than a right angle.
const STEEPEST_VIEW: f64 = 1.55;
/// Factor on the distance for one notch of the mouse wheel.
const NOTCH: f64 = 0.85;
/// Smallest and largest distance of the eye, in radii of the scene.
const NEAREST: f64 = 1e-3;
const FARTHEST: f64 = 100.0;

/// An eye on a sphere around its target.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OrbitView {
    /// The point that it looks at, metres.
    pub target: DVec3,
    /// Distance of the eye from the target, metres.
    pub distance: f64,
    /// Direction of the view about +Y in radians; 0 looks along -Z, and larger angles turn to the left.
    pub yaw: f64,
    /// Direction of the view above the horizon, radians.
    pub pitch: f64,
    /// Half the diagonal of the scene in metres, which limits the distance.
    pub radius: f64,
}

impl OrbitView {
    /// Creates an orbit from a camera's view. The target is the point on its line of sight that is nearest to
    /// the scene's centre.
    pub fn of_camera(view: &Transform, bounds: &Bounds) -> Self {
        let radius = bounds.radius().max(1e-6);
        let forward = view.rotation * DVec3::NEG_Z;
        let along = (bounds.center() - view.translation).dot(forward);
        // Inside a room, or facing away from the scene, the target is still a point in front of the eye.
        let distance = along.clamp(0.05 * radius, FARTHEST * radius);
        let flat = DVec2::new(-forward.x, -forward.z);
        let yaw = match flat.length() > 1e-6 {
            true => flat.x.atan2(flat.y),
            // Looking straight up or down, the camera's own up vector gives the heading.
            false => {
                let up = (view.rotation * DVec3::Y) * -forward.y.signum();
                (-up.x).atan2(-up.z)
            }
        };
        let pitch = forward.y.clamp(-1.0, 1.0).asin().clamp(-STEEPEST_VIEW, STEEPEST_VIEW);
        Self { target: view.translation + forward * distance, distance, yaw, pitch, radius }
    }

    /// Turns around the target by `turn`, to the right and downwards in radians, so that the picture follows
    /// the mouse.
    pub fn turn(&mut self, turn: DVec2) {
        if turn.is_finite() {
            self.yaw = (self.yaw - turn.x).rem_euclid(std::f64::consts::TAU);
            self.pitch = (self.pitch - turn.y).clamp(-STEEPEST_VIEW, STEEPEST_VIEW);
        }
    }

    /// Moves the target across the view by `motion`, to the right and downwards as fractions of the picture's
    /// height, so that the picture follows the mouse. The picture shows `height` metres per metre of
    /// distance.
    pub fn pan(&mut self, motion: DVec2, height: f64) {
        if motion.is_finite() {
            let across = DVec3::new(-motion.x, motion.y, 0.0) * height * self.distance;
            self.target += self.rotation() * across;
        }
    }

    /// Moves the eye closer by a number of wheel notches, or away for a negative number.
    pub fn zoom(&mut self, notches: f64) {
        if notches.is_finite() {
            let distance = self.distance * NOTCH.powf(notches.clamp(-50.0, 50.0));
            self.distance = distance.clamp(NEAREST * self.radius, FARTHEST * self.radius);
        }
    }

    /// Returns the transform of the eye.
    pub fn place(&self) -> Transform {
        let rotation = self.rotation();
        let eye = self.target + rotation * DVec3::Z * self.distance;
        Transform::from_translation(eye).with_rotation(rotation)
    }

    /// Returns a distance of the near plane that clips nothing at this distance.
    pub fn near(&self) -> f64 {
        (0.01 * self.distance).min(1e-3 * self.radius).max(1e-9)
    }

    fn rotation(&self) -> DQuat {
        DQuat::from_rotation_y(self.yaw) * DQuat::from_rotation_x(self.pitch)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const UNIT: Bounds = Bounds { min: DVec3::NEG_ONE, max: DVec3::ONE };

    fn forward(view: &OrbitView) -> DVec3 {
        view.place().rotation * DVec3::NEG_Z
    }

    #[test]
    fn begins_where_the_camera_is_and_turns_around_the_middle() {
        let camera = Transform::from_xyz(3.0, 2.0, 4.0).looking_at(DVec3::ZERO, DVec3::Y);
        let mut view = OrbitView::of_camera(&camera, &UNIT);
        assert!(view.place().translation.distance(camera.translation) < 1e-9);
        assert!(forward(&view).distance(camera.rotation * DVec3::NEG_Z) < 1e-9);
        assert!(view.target.length() < 1e-9);
        let distance = view.distance;
        // A quarter turn to the right: the side that was on the left is now in front.
        let right = camera.rotation * DVec3::X;
        view.turn(DVec2::new(std::f64::consts::FRAC_PI_2, 0.0));
        let eye = view.place().translation;
        assert!((eye.length() - distance).abs() < 1e-9 && eye.y > 1.99 && eye.y < 2.01);
        assert!(eye.dot(right) < -0.9 * (3.0f64 * 3.0 + 4.0 * 4.0).sqrt(), "{eye}");
        view.turn(DVec2::new(0.0, 100.0));
        assert_eq!(view.pitch, -STEEPEST_VIEW);
        view.turn(DVec2::NAN);
        assert!(view.place().translation.is_finite());
    }

    #[test]
    fn what_lies_under_the_mouse_follows_it() {
        let camera = Transform::from_xyz(0.0, 0.0, 5.0);
        let mut view = OrbitView::of_camera(&camera, &UNIT);
        let height = 2.0 * (0.5f64 * 0.7).tan();
        // The position of the world's origin in the picture, as fractions of its height from the centre, y
        // downwards.
        let seen = |view: &OrbitView| {
            let from = view.place().affine().inverse().transform_point3(DVec3::ZERO);
            DVec2::new(from.x, -from.y) / (-from.z * height)
        };
        assert!(seen(&view).length() < 1e-9);
        view.pan(DVec2::new(0.25, -0.1), height);
        assert!(seen(&view).distance(DVec2::new(0.25, -0.1)) < 1e-9, "{}", seen(&view));
    }

    #[test]
    fn the_wheel_neither_reaches_the_target_nor_infinity() {
        let mut view = OrbitView::of_camera(&Transform::from_xyz(0.0, 0.0, 5.0), &UNIT);
        view.zoom(1.0);
        assert!((view.distance - 5.0 * NOTCH).abs() < 1e-12);
        view.zoom(-1.0);
        assert!((view.distance - 5.0).abs() < 1e-12);
        for notches in [1e9, -1e9, f64::NAN] {
            view.zoom(notches);
            view.zoom(notches);
            assert!(view.distance > 0.0 && view.distance < 1e3 && view.near() > 0.0);
        }
    }

    #[test]
    fn looking_straight_down_keeps_the_heading() {
        let camera = Transform::from_xyz(0.0, 5.0, 0.0).looking_at(DVec3::ZERO, DVec3::NEG_Z);
        let view = OrbitView::of_camera(&camera, &UNIT);
        // What was up in the picture stays up.
        assert!((view.place().rotation * DVec3::Y).dot(DVec3::NEG_Z) > 0.99);
        let nothing = OrbitView::of_camera(&Transform::IDENTITY, &Bounds::EMPTY);
        assert!(nothing.place().translation.is_finite() && nothing.distance > 0.0);
    }
}
