//! What a player or viewer wants, free of any window: held keys, gestures of the mouse, and one-off commands. Which key means what is the
//! window's.

use glam::DVec2;
use serde::{Deserialize, Serialize};

/// What is held down, and how far the view turns, during one frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Input {
    /// Walk where the view points.
    #[serde(skip_serializing_if = "is_false")]
    pub forward: bool,
    /// Walk backwards.
    #[serde(skip_serializing_if = "is_false")]
    pub back: bool,
    /// Step to the left.
    #[serde(skip_serializing_if = "is_false")]
    pub left: bool,
    /// Step to the right.
    #[serde(skip_serializing_if = "is_false")]
    pub right: bool,
    /// Faster.
    #[serde(skip_serializing_if = "is_false")]
    pub run: bool,
    /// Jump, or rise when flying.
    #[serde(skip_serializing_if = "is_false")]
    pub jump: bool,
    /// Sink when flying.
    #[serde(skip_serializing_if = "is_false")]
    pub sink: bool,
    /// Turn of the view in radians: x to the right, y downwards, as a mouse moves.
    #[serde(skip_serializing_if = "is_zero")]
    pub look: DVec2,
    /// Turn around what is looked at in radians: x to the right, y downwards, as a mouse moves.
    #[serde(skip_serializing_if = "is_zero")]
    pub orbit: DVec2,
    /// Shift of the picture in parts of its height: x to the right, y downwards, as a mouse moves.
    #[serde(skip_serializing_if = "is_zero")]
    pub pan: DVec2,
    /// Notches of the wheel towards what is looked at.
    #[serde(skip_serializing_if = "is_still")]
    pub zoom: f64,
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde calls it with a reference")]
fn is_false(value: &bool) -> bool {
    !*value
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde calls it with a reference")]
fn is_still(value: &f64) -> bool {
    *value == 0.0
}

fn is_zero(value: &DVec2) -> bool {
    *value == DVec2::ZERO
}

impl Input {
    /// The same keys with the mouse at rest: what the following steps of the same frame see.
    pub fn held(self) -> Self {
        Self { look: DVec2::ZERO, orbit: DVec2::ZERO, pan: DVec2::ZERO, zoom: 0.0, ..self }
    }

    /// Adds what the mouse did in another input; gestures that are no numbers are left out.
    pub fn add_gestures(&mut self, other: &Self) {
        if other.has_finite_gestures() {
            self.look += other.look;
            self.orbit += other.orbit;
            self.pan += other.pan;
            self.zoom += other.zoom;
        }
    }

    /// Whether everything that the mouse did is a number.
    pub fn has_finite_gestures(&self) -> bool {
        self.look.is_finite() && self.orbit.is_finite() && self.pan.is_finite() && self.zoom.is_finite()
    }

    /// Whether somebody wants to go somewhere on foot or in flight.
    pub fn wants_to_go(&self) -> bool {
        self.walk() != DVec2::ZERO || self.climb() != 0.0
    }

    /// Walking direction in the player's frame, x to the right and y forward, of length 0 or 1.
    pub fn walk(&self) -> DVec2 {
        let axis = |plus: bool, minus: bool| f64::from(i8::from(plus) - i8::from(minus));
        DVec2::new(axis(self.right, self.left), axis(self.forward, self.back)).normalize_or_zero()
    }

    /// Up (1) or down (-1) when flying.
    pub fn climb(&self) -> f64 {
        f64::from(i8::from(self.jump) - i8::from(self.sink))
    }
}

/// A command that happens once, when its key goes down.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Action {
    /// Shade every object flat.
    ShadeFlat,
    /// Shade every object at its vertices.
    ShadeGouraud,
    /// Shade every object at every fragment.
    ShadePhong,
    /// Flat, Gouraud, Phong, and what the level itself asks for.
    CycleShading,
    /// The next reflection model.
    CycleReflection,
    /// Lightmaps on or off.
    ToggleLightmaps,
    /// Multisampling on or off.
    ToggleMultisample,
    /// The overlay on or off.
    ToggleOverlay,
    /// Counts of lights in the overlay on or off.
    ToggleLightCounts,
    /// The most accurate picture of the view beside the frame, or not.
    ToggleReference,
    /// Measure what lights and other settings would cost in this view.
    MeasureSettings,
    /// The settings that are the next cheaper ones, once they are measured.
    CheaperSettings,
    /// The settings that are the next better ones, once they are measured.
    BetterSettings,
    /// The torch on or off.
    ToggleTorch,
    /// Walk, or fly through walls.
    ToggleFlight,
    /// Turn around the whole scene.
    OrbitEverything,
    /// Look through the next camera of the file.
    NextCamera,
    /// Meter the exposure, or take the camera's.
    ToggleAutoExposure,
    /// Bake the file, or cancel the bake that runs.
    ToggleBake,
    /// Write the baked file.
    SaveBake,
    /// Leave the game.
    Quit,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn opposite_keys_cancel_and_diagonals_are_no_faster() {
        let both = Input { forward: true, back: true, left: true, ..Input::default() };
        assert_eq!(both.walk(), DVec2::new(-1.0, 0.0));
        let diagonal = Input { forward: true, right: true, ..Input::default() };
        assert!((diagonal.walk().length() - 1.0).abs() < 1e-15);
        assert_eq!(Input::default().walk(), DVec2::ZERO);
    }

    #[test]
    fn only_what_is_pressed_is_written() {
        let input = Input { forward: true, look: DVec2::new(0.5, 0.0), ..Input::default() };
        let text = serde_json::to_string(&input).unwrap();
        assert_eq!(text, r#"{"forward":true,"look":[0.5,0.0]}"#);
        assert_eq!(serde_json::from_str::<Input>(&text).unwrap(), input);
        assert!(serde_json::from_str::<Input>(r#"{"foward":true}"#).is_err());
        assert_eq!(serde_json::to_string(&Action::CycleShading).unwrap(), r#""cycle-shading""#);
    }
}
