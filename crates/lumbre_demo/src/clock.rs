//! Fixed steps out of frames of any length. Not what happens in a step: that is `game`.

use std::time::Duration;

use crate::recording::STEPS_PER_SECOND;

/// A frame counts for no more than this: after a pause the game goes on where it was.
pub const LONGEST_FRAME: Duration = Duration::from_millis(250);
/// Length of a step in seconds.
pub const STEP_SECONDS: f64 = 1.0 / STEPS_PER_SECOND as f64;

/// Game time. Whole nanoseconds, so that the same total makes the same steps however it is cut into frames.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Clock {
    elapsed: Duration,
    steps: u64,
}

impl Clock {
    /// Time since the start.
    pub fn elapsed(&self) -> Duration {
        self.elapsed
    }

    /// Steps made so far.
    pub fn steps(&self) -> u64 {
        self.steps
    }

    /// Lets a frame's time pass; the steps it is worth are then [due](Self::take_step).
    pub fn pass(&mut self, frame: Duration) {
        self.elapsed = self.elapsed.saturating_add(frame.min(LONGEST_FRAME));
    }

    /// Lets exactly the time to the end of the next step pass.
    pub fn pass_one_step(&mut self) {
        self.elapsed = self.elapsed.max(end_of(self.steps));
    }

    /// Makes the next step if it is due.
    pub fn take_step(&mut self) -> bool {
        let due = end_of(self.steps) <= self.elapsed;
        self.steps += u64::from(due);
        due
    }

    /// How much of the next step has passed, [0, 1).
    pub fn part_of_step(&self) -> f64 {
        let start = Duration::from_nanos_u128(start_of(self.steps));
        ((self.elapsed.saturating_sub(start)).as_secs_f64() / STEP_SECONDS).clamp(0.0, 1.0)
    }
}

/// Nanoseconds at which a step begins.
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
        // A pause of an hour is a quarter of a second.
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
