//! Distributes samples over the pixels in proportion to their noise, which for a given number of samples
//! minimizes the squared error of the whole picture (Neyman 1934). When a picture is good enough is decided
//! in `rendering`.
//!
//! A pixel that decides by its own samples when to stop is biased: it stops when it happens to be dark. So
//! the noise of a pixel is estimated once from the first samples of its neighbours, which are independent of
//! its own. Its mean is then as unbiased as with a fixed number of samples, and its standard error as valid.

use crate::film::Film;

/// The share of the samples of every pixel.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct SampleDistribution {
    /// Passes of a pixel per pass of the average pixel.
    shares: Vec<f64>,
}

/// Neighbours up to this many pixels away are taken into account.
const REACH: usize = 2;
/// Fraction of the samples that is distributed evenly, so that noise that no neighbour has met yet is found
/// eventually.
const EVEN: f64 = 0.25;

impl SampleDistribution {
    /// Computes the shares from the passes that every pixel has.
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

    /// Restores a distribution from its [`shares`](Self::shares).
    pub fn from_shares(shares: Vec<f64>) -> Self {
        Self { shares }
    }

    /// Returns the share of every pixel: its passes per pass of the average pixel.
    pub fn shares(&self) -> &[f64] {
        &self.shares
    }

    /// Returns the passes of a pixel when the average pixel has `rounds`, of which the `first` ones were the
    /// same for all pixels.
    pub fn passes(&self, pixel: usize, first: u32, rounds: u32) -> u32 {
        // Far below 2^32: there are at most 2^18 rounds, and no share exceeds the number of pixels.
        first + (f64::from(rounds.saturating_sub(first)) * self.shares[pixel]) as u32
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::film::{PixelSum, Sample};

    /// A row of pixels, each with two passes that differ from 1 by its noise.
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
        // More noise in pixel 3 raises the share of pixel 5, which has it for a neighbour, but not its own.
        assert!(
            (others.shares[3] - EVEN) / (others.shares[5] - EVEN) < (shares[3] - EVEN) / (shares[5] - EVEN)
        );
        assert_eq!(SampleDistribution::of(&film(&[0.0; 5])).shares, [1.0; 5]);
        assert_eq!(others.passes(7, 8, 16), 8 + 2);
        assert_eq!(others.passes(7, 8, 5), 8);
    }
}
