//! Divides frames of any length into fixed time steps. What happens in a step is in `game`.

use std::time::Duration;

use crate::recording::STEPS_PER_SECOND;

/// A longer frame counts as this long, so that after a pause the game goes on where it was.
pub const LONGEST_FRAME: Duration = Duration::from_millis(250);
/// Length of a step in seconds.
pub const STEP_SECONDS: f64 = 1.0 / STEPS_PER_SECOND as f64;

/// Game time in whole nanoseconds, so that the same total gives the same steps however it is divided into
/// frames.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Clock {
    elapsed: Duration,
    steps: u64,
}

impl Clock {
    /// Returns the time since the start.
    pub fn elapsed(&self) -> Duration {
        self.elapsed
    }

    /// Returns the number of steps made so far.
    pub fn steps(&self) -> u64 {
        self.steps
    }

    /// Adds the time of a frame; the steps within it are then [due](Self::take_step).
    pub fn pass(&mut self, frame: Duration) {
        self.elapsed = self.elapsed.saturating_add(frame.min(LONGEST_FRAME));
    }

    /// Adds exactly the time up to the end of the next step.
    pub fn pass_one_step(&mut self) {
        self.elapsed = self.elapsed.max(end_of(self.steps));
    }

    /// Makes the next step and returns true if it is due.
    pub fn take_step(&mut self) -> bool {
        let due = end_of(self.steps) <= self.elapsed;
        self.steps += u64::from(due);
        due
    }

    /// Returns the fraction of the next step that has passed, in [0, 1).
    pub fn part_of_step(&self) -> f64 {
        let start = Duration::from_nanos_u128(start_of(self.steps));
        ((self.elapsed.saturating_sub(start)).as_secs_f64() / STEP_SECONDS).clamp(0.0, 1.0)
    }
}

/// Returns the nanosecond at which a step begins.
fn start_of(step: u64) -> u128 {
    u128::from(step) * 1_000_000_000 / u128::from(STEPS_PER_SECOND)
}

fn end_of(step: u64) -> Duration {
    Duration::from_nanos_u128(start_of(step.saturating_add(1)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_of_any_length_make_the_same_steps() {
        let steps_of = |frame: Duration, frames: u32| {
            let mut clock = Clock::default();
            for _ in 0..frames {
                clock.pass(frame);
                while clock.take_step() {}
            }
            clock.steps()
        };
        assert_eq!(steps_of(Duration::from_millis(1), 3000), 360);
        assert_eq!(steps_of(Duration::from_millis(250), 12), 360);
        assert_eq!(steps_of(Duration::from_micros(3), 1_000_000), 360);
        // A pause of an hour counts as a quarter of a second.
        assert_eq!(steps_of(Duration::from_secs(3600), 1), 30);
    }

    #[test]
    fn one_step_at_a_time() {
        let mut clock = Clock::default();
        for step in 0..500 {
            assert!(!clock.take_step());
            clock.pass_one_step();
            assert!(clock.take_step() && clock.steps() == step + 1);
            assert!(clock.part_of_step() < 1e-6);
        }
    }
}
