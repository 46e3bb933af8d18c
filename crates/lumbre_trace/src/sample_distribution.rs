//! Where samples are worth most: pixels get them in proportion to their noise, which for one number of samples makes the squared error of the
//! whole picture least (Neyman 1934). Not when a picture is good enough.
//!
//! A pixel that chooses by its own samples when to stop is wrong: it stops when it happens to be dark. So the noise of a pixel is told by its
//! neighbours' first samples, which its own are independent of, once and for all. Its mean is as true as with any fixed number of samples,
//! and so is its standard error.

use crate::film::Film;

/// Shares of the pixels.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct SampleDistribution {
    /// Passes of a pixel for one of the mean pixel.
    shares: Vec<f64>,
}

/// Neighbours up to so many pixels away are asked.
const REACH: usize = 2;
/// Part of the samples that is spread evenly: noise that no neighbour has met yet is met at last.
const EVEN: f64 = 0.25;

impl SampleDistribution {
    /// By the passes that every pixel has.
    pub fn of(film: &Film) -> Self {
        let (width, height) = (film.width, film.pixels.len() / film.width);
        let variances: Vec<f64> = film.pixels.iter().map(|pixel| pixel.variance().element_sum()).collect();
        let mut noise = Vec::with_capacity(variances.len());
        for y in 0..height {
            for x in 0..width {
                let (mut sum, mut count) = (0.0, 0.0_f64);
                for row in y.saturating_sub(REACH)..(y + REACH + 1).min(height) {
                    for column in x.saturating_sub(REACH)..(x + REACH + 1).min(width) {
                        if (column, row) != (x, y) {
                            sum += variances[row * width + column];
                            count += 1.0;
                        }
                    }
                }
                noise.push((sum / count.max(1.0)).sqrt());
            }
        }
        let mean = noise.iter().sum::<f64>() / noise.len().max(1) as f64;
        let share = |noise: &f64| if mean > 0.0 { EVEN + (1.0 - EVEN) * noise / mean } else { 1.0 };
        Self { shares: noise.iter().map(share).collect() }
    }

    /// From what [`shares`](Self::shares) gave.
    pub fn from_shares(shares: Vec<f64>) -> Self {
        Self { shares }
    }

    /// Of every pixel.
    pub fn shares(&self) -> &[f64] {
        &self.shares
    }

    /// Passes of a pixel when the mean pixel has `rounds`, of which all had the `first` ones alike.
    pub fn passes(&self, pixel: usize, first: u32, rounds: u32) -> u32 {
        // Far below 2^32: there are at most 2^18 rounds, and no share is above the number of pixels.
        first + (f64::from(rounds.saturating_sub(first)) * self.shares[pixel]) as u32
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::film::{PixelSum, Sample};

    /// A row of pixels, each with two passes that differ from 1 by so much.
    fn film(noise: &[f64]) -> Film {
        let mut film = Film::new((noise.len(), 1), 0);
        for (at, noise) in noise.iter().enumerate() {
            for value in [1.0 - noise, 1.0 + noise] {
                let mut pass = PixelSum::default();
                pass.add(&Sample { radiance: DVec3::splat(value), ..Sample::default() }, 1.0);
                film.add(at, &pass);
            }
        }
        film
    }

    #[test]
    fn as_many_as_the_mean_pixel_and_no_pixel_by_its_own_noise() {
        let noise = [0.0, 0.0, 0.0, 0.5, 0.1, 0.0, 0.0, 0.0];
        let shares = SampleDistribution::of(&film(&noise)).shares;
        assert!((shares.iter().sum::<f64>() / 8.0 - 1.0).abs() < 1e-12);
        assert!(shares[7] == EVEN && shares[2] > 1.0, "{shares:?}");
        let mut other = noise;
        other[3] = 0.9;
        let others = SampleDistribution::of(&film(&other));
        // What the pixel itself does changes the others' part, not the order between it and a pixel that does not see either.
        assert!(
            (others.shares[3] - EVEN) / (others.shares[5] - EVEN) < (shares[3] - EVEN) / (shares[5] - EVEN)
        );
        assert_eq!(SampleDistribution::of(&film(&[0.0; 5])).shares, [1.0; 5]);
        assert_eq!(others.passes(7, 8, 16), 8 + 2);
        assert_eq!(others.passes(7, 8, 5), 8);
    }
}
