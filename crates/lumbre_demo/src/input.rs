//! Player input, independent of any window: held keys, mouse gestures and commands. The keys themselves are
//! assigned in `window`.

use glam::DVec2;
use serde::{Deserialize, Serialize};

/// The keys held during a frame, and the mouse gestures made in it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Input {
    /// Walk in the direction of the view.
    #[serde(skip_serializing_if = "is_default")]
    pub forward: bool,
    /// Walk backwards.
    #[serde(skip_serializing_if = "is_default")]
    pub back: bool,
    /// Walk sideways to the left.
    #[serde(skip_serializing_if = "is_default")]
    pub left: bool,
    /// Walk sideways to the right.
    #[serde(skip_serializing_if = "is_default")]
    pub right: bool,
    /// Run instead of walking.
    #[serde(skip_serializing_if = "is_default")]
    pub run: bool,
    /// Jump, or rise while flying.
    #[serde(skip_serializing_if = "is_default")]
    pub jump: bool,
    /// Sink while flying.
    #[serde(skip_serializing_if = "is_default")]
    pub sink: bool,
    /// Rotation of the view in radians, as the mouse moves: x to the right, y downwards.
    #[serde(skip_serializing_if = "is_default")]
    pub look: DVec2,
    /// Rotation around the target of the view in radians, as the mouse moves: x to the right, y downwards.
    #[serde(skip_serializing_if = "is_default")]
    pub orbit: DVec2,
    /// Shift of the picture as a fraction of its height, as the mouse moves: x to the right, y downwards.
    #[serde(skip_serializing_if = "is_default")]
    pub pan: DVec2,
    /// Notches of the mouse wheel; positive zooms in.
    #[serde(skip_serializing_if = "is_default")]
    pub zoom: f64,
}

fn is_default<T: Default + PartialEq>(value: &T) -> bool {
    *value == T::default()
}

impl Input {
    /// Returns the same keys without mouse gestures: the input of the further steps of a frame.
    pub fn held(self) -> Self {
        Self { look: DVec2::ZERO, orbit: DVec2::ZERO, pan: DVec2::ZERO, zoom: 0.0, ..self }
    }

    /// Adds the gestures of another input, unless any of them is not finite.
    pub fn add_gestures(&mut self, other: &Self) {
        if other.has_finite_gestures() {
            self.look += other.look;
            self.orbit += other.orbit;
            self.pan += other.pan;
            self.zoom += other.zoom;
        }
    }

    /// Returns true if all gestures are finite.
    pub fn has_finite_gestures(&self) -> bool {
        self.look.is_finite() && self.orbit.is_finite() && self.pan.is_finite() && self.zoom.is_finite()
    }

    /// Returns true if the player wants to move, on foot or in flight.
    pub fn wants_to_go(&self) -> bool {
        self.walk() != DVec2::ZERO || self.climb() != 0.0
    }

    /// Returns the walking direction in the player's frame, x to the right and y forward, with length 0 or 1.
    pub fn walk(&self) -> DVec2 {
        let axis = |plus: bool, minus: bool| f64::from(i8::from(plus) - i8::from(minus));
        DVec2::new(axis(self.right, self.left), axis(self.forward, self.back)).normalize_or_zero()
    }

    /// Returns 1 for up, -1 for down and 0 for neither, while flying.
    pub fn climb(&self) -> f64 {
        f64::from(i8::from(self.jump) - i8::from(self.sink))
    }
}

/// A command that is carried out once, when its key is pressed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Action {
    /// Flat shading for every object.
    ShadeFlat,
    /// Gouraud shading for every object: lit per vertex.
    ShadeGouraud,
    /// Phong shading for every object: lit per fragment.
    ShadePhong,
    /// Cycles through flat, Gouraud, Phong and what the level itself asks for.
    CycleShading,
    /// Switches to the next reflection model.
    CycleReflection,
    /// Switches lightmaps on or off.
    ToggleLightmaps,
    /// Switches multisampling on or off.
    ToggleMultisample,
    /// Shows or hides the overlay.
    ToggleOverlay,
    /// Shows or hides the counts of lights in the overlay.
    ToggleLightCounts,
    /// Shows or hides the reference picture beside the frame.
    ToggleReference,
    /// Measures what lights and other settings would cost in this view.
    MeasureSettings,
    /// Chooses the next cheaper settings, once they are measured.
    CheaperSettings,
    /// Chooses the next better settings, once they are measured.
    BetterSettings,
    /// Switches the torch on or off.
    ToggleTorch,
    /// Switches between walking and flying through walls.
    ToggleFlight,
    /// Frames the whole scene and turns around it.
    OrbitEverything,
    /// Looks through the file's next camera.
    NextCamera,
    /// Switches between a metered exposure and the camera's.
    ToggleAutoExposure,
    /// Bakes the file, or cancels the bake that runs.
    ToggleBake,
    /// Writes the baked file.
    SaveBake,
    /// Quits the game.
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
