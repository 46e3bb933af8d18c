//! The variance of the part of a source that is seen, from batches of shadow samples. Not the sampling.

use crate::sources::batches::{BATCHES, variance_of_mean};

/// Variance of the mean of `samples` shadow samples over batches that saw these shares, `mean` together.
///
/// Batches of a few samples see one of a few shares, n/16 say, and an even edge often shows the same to all four: their spread is then 0, and
/// whoever stops by it stops by luck, with an error of a whole sample. So it is at least what an edge leaves when its samples are as evenly
/// spread as they can be: of √N strata that it crosses, each is in light or not with a variance of 1/6 on average (p (1 - p) over even p),
/// which is about N^-3/2 / 5 where the edge crosses the whole disc, and less by its chord, √(4 s (1 - s)), where it cuts off a share s.
pub(crate) fn share_variance(shares: [f32; BATCHES], mean: f32, samples: u32) -> f32 {
    let spread = variance_of_mean(shares);
    if !(mean > 0.0 && mean < 1.0) {
        return spread;
    }
    let chord = (4.0 * mean * (1.0 - mean)).sqrt();
    spread.max(EDGE * chord * (samples.max(1) as f32).powf(-1.5))
}

/// Variance of the mean of light at so many points of a receiver, by batches of them, that differs by `range`: at least what an edge leaves that
/// goes right across, with all of the range between its sides.
pub(crate) fn uneven_variance(means: [f32; BATCHES], range: f32, points: u32) -> f32 {
    let edge = EDGE * range * range * (points.max(1) as f32).powf(-1.5);
    variance_of_mean(means).max(edge)
}

/// Strata that a diameter crosses over √N, 1.13 sides of the square that the disc is mapped from, times 1/6.
const EDGE: f32 = 0.19;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::{Sequence, Stream, cosine_direction};

    /// Of many replicates, the mean squared error of the share that a chord cuts off the disc, and the mean of what is stated for it.
    fn of_chord(height: f32, samples: u32) -> (f64, f64, usize) {
        let exact =
            f64::from((height.acos() - height * (1.0 - height * height).sqrt()) / std::f32::consts::PI);
        let (mut squares, mut stated, mut none) = (0.0, 0.0, 0);
        const REPLICATES: u32 = 2000;
        for replicate in 0..REPLICATES {
            let sequence = Sequence::new(7, Stream::Test(1), replicate);
            let mut batches = [0.0f32; BATCHES];
            for sample in 0..samples {
                let [u, v, ..] = sequence.point(sample, 0);
                // An edge along neither axis of the square.
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
    fn no_penumbra_is_stated_to_be_without_error() {
        let mut without = 0;
        for height in [0.0, 0.3, 0.7] {
            for samples in [16, 64, 256, 1024] {
                let (squared, stated, none) = of_chord(height, samples);
                println!(
                    "{height} {samples}: error {squared:.2e}, stated {stated:.2e}, batches that agree {none}"
                );
                without += none;
                // What is stated is no less than what is there, and no wild exaggeration: four batches and their double counting bring
                // it to some times as much.
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
