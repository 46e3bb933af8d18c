//! The player: a body and the direction of its view, walking or flying. Collisions with the level are in
//! `walking`.

use bevy_ecs::prelude::*;
use glam::{DQuat, DVec2, DVec3};
use lumbre_scene::Transform;

use crate::input::Input;
use crate::walking::{Body, Stature, TriangleTree, Wish, move_body};

/// Largest angle of the view above or below the horizon, radians; slightly less than a right angle.
const STEEPEST_VIEW: f64 = 1.55;
/// Rate at which the eyes follow the feet up a step, 1/s.
const EYE_FOLLOW: f64 = 12.0;
/// Speed of flying as a multiple of walking, in scenes of human size.
const FLIGHT: f64 = 1.5;

/// The player.
#[derive(Component, Clone, Copy, Debug, PartialEq)]
pub struct Player {
    /// Position and velocity of the body.
    pub body: Body,
    /// Direction of the view about +Y in radians; 0 looks along -Z, and larger angles turn to the left.
    pub yaw: f64,
    /// Direction of the view above the horizon, radians.
    pub pitch: f64,
    /// How far the eyes are above their proper height, metres: the feet climb a step at once, and the eyes
    /// follow smoothly.
    pub eye_lag: f64,
    /// Whether the player flies: through walls and without gravity.
    pub flying: bool,
    /// Speed of flying, m/s. Running flies faster by the same factor as on foot.
    pub flight_speed: f64,
    /// Size and speed.
    pub stature: Stature,
}

impl Player {
    /// Creates a player whose eyes are where a camera is, looking in its direction.
    pub fn with_eyes_at(view: &Transform) -> Self {
        let stature = Stature::default();
        let body = Body { feet: view.translation - DVec3::Y * stature.eyes, ..Body::default() };
        let forward = view.rotation * DVec3::NEG_Z;
        let flat = DVec2::new(-forward.x, -forward.z);
        let yaw = if flat.length() > 1e-6 { flat.x.atan2(flat.y) } else { 0.0 };
        let pitch = forward.y.clamp(-1.0, 1.0).asin().clamp(-STEEPEST_VIEW, STEEPEST_VIEW);
        let flight_speed = FLIGHT * stature.walk;
        Self { body, yaw, pitch, eye_lag: 0.0, flying: false, flight_speed, stature }
    }

    /// Turns the view by `look`, to the right and downwards in radians.
    pub fn turn(&mut self, look: DVec2) {
        if look.is_finite() {
            self.yaw = (self.yaw - look.x).rem_euclid(std::f64::consts::TAU);
            self.pitch = (self.pitch - look.y).clamp(-STEEPEST_VIEW, STEEPEST_VIEW);
        }
    }

    /// Advances the player by one step of `seconds`.
    pub fn step(&mut self, input: &Input, level: &TriangleTree, seconds: f64) {
        self.turn(input.look);
        let speed = if input.run { self.stature.run } else { self.stature.walk };
        let walk = input.walk();
        if self.flying {
            let ahead = self.view_rotation() * DVec3::new(walk.x, 0.0, -walk.y);
            self.body.velocity =
                (ahead + DVec3::Y * input.climb()) * self.flight_speed * speed / self.stature.walk;
            self.body.feet += self.body.velocity * seconds;
            self.body.on_ground = false;
            return;
        }
        let ahead = DQuat::from_rotation_y(self.yaw) * DVec3::new(walk.x, 0.0, -walk.y);
        let wish = Wish { velocity: DVec2::new(ahead.x, ahead.z) * speed, jump: input.jump };
        let (before, stood) = (self.body.feet.y, self.body.on_ground);
        move_body(&mut self.body, wish, &self.stature, level, seconds);
        if stood && self.body.on_ground {
            self.eye_lag += before - self.body.feet.y;
        }
        self.eye_lag *= (-EYE_FOLLOW * seconds).exp();
        self.eye_lag = self.eye_lag.clamp(-2.0 * self.stature.step, 2.0 * self.stature.step);
    }

    /// Returns the current height of the eyes above the feet, metres.
    pub fn eye_height(&self) -> f64 {
        self.stature.eyes + self.eye_lag
    }

    /// Returns the rotation from the camera's space to the world's.
    pub fn view_rotation(&self) -> DQuat {
        DQuat::from_rotation_y(self.yaw) * DQuat::from_rotation_x(self.pitch)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn takes_over_the_view_of_a_camera() {
        let target = DVec3::new(3.0, 2.0, -1.0);
        let view = Transform::from_xyz(1.0, 1.7, 4.0).looking_at(target, DVec3::Y);
        let player = Player::with_eyes_at(&view);
        let forward = player.view_rotation() * DVec3::NEG_Z;
        assert!(forward.distance((target - view.translation).normalize()) < 1e-12);
        assert_eq!(player.body.feet, DVec3::new(1.0, 1.7 - 1.62, 4.0));
        let down = Player::with_eyes_at(&Transform::default().looking_at(DVec3::NEG_Y, DVec3::Y));
        assert_eq!(down.pitch, -STEEPEST_VIEW);
        assert!(down.yaw.is_finite());
    }

    #[test]
    fn turning_right_is_clockwise_from_above_and_the_neck_has_limits() {
        let mut player = Player::with_eyes_at(&Transform::default());
        player.turn(DVec2::new(std::f64::consts::FRAC_PI_2, 0.0));
        assert!((player.view_rotation() * DVec3::NEG_Z).distance(DVec3::X) < 1e-12);
        player.turn(DVec2::new(0.0, 100.0));
        assert_eq!(player.pitch, -STEEPEST_VIEW);
        player.turn(DVec2::new(f64::NAN, 0.0));
        assert!(player.yaw.is_finite());
    }

    #[test]
    fn flies_where_it_looks() {
        let mut player = Player::with_eyes_at(&Transform::default());
        player.flying = true;
        player.turn(DVec2::new(0.0, -0.5));
        let forward = Input { forward: true, ..Input::default() };
        player.step(&forward, &TriangleTree::default(), 1.0);
        let moved = player.body.feet + DVec3::Y * player.stature.eyes;
        assert!(moved.normalize().distance(player.view_rotation() * DVec3::NEG_Z) < 1e-12);
        assert!((moved.length() - player.stature.walk * FLIGHT).abs() < 1e-12);
    }
}
