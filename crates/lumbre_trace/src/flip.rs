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

/// Returns the difference of each pixel, in [0, 1], of two pictures of the same size.
pub fn flip(reference: &Picture, test: &Picture, pixels_per_degree: f64) -> Vec<f64> {
    let color = color_differences(reference, test, pixels_per_degree);
    let feature = feature_differences(reference, test, pixels_per_degree);
    color.iter().zip(feature).map(|(color, feature)| color.powf(1.0 - feature)).collect()
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

fn from_opponent(color: DVec3) -> DVec3 {
    let y = (color.x + 16.0) / 116.0;
    to_xyz().inverse() * (DVec3::new(y + color.y / 500.0, y, y - color.z / 200.0) * WHITE)
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

fn color_differences(reference: &Picture, test: &Picture, pixels_per_degree: f64) -> Vec<f64> {
    let [reference, test] = [reference, test].map(|picture| filtered(picture, pixels_per_degree));
    let largest = color_distance(hunt_lab(DVec3::Y), hunt_lab(DVec3::Z));
    let knee = KNEE[0] * largest;
    let spread = |difference: f64| match difference < knee {
        true => KNEE[1] / knee * difference,
        false => KNEE[1] + (difference - knee) / (largest - knee) * (1.0 - KNEE[1]),
    };
    reference.iter().zip(&test).map(|(a, b)| spread(color_distance(*a, *b))).collect()
}

/// Applies the contrast sensitivity functions: what the eye resolves of a picture, in Hunt-adjusted CIELAB.
fn filtered(picture: &Picture, pixels_per_degree: f64) -> Vec<DVec3> {
    let widest = SENSITIVITY.iter().flat_map(|s| [s[1], s[3]]).fold(0.0, f64::max);
    let radius = (3.0 * (widest / (2.0 * PI * PI)).sqrt() * pixels_per_degree).ceil() as i64;
    let opponents: Vec<_> = picture.pixels.iter().map(|color| opponent(linear(*color))).collect();
    let (mut seen, mut sum) = (vec![DVec3::ZERO; opponents.len()], DVec3::ZERO);
    // Each of the two Gaussians is separable into rows and columns; their sum is not.
    for gaussian in [0, 2] {
        let along = kernel(radius, |x| {
            DVec3::from(SENSITIVITY.map(|s| (-(PI * x / pixels_per_degree).powi(2) / s[gaussian + 1]).exp()))
        });
        let height = DVec3::from(SENSITIVITY.map(|s| s[gaussian] * (PI / s[gaussian + 1]).sqrt()));
        let down: Vec<DVec3> = along.iter().map(|weight| height * *weight).collect();
        let total: DVec3 = along.iter().sum();
        sum += height * total * total;
        let part = convolved(&opponents, picture.width, &along, &down);
        seen.iter_mut().zip(part).for_each(|(seen, part)| *seen += part);
    }
    let clamped = |color: DVec3| from_opponent(color / sum).clamp(DVec3::ZERO, DVec3::ONE);
    seen.into_iter().map(|color| hunt_lab(clamped(color))).collect()
}

fn feature_differences(reference: &Picture, test: &Picture, pixels_per_degree: f64) -> Vec<f64> {
    let [reference, test] = [reference, test].map(|picture| features(picture, pixels_per_degree));
    let difference = |(a, b): (&[f64; 2], &[f64; 2])| {
        let largest = (a[0] - b[0]).abs().max((a[1] - b[1]).abs());
        (largest / 2f64.sqrt()).powf(FEATURE_EXPONENT)
    };
    reference.iter().zip(&test).map(difference).collect()
}

/// Returns the strength of edges and of points at each pixel.
fn features(picture: &Picture, pixels_per_degree: f64) -> Vec<[f64; 2]> {
    let deviation = 0.5 * FEATURE * pixels_per_degree;
    let radius = (3.0 * deviation).ceil() as i64;
    let lightness: Vec<_> = picture
        .pixels
        .iter()
        .map(|color| DVec3::splat((opponent(linear(*color)).x + 16.0) / 116.0))
        .collect();
    let bell = |x: f64| (-x * x / (2.0 * deviation * deviation)).exp();
    let beside = kernel(radius, |x| DVec3::splat(bell(x)));
    let total: DVec3 = beside.iter().sum();
    // Edges in the first channel, points in the second.
    let mut along =
        kernel(radius, |x| DVec3::new(-x, (x / deviation).powi(2) - 1.0, 0.0) * DVec3::splat(bell(x)));
    // The kernel is normalized so that its positive weights sum to 1 and its negative weights to -1.
    let [above, below] = [1.0, -1.0]
        .map(|sign| along.iter().map(|weight| (sign * *weight).max(DVec3::ZERO)).sum::<DVec3>() * total);
    for weight in &mut along {
        let scaled = |channel: usize| {
            let size = if weight[channel] > 0.0 { above[channel] } else { below[channel] };
            if size > 0.0 { weight[channel] / size } else { 0.0 }
        };
        *weight = DVec3::new(scaled(0), scaled(1), 0.0);
    }
    let across = convolved(&lightness, picture.width, &along, &beside);
    let down = convolved(&lightness, picture.width, &beside, &along);
    across.iter().zip(&down).map(|(a, b)| [a.x.hypot(b.x), a.y.hypot(b.y)]).collect()
}

/// Evaluates a kernel's weights at the integers from -radius to radius.
fn kernel(radius: i64, weight: impl Fn(f64) -> DVec3) -> Vec<DVec3> {
    (-radius..=radius).map(|x| weight(x as f64)).collect()
}

/// Convolves each channel with a separable kernel; beyond the border the border's pixels are repeated.
fn convolved(pixels: &[DVec3], width: usize, across: &[DVec3], down: &[DVec3]) -> Vec<DVec3> {
    let height = pixels.len() / width.max(1);
    let near = |at: usize, step: usize, weights: &[DVec3], end: usize| {
        (at + step).saturating_sub(weights.len() / 2).min(end - 1)
    };
    let in_rows = |index: usize| {
        let (x, row) = (index % width, &pixels[index / width * width..][..width]);
        let at = |step: usize| row[near(x, step, across, width)];
        across.iter().enumerate().map(|(step, weight)| *weight * at(step)).sum()
    };
    let rows: Vec<DVec3> = (0..pixels.len()).into_par_iter().map(in_rows).collect();
    let in_columns = |index: usize| {
        let (x, y) = (index % width, index / width);
        let at = |step: usize| rows[near(y, step, down, height) * width + x];
        down.iter().enumerate().map(|(step, weight)| *weight * at(step)).sum()
    };
    (0..pixels.len()).into_par_iter().map(in_columns).collect()
}
