//! The variance of a source's visible fraction, from batches of shadow samples. The samples are drawn elsewhere.

use super::batches::{BATCHES, variance_of_mean};

/// Variance of the visible fraction `mean` of `samples` shadow samples, whose batches have the visible fractions
/// `shares`.
///
/// A batch of few samples can only have one of a few fractions, n/16 say, and at a straight edge all four batches often
/// have the same. Their spread is then 0 by chance, although the error may be as large as a whole sample. The variance
/// is therefore at least what an edge leaves when the samples are distributed as evenly as possible: the edge crosses
/// √N strata, each of which is lit or not with a variance of 1/6 on average (the mean of p (1 - p) over uniform p).
/// This gives about N^-3/2 / 5 for an edge across the whole disc, times the length of its chord, √(4 s (1 - s)), if it
/// cuts off a fraction s.
pub(crate) fn share_variance(shares: [f32; BATCHES], mean: f32, samples: u32) -> f32 {
    let spread = variance_of_mean(shares);
    if !(mean > 0.0 && mean < 1.0) {
        return spread;
    }
    let chord = (4.0 * mean * (1.0 - mean)).sqrt();
    spread.max(EDGE * chord * (samples.max(1) as f32).powf(-1.5))
}

/// Variance of the mean light at `points` points of a receiver, from the means of their batches. It is at least what a
/// shadow edge across the whole receiver leaves, if the light differs by `range` (largest minus smallest light) between
/// its two sides.
pub(crate) fn uneven_variance(means: [f32; BATCHES], range: f32, points: u32) -> f32 {
    let edge = EDGE * range * range * (points.max(1) as f32).powf(-1.5);
    variance_of_mean(means).max(edge)
}

/// Number of strata that a diameter crosses, divided by √N (1.13 sides of the square that is mapped to the disc), times
/// 1/6.
const EDGE: f32 = 0.19;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::{Sequence, Stream, cosine_direction};

    /// Estimates the fraction of a disc beyond a chord in many replicates. Returns the mean squared error, the mean
    /// stated variance, and the number of replicates whose batches all agree.
    fn chord_errors(height: f32, samples: u32) -> (f64, f64, usize) {
        let exact =
            f64::from((height.acos() - height * (1.0 - height * height).sqrt()) / std::f32::consts::PI);
        let (mut squares, mut stated, mut none) = (0.0, 0.0, 0);
        const REPLICATES: u32 = 2000;
        for replicate in 0..REPLICATES {
            let sequence = Sequence::new(7, Stream::Test(1), replicate);
            let mut batches = [0.0f32; BATCHES];
            for sample in 0..samples {
                let [u, v, ..] = sequence.point(sample, 0);
                // The edge is parallel to neither axis of the square.
                let disc = cosine_direction(u, v);
                let seen = disc.x * 0.8 + disc.y * 0.6 > height;
                batches[(sample * BATCHES as u32 / samples) as usize] += f32::from(u8::from(seen));
            }
            let shares = batches.map(|sum| sum * BATCHES as f32 / samples as f32);
            let mean = shares.iter().sum::<f32>() / BATCHES as f32;
            squares += (f64::from(mean) - exact).powi(2);
            stated += f64::from(share_variance(shares, mean, samples));
            none += usize::from(variance_of_mean(shares) == 0.0);
        }
        (squares / f64::from(REPLICATES), stated / f64::from(REPLICATES), none)
    }

    #[test]
    fn the_stated_variance_of_a_penumbra_covers_its_error() {
        let mut without = 0;
        for height in [0.0, 0.3, 0.7] {
            for samples in [16, 64, 256, 1024] {
                let (squared, stated, none) = chord_errors(height, samples);
                println!(
                    "{height} {samples}: error {squared:.2e}, stated {stated:.2e}, batches that agree {none}"
                );
                without += none;
                // The stated variance must cover the squared error but not exceed it wildly: few batches and their
                // safety factor make it a few times as large.
                assert!(
                    stated > squared && stated < 8.0 * squared,
                    "{height} {samples}: {squared:e} {stated:e}"
                );
            }
        }
        assert!(without > 100, "batches agree by chance: {without} of them");
        assert_eq!(share_variance([0.0; BATCHES], 0.0, 64), 0.0, "in full shadow there is none");
        assert_eq!(share_variance([1.0; BATCHES], 1.0, 64), 0.0, "nor in full light");
    }
}
