//! How much of the error a round of the final gather aims to leave: in the whole level, and in the view from everywhere
//! in it, so that no room stays noisy because the level has many easier texels elsewhere. Where the rays that this takes
//! are cast is decided in `sample_allocation`.

use rayon::prelude::*;

use super::map_error::MapError;
use crate::direct_light::LocalLight;
use crate::direct_light::views::SharesLeft;
use crate::sample_allocation::WeightedGoal;
use crate::squared_errors::SquaredErrors;
use crate::texel_index::CoveredTexel;

/// More rays are not worthwhile if the error that they can reduce is less than this fraction of the squared error.
const MIN_REDUCIBLE: f64 = 0.1;
/// Fraction of the requested squared error that a round aims at. It is well below 1 because a round's outcome is
/// predicted only roughly, and missing the request would cost another round, with another smoothing of everything.
pub(super) const TARGET: f64 = 0.65;
/// Largest factor by which one round tries to reduce the reducible squared error: the first estimates of it are rough.
const MAX_REDUCTION: f64 = 8.0;
/// Exponent p of the variance n^-p after n samples: between 1, for random samples, and 3, for a Sobol sequence and a
/// smooth integrand.
pub(super) const CONVERGENCE_ORDER: f64 = 1.25;

/// What is left after a round, relative to local light: in the whole level and in each view.
pub(super) struct ErrorLeft<'a> {
    local: &'a LocalLight,
    /// The part of the squared errors that rays reduce, per covered texel.
    reducible: SquaredErrors,
    /// The sum of the squared errors over the whole level, and of the part that rays reduce.
    whole: [f64; 2],
    /// The mean squared error in the view from each block, and that of the part that rays reduce.
    in_views: [Vec<f64>; 2],
}

impl<'a> ErrorLeft<'a> {
    /// `reducible` are the squared errors that rays reduce, W/m².
    pub fn new(local: &'a LocalLight, error: &MapError, reducible: &SquaredErrors) -> Self {
        let reducible = local.relative_errors(reducible);
        let whole = [error.relative_squares, local.views.sum(&reducible.expected)];
        let in_views = [error.in_views.clone(), local.views.means(&reducible.expected)];
        Self { local, reducible, whole, in_views }
    }

    /// The sum of the reducible squared errors, as far as they count.
    pub fn reducible_sum(&self, weights: &[f32]) -> f64 {
        let weighted = self.reducible.expected.par_iter().zip(weights).map(|(error, weight)| error * weight);
        self.local.views.sum(&weighted.collect::<Vec<_>>())
    }

    /// Whether more rays are not worthwhile, for they can hardly reduce what keeps the level, or its worst view, from
    /// the requested squared error of a texel.
    pub fn is_hardly_reducible(&self, requested: f64, open: f64) -> bool {
        let [whole, reducible] = self.whole;
        let is_stuck = |total: f64, reducible: f64| reducible <= MIN_REDUCIBLE * total;
        if whole > requested * open {
            return is_stuck(whole, reducible);
        }
        let (mut total, mut reducible) = (0.0, 0.0);
        let [in_views, parts] = &self.in_views;
        for (block, texels) in self.local.views.counted(in_views) {
            if in_views[block] > requested {
                (total, reducible) = (total + texels * in_views[block], reducible + texels * parts[block]);
            }
        }
        is_stuck(total, reducible)
    }

    /// The goal of a round that aims at a squared error of `aim` per texel, for the `open` texels of the level.
    pub fn goal(&self, aim: f64, open: &[CoveredTexel]) -> WeightedGoal {
        self.goal_with(&self.shares_of_views(aim), aim, open)
    }

    /// The same for the whole level alone.
    pub fn goal_of_whole(&self, aim: f64, open: &[CoveredTexel]) -> WeightedGoal {
        self.goal_with(&vec![1.0; self.in_views[0].len()], aim, open)
    }

    /// Per block, the share of the reducible squared error that may be left in the view from there.
    fn shares_of_views(&self, aim: f64) -> Vec<f64> {
        let [total, reducible] = &self.in_views;
        total.iter().zip(reducible).map(|(&total, &reducible)| share_left(total, reducible, aim)).collect()
    }

    /// The goal for these shares of the views and the aim for the whole level.
    fn goal_with(&self, of_blocks: &[f64], aim: f64, open: &[CoveredTexel]) -> WeightedGoal {
        let [whole, whole_reducible] = self.whole;
        let of_whole = share_left(whole, whole_reducible, aim * open.len() as f64);
        let left = SharesLeft { of_blocks, of_whole, least: MAX_REDUCTION.recip() };
        let shares = self.local.views.shares(&left, &self.reducible.expected);
        WeightedGoal::new(&self.reducible.cautious, &shares, open, CONVERGENCE_ORDER)
    }
}

/// The share of the reducible squared error that may be left: as much as the irreducible one leaves room for below the
/// aim, or what is negligible beside the irreducible one; at least what a round can be expected to leave.
fn share_left(total: f64, reducible: f64, aim: f64) -> f64 {
    let irreducible = total - reducible;
    let left = (aim - irreducible).max(MIN_REDUCIBLE * irreducible).max(reducible / MAX_REDUCTION);
    (left / reducible.max(f64::MIN_POSITIVE)).min(1.0)
}
