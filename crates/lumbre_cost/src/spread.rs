//! Repeated times of the same work: their median, and a range that shows how reliable it is.

use serde::{Deserialize, Serialize};

/// Median and range of the times of some work, in milliseconds.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Spread {
    /// The lower quartile; the shortest time if there are fewer than
    /// [`MIN_ROUNDS_FOR_QUARTILES`](Self::MIN_ROUNDS_FOR_QUARTILES) rounds.
    pub lower: f64,
    /// The median.
    pub median: f64,
    /// The upper quartile; the longest time if there are fewer than
    /// [`MIN_ROUNDS_FOR_QUARTILES`](Self::MIN_ROUNDS_FOR_QUARTILES) rounds.
    pub upper: f64,
    /// Number of rounds.
    pub rounds: usize,
}

/// Largest probability that the interval of [`Spread::of_median`] misses the true median, on both sides
/// together.
const MISSES: f64 = 0.05;

impl Spread {
    /// Smallest number of rounds for which quartiles are computed. With fewer rounds they would be
    /// interpolated between too few times to be meaningful, and the extremes are used instead.
    pub const MIN_ROUNDS_FOR_QUARTILES: usize = 5;
    /// Smallest number of rounds from which two times are told apart. With two rounds each, work of equal
    /// duration would have disjoint ranges one time in three.
    pub const MIN_ROUNDS_TO_DISTINGUISH: usize = 3;
    /// Smallest number of pairs from which a ratio is told apart from 1. With fewer, all ratios of equal
    /// times lie on the same side of 1 more than one time in sixteen.
    pub const MIN_PAIRS_TO_DISTINGUISH: usize = 5;

    /// Returns the spread of some times; `None` if there are none.
    pub fn of(times: &[f64]) -> Option<Self> {
        let sorted = sorted(times);
        let last = sorted.len().checked_sub(1)?;
        // Quartiles between two ranks are interpolated.
        let at = |quarter: usize| {
            let (low, part) = (quarter * last / 4, (quarter * last % 4) as f64 / 4.0);
            sorted[low] + part * (sorted[(low + 1).min(last)] - sorted[low])
        };
        let (lower, upper) = match sorted.len() < Self::MIN_ROUNDS_FOR_QUARTILES {
            true => (sorted[0], sorted[last]),
            false => (at(1), at(3)),
        };
        Some(Self { lower, median: at(2), upper, rounds: sorted.len() })
    }

    /// Returns the median with an interval that contains the true median with a confidence of at least 95 %,
    /// whatever the distribution. Its ends are two order statistics whose ranks follow from the binomial
    /// distribution. With fewer than six values the interval ends at the extremes, and the confidence is
    /// lower (94 % for five). `None` if there are no values.
    pub fn of_median(values: &[f64]) -> Option<Self> {
        let sorted = sorted(values);
        let count = sorted.len();
        let median = Self::of(values)?.median;
        let rank = ranks_outside(count);
        Some(Self { lower: sorted[rank], median, upper: sorted[count - 1 - rank], rounds: count })
    }

    /// Returns true if its whole range lies below that of the other, and both have enough rounds for this to
    /// mean something.
    pub fn is_below(&self, other: &Self) -> bool {
        self.rounds.min(other.rounds) >= Self::MIN_ROUNDS_TO_DISTINGUISH && self.upper < other.lower
    }

    /// Returns the spread of work that takes this many times as long.
    pub fn times(&self, factor: f64) -> Self {
        let Self { lower, median, upper, rounds } = *self;
        Self { lower: lower * factor, median: median * factor, upper: upper * factor, rounds }
    }

    /// Returns half the width of its range, in milliseconds.
    pub fn half_width(&self) -> f64 {
        0.5 * (self.upper - self.lower)
    }
}

fn sorted(values: &[f64]) -> Vec<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted
}

/// Returns how many of `count` values can be left out at each end so that the interval of the others still
/// contains the median with the required confidence.
fn ranks_outside(count: usize) -> usize {
    // The k-th smallest value lies above the median if fewer than k values lie below it. Each value does so
    // with probability 1/2.
    let mut term = 0.5f64.powi(i32::try_from(count).unwrap_or(i32::MAX));
    let (mut outside, mut sum) = (0, term);
    while outside + 1 < count.div_ceil(2) {
        term *= (count - outside) as f64 / (outside + 1) as f64;
        if 2.0 * (sum + term) > MISSES {
            break;
        }
        sum += term;
        outside += 1;
    }
    // With very few values even the extremes miss the median too often, and nothing can be left out.
    if 2.0 * sum > MISSES { 0 } else { outside }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quartiles_of_many_and_extremes_of_few() {
        assert_eq!(Spread::of(&[]), None);
        assert_eq!(Spread::of(&[3.0]), Some(Spread { lower: 3.0, median: 3.0, upper: 3.0, rounds: 1 }));
        let five = Spread::of(&[5.0, 1.0, 2.0, 4.0, 3.0]);
        assert_eq!(five, Some(Spread { lower: 2.0, median: 3.0, upper: 4.0, rounds: 5 }));
        let two = Spread::of(&[2.0, 1.0]);
        assert_eq!(two, Some(Spread { lower: 1.0, median: 1.5, upper: 2.0, rounds: 2 }));
    }

    #[test]
    fn only_ranges_that_lie_apart_are_told_apart() {
        let spread = |times: &[f64]| Spread::of(times).expect("there are times");
        let (fast, slow, both) =
            (spread(&[1.0, 1.1, 1.2]), spread(&[2.0, 2.1, 2.2]), spread(&[0.5, 1.6, 2.8]));
        assert!(fast.is_below(&slow) && !slow.is_below(&fast));
        assert!(!fast.is_below(&both) && !both.is_below(&slow));
        assert!(!spread(&[1.0]).is_below(&slow), "one round proves nothing");
        assert!(!spread(&[1.0, 1.1]).is_below(&slow), "two prove little");
    }

    /// Ranks from tables of the binomial distribution (as in Conover, "Practical Nonparametric Statistics",
    /// 1999, table A3).
    #[test]
    fn intervals_of_the_median_have_the_ranks_of_the_tables() {
        for (count, outside) in
            [(1, 0), (2, 0), (5, 0), (6, 0), (8, 0), (9, 1), (12, 2), (15, 3), (20, 5), (51, 18)]
        {
            assert_eq!(ranks_outside(count), outside, "of {count}");
        }
        let values: Vec<f64> = (1..=15).map(f64::from).collect();
        let found = Spread::of_median(&values);
        assert_eq!(found, Some(Spread { lower: 4.0, median: 8.0, upper: 12.0, rounds: 15 }));
        assert_eq!(Spread::of_median(&[]), None);
    }
}
