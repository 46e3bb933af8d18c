//! Error metrics between two pictures, in linear radiance and as displayed. What error is acceptable is for
//! the caller to say.

use glam::DVec3;
use serde::Serialize;

use crate::flip::{PIXELS_PER_DEGREE, Picture, Seen};

/// The difference between a picture and a reference.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Comparison {
    /// Root mean square difference over the root mean square of the reference, over all channels, linear.
    pub relative_error: f64,
    /// Mean difference over the mean of the reference, linear; positive where the picture is brighter.
    pub relative_bias: f64,
    /// Largest absolute difference of a channel, linear.
    pub largest: f64,
    /// Column and row of the pixel with the largest difference.
    pub largest_at: [usize; 2],
    /// Peak signal-to-noise ratio of the pictures as displayed, in decibels; `None` if they are equal.
    pub psnr: Option<f64>,
    /// Mean of LDR-FLIP of the pictures as displayed, 0 to 1.
    pub flip: f64,
    /// FLIP of every pixel, top row first.
    #[serde(skip)]
    pub map: Vec<f64>,
}

/// A picture as displayed in sRGB, in [0, 1], with what the eye makes of it. A reference that many pictures are
/// compared with is looked at once.
#[derive(Clone, Debug)]
pub struct Displayed {
    picture: Picture,
    seen: Seen,
}

impl Displayed {
    /// Looks at a picture of this width, top row first.
    pub fn new(width: usize, pixels: Vec<DVec3>) -> Self {
        let picture = Picture { width, pixels };
        Self { seen: Seen::of(&picture, PIXELS_PER_DEGREE), picture }
    }
}

/// Compares two pictures of the same size, given as linear radiance (`linear`) and as displayed in sRGB, in
/// [0, 1] (`shown`); each array holds the reference first.
///
/// A pixel with a channel that is not finite in either picture counts as infinitely different.
pub fn compare(width: usize, linear: [&[DVec3]; 2], shown: [Vec<DVec3>; 2]) -> Comparison {
    let [reference, test] = shown.map(|pixels| Displayed::new(width, pixels));
    compare_displayed(linear, [&reference, &test])
}

/// Does what [`compare`] does, with pictures that have been looked at.
pub fn compare_displayed(linear: [&[DVec3]; 2], shown: [&Displayed; 2]) -> Comparison {
    let width = shown[0].picture.width;
    let [reference, test] = linear;
    let (mut sum, mut brightness) = (0.0, 0.0);
    let (mut largest, mut at) = (0.0, 0);
    for (pixel, (wanted, found)) in reference.iter().zip(test).enumerate() {
        let apart = *found - *wanted;
        let most = if apart.is_finite() { apart.abs().max_element() } else { f64::INFINITY };
        if most > largest {
            (largest, at) = (most, pixel);
        }
        sum += apart.element_sum();
        brightness += wanted.element_sum();
    }
    let [wanted, found] = shown.map(|displayed| &displayed.picture.pixels);
    let noise: f64 = wanted.iter().zip(found).map(|(a, b)| (*a - *b).length_squared()).sum();
    let mean = noise / (3 * wanted.len().max(1)) as f64;
    let map = shown[0].seen.differences(&shown[1].seen);
    Comparison {
        relative_error: relative_error(linear[0], linear[1]),
        relative_bias: over(sum, brightness),
        largest,
        largest_at: [at % width.max(1), at / width.max(1)],
        psnr: (mean > 0.0).then(|| -10.0 * mean.log10()),
        flip: map.iter().sum::<f64>() / map.len().max(1) as f64,
        map,
    }
}

/// Root mean square difference of two pictures of the same size over the root mean square of the reference,
/// over all channels, linear: [`relative_error`](Comparison::relative_error) without the rest of [`compare`].
pub fn relative_error(reference: &[DVec3], test: &[DVec3]) -> f64 {
    let (mut squares, mut of_reference) = (0.0, 0.0);
    for (wanted, found) in reference.iter().zip(test) {
        let apart = *found - *wanted;
        squares += if apart.is_finite() { apart.length_squared() } else { f64::INFINITY };
        of_reference += wanted.length_squared();
    }
    over(squares, of_reference).sqrt()
}

/// `value / size`, with 0/0 = 0.
fn over(value: f64, size: f64) -> f64 {
    if value == 0.0 { 0.0 } else { value / size }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_known_difference_in_one_channel() {
        let reference = vec![DVec3::splat(0.5); 64];
        let mut test = reference.clone();
        test[10].y += 0.25;
        let found = compare(8, [&reference, &test], [reference.clone(), test.clone()]);
        assert!((found.relative_error - (0.0625_f64 / (192.0 * 0.25)).sqrt()).abs() < 1e-15);
        assert!((found.relative_bias - 0.25 / 96.0).abs() < 1e-15);
        assert_eq!((found.largest, found.largest_at), (0.25, [2, 1]));
        assert!((found.psnr.unwrap_or(0.0) + 10.0 * (0.0625_f64 / 192.0).log10()).abs() < 1e-12);
        assert!(found.flip > 0.0 && found.map[10] > found.map[60]);
        let same = compare(8, [&reference, &reference], [reference.clone(), reference.clone()]);
        assert_eq!((same.relative_error, same.largest, same.psnr, same.flip), (0.0, 0.0, None, 0.0));
        test[3].x = f64::NAN;
        let broken = compare(8, [&reference, &test], [reference.clone(), reference.clone()]);
        assert_eq!((broken.largest, broken.relative_error), (f64::INFINITY, f64::INFINITY));
    }
}
