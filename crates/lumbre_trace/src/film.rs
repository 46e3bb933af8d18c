//! Accumulation of samples per pixel, standard errors, and importance sampling of the reconstruction filter.
//! Where the radiance comes from is in `ray_tree` and `path`.

use glam::{DVec2, DVec3};

use crate::filter::Filter;
use crate::light_terms::LightTerms;
use crate::options::Cut;

/// The result of one sample.
#[derive(Clone, Debug, Default)]
pub(crate) struct Sample {
    pub radiance: DVec3,
    pub rays: u32,
    /// Sum of the weights of the rays that the limits cut off.
    pub cut: f64,
    /// The brightest radiance that any of its rays returned.
    pub brightest: f64,
    /// Upper bound of the radiance that any of its rays could return, derived from the points that were hit;
    /// may be infinite.
    pub limit: f64,
    /// The terms that the radiance is the sum of, if they are wanted.
    pub terms: LightTerms,
}

/// Sum of a pixel's samples in one pass.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct PixelSum {
    pub radiance: DVec3,
    pub weight: f64,
    /// The part of the radiance that belongs to each auxiliary picture.
    pub light: Vec<DVec3>,
    pub samples: u32,
    pub rays: u32,
    pub cut: f64,
    pub brightest: f64,
    pub limit: f64,
}

impl PixelSum {
    /// Adds a sample with a weight, which is the sign of the filter at the sample.
    pub fn add(&mut self, sample: &Sample, weight: f64) {
        self.radiance += sample.radiance * weight;
        self.weight += weight;
        self.samples += 1;
        self.rays = self.rays.saturating_add(sample.rays);
        self.cut = self.cut.max(sample.cut);
        self.brightest = self.brightest.max(sample.brightest);
        self.limit = self.limit.max(sample.limit);
    }

    fn over_weight(&self, sum: DVec3) -> DVec3 {
        // Samples whose signs cancel give no estimate of the pixel.
        if self.weight.abs() > 1e-6 { sum / self.weight } else { DVec3::ZERO }
    }

    /// Returns the weighted mean of the samples.
    pub fn mean(&self) -> DVec3 {
        self.over_weight(self.radiance)
    }
}

/// The accumulated passes of a picture.
#[derive(Debug)]
pub(crate) struct Film {
    pub width: usize,
    pub pixels: Vec<FilmPixel>,
    /// For each auxiliary picture of light and each pixel: the sum of the passes' means, each times its
    /// number of samples.
    pub light: Vec<Vec<DVec3>>,
}

/// The accumulated passes of a pixel.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct FilmPixel {
    /// Sum of the passes' means, each times its number of samples.
    pub sum: DVec3,
    /// Sum of the squares of the passes' means.
    pub squares: DVec3,
    /// Sum of the passes' means.
    pub means: DVec3,
    pub passes: u32,
    pub samples: u32,
    pub rays: u32,
    pub cut: f64,
    pub brightest: f64,
    pub limit: f64,
}

impl FilmPixel {
    /// Adds a pass.
    pub fn add(&mut self, pass: &PixelSum) {
        let mean = pass.mean();
        self.sum += mean * f64::from(pass.samples);
        self.means += mean;
        self.squares += mean * mean;
        self.passes += 1;
        self.samples += pass.samples;
        self.rays = self.rays.saturating_add(pass.rays);
        self.cut = self.cut.max(pass.cut);
        self.brightest = self.brightest.max(pass.brightest);
        self.limit = self.limit.max(pass.limit);
    }

    /// Returns the pixel's radiance; 0 before the first pass.
    pub fn mean(&self) -> DVec3 {
        self.sum / f64::from(self.samples.max(1))
    }

    /// Returns the standard error of the mean, estimated from the differences between passes, all of which
    /// are taken to have as many samples; `None` before the second pass.
    pub fn standard_error(&self) -> Option<DVec3> {
        (self.passes >= 2).then(|| (self.variance() / f64::from(self.passes)).map(f64::sqrt))
    }

    /// Returns the variance of a pass; 0 before the second pass.
    pub fn variance(&self) -> DVec3 {
        let count = f64::from(self.passes);
        if self.passes < 2 {
            return DVec3::ZERO;
        }
        let mean = self.means / count;
        (self.squares / count - mean * mean).max(DVec3::ZERO) * (count / (count - 1.0))
    }
}

impl Film {
    /// Creates a film without samples, with `light` auxiliary pictures of light.
    pub fn new((width, height): (usize, usize), light: usize) -> Self {
        let count = width * height;
        Self {
            width,
            pixels: vec![FilmPixel::default(); count],
            light: vec![vec![DVec3::ZERO; count]; light],
        }
    }

    /// Adds a pass to the pixel with index `at`.
    pub fn add(&mut self, at: usize, pass: &PixelSum) {
        self.pixels[at].add(pass);
        for (sums, sum) in self.light.iter_mut().zip(&pass.light) {
            sums[at] += pass.over_weight(*sum) * f64::from(pass.samples);
        }
    }

    /// Returns the auxiliary picture of light with an index.
    pub fn light(&self, number: usize) -> Vec<DVec3> {
        let samples = self.pixels.iter().map(|pixel| f64::from(pixel.samples.max(1)));
        self.light[number].iter().zip(samples).map(|(sum, samples)| *sum / samples).collect()
    }

    /// Returns the root mean square of the pixels' standard errors over the mean radiance of the picture, all
    /// channels together; `None` while a pixel has no standard error, and 0 for a black picture.
    pub fn relative_error(&self) -> Option<f64> {
        let (mut variance, mut sum, mut count) = (0.0, 0.0, 0.0_f64);
        for pixel in &self.pixels {
            variance += pixel.standard_error()?.length_squared();
            sum += pixel.mean().element_sum();
            count += 3.0;
        }
        let mean = sum / count.max(1.0);
        if mean <= 0.0 { Some(0.0) } else { Some((variance / count.max(1.0)).sqrt() / mean) }
    }

    /// Summarizes what the limits cut off.
    pub fn cut(&self) -> Cut {
        let brightest = self.pixels.iter().fold(0.0_f64, |largest, pixel| largest.max(pixel.brightest));
        let largest_weight = self.pixels.iter().fold(0.0_f64, |largest, pixel| largest.max(pixel.cut));
        let sum: f64 = self.pixels.iter().map(|pixel| pixel.cut).sum();
        let mean_weight = sum / self.pixels.len().max(1) as f64;
        let limit = self.pixels.iter().fold(0.0_f64, |largest, pixel| largest.max(pixel.limit));
        let bound = if largest_weight == 0.0 { 0.0 } else { largest_weight * limit };
        Cut { mean_weight, largest_weight, brightest, bound: bound.is_finite().then_some(bound) }
    }
}

/// Samples positions in proportion to the filter's absolute value, so that all samples of a pixel have the
/// same weight except for the filter's sign.
#[derive(Clone, Debug)]
pub(crate) struct FilterSampler {
    filter: Filter,
    /// Cumulative distribution of |filter| along one axis, from -radius to radius; begins with 0 and ends
    /// with 1.
    distribution: Vec<f64>,
}

/// Number of intervals of a filter's distribution.
const PIECES: usize = 512;

impl FilterSampler {
    pub fn new(filter: Filter) -> Self {
        let middle =
            |piece: usize| 2.0 * filter.radius() * ((piece as f64 + 0.5) / PIECES as f64) - filter.radius();
        let mut distribution = vec![0.0];
        let mut sum = 0.0;
        for piece in 0..PIECES {
            sum += filter.value(DVec2::new(middle(piece), 0.0)).abs();
            distribution.push(sum);
        }
        distribution.iter_mut().for_each(|value| *value /= sum);
        Self { filter, distribution }
    }

    /// Returns an offset from the pixel's centre in pixels, and the filter's sign there.
    pub fn place(&self, numbers: DVec2) -> (DVec2, f64) {
        if self.filter == Filter::Box {
            return (numbers - 0.5, 1.0);
        }
        let along = |number: f64| {
            let piece = self.distribution.partition_point(|value| *value <= number).clamp(1, PIECES) - 1;
            let (low, high) = (self.distribution[piece], self.distribution[piece + 1]);
            let part = if high > low { ((number - low) / (high - low)).clamp(0.0, 1.0) } else { 0.5 };
            let radius = self.filter.radius();
            2.0 * radius * (piece as f64 + part) / PIECES as f64 - radius
        };
        let offset = DVec2::new(along(numbers.x), along(numbers.y));
        (offset, if self.filter.value(offset) < 0.0 { -1.0 } else { 1.0 })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_seen_through_a_filter_is_the_filters_integral() {
        for filter in Filter::ALL {
            let sampler = FilterSampler::new(*filter);
            // Radiance is 1 to the right of 0.3 pixels from the centre, and 0 to the left.
            let (mut sum, mut weight) = (0.0, 0.0);
            let steps = 400;
            for row in 0..steps {
                for column in 0..steps {
                    let at = |index: i32| (f64::from(index) + 0.5) / f64::from(steps);
                    let (offset, sign) = sampler.place(DVec2::new(at(column), at(row)));
                    weight += sign;
                    sum += if offset.x > 0.3 { sign } else { 0.0 };
                }
            }
            let (mut expected, mut whole) = (0.0, 0.0);
            let fine = 20_000;
            for step in 0..fine {
                let x = filter.radius() * (2.0 * (f64::from(step) + 0.5) / f64::from(fine) - 1.0);
                let value = filter.value(DVec2::new(x, 0.0));
                whole += value;
                expected += if x > 0.3 { value } else { 0.0 };
            }
            let (found, wanted) = (sum / weight, expected / whole);
            assert!((found - wanted).abs() < 4e-3, "{}: {found} for {wanted}", filter.name());
        }
    }

    #[test]
    fn the_standard_error_is_that_of_the_mean() {
        // Passes of one sample each: 1, 2, 3, 4 have variance 5/3, and their mean has 5/12.
        let mut pixel = FilmPixel::default();
        for value in [1.0, 2.0, 3.0, 4.0] {
            let mut pass = PixelSum::default();
            pass.add(&Sample { radiance: DVec3::splat(value), ..Sample::default() }, 1.0);
            pixel.add(&pass);
        }
        assert_eq!(pixel.mean(), DVec3::splat(2.5));
        let error = pixel.standard_error().expect("there are passes enough");
        assert!((error.x - (5.0f64 / 12.0).sqrt()).abs() < 1e-14);
        assert_eq!(FilmPixel::default().standard_error(), None);
    }
}
