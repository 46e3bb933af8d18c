//! What direct light aims at: its share of the requested error, and under a time limit, the coarser errors before it.

use crate::BakeOptions;
use crate::coverage::CoveredTexels;
use crate::sources::Sources;

/// The errors to aim at, one after the other. With a time limit they begin with a coarse one and go down by steps of
/// [`GOAL_STEP`] to the requested one: whenever the time is up, all texels are about equally good.
pub(crate) fn error_goals(options: &BakeOptions) -> Vec<f64> {
    let mut goals = vec![options.error];
    while options.time.is_some() && goals[goals.len() - 1] < MIN_FIRST_GOAL {
        goals.push(GOAL_STEP * goals[goals.len() - 1]);
    }
    goals.reverse();
    goals
}

/// Under a time limit the first error to aim at is at least this one.
const MIN_FIRST_GOAL: f64 = 0.08;

/// Each goal is so many times the next one. A step of 2 left up to half of the time unused, as the last goal that fits is
/// reached early or the next one does not fit.
const GOAL_STEP: f64 = std::f64::consts::SQRT_2;

/// What direct light may leave of the requested error, as sums over all texels of squared errors relative to the local
/// light.
pub(crate) struct ErrorGoals {
    /// The sum that is requested for the whole bake.
    total: f64,
    /// The least share of it for direct light.
    share: f64,
    /// The sum that individually sampled sources may leave.
    pub individual: f64,
    /// What they may leave once a round of many samples has missed the goal: more if shared sources and a gather can
    /// use the samples better.
    pub individual_enough: f64,
    /// Whether light bounces, so that a final gather follows.
    has_gather: bool,
}

impl ErrorGoals {
    pub fn new(
        sources: &Sources<'_>,
        texels: &CoveredTexels<'_>,
        options: &BakeOptions,
        has_shared: bool,
    ) -> Self {
        let open = texels.open().count().max(1) as f64;
        let total = open * options.error.powi(2);
        let has_gather = sources.scene.surfaces.iter().any(|surface| !surface.is_black());
        // Shared samples are mostly cheaper than rays of the gather, so that direct light is held to a smaller share of
        // the error.
        let share = if has_shared && has_gather { MIN_SHARED_SHARE } else { INDIVIDUAL_SHARE };
        let individual = total * if has_shared { 0.5 * share } else { share };
        let is_one_of_three = has_shared && has_gather;
        let individual_enough = if is_one_of_three { ENOUGH_OF_THREE * individual } else { individual };
        Self { total, share, individual, individual_enough, has_gather }
    }

    /// What sources that share samples may leave if direct light has this share of the total, and the individually
    /// sampled ones leave `left`.
    pub fn of_shared(&self, share: f64, left: f64) -> f64 {
        (self.total * share - left).max(self.individual)
    }

    /// The share of the quality's budget that shared samples may take.
    pub fn budget_share(&self) -> f64 {
        if self.has_gather { BUDGET_SHARE_BESIDE_GATHER } else { 1.0 }
    }

    /// The share of the total for direct light if shared sources need so many samples per texel to reach the least
    /// share.
    pub fn share_for(&self, samples: f64) -> f64 {
        if self.has_gather { share_beside_gather(samples) } else { self.share }
    }
}

/// The share of the requested squared error that direct light may leave where all sources are sampled individually.
const INDIVIDUAL_SHARE: f64 = 0.35;
/// Its least and greatest value where sources share samples and a gather follows.
const MIN_SHARED_SHARE: f64 = 0.2;
const MAX_SHARED_SHARE: f64 = 0.5;
/// How many times their goal individually sampled sources may leave beside shared ones and a gather once a round of many
/// samples has missed it: a fifth of the whole, beside a tenth or more for the shared ones.
const ENOUGH_OF_THREE: f64 = 2.0;
/// The share of the quality's budget for shared samples if a gather follows. Beyond it, they lower the error less than
/// rays of the gather in the same time.
const BUDGET_SHARE_BESIDE_GATHER: f64 = 0.6;
/// The share that direct light and the gather may leave together.
const BOTH_SHARE: f64 = 0.85;
/// Cost of the gather: its rays per texel times the share of the squared error that they leave. At a requested 2 % it is
/// 2 in a bright hall, 4 under many lamps, and 10 to 11 in a room behind a door and in the demo level.
const GATHER_COST: f64 = 8.0;

/// The share of the requested squared error for direct light, whose shared sources need so many samples per texel to
/// reach [`MIN_SHARED_SHARE`]. As variance is inversely proportional to the samples, direct light and the gather take the
/// fewest samples together if their shares are in proportion to the square roots of their costs.
fn share_beside_gather(samples: f64) -> f64 {
    let (direct, gather) = ((samples * MIN_SHARED_SHARE).sqrt(), GATHER_COST.sqrt());
    (BOTH_SHARE * direct / (direct + gather)).clamp(MIN_SHARED_SHARE, MAX_SHARED_SHARE)
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    #[test]
    fn direct_light_has_more_of_the_error_the_more_samples_it_takes() {
        let shares = [0.0, 8.0, 40.0, 200.0].map(share_beside_gather);
        assert_eq!((shares[0], shares[3]), (MIN_SHARED_SHARE, MAX_SHARED_SHARE));
        assert!(shares.is_sorted() && shares[1] > MIN_SHARED_SHARE && shares[2] < MAX_SHARED_SHARE);
        // As costly as the gather: each has half of what both may leave.
        let equal = share_beside_gather(GATHER_COST / MIN_SHARED_SHARE);
        assert!((equal - 0.5 * BOTH_SHARE).abs() < 1e-12, "{equal}");
    }

    #[test]
    fn only_a_time_limit_makes_direct_light_go_through_coarser_goals() {
        let goals = |error: f64, time: Option<u64>| {
            error_goals(&BakeOptions { error, time: time.map(Duration::from_secs), ..BakeOptions::default() })
        };
        assert_eq!(goals(0.01, None), [0.01]);
        let limited = goals(0.01, Some(60));
        assert_eq!((limited.len(), limited[6]), (7, 0.01));
        assert!(limited[0] >= MIN_FIRST_GOAL && limited[1] < MIN_FIRST_GOAL);
        assert!(limited.is_sorted_by(|coarse, fine| (coarse / fine - GOAL_STEP).abs() < 1e-9));
        assert_eq!(goals(0.5, Some(60)), [0.5], "coarser than any goal");
    }
}
