//! Which texels are worth how many more rays. Not the rays.
//!
//! A texel whose variance is v after n samples has v (n / m)^p after m, with the order p of the sequence's convergence: a sample more takes
//! p v / n off the sum over all, at first. The least samples for a sum come where that is the same for all that have more than at first
//! (Neyman, "On the Two Different Aspects of the Representative Method", 1934, section 5).

use rayon::prelude::*;

use crate::texel_index::CoveredTexel;

/// A texel that is to have more samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct SampleAllocation {
    pub texel: CoveredTexel,
    /// In all, with those that it has.
    pub samples: u32,
}

/// Texels that are summed up together.
const CHUNK: usize = 4096;
/// Most that one round doubles the samples: a variance from few is not to be trusted further.
const MAX_DOUBLINGS: usize = 3;
/// What a sample must at least be worth is sought by this factor, down to this share of the highest, and then by so many halvings.
const FACTOR: f64 = 4.0;
const LEAST: f64 = 1e-9;
const HALVINGS: u32 = 6;

/// The samples that bring the sum of variances down to `goal`, each texel's to at most `most`, by powers of two; all that can be had if that
/// does not suffice. `variances` and `samples` are those of the covered texels; `order` is that of the variance's fall with the samples.
pub(crate) fn allocate(
    texels: impl Iterator<Item = CoveredTexel> + Clone,
    variances: &[f32],
    samples: &[u32],
    most: u32,
    order: f64,
    goal: f64,
) -> Vec<SampleAllocation> {
    // With k times the samples, each is worth 1 / k^(1 + p) of what it was, and k^-p of the variance is left.
    let powers = |exponent: f64| [1.0, 2.0, 4.0, 8.0].map(|factor: f64| factor.powf(exponent));
    let (devalued, remaining) = (powers(1.0 + order), powers(-order));
    let worth =
        |texel: CoveredTexel| f64::from(variances[texel.place()]) / f64::from(samples[texel.place()].max(1));
    // Doublings of a texel's samples; the last one may end at `most`.
    let doublings = |texel: CoveredTexel, least_worth: f64| {
        let (own, worth) = (samples[texel.place()].max(1), worth(texel));
        let mut doublings = 0;
        while doublings < MAX_DOUBLINGS
            && own << doublings < most
            && worth > least_worth * devalued[doublings]
        {
            doublings += 1;
        }
        doublings
    };
    let all: Vec<CoveredTexel> = texels.clone().collect();
    let left = |least_worth: f64| -> f64 {
        let one = |&texel: &CoveredTexel| {
            f64::from(variances[texel.place()]) * remaining[doublings(texel, least_worth)]
        };
        // By chunks of one size, so that the sum is the same on any number of threads.
        let sums: Vec<f64> = all.par_chunks(CHUNK).map(|chunk| chunk.iter().map(one).sum()).collect();
        sums.iter().sum()
    };
    let highest = texels.clone().map(worth).fold(0.0, f64::max);
    // All that can be had, if need be; less where that does.
    let (mut too_high, mut least_worth) = (0.0, highest);
    if left(highest) > goal {
        least_worth = 0.0;
        let mut power = highest;
        // Down by factors first, as variances are many orders apart, to where the goal is met or nobody can have more.
        while power > f64::MIN_POSITIVE && left(power) > goal && power > highest * LEAST {
            (too_high, power) = (power, power / FACTOR);
        }
        if left(power) <= goal {
            let (mut above, mut below) = (too_high, power);
            for _ in 0..HALVINGS {
                let middle = 0.5 * (above + below);
                if left(middle) <= goal { below = middle } else { above = middle }
            }
            least_worth = below;
        }
    }
    let wanted = |texel: CoveredTexel| {
        let own = samples[texel.place()].max(1);
        (own << doublings(texel, least_worth)).min(most.max(own))
    };
    let more = |texel: CoveredTexel| SampleAllocation { texel, samples: wanted(texel) };
    texels.map(more).filter(|own| own.samples > samples[own.texel.place()]).collect()
}

/// As [`allocate`], of at most `budget` more samples: what is left over the goal is then as little as they can make it.
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
        let more = |own: &SampleAllocation| u64::from(own.samples - samples[own.texel.place()]);
        if wanted.iter().map(more).sum::<u64>() <= budget {
            return wanted;
        }
        if goal >= left {
            return Vec::new();
        }
        goal = (goal * RELAXED).max(left * LEAST);
    }
}

/// By how much a goal is raised that takes too many samples.
const RELAXED: f64 = 1.2;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_goal_is_reached_with_rays_where_they_are_worth_most() {
        let variances = [16.0f32, 1.0, 0.01, 0.0];
        let samples = [4, 4, 4, 4];
        let allocated = allocate(CoveredTexel::all(4), &variances, &samples, 1024, 1.0, 6.0);
        // 16 to 4 brings 17.01 down to 5.01; the second's samples are worth a sixteenth of the first's.
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
        // The goal alone would take far more than these.
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
