//! Times of the same work, repeated: their median, and a range that says how far to trust it. Not the repeating.

use serde::{Deserialize, Serialize};

/// Milliseconds of some work over several rounds.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Spread {
    /// The lower quartile; the shortest time where there are fewer than [`ROUNDS_WITH_QUARTILES`](Self::ROUNDS_WITH_QUARTILES) rounds.
    pub lower: f64,
    /// Half of the rounds took at most this long.
    pub median: f64,
    /// The upper quartile; the longest time where there are few rounds.
    pub upper: f64,
    /// Rounds that were measured.
    pub rounds: usize,
}

/// Two-sided probability that the interval of [`Spread::of_median`] misses the true median.
const MISSES: f64 = 0.05;

impl Spread {
    /// With fewer rounds than this, quartiles would be interpolated between so few times that they say nothing: the extremes take their place.
    pub const ROUNDS_WITH_QUARTILES: usize = 5;
    /// With fewer rounds than this, two pieces of work that take equally long would often have ranges that lie apart (one time in three, with two rounds each).
    pub const FEWEST_ROUNDS_THAT_TELL: usize = 3;
    /// With fewer pairs than this, all ratios of two equal times lie on one side of 1 more than one time in sixteen.
    pub const FEWEST_PAIRS_THAT_TELL: usize = 5;

    /// Of at least one time; nothing of none.
    pub fn of(times: &[f64]) -> Option<Self> {
        let sorted = sorted(times);
        let last = sorted.len().checked_sub(1)?;
        // Quartiles between two ranks are interpolated.
        let at = |quarter: usize| {
            let (low, part) = (quarter * last / 4, (quarter * last % 4) as f64 / 4.0);
            sorted[low] + part * (sorted[(low + 1).min(last)] - sorted[low])
        };
        let (lower, upper) = match sorted.len() < Self::ROUNDS_WITH_QUARTILES {
            true => (sorted[0], sorted[last]),
            false => (at(1), at(3)),
        };
        Some(Self { lower, median: at(2), upper, rounds: sorted.len() })
    }

    /// The median with an interval that holds the true median with at least 95 % confidence, whatever the distribution: between two order statistics whose ranks follow from the binomial
    /// distribution. With fewer than six values the extremes are the most that can be said (94 % for five). Nothing of no values.
    pub fn of_median(values: &[f64]) -> Option<Self> {
        let sorted = sorted(values);
        let count = sorted.len();
        let median = Self::of(values)?.median;
        let rank = ranks_outside(count);
        Some(Self { lower: sorted[rank], median, upper: sorted[count - 1 - rank], rounds: count })
    }

    /// Whether it lies below the other, ranges and all, and both have rounds enough for that to mean something.
    pub fn is_below(&self, other: &Self) -> bool {
        self.rounds.min(other.rounds) >= Self::FEWEST_ROUNDS_THAT_TELL && self.upper < other.lower
    }

    /// Half of its range, in milliseconds.
    pub fn half_width(&self) -> f64 {
        0.5 * (self.upper - self.lower)
    }
}

fn sorted(values: &[f64]) -> Vec<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted
}

/// How many values may be left out at each end of so many for the rest to hold the median with the confidence that is asked for.
fn ranks_outside(count: usize) -> usize {
    // The k-th smallest lies above the median if fewer than k values lie below it: each does with probability 1/2.
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
    // With very few values even the extremes miss it more often, and nothing can be left out.
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

    /// Ranks from tables of the binomial distribution (as in Conover, "Practical Nonparametric Statistics", 1999, table A3).
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
