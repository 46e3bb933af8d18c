//! The mouse as a head: grabbed it turns the view, released it points.

use glam::DVec2;
use winit::dpi::PhysicalPosition;
use winit::window::{CursorGrabMode, Window};

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
