//! Decides how many more samples each texel gets. The samples themselves are taken by the caller.
//!
//! A texel whose variance is v after n samples has the variance v (n / m)^p after m, with the order p of the sequence's
//! convergence: the first additional sample lowers the sum over all texels by p v / n. A given sum takes the fewest
//! samples if this gain is the same for all texels that get more samples (Neyman allocation: Neyman, "On the Two
//! Different Aspects of the Representative Method", 1934, section 5).

use rayon::prelude::*;

use crate::BakeError;
use crate::checkpoint::record::Record;
use crate::chunks::in_chunks_until_deadline;
use crate::monitor::BakeMonitor;
use crate::texel_index::CoveredTexel;

/// The samples that a texel is to have.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct SampleAllocation {
    pub texel: CoveredTexel,
    /// In total, including those that it has.
    pub samples: u32,
}

/// Variances and a goal for their sum, weighted such that each texel's variance falls to a share of its own when the
/// sum reaches the goal. Where all of it may be left, it does not count: what is good enough gets no samples because
/// something else cannot be reached.
pub(crate) struct WeightedGoal {
    /// Per covered texel, how much its variance counts.
    pub weights: Vec<f32>,
    /// Per covered texel, its variance times its weight.
    pub variances: Vec<f32>,
    /// What may be left of the sum of these variances.
    pub sum: f64,
}

impl WeightedGoal {
    /// `shares` are what may be left of the variances, in (0, 1], per covered texel like them; `texels` are those that
    /// may get more samples, and `order` is that of their convergence.
    pub fn new(variances: &[f32], shares: &[f32], texels: &[CoveredTexel], order: f64) -> Self {
        // Where the least worth of a sample is c, and a variance counts w times, it falls to (c / w)^(p / (1 + p)) of
        // what it would be for a worth and a weight of 1.
        let exponent = -((1.0 + order) / order) as f32;
        let weight = |&share: &f32| if share < 1.0 { share.powf(exponent) } else { 0.0 };
        let weights: Vec<f32> = shares.par_iter().map(weight).collect();
        let variances: Vec<f32> =
            variances.par_iter().zip(&weights).map(|(variance, weight)| variance * weight).collect();
        let left = |texel: &CoveredTexel| f64::from(variances[texel.place()] * shares[texel.place()]);
        Self { sum: texels.iter().map(left).sum(), weights, variances }
    }
}

/// Texels that may get more samples. Lists are per covered texel.
pub(crate) struct SampleAllocator<'a> {
    pub texels: &'a [CoveredTexel],
    pub variances: &'a [f32],
    /// The samples that each texel has.
    pub samples: &'a [u32],
    /// Most samples of a texel.
    pub most: u32,
    /// The variance falls with this power of the samples.
    pub order: f64,
}

/// Texels that are summed up in one task.
const CHUNK: usize = 4096;
/// The most times that one round doubles a texel's samples: a variance from few samples cannot be trusted further.
const MAX_DOUBLINGS: usize = 3;
/// About the share of a squared error that so many doublings leave: a round that aims at less cannot reach it.
pub(crate) const MOST_DOUBLINGS_LEAVE: f64 = 1.0 / 16.0;
/// The factor by which the search for the least worth of a sample goes down from the highest worth.
const FACTOR: f64 = 4.0;
/// The lowest value that is searched, as a share of the highest.
const LEAST: f64 = 1e-9;
/// Bisections of the interval in which the search ends.
const BISECTIONS: u32 = 6;
/// Bisections, of the logarithm, with which the search for what a budget allows ends: to 2 % of the worth.
const BUDGET_BISECTIONS: u32 = 10;

impl SampleAllocator<'_> {
    /// Allocates the samples that bring the sum of the texels' variances down to `goal`. Each texel's samples are doubled
    /// a few times, up to the most; if that does not suffice, every texel gets as many as it may.
    pub fn reach(&self, goal: f64) -> Vec<SampleAllocation> {
        let search = LeastWorthSearch::new(self);
        search.allocated(search.least_worth(goal))
    }

    /// Like [`SampleAllocator::reach`], but with at most `budget` additional samples in total: if they do not suffice, they
    /// go where they are worth most. Texels where they are worth the same get them together or not at all.
    pub fn within(&self, budget: u64, goal: f64) -> Vec<SampleAllocation> {
        let search = LeastWorthSearch::new(self);
        let least_worth = search.least_worth(goal);
        if search.added(least_worth) <= budget {
            return search.allocated(least_worth);
        }
        let highest = search.highest;
        let (mut too_low, mut affordable) = (least_worth.max(highest * LEAST), highest);
        for _ in 0..BUDGET_BISECTIONS {
            let middle = (too_low * affordable).sqrt();
            if search.added(middle) <= budget { affordable = middle } else { too_low = middle }
        }
        search.allocated(affordable)
    }

    /// What the next sample of a texel lowers the sum of the variances by, but for a constant factor.
    fn worth(&self, texel: CoveredTexel) -> f64 {
        f64::from(self.variances[texel.place()]) / f64::from(self.samples[texel.place()].max(1))
    }

    /// How many samples the allocations add.
    pub fn added(&self, allocations: &[SampleAllocation]) -> u64 {
        let added = |to: &SampleAllocation| u64::from(to.samples - self.samples[to.texel.place()]);
        allocations.iter().map(added).sum()
    }
}

/// The search for the least worth of a sample that is taken. A sample's worth is what it lowers the sum of the variances
/// by, but for a constant factor.
struct LeastWorthSearch<'a> {
    allocator: &'a SampleAllocator<'a>,
    /// The highest finite worth of any texel's next sample.
    highest: f64,
    /// By how often a texel's samples are doubled: what a sample is worth then, as a share of what it was, and the share
    /// of the variance that is left.
    devalued: [f64; MAX_DOUBLINGS + 1],
    remaining: [f64; MAX_DOUBLINGS + 1],
}

impl<'a> LeastWorthSearch<'a> {
    fn new(allocator: &'a SampleAllocator<'a>) -> Self {
        // With k times the samples, a sample is worth k^-(1 + p) of what it was, and k^-p of the variance is left.
        let powers = |exponent: f64| [1.0, 2.0, 4.0, 8.0].map(|factor: f64| factor.powf(exponent));
        let (devalued, remaining) = (powers(-1.0 - allocator.order), powers(-allocator.order));
        let worth = |&texel: &CoveredTexel| allocator.worth(texel);
        let finite = allocator.texels.iter().map(worth).filter(|worth| worth.is_finite());
        let highest = finite.fold(0.0, f64::max);
        Self { allocator, highest, devalued, remaining }
    }

    /// The allocations if every sample is to be worth at least this much.
    fn allocated(&self, least_worth: f64) -> Vec<SampleAllocation> {
        let SampleAllocator { texels, samples: before, .. } = *self.allocator;
        let allocation =
            |&texel: &CoveredTexel| SampleAllocation { texel, samples: self.samples(least_worth, texel) };
        let allocations = texels.iter().map(allocation);
        allocations.filter(|allocation| allocation.samples > before[allocation.texel.place()]).collect()
    }

    /// The number of samples that they add.
    fn added(&self, least_worth: f64) -> u64 {
        let SampleAllocator { texels, samples: before, .. } = *self.allocator;
        let added = |&texel: &CoveredTexel| {
            u64::from(self.samples(least_worth, texel).saturating_sub(before[texel.place()]))
        };
        texels.par_iter().map(added).sum()
    }

    /// The samples of a texel.
    fn samples(&self, least_worth: f64, texel: CoveredTexel) -> u32 {
        let current = self.allocator.samples[texel.place()].max(1);
        (current << self.doublings(least_worth, texel)).min(self.allocator.most.max(current))
    }

    /// How many times a texel's samples are doubled; the last time, perhaps only up to the most.
    fn doublings(&self, least_worth: f64, texel: CoveredTexel) -> usize {
        let SampleAllocator { samples, most, .. } = *self.allocator;
        let (current, worth) = (samples[texel.place()].max(1), self.allocator.worth(texel));
        let mut doublings = 0;
        while doublings < MAX_DOUBLINGS
            && current << doublings < most
            && worth * self.devalued[doublings] > least_worth
        {
            doublings += 1;
        }
        doublings
    }

    /// The sum of the variances that is left.
    fn left(&self, least_worth: f64) -> f64 {
        let SampleAllocator { texels, variances, .. } = *self.allocator;
        let variance_left = |&texel: &CoveredTexel| {
            f64::from(variances[texel.place()]) * self.remaining[self.doublings(least_worth, texel)]
        };
        // Chunks of a fixed size make the sum the same on any number of threads.
        let sums: Vec<f64> =
            texels.par_chunks(CHUNK).map(|chunk| chunk.iter().map(variance_left).sum()).collect();
        sums.iter().sum()
    }

    /// The least worth with which the sum of the variances falls to `goal`; 0 if none is low enough.
    fn least_worth(&self, goal: f64) -> f64 {
        // A least worth of 0 gives every texel all that it may have; a higher one suffices if it meets the goal.
        if self.left(self.highest) <= goal {
            return self.highest;
        }
        let (mut too_high, mut tried) = (0.0, self.highest);
        // Variances differ by many orders of magnitude: go down by a factor until the goal is met or no texel can have
        // more.
        let mut is_met = false;
        while !is_met && tried > f64::MIN_POSITIVE && tried > self.highest * LEAST {
            (too_high, tried) = (tried, tried / FACTOR);
            is_met = self.left(tried) <= goal;
        }
        if !is_met {
            return 0.0;
        }
        let (mut above, mut below) = (too_high, tried);
        for _ in 0..BISECTIONS {
            let middle = 0.5 * (above + below);
            if self.left(middle) <= goal { below = middle } else { above = middle }
        }
        below
    }
}

/// Takes the allocated samples as far as there is time. `add` gives the sums that a texel has with them, from those that
/// it had. Returns the allocations for which there was time.
pub(crate) fn take_samples<'a, T: Copy + Send + Sync + Record>(
    allocations: &'a [SampleAllocation],
    sums: &mut [T],
    monitor: &mut BakeMonitor<'_>,
    add: impl Fn(SampleAllocation, T) -> T + Sync,
) -> Result<&'a [SampleAllocation], BakeError> {
    let new_sums = in_chunks_until_deadline(allocations.len(), monitor, |index| {
        add(allocations[index], sums[allocations[index].texel.place()])
    })?;
    let taken = &allocations[..new_sums.len()];
    for (allocation, new) in taken.iter().zip(new_sums) {
        sums[allocation.texel.place()] = new;
    }
    Ok(taken)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Allocates with order 1, up to `most` samples a texel.
    fn allocator<'a>(
        texels: &'a [CoveredTexel],
        variances: &'a [f32],
        samples: &'a [u32],
        most: u32,
    ) -> SampleAllocator<'a> {
        SampleAllocator { texels, variances, samples, most, order: 1.0 }
    }

    #[test]
    fn the_goal_is_reached_with_rays_where_they_are_worth_most() {
        let variances = [16.0f32, 1.0, 0.01, 0.0];
        let texels = CoveredTexel::all(4).collect::<Vec<_>>();
        let allocator = allocator(&texels, &variances, &[4; 4], 1024);
        let allocated = allocator.reach(6.0);
        // The first texel's variance falls from 16 to 4, and the sum from 17.01 to 5.01; the second's samples are worth
        // a sixteenth of the first's.
        assert_eq!(allocated, [SampleAllocation { texel: CoveredTexel(0), samples: 16 }]);
        let total: f32 = variances.iter().sum();
        assert!(allocator.reach(f64::from(total) * 1.01).is_empty());
    }

    #[test]
    fn a_budget_goes_where_samples_are_worth_most() {
        let variances = [16.0f32, 1.0, 0.01, 0.0];
        let texels = CoveredTexel::all(4).collect::<Vec<_>>();
        let allocator = allocator(&texels, &variances, &[4; 4], 1024);
        // The goal alone would take far more than 12 samples.
        let allocated = allocator.within(12, 1e-3);
        assert_eq!(allocated, [SampleAllocation { texel: CoveredTexel(0), samples: 16 }]);
        assert!(allocator.within(3, 1e-3).is_empty());
        let plenty = allocator.within(1 << 20, 6.0);
        assert_eq!(plenty, allocator.reach(6.0));
    }

    #[test]
    fn with_weights_each_texel_keeps_its_own_share() {
        // Four texels of equal variance, of which two may keep all of it and two an eighth.
        let (variances, shares) = ([1.0f32; 4], [1.0, 1.0, 0.125, 0.125]);
        let texels = CoveredTexel::all(4).collect::<Vec<_>>();
        let goal = WeightedGoal::new(&variances, &shares, &texels, 1.0);
        assert_eq!((goal.weights[0], goal.weights[2]), (0.0, 64.0));
        let allocated = allocator(&texels, &goal.variances, &[4; 4], 1024).reach(goal.sum);
        // Without weights, all four would get equally many.
        let wanted = |place| SampleAllocation { texel: CoveredTexel(place), samples: 32 };
        assert_eq!(allocated, [wanted(2), wanted(3)]);
        // Out of reach: the others still get none.
        let allocator = allocator(&texels, &goal.variances, &[4, 4, 1024, 4], 1024);
        assert_eq!(allocator.reach(0.0), [wanted(3)]);
    }

    #[test]
    fn a_goal_out_of_reach_takes_all_there_is_and_ends() {
        let texels = CoveredTexel::all(3).collect::<Vec<_>>();
        let allocated = allocator(&texels, &[1.0, 2.0, 0.0], &[4, 8, 4], 16).reach(0.0);
        assert_eq!(
            allocated,
            [
                SampleAllocation { texel: CoveredTexel(0), samples: 16 },
                SampleAllocation { texel: CoveredTexel(1), samples: 16 }
            ]
        );
        assert!(allocator(&texels[..1], &[f32::MIN_POSITIVE], &[16], 16).reach(0.0).is_empty());
    }
}
