//! How a body moves through a level: gravity, walls and steps. The player that it belongs to is in `player`.
//!
//! ```text
//!        ┌───┐  ─ feet + 1.75 m
//!        │   │
//!        │ o │    capsule against walls: pushed out sideways, so it slides
//!        │   │
//!        └───┘  ─ feet + 0.35 m: lower obstacles are stepped onto
//!         |||     nine rays find the ground
//!         feet
//! ```

mod capsule;
mod collide;
mod ground;
mod triangle_tree;

pub use capsule::Capsule;
pub use collide::{overlaps, push_out};
pub use ground::ground_below;
pub use triangle_tree::TriangleTree;

use glam::{DVec2, DVec3};

/// The size and abilities of a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stature {
    /// Radius, metres.
    pub radius: f64,
    /// From the feet to the top of the head, metres.
    pub height: f64,
    /// Height of the eyes above the feet, metres.
    pub eyes: f64,
    /// Highest step that is climbed, metres.
    pub step: f64,
    /// Speed of walking, m/s.
    pub walk: f64,
    /// Speed of running, m/s.
    pub run: f64,
    /// Vertical speed at the start of a jump, m/s.
    pub jump: f64,
}

impl Default for Stature {
    fn default() -> Self {
        Self { radius: 0.3, height: 1.75, eyes: 1.62, step: 0.35, walk: 2.8, run: 5.0, jump: 4.0 }
    }
}

impl Stature {
    /// Returns the collision capsule of a body with its feet at `feet`. It ends one step above the ground.
    pub fn capsule(&self, feet: DVec3) -> Capsule {
        let bottom = feet + DVec3::Y * (self.step + self.radius);
        Capsule {
            bottom,
            height: (self.height - self.step - 2.0 * self.radius).max(0.0),
            radius: self.radius,
        }
    }
}

/// Position and motion of a body.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Body {
    /// Lowest point, metres in the world.
    pub feet: DVec3,
    /// Metres per second.
    pub velocity: DVec3,
    /// Whether it stands, rather than falls or flies.
    pub on_ground: bool,
}

/// The motion that a body is asked to make in a step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Wish {
    /// Horizontal velocity in the world's x and z, m/s.
    pub velocity: DVec2,
    /// Whether to jump.
    pub jump: bool,
}

/// Gravitational acceleration, m/s².
pub const GRAVITY: f64 = 9.81;
/// Largest speed of a body, m/s.
const TERMINAL: f64 = 50.0;
/// Rate at which a body on the ground approaches the wished velocity, 1/s.
const GRIP: f64 = 14.0;
/// Rate at which a body in the air approaches it, 1/s.
const AIR_CONTROL: f64 = 1.5;

/// Moves a body for `seconds`, clamped to [0, 1], in sub-steps of at most half its radius, so that it never
/// tunnels through a wall.
pub fn move_body(body: &mut Body, wish: Wish, stature: &Stature, level: &TriangleTree, seconds: f64) {
    let seconds = seconds.clamp(0.0, 1.0);
    if wish.jump && body.on_ground {
        body.velocity.y = stature.jump;
        body.on_ground = false;
    }
    let grip = if body.on_ground { GRIP } else { AIR_CONTROL };
    let share = 1.0 - (-grip * seconds).exp();
    body.velocity.x += (wish.velocity.x - body.velocity.x) * share;
    body.velocity.z += (wish.velocity.y - body.velocity.z) * share;
    if !body.on_ground {
        body.velocity.y -= GRAVITY * seconds;
    }
    body.velocity = body.velocity.clamp_length_max(TERMINAL);
    let distance = body.velocity.length() * seconds;
    // At most 50 m in sub-steps of some centimetres. The lower bound limits their number for a body without a
    // size.
    let steps = (distance / (0.5 * stature.radius).max(0.01)).ceil().max(1.0);
    for _ in 0..steps as usize {
        advance(body, stature, level, seconds / steps);
    }
}

fn advance(body: &mut Body, stature: &Stature, level: &TriangleTree, seconds: f64) {
    let before = body.feet;
    body.feet += body.velocity * seconds;
    let mut capsule = stature.capsule(body.feet);
    let bottom = capsule.bottom;
    push_out(&mut capsule, before + (bottom - body.feet), level, |normal| {
        body.velocity -= normal * body.velocity.dot(normal).min(0.0);
    });
    body.feet += capsule.bottom - bottom;

    // A standing body also follows steps down, a falling body lands on what its feet passed through, and a
    // rising body does neither.
    let down = if body.on_ground { stature.step } else { 0.0 };
    let ground = (body.velocity.y <= 0.0).then(|| ground_below(body.feet, down, stature, level)).flatten();
    let Some(height) = ground else {
        body.on_ground = false;
        return;
    };
    let raised = body.feet.with_y(height);
    if height > body.feet.y && overlaps(&stature.capsule(raised), level) {
        // There is no headroom above that step, so it acts as a wall.
        body.feet = before.with_y(body.feet.y);
        body.velocity = DVec3::new(0.0, body.velocity.y, 0.0);
        return;
    }
    body.feet = raised;
    body.velocity.y = 0.0;
    body.on_ground = true;
}

#[cfg(test)]
mod tests;
