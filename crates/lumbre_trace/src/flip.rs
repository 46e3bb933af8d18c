//! Perceived difference of two pictures when one flips between them: LDR-FLIP (Andersson, Nilsson,
//! Akenine-Möller, Oskarsson, Åström and Fairchild, "FLIP: A Difference Evaluator for Alternating Images",
//! 2020), with its published constants. For differences in radiance see [`compare`](crate::compare).

use std::f64::consts::PI;

use glam::{DMat3, DVec3};
use lumbre_optics::decode_srgb;
use rayon::prelude::*;

/// Pixels per degree of a monitor 0.7 m and 3840 pixels wide, seen from 0.7 m.
pub const PIXELS_PER_DEGREE: f64 = 0.7 * 3840.0 / 0.7 * PI / 180.0;

/// A picture of sRGB-encoded colours, each channel in [0, 1], row by row.
#[derive(Clone, Debug)]
pub struct Picture {
    /// Width in pixels.
    pub width: usize,
    /// Colours, top row first.
    pub pixels: Vec<DVec3>,
}

/// The D65 white point in XYZ, by the matrix of `to_xyz`.
const WHITE: DVec3 = DVec3::new(0.950_428_545, 1.0, 1.088_900_371);
/// Contrast sensitivity function of each channel: weight and width of two Gaussians.
const SENSITIVITY: [[f64; 4]; 3] =
    [[1.0, 0.0047, 0.0, 1e-5], [1.0, 0.0053, 0.0, 1e-5], [34.1, 0.04, 13.5, 0.025]];
/// Width in degrees of the filters that detect edges and points.
const FEATURE: f64 = 0.082;
/// Exponents of colour differences and of feature differences.
const COLOR_EXPONENT: f64 = 0.7;
const FEATURE_EXPONENT: f64 = 0.5;
/// Colour differences up to the first number times the largest one are mapped to 0 up to the second number,
/// and larger ones to the rest of [0, 1].
const KNEE: [f64; 2] = [0.4, 0.95];

/// What the eye makes of a picture. A picture that many others are compared with is looked at once.
#[derive(Clone, Debug)]
pub struct Seen {
    /// The colours that it resolves, in Hunt-adjusted CIELAB.
    colors: Vec<DVec3>,
    /// The strength of edges and of points.
    features: Vec<[f64; 2]>,
}

impl Seen {
    /// Looks at a picture.
    pub fn of(picture: &Picture, pixels_per_degree: f64) -> Self {
        let opponents: Vec<DVec3> = picture.pixels.par_iter().map(|color| opponent(linear(*color))).collect();
        Self {
            colors: filtered(&opponents, picture.width, pixels_per_degree),
            features: features(&opponents, picture.width, pixels_per_degree),
        }
    }

    /// Returns the difference of each pixel, in [0, 1], of a picture of the same size.
    pub fn differences(&self, test: &Self) -> Vec<f64> {
        let largest = color_distance(hunt_lab(DVec3::Y), hunt_lab(DVec3::Z));
        let colors = self.colors.par_iter().zip(&test.colors);
        let features = self.features.par_iter().zip(&test.features);
        let pixels = colors.zip(features).map(|((a, b), (edges, others))| {
            let color = spread(color_distance(*a, *b), largest);
            color.powf(1.0 - feature_difference(edges, others))
        });
        pixels.collect()
    }
}

/// Returns the difference of each pixel, in [0, 1], of two pictures of the same size.
pub fn flip(reference: &Picture, test: &Picture, pixels_per_degree: f64) -> Vec<f64> {
    let [reference, test] = [reference, test].map(|picture| Seen::of(picture, pixels_per_degree));
    reference.differences(&test)
}

/// Returns the mean difference at [`PIXELS_PER_DEGREE`], in [0, 1]; 0 for pictures without pixels.
pub fn mean_flip(reference: &Picture, test: &Picture) -> f64 {
    let map = flip(reference, test, PIXELS_PER_DEGREE);
    map.iter().sum::<f64>() / map.len().max(1) as f64
}

fn linear(color: DVec3) -> DVec3 {
    color.map(decode_srgb)
}

/// Linear sRGB to XYZ.
fn to_xyz() -> DMat3 {
    DMat3::from_cols(
        DVec3::new(10_135_552.0 / 24_577_794.0, 2_613_072.0 / 12_288_897.0, 1_425_312.0 / 73_733_382.0),
        DVec3::new(8_788_810.0 / 24_577_794.0, 8_788_810.0 / 12_288_897.0, 8_788_810.0 / 73_733_382.0),
        DVec3::new(4_435_075.0 / 24_577_794.0, 887_015.0 / 12_288_897.0, 70_074_185.0 / 73_733_382.0),
    )
}

/// Converts linear sRGB to luminance and two opponent colours, linear in XYZ (the paper's YCxCz).
fn opponent(linear: DVec3) -> DVec3 {
    let v = to_xyz() * linear / WHITE;
    DVec3::new(116.0 * v.y - 16.0, 500.0 * (v.x - v.y), 200.0 * (v.y - v.z))
}

/// Converts back; `from_xyz` is the inverse of [`to_xyz`].
fn from_opponent(color: DVec3, from_xyz: DMat3) -> DVec3 {
    let y = (color.x + 16.0) / 116.0;
    from_xyz * (DVec3::new(y + color.y / 500.0, y, y - color.z / 200.0) * WHITE)
}

/// Converts linear sRGB to CIELAB with its chroma reduced in the dark (Hunt effect).
fn hunt_lab(linear: DVec3) -> DVec3 {
    let curve = |t: f64| {
        let delta: f64 = 6.0 / 29.0;
        if t > delta.powi(3) { t.cbrt() } else { t / (3.0 * delta * delta) + 4.0 / 29.0 }
    };
    let v = DVec3::from((to_xyz() * linear / WHITE).to_array().map(curve));
    let lightness = 116.0 * v.y - 16.0;
    let weaker = 0.01 * lightness;
    DVec3::new(lightness, weaker * 500.0 * (v.x - v.y), weaker * 200.0 * (v.y - v.z))
}

fn color_distance(a: DVec3, b: DVec3) -> f64 {
    ((a.x - b.x).abs() + (a.y - b.y).hypot(a.z - b.z)).powf(COLOR_EXPONENT)
}

/// Maps a difference of colours to [0, 1], where `largest` is the largest one.
fn spread(difference: f64, largest: f64) -> f64 {
    let knee = KNEE[0] * largest;
    match difference < knee {
        true => KNEE[1] / knee * difference,
        false => KNEE[1] + (difference - knee) / (largest - knee) * (1.0 - KNEE[1]),
    }
}

/// Applies the contrast sensitivity functions: what the eye resolves of a picture, in Hunt-adjusted CIELAB.
fn filtered(opponents: &[DVec3], width: usize, pixels_per_degree: f64) -> Vec<DVec3> {
    let widest = SENSITIVITY.iter().flat_map(|s| [s[1], s[3]]).fold(0.0, f64::max);
    let radius = (3.0 * (widest / (2.0 * PI * PI)).sqrt() * pixels_per_degree).ceil() as i64;
    let channel = |channel: usize| {
        let plane: Vec<f64> = opponents.iter().map(|color| color[channel]).collect();
        let (mut seen, mut sum) = (vec![0.0; plane.len()], 0.0);
        // Each of the two Gaussians is separable into rows and columns; their sum is not.
        for [weight, spread] in SENSITIVITY[channel].as_chunks::<2>().0 {
            if *weight == 0.0 {
                continue;
            }
            let along = kernel(radius, |x| (-(PI * x / pixels_per_degree).powi(2) / spread).exp());
            let height = weight * (PI / spread).sqrt();
            let down: Vec<f64> = along.iter().map(|weight| height * weight).collect();
            let total: f64 = along.iter().sum();
            sum += height * total * total;
            let part = in_columns(&in_rows(&plane, width, &along), width, &down);
            seen.iter_mut().zip(part).for_each(|(seen, part)| *seen += part);
        }
        (seen, sum)
    };
    let [(a, of_a), (b, of_b), (c, of_c)] = [0, 1, 2].map(channel);
    let (sum, from_xyz) = (DVec3::new(of_a, of_b, of_c), to_xyz().inverse());
    let color = |index: usize| {
        let seen = DVec3::new(a[index], b[index], c[index]);
        hunt_lab(from_opponent(seen / sum, from_xyz).clamp(DVec3::ZERO, DVec3::ONE))
    };
    (0..opponents.len()).into_par_iter().map(color).collect()
}

fn feature_difference(a: &[f64; 2], b: &[f64; 2]) -> f64 {
    let largest = (a[0] - b[0]).abs().max((a[1] - b[1]).abs());
    (largest / 2f64.sqrt()).powf(FEATURE_EXPONENT)
}

/// Returns the strength of edges and of points at each pixel.
fn features(opponents: &[DVec3], width: usize, pixels_per_degree: f64) -> Vec<[f64; 2]> {
    let deviation = 0.5 * FEATURE * pixels_per_degree;
    let radius = (3.0 * deviation).ceil() as i64;
    let lightness: Vec<f64> = opponents.iter().map(|color| (color.x + 16.0) / 116.0).collect();
    let bell = |x: f64| (-x * x / (2.0 * deviation * deviation)).exp();
    let beside = kernel(radius, bell);
    let total: f64 = beside.iter().sum();
    let smooth = in_rows(&lightness, width, &beside);
    let strength = |weight: &dyn Fn(f64) -> f64| -> Vec<f64> {
        let along = normalized(kernel(radius, weight), total);
        let across = in_columns(&in_rows(&lightness, width, &along), width, &beside);
        let down = in_columns(&smooth, width, &along);
        across.iter().zip(&down).map(|(a, b)| a.hypot(*b)).collect()
    };
    let edges = strength(&|x| -x * bell(x));
    let points = strength(&|x| ((x / deviation).powi(2) - 1.0) * bell(x));
    edges.into_iter().zip(points).map(|(edge, point)| [edge, point]).collect()
}

/// Scales a kernel so that, beside weights with this `total`, its positive weights sum to 1 and its negative ones to
/// -1.
fn normalized(mut kernel: Vec<f64>, total: f64) -> Vec<f64> {
    let [above, below] =
        [1.0, -1.0].map(|sign| kernel.iter().map(|weight| (sign * weight).max(0.0)).sum::<f64>() * total);
    for weight in &mut kernel {
        let size = if *weight > 0.0 { above } else { below };
        *weight = if size > 0.0 { *weight / size } else { 0.0 };
    }
    kernel
}

/// Evaluates a kernel's weights at the integers from -radius to radius.
fn kernel(radius: i64, weight: impl Fn(f64) -> f64) -> Vec<f64> {
    (-radius..=radius).map(|x| weight(x as f64)).collect()
}

/// Convolves each row with a kernel; beyond the border the border's pixels are repeated.
fn in_rows(pixels: &[f64], width: usize, kernel: &[f64]) -> Vec<f64> {
    let radius = kernel.len() / 2;
    let mut sums = vec![0.0; pixels.len()];
    let rows = sums.par_chunks_mut(width.max(1)).zip(pixels.par_chunks(width.max(1)));
    rows.for_each(|(sums, row)| {
        let [Some(first), Some(last)] = [row.first(), row.last()] else { return };
        let before = std::iter::repeat_n(*first, radius);
        let padded: Vec<f64> =
            before.chain(row.iter().copied()).chain(std::iter::repeat_n(*last, radius)).collect();
        for (step, weight) in kernel.iter().enumerate() {
            add(sums, *weight, &padded[step..]);
        }
    });
    sums
}

/// Convolves each column with a kernel; beyond the border the border's pixels are repeated.
fn in_columns(pixels: &[f64], width: usize, kernel: &[f64]) -> Vec<f64> {
    let (width, radius) = (width.max(1), kernel.len() / 2);
    let height = pixels.len() / width;
    let mut sums = vec![0.0; pixels.len()];
    sums.par_chunks_mut(width).enumerate().for_each(|(y, sums)| {
        for (step, weight) in kernel.iter().enumerate() {
            let row = (y + step).saturating_sub(radius).min(height.saturating_sub(1));
            add(sums, *weight, &pixels[row * width..]);
        }
    });
    sums
}

/// Adds values times a weight, each to its sum. Sums of many pixels at once are what processors are fast at.
fn add(sums: &mut [f64], weight: f64, values: &[f64]) {
    sums.iter_mut().zip(values).for_each(|(sum, value)| *sum += weight * value);
}
