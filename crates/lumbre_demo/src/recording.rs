//! Recordings: a player's input step by step, so that it can be replayed exactly. `game` replays it.

use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::input::{Action, Input};

/// Fixed steps per second of game time; recordings count in them.
pub const STEPS_PER_SECOND: u32 = 120;

/// The input of a player over time. Recordings can also be written by hand, in the same form:
///
/// ```json
/// {"events": [{"step": 0, "input": {"forward": true}},
///             {"step": 240, "input": {"look": [1.57, 0]}, "actions": ["toggle-torch"]}],
///  "end": 360}
/// ```
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Recording {
    /// Changes of input, in ascending order of steps.
    pub events: Vec<Event>,
    /// The number of steps.
    pub end: u64,
}

/// A change of input.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Event {
    /// The step before which it applies; there are [`STEPS_PER_SECOND`].
    pub step: u64,
    /// The input, held until the next event; its `look`, `orbit`, `pan` and `zoom` are applied once.
    #[serde(default)]
    pub input: Input,
    /// Commands that are carried out before the step.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub actions: Vec<Action>,
}

/// Reasons why a recording cannot be used.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RecordingError {
    /// The file cannot be read or written.
    #[error("{file}: {source}; check the path and its permissions")]
    File {
        /// The path.
        file: String,
        /// The error of the system.
        source: std::io::Error,
    },
    /// The file is not a recording.
    #[error("{file} is no recording: {source}")]
    Unreadable {
        /// The path.
        file: String,
        /// The error of the parser, with its place.
        source: serde_json::Error,
    },
    /// An event is out of order or has a number that is not finite.
    #[error("event {index} of the recording {problem}")]
    Event {
        /// Its index in the list.
        index: usize,
        /// What is wrong with it.
        problem: &'static str,
    },
}

impl Recording {
    /// Parses a recording; `file` names it in error messages.
    ///
    /// # Errors
    /// [`RecordingError`] if the text is not a valid recording.
    pub fn parse(text: &str, file: &str) -> Result<Self, RecordingError> {
        let recording: Self = serde_json::from_str(text)
            .map_err(|source| RecordingError::Unreadable { file: file.to_owned(), source })?;
        recording.validate()?;
        Ok(recording)
    }

    /// Reads a recording from a file.
    ///
    /// # Errors
    /// [`RecordingError`] with the file's name.
    pub fn load(path: &Path) -> Result<Self, RecordingError> {
        let file = path.display().to_string();
        let text = std::fs::read_to_string(path)
            .map_err(|source| RecordingError::File { file: file.clone(), source })?;
        Self::parse(&text, &file)
    }

    /// Writes the recording to a file, through a temporary one, so that no partial file is left under its
    /// name.
    ///
    /// # Errors
    /// [`RecordingError`] with the file's name.
    pub fn save(&self, path: &Path) -> Result<(), RecordingError> {
        let fail = |source| RecordingError::File { file: path.display().to_string(), source };
        let text = serde_json::to_string(self).map_err(std::io::Error::from).map_err(fail)?;
        let beside = path.with_extension("unfinished");
        std::fs::write(&beside, text).map_err(fail)?;
        std::fs::rename(&beside, path).map_err(fail)
    }

    fn validate(&self) -> Result<(), RecordingError> {
        let fail = |index, problem| Err(RecordingError::Event { index, problem });
        for (index, event) in self.events.iter().enumerate() {
            if !event.input.has_finite_gestures() {
                return fail(index, "moves the mouse by a number that is not finite");
            }
            if index > 0 && event.step < self.events[index - 1].step {
                return fail(index, "comes before the one above it; sort by step");
            }
        }
        Ok(())
    }

    /// Records the input before a step, if it differs from what is held.
    pub fn note(&mut self, step: u64, input: Input, actions: &[Action]) {
        let held = self.events.last().map_or_else(Input::default, |event| event.input.held());
        if input != held || !actions.is_empty() {
            self.events.push(Event { step, input, actions: actions.to_vec() });
        }
        self.end = self.end.max(step + 1);
    }

    /// Returns an iterator over the input of each step.
    pub fn player(&self) -> Playback<'_> {
        Playback { recording: self, step: 0, next: 0, held: Input::default() }
    }
}

/// Iterates over the steps of a recording.
#[derive(Clone, Debug)]
pub struct Playback<'r> {
    recording: &'r Recording,
    step: u64,
    next: usize,
    held: Input,
}

impl Iterator for Playback<'_> {
    type Item = (Input, Vec<Action>);

    /// Returns the input of the next step, and the commands before it.
    fn next(&mut self) -> Option<Self::Item> {
        if self.step >= self.recording.end {
            return None;
        }
        let (mut gestures, mut actions) = (Input::default(), Vec::new());
        while let Some(event) = self.recording.events.get(self.next).filter(|event| event.step <= self.step) {
            gestures.add_gestures(&event.input);
            actions.extend(&event.actions);
            self.held = event.input.held();
            self.next += 1;
        }
        self.step += 1;
        let mut input = self.held;
        input.add_gestures(&gestures);
        Some((input, actions))
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec2;

    use super::*;

    #[test]
    fn what_is_noted_is_played_back() {
        let forward = Input { forward: true, ..Input::default() };
        let turning = Input { look: DVec2::new(0.25, 0.0), ..forward };
        let script = [Input::default(), forward, forward, turning, turning, forward, Input::default()];
        let mut recording = Recording::default();
        for (step, input) in script.into_iter().enumerate() {
            let actions: &[Action] = if step == 2 { &[Action::ToggleTorch] } else { &[] };
            recording.note(step as u64, input, actions);
        }
        // Steps without a change add no event; those that do are 1, 2 (a command), 3, 4 and 6.
        assert_eq!(recording.events.len(), 5);
        let text = serde_json::to_string(&recording).unwrap();
        let again = Recording::parse(&text, "test").unwrap();
        let played: Vec<_> = again.player().collect();
        assert_eq!(played.iter().map(|(input, _)| *input).collect::<Vec<_>>(), script);
        assert_eq!(played[2].1, [Action::ToggleTorch]);
    }

    #[test]
    fn what_is_wrong_is_named() {
        let text = r#"{"events":[{"step":5},{"step":4}],"end":9}"#;
        assert!(Recording::parse(text, "walk").unwrap_err().to_string().contains("event 1"));
        assert!(Recording::parse("{}", "walk.json").unwrap_err().to_string().contains("walk.json"));
        let missing = Recording::load(Path::new("no/such/walk.json")).unwrap_err();
        assert!(missing.to_string().contains("walk.json"));
    }
}
