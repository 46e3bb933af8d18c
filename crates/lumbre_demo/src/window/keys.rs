//! Key bindings. Keys are identified by position and not by label, so that WASD is in the same place on every
//! layout.

use winit::keyboard::KeyCode;

use crate::input::{Action, Input};

/// Returns the command of a key that is pressed, if it has one.
pub fn action(key: KeyCode) -> Option<Action> {
    Some(match key {
        KeyCode::Digit1 | KeyCode::Numpad1 => Action::ShadeFlat,
        KeyCode::Digit2 | KeyCode::Numpad2 => Action::ShadeGouraud,
        KeyCode::Digit3 | KeyCode::Numpad3 => Action::ShadePhong,
        KeyCode::KeyG => Action::CycleShading,
        KeyCode::KeyR => Action::CycleReflection,
        KeyCode::KeyL => Action::ToggleLightmaps,
        KeyCode::KeyM => Action::ToggleMultisample,
        KeyCode::KeyN => Action::ToggleLightCounts,
        KeyCode::KeyX => Action::ToggleReference,
        KeyCode::KeyP => Action::MeasureSettings,
        KeyCode::Comma => Action::CheaperSettings,
        KeyCode::Period => Action::BetterSettings,
        KeyCode::KeyT => Action::ToggleTorch,
        KeyCode::KeyF => Action::ToggleFlight,
        KeyCode::KeyO | KeyCode::Home => Action::OrbitEverything,
        KeyCode::KeyV => Action::NextCamera,
        KeyCode::KeyE => Action::ToggleAutoExposure,
        KeyCode::KeyB => Action::ToggleBake,
        KeyCode::KeyK => Action::SaveBake,
        KeyCode::F1 | KeyCode::Tab => Action::ToggleOverlay,
        KeyCode::KeyQ => Action::Quit,
        _ => return None,
    })
}

/// Sets or clears what a key stands for while it is held.
pub fn hold(input: &mut Input, key: KeyCode, down: bool) {
    let held = match key {
        KeyCode::KeyW | KeyCode::ArrowUp => &mut input.forward,
        KeyCode::KeyS | KeyCode::ArrowDown => &mut input.back,
        KeyCode::KeyA | KeyCode::ArrowLeft => &mut input.left,
        KeyCode::KeyD | KeyCode::ArrowRight => &mut input.right,
        KeyCode::ShiftLeft | KeyCode::ShiftRight => &mut input.run,
        KeyCode::Space => &mut input.jump,
        KeyCode::ControlLeft | KeyCode::KeyC => &mut input.sink,
        _ => return,
    };
    *held = down;
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_hold_and_release() {
        let mut input = Input::default();
        hold(&mut input, KeyCode::KeyW, true);
        hold(&mut input, KeyCode::ShiftLeft, true);
        assert_eq!(input, Input { forward: true, run: true, ..Input::default() });
        hold(&mut input, KeyCode::KeyW, false);
        hold(&mut input, KeyCode::ShiftLeft, false);
        hold(&mut input, KeyCode::KeyZ, true);
        assert_eq!(input, Input::default());
    }

    #[test]
    fn commands_have_keys() {
        assert_eq!(action(KeyCode::Digit2), Some(Action::ShadeGouraud));
        assert_eq!(action(KeyCode::Tab), Some(Action::ToggleOverlay));
        assert_eq!(action(KeyCode::KeyB), Some(Action::ToggleBake));
        assert_eq!(action(KeyCode::KeyW), None);
    }
}
