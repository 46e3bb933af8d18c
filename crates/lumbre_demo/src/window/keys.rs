//! Key bindings. Keys are identified by position and not by label, so that WASD is in the same place on every
//! layout.

use winit::keyboard::KeyCode;

use crate::input::{Action, Input};

/// The keys of a command.
struct Binding {
    codes: &'static [KeyCode],
    action: Action,
    /// The keys, as the help names them.
    keys: &'static str,
    /// What the command does, in a few words.
    about: &'static str,
}

const fn binding(
    codes: &'static [KeyCode],
    action: Action,
    keys: &'static str,
    about: &'static str,
) -> Binding {
    Binding { codes, action, keys, about }
}

/// The keys of all commands, in the order of the help.
#[rustfmt::skip]
const BINDINGS: &[Binding] = &[
    binding(&[KeyCode::KeyO, KeyCode::Home], Action::OrbitEverything, "O, Home", "show everything, turn around it"),
    binding(&[KeyCode::KeyV], Action::NextCamera, "V", "the file's next camera"),
    binding(&[KeyCode::KeyB], Action::ToggleBake, "B", "bake in the background; again or Esc cancels"),
    binding(&[KeyCode::KeyK], Action::SaveBake, "K", "keep the bake: writes NAME.baked.glb beside the file"),
    binding(&[KeyCode::KeyE], Action::ToggleAutoExposure, "E", "adapt the exposure"),
    binding(&[KeyCode::Digit1, KeyCode::Numpad1], Action::ShadeFlat, "1", "flat shading"),
    binding(&[KeyCode::Digit2, KeyCode::Numpad2], Action::ShadeGouraud, "2", "Gouraud shading"),
    binding(&[KeyCode::Digit3, KeyCode::Numpad3], Action::ShadePhong, "3", "Phong shading"),
    binding(&[KeyCode::KeyG], Action::CycleShading, "G", "the next shading, or the file's"),
    binding(&[KeyCode::KeyR], Action::CycleReflection, "R", "the next reflection model"),
    binding(&[KeyCode::KeyL], Action::ToggleLightmaps, "L", "lightmaps on or off"),
    binding(&[KeyCode::KeyM], Action::ToggleMultisample, "M", "multisampling on or off"),
    binding(&[KeyCode::KeyT], Action::ToggleTorch, "T", "the torch on or off"),
    binding(&[KeyCode::KeyF], Action::ToggleFlight, "F", "fly through walls, or walk again"),
    binding(&[KeyCode::KeyX], Action::ToggleReference, "X", "the most accurate frame beside this one"),
    binding(&[KeyCode::KeyP], Action::MeasureSettings, "P", "measure what lights and settings cost in this view"),
    binding(&[KeyCode::Comma], Action::CheaperSettings, ",", "the next cheaper of the measured settings"),
    binding(&[KeyCode::Period], Action::BetterSettings, ".", "the next better of the measured settings"),
    binding(&[KeyCode::KeyN], Action::ToggleLightCounts, "N", "how many lights are tested"),
    binding(&[KeyCode::Tab, KeyCode::F1], Action::ToggleOverlay, "Tab, F1", "the overlay"),
    binding(&[KeyCode::KeyQ], Action::Quit, "Q", "quit"),
];

/// What the help says besides the keys of commands: gestures and keys that are held.
const GESTURES: [(&str, &str); 8] = [
    ("drag, left button", "turn"),
    ("drag, right or middle", "shift"),
    ("wheel", "come nearer"),
    ("click", "look around, when walking"),
    ("drop a file", "open it"),
    ("W A S D, arrows", "walk or fly; Shift runs"),
    ("Space; Ctrl, C", "jump, or rise in flight; sink in flight"),
    ("Esc", "free the mouse, or cancel a measurement or the bake"),
];

/// Returns a line for each key and gesture of the window, for the help of the command line.
pub fn key_help() -> String {
    let lines = GESTURES.into_iter().chain(BINDINGS.iter().map(|binding| (binding.keys, binding.about)));
    lines.map(|(keys, about)| format!("  {keys:<24}{about}\n")).collect()
}

/// Returns the command of a key that is pressed, if it has one.
pub fn action(key: KeyCode) -> Option<Action> {
    BINDINGS.iter().find(|binding| binding.codes.contains(&key)).map(|binding| binding.action)
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

    #[test]
    fn no_key_has_two_meanings() {
        let mut seen = std::collections::HashSet::new();
        for code in BINDINGS.iter().flat_map(|binding| binding.codes) {
            assert!(seen.insert(code), "{code:?} has two commands");
            let mut input = Input::default();
            hold(&mut input, *code, true);
            assert_eq!(input, Input::default(), "{code:?} is also held");
        }
    }

    #[test]
    fn the_help_names_every_key() {
        let help = key_help();
        for line in ["  X    ", "  P    ", "  ,    ", "  .    ", "  O, Home   ", "  Q   "] {
            assert!(help.lines().any(|found| found.starts_with(line)), "{line}: {help}");
        }
        assert_eq!(help.lines().count(), GESTURES.len() + BINDINGS.len());
    }
}
