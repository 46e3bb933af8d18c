//! Which texels are worth how many more rays. Not the rays.
//!
//! A texel whose variance is v after n samples has v (n / m)^p after m, with the order p of the sequence's convergence: a sample more takes
//! p v / n off the sum over all, at first. The least samples for a sum come where that is the same for all that have more than at first
//! (Neyman, "On the Two Different Aspects of the Representative Method", 1934, section 5).

/// A texel that is to have more samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Allotment {
    pub index: u32,
    /// In all, with those that it has.
    pub samples: u32,
}

/// Factors of a bisection of what a sample is worth.
const STEP: f64 = 1.25;
/// Most that one round multiplies the samples by: a variance from few is not to be trusted further.
const MOST_AT_ONCE: u32 = 8;

/// The samples that bring the sum of variances down to `goal`, each texel's to at most `most`, by powers of two; all that can be had if that
/// does not suffice. `variances` and `samples` are those of `texels`, by index; `order` is that of the variance's fall with the samples.
pub(crate) fn allot(
    texels: impl Iterator<Item = u32> + Clone,
    variances: &[f32],
    samples: &[u32],
    most: u32,
    order: f64,
    goal: f64,
) -> Vec<Allotment> {
    let worth = |index: u32| f64::from(variances[index as usize]) / f64::from(samples[index as usize].max(1));
    let wanted = |index: u32, least_worth: f64| {
        let own = samples[index as usize].max(1);
        let mut factor = 1;
        while worth(index) > least_worth * f64::from(factor).powf(1.0 + order)
            && factor < MOST_AT_ONCE
            && own * factor < most
        {
            factor *= 2;
        }
        (own * factor).min(most.max(own))
    };
    let left = |least_worth: f64| -> f64 {
        let one = |index: u32| {
            let own = f64::from(samples[index as usize].max(1));
            f64::from(variances[index as usize]) * (own / f64::from(wanted(index, least_worth))).powf(order)
        };
        texels.clone().map(one).sum()
    };
    let mut least_worth = texels.clone().map(worth).fold(0.0, f64::max);
    while least_worth > f64::MIN_POSITIVE && left(least_worth) > goal {
        let before = least_worth;
        least_worth /= STEP;
        // Where all have what they may have, nothing is gained any more.
        let nobody_is_left = texels.clone().all(|index| {
            let own = samples[index as usize].max(1);
            wanted(index, before) >= (own * MOST_AT_ONCE).min(most.max(own)) || worth(index) == 0.0
        });
        if nobody_is_left {
            break;
        }
    }
    let more = |index: u32| Allotment { index, samples: wanted(index, least_worth) };
    texels.map(more).filter(|own| own.samples > samples[own.index as usize]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_goal_is_reached_with_rays_where_they_are_worth_most() {
        let variances = [16.0f32, 1.0, 0.01, 0.0];
        let samples = [4, 4, 4, 4];
        let allotted = allot(0..4, &variances, &samples, 1024, 1.0, 6.0);
        // 16 to 4 brings 17.01 down to 5.01; the second's samples are worth a sixteenth of the first's.
        assert_eq!(allotted, [Allotment { index: 0, samples: 16 }]);
        let total: f32 = variances.iter().sum();
        assert!(allot(0..4, &variances, &samples, 1024, 1.0, f64::from(total) * 1.01).is_empty());
    }

    #[test]
    fn a_goal_out_of_reach_takes_all_there_is_and_ends() {
        let allotted = allot(0..3, &[1.0, 2.0, 0.0], &[4, 8, 4], 16, 1.0, 0.0);
        assert_eq!(allotted, [Allotment { index: 0, samples: 16 }, Allotment { index: 1, samples: 16 }]);
        assert!(allot(0..1, &[f32::MIN_POSITIVE], &[16], 16, 1.0, 0.0).is_empty());
    }
}
