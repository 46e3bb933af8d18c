//! The mouse: grabbed it turns the head; released it points, and drags what it is pressed on.

use glam::DVec2;
use winit::dpi::PhysicalPosition;
use winit::event::{MouseButton, MouseScrollDelta};
use winit::window::{CursorGrabMode, Window};

use crate::input::Input;

/// Radians per unit of the mouse.
const SENSITIVITY: f64 = 0.0022;

/// Who has the mouse.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Grab {
    /// The desktop.
    #[default]
    Released,
    /// The game; the pointer stands still.
    Locked,
    /// The game; the pointer is kept in the window and put back to its middle.
    Confined,
}

impl Grab {
    /// Whether the game has it.
    pub fn is_held(self) -> bool {
        self != Self::Released
    }

    /// Takes the mouse, in the best way that the system offers.
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

    /// Gives it back.
    pub fn release(&mut self, window: &Window) {
        if let Err(error) = window.set_cursor_grab(CursorGrabMode::None) {
            tracing::debug!("the mouse cannot be released: {error}");
        }
        window.set_cursor_visible(true);
        *self = Self::Released;
    }

    /// Keeps a confined pointer from the window's edge, where it would stop turning the view.
    pub fn recentre(self, window: &Window) {
        if self == Self::Confined {
            let size = window.inner_size();
            let middle = PhysicalPosition::new(size.width / 2, size.height / 2);
            // Where the pointer cannot be moved it only stops at the edge.
            let _ = window.set_cursor_position(middle);
        }
    }

    /// How far the view turns for a motion of the mouse.
    pub fn look(self, delta: (f64, f64)) -> DVec2 {
        let motion = DVec2::new(delta.0, delta.1);
        if self.is_held() && motion.is_finite() { motion * SENSITIVITY } else { DVec2::ZERO }
    }
}

/// Radians that a view turns by while the mouse is dragged over the height of the window.
const TURN_PER_HEIGHT: f64 = std::f64::consts::PI;
/// Pixels of a touchpad that count as one notch of a wheel.
const PIXELS_PER_NOTCH: f64 = 50.0;

/// A released mouse: where it is, and what it drags.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Drag {
    at: Option<DVec2>,
    button: Option<MouseButton>,
}

impl Drag {
    /// A button goes down over the picture.
    pub fn press(&mut self, button: MouseButton) {
        self.button = Some(button);
    }

    /// A button goes up.
    pub fn release(&mut self, button: MouseButton) {
        if self.button == Some(button) {
            self.button = None;
        }
    }

    /// The mouse moves to a place in pixels, over a window that is `height` pixels high. The left button turns, the others shift.
    pub fn motion(&mut self, to: (f64, f64), height: u32) -> Input {
        let to = DVec2::new(to.0, to.1);
        let moved = self.at.replace(to).map_or(DVec2::ZERO, |at| to - at) / f64::from(height.max(1));
        match self.button {
            Some(MouseButton::Left) => Input { orbit: moved * TURN_PER_HEIGHT, ..Input::default() },
            Some(MouseButton::Right | MouseButton::Middle) => Input { pan: moved, ..Input::default() },
            _ => Input::default(),
        }
    }

    /// The wheel turns.
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
