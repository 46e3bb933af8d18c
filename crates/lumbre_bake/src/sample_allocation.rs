//! Decides how many more samples each texel gets. The samples themselves are taken by the caller.
//!
//! A texel whose variance is v after n samples has the variance v (n / m)^p after m, with the order p of the sequence's
//! convergence: the first additional sample lowers the sum over all texels by p v / n. A given sum takes the fewest
//! samples if this gain is the same for all texels that get more samples (Neyman allocation: Neyman, "On the Two
//! Different Aspects of the Representative Method", 1934, section 5).

use rayon::prelude::*;

use crate::texel_index::CoveredTexel;

/// The samples that a texel is to have.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct SampleAllocation {
    pub texel: CoveredTexel,
    /// In total, including those that it has.
    pub samples: u32,
}

/// How many samples the allocations add to those that the covered texels have.
pub(crate) fn added(allocations: &[SampleAllocation], samples: &[u32]) -> u64 {
    let added = |to: &SampleAllocation| u64::from(to.samples - samples[to.texel.place()]);
    allocations.iter().map(added).sum()
}

/// Texels that are summed up in one task.
const CHUNK: usize = 4096;
/// The most times that one round doubles a texel's samples: a variance from few samples cannot be trusted further.
const MAX_DOUBLINGS: usize = 3;
/// The factor by which the search for the least worth of a sample goes down from the highest worth.
const FACTOR: f64 = 4.0;
/// The lowest value that is searched, as a share of the highest.
const LEAST: f64 = 1e-9;
/// Bisections of the interval in which the search ends.
const BISECTIONS: u32 = 6;

/// Allocates the samples that bring the sum of variances of `texels` down to `goal`. Each texel's samples are doubled a
/// few times, up to `most`; if that does not suffice, every texel gets as many as it may. `variances` and `samples` are
/// lists of the covered texels; the variance falls with the `order`th power of the samples.
pub(crate) fn allocate(
    texels: impl Iterator<Item = CoveredTexel> + Clone,
    variances: &[f32],
    samples: &[u32],
    most: u32,
    order: f64,
    goal: f64,
) -> Vec<SampleAllocation> {
    // With k times the samples, a sample is worth k^-(1 + p) of what it was, and k^-p of the variance is left.
    let powers = |exponent: f64| [1.0, 2.0, 4.0, 8.0].map(|factor: f64| factor.powf(exponent));
    let (devalued, remaining) = (powers(1.0 + order), powers(-order));
    let worth =
        |texel: CoveredTexel| f64::from(variances[texel.place()]) / f64::from(samples[texel.place()].max(1));
    // How many times a texel's samples are doubled; the last time, perhaps only up to `most`.
    let doublings = |texel: CoveredTexel, least_worth: f64| {
        let (current, worth) = (samples[texel.place()].max(1), worth(texel));
        let mut doublings = 0;
        while doublings < MAX_DOUBLINGS
            && current << doublings < most
            && worth > least_worth * devalued[doublings]
        {
            doublings += 1;
        }
        doublings
    };
    let all: Vec<CoveredTexel> = texels.clone().collect();
    let left = |least_worth: f64| -> f64 {
        let variance_left = |&texel: &CoveredTexel| {
            f64::from(variances[texel.place()]) * remaining[doublings(texel, least_worth)]
        };
        // Chunks of a fixed size make the sum the same on any number of threads.
        let sums: Vec<f64> =
            all.par_chunks(CHUNK).map(|chunk| chunk.iter().map(variance_left).sum()).collect();
        sums.iter().sum()
    };
    let highest = texels.clone().map(worth).fold(0.0, f64::max);
    // A least worth of 0 gives every texel all that it may have; a higher one suffices if it meets the goal.
    let (mut too_high, mut least_worth) = (0.0, highest);
    if left(highest) > goal {
        least_worth = 0.0;
        let mut tried = highest;
        // Variances differ by many orders of magnitude: go down by a factor until the goal is met or no texel can have
        // more.
        while tried > f64::MIN_POSITIVE && left(tried) > goal && tried > highest * LEAST {
            (too_high, tried) = (tried, tried / FACTOR);
        }
        if left(tried) <= goal {
            let (mut above, mut below) = (too_high, tried);
            for _ in 0..BISECTIONS {
                let middle = 0.5 * (above + below);
                if left(middle) <= goal { below = middle } else { above = middle }
            }
            least_worth = below;
        }
    }
    let wanted = |texel: CoveredTexel| {
        let current = samples[texel.place()].max(1);
        (current << doublings(texel, least_worth)).min(most.max(current))
    };
    let allocations = texels.map(|texel| SampleAllocation { texel, samples: wanted(texel) });
    allocations.filter(|allocation| allocation.samples > samples[allocation.texel.place()]).collect()
}

/// Like [`allocate`], but with at most `budget` additional samples in total: if they do not suffice, the goal is raised
/// step by step until they do.
pub(crate) fn allocate_within(
    budget: u64,
    texels: impl Iterator<Item = CoveredTexel> + Clone,
    variances: &[f32],
    samples: &[u32],
    most: u32,
    order: f64,
    mut goal: f64,
) -> Vec<SampleAllocation> {
    let left: f64 = texels.clone().map(|texel| f64::from(variances[texel.place()])).sum();
    loop {
        let wanted = allocate(texels.clone(), variances, samples, most, order, goal);
        if added(&wanted, samples) <= budget {
            return wanted;
        }
        if goal >= left {
            return Vec::new();
        }
        goal = (goal * RELAXED).max(left * LEAST);
    }
}

/// The factor by which a goal is raised that takes too many samples.
const RELAXED: f64 = 1.2;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_goal_is_reached_with_rays_where_they_are_worth_most() {
        let variances = [16.0f32, 1.0, 0.01, 0.0];
        let samples = [4, 4, 4, 4];
        let allocated = allocate(CoveredTexel::all(4), &variances, &samples, 1024, 1.0, 6.0);
        // The first texel's variance falls from 16 to 4, and the sum from 17.01 to 5.01; the second's samples are worth
        // a sixteenth of the first's.
        assert_eq!(allocated, [SampleAllocation { texel: CoveredTexel(0), samples: 16 }]);
        let total: f32 = variances.iter().sum();
        assert!(
            allocate(CoveredTexel::all(4), &variances, &samples, 1024, 1.0, f64::from(total) * 1.01)
                .is_empty()
        );
    }

    #[test]
    fn a_budget_goes_where_samples_are_worth_most() {
        let variances = [16.0f32, 1.0, 0.01, 0.0];
        let samples = [4, 4, 4, 4];
        // The goal alone would take far more than 12 samples.
        let allocated = allocate_within(12, CoveredTexel::all(4), &variances, &samples, 1024, 1.0, 1e-3);
        assert_eq!(allocated, [SampleAllocation { texel: CoveredTexel(0), samples: 16 }]);
        assert!(allocate_within(3, CoveredTexel::all(4), &variances, &samples, 1024, 1.0, 1e-3).is_empty());
        let plenty = allocate_within(1 << 20, CoveredTexel::all(4), &variances, &samples, 1024, 1.0, 6.0);
        assert_eq!(plenty, allocate(CoveredTexel::all(4), &variances, &samples, 1024, 1.0, 6.0));
    }

    #[test]
    fn a_goal_out_of_reach_takes_all_there_is_and_ends() {
        let allocated = allocate(CoveredTexel::all(3), &[1.0, 2.0, 0.0], &[4, 8, 4], 16, 1.0, 0.0);
        assert_eq!(
            allocated,
            [
                SampleAllocation { texel: CoveredTexel(0), samples: 16 },
                SampleAllocation { texel: CoveredTexel(1), samples: 16 }
            ]
        );
        assert!(allocate(CoveredTexel::all(1), &[f32::MIN_POSITIVE], &[16], 16, 1.0, 0.0).is_empty());
    }
}
