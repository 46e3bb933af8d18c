//! Times of the same work, done again and again: the median and the quartiles. Not the doing.

use serde::{Deserialize, Serialize};

/// Milliseconds of some work over several rounds.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Spread {
    /// A quarter of the rounds took at most this long.
    pub lower: f64,
    /// Half of them.
    pub median: f64,
    /// Three quarters of them.
    pub upper: f64,
    /// Rounds that were measured.
    pub rounds: usize,
}

impl Spread {
    /// Of at least one time; nothing of none.
    pub fn of(times: &[f64]) -> Option<Self> {
        let mut sorted = times.to_vec();
        sorted.sort_by(f64::total_cmp);
        let last = sorted.len().checked_sub(1)?;
        // Between two ranks in proportion, so that few rounds have quartiles too.
        let at = |quarter: usize| {
            let (low, part) = (quarter * last / 4, (quarter * last % 4) as f64 / 4.0);
            sorted[low] + part * (sorted[(low + 1).min(last)] - sorted[low])
        };
        Some(Self { lower: at(1), median: at(2), upper: at(3), rounds: sorted.len() })
    }

    /// Whether it lies below the other, quartiles and all. A single round has no quartiles to tell by.
    pub fn is_below(&self, other: &Self) -> bool {
        self.rounds > 1 && other.rounds > 1 && self.upper < other.lower
    }

    /// Half of the range that the middle half of the rounds lies in, in milliseconds.
    pub fn half_width(&self) -> f64 {
        0.5 * (self.upper - self.lower)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quartiles_of_few_and_many() {
        assert_eq!(Spread::of(&[]), None);
        assert_eq!(Spread::of(&[3.0]), Some(Spread { lower: 3.0, median: 3.0, upper: 3.0, rounds: 1 }));
        let five = Spread::of(&[5.0, 1.0, 2.0, 4.0, 3.0]);
        assert_eq!(five, Some(Spread { lower: 2.0, median: 3.0, upper: 4.0, rounds: 5 }));
        let two = Spread::of(&[2.0, 1.0]);
        assert_eq!(two, Some(Spread { lower: 1.25, median: 1.5, upper: 1.75, rounds: 2 }));
    }

    #[test]
    fn only_ranges_that_lie_apart_are_told_apart() {
        let spread = |times: &[f64]| Spread::of(times).expect("there are times");
        let (fast, slow, both) =
            (spread(&[1.0, 1.1, 1.2]), spread(&[2.0, 2.1, 2.2]), spread(&[0.5, 1.6, 2.8]));
        assert!(fast.is_below(&slow) && !slow.is_below(&fast));
        assert!(!fast.is_below(&both) && !both.is_below(&slow));
        assert!(!spread(&[1.0]).is_below(&slow), "one round proves nothing");
    }
}
