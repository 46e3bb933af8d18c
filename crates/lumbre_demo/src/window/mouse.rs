//! The mouse: while grabbed it turns the view; otherwise it points, and drags what it is pressed on.

use glam::DVec2;
use winit::dpi::PhysicalPosition;
use winit::event::{MouseButton, MouseScrollDelta};
use winit::window::{CursorGrabMode, Window};

use crate::input::Input;

/// Rotation of the view in radians per unit of mouse motion.
const SENSITIVITY: f64 = 0.0022;

/// Whether the game has grabbed the mouse, and how.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Grab {
    /// Not grabbed.
    #[default]
    Released,
    /// Grabbed, with a pointer that does not move.
    Locked,
    /// Grabbed, with a pointer that is confined to the window and moved back to its centre.
    Confined,
}

impl Grab {
    /// Returns true if the game has grabbed the mouse.
    pub fn is_held(self) -> bool {
        self != Self::Released
    }

    /// Grabs the mouse in the best way that the system offers.
    pub fn take(window: &Window) -> Self {
        let ways = [(CursorGrabMode::Locked, Self::Locked), (CursorGrabMode::Confined, Self::Confined)];
        for (mode, grab) in ways {
            match window.set_cursor_grab(mode) {
                Ok(()) => {
                    window.set_cursor_visible(false);
                    return grab;
                }
                Err(error) => tracing::debug!("the mouse cannot be {mode:?}: {error}"),
            }
        }
        Self::Released
    }

    /// Releases the mouse.
    pub fn release(&mut self, window: &Window) {
        if let Err(error) = window.set_cursor_grab(CursorGrabMode::None) {
            tracing::debug!("the mouse cannot be released: {error}");
        }
        window.set_cursor_visible(true);
        *self = Self::Released;
    }

    /// Keeps a confined pointer away from the window's edge, where it would stop turning the view.
    pub fn recentre(self, window: &Window) {
        if self == Self::Confined {
            let size = window.inner_size();
            let middle = PhysicalPosition::new(size.width / 2, size.height / 2);
            // If this fails, the pointer merely stops at the edge.
            let _ = window.set_cursor_position(middle);
        }
    }

    /// Returns the rotation of the view for a motion of the mouse.
    pub fn look(self, delta: (f64, f64)) -> DVec2 {
        let motion = DVec2::new(delta.0, delta.1);
        if self.is_held() && motion.is_finite() { motion * SENSITIVITY } else { DVec2::ZERO }
    }
}

/// Rotation of the view in radians for a drag over the whole height of the window.
const TURN_PER_HEIGHT: f64 = std::f64::consts::PI;
/// Touchpad pixels that count as one notch of a mouse wheel.
const PIXELS_PER_NOTCH: f64 = 50.0;

/// The state of a mouse that is not grabbed: its position and the pressed button.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Drag {
    at: Option<DVec2>,
    button: Option<MouseButton>,
}

impl Drag {
    /// Notes that a button is pressed over the picture.
    pub fn press(&mut self, button: MouseButton) {
        self.button = Some(button);
    }

    /// Notes that a button is released.
    pub fn release(&mut self, button: MouseButton) {
        if self.button == Some(button) {
            self.button = None;
        }
    }

    /// Moves the mouse to a position in pixels in a window that is `height` pixels high, and returns the
    /// gesture: the left button turns, the others shift.
    pub fn motion(&mut self, to: (f64, f64), height: u32) -> Input {
        let to = DVec2::new(to.0, to.1);
        let moved = self.at.replace(to).map_or(DVec2::ZERO, |at| to - at) / f64::from(height.max(1));
        match self.button {
            Some(MouseButton::Left) => Input { orbit: moved * TURN_PER_HEIGHT, ..Input::default() },
            Some(MouseButton::Right | MouseButton::Middle) => Input { pan: moved, ..Input::default() },
            _ => Input::default(),
        }
    }

    /// Returns the gesture of a turn of the wheel.
    pub fn wheel(delta: MouseScrollDelta) -> Input {
        let zoom = match delta {
            MouseScrollDelta::LineDelta(_, lines) => f64::from(lines),
            MouseScrollDelta::PixelDelta(pixels) => pixels.y / PIXELS_PER_NOTCH,
        };
        Input { zoom, ..Input::default() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_left_button_turns_and_the_others_shift() {
        let mut drag = Drag::default();
        assert_eq!(drag.motion((100.0, 100.0), 400), Input::default(), "where it came from is not known");
        assert_eq!(drag.motion((120.0, 100.0), 400), Input::default(), "nothing is pressed");
        drag.press(MouseButton::Left);
        let turned = drag.motion((320.0, 0.0), 400);
        assert_eq!(turned.orbit, DVec2::new(0.5, -0.25) * TURN_PER_HEIGHT);
        drag.release(MouseButton::Right);
        assert_ne!(drag.motion((0.0, 0.0), 400).orbit, DVec2::ZERO, "another button went up");
        drag.release(MouseButton::Left);
        for button in [MouseButton::Right, MouseButton::Middle] {
            drag.press(button);
            drag.motion((0.0, 0.0), 400);
            assert_eq!(
                drag.motion((0.0, 40.0), 400),
                Input { pan: DVec2::new(0.0, 0.1), ..Input::default() }
            );
        }
        assert_eq!(Drag::wheel(MouseScrollDelta::LineDelta(0.0, 2.0)).zoom, 2.0);
        let pixels = MouseScrollDelta::PixelDelta(PhysicalPosition::new(0.0, -100.0));
        assert_eq!(Drag::wheel(pixels).zoom, -2.0);
    }
}
