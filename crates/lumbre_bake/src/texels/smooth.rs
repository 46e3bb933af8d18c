//! Smooths the gathered light within charts: a weighted plane through each texel's neighbourhood, with weights that stop at
//! edges larger than the noise. The same weights for every scramble, so that their spread stays an estimate of the error.

use glam::{DMat2, DVec2, DVec3, Vec3};
use rayon::prelude::*;

use super::footprint::Texel;
use super::gather::SCRAMBLES;
use crate::scene::{BakeScene, LightmapLayout};

/// What a texel has, before and after.
pub(crate) type Estimates = [Vec3; SCRAMBLES];

/// Reach of the smoothing in texels.
const RADIUS: i64 = 4;
/// Texels at which a neighbour weighs e⁻¹; and where things are near, the share of their harmonic mean distance, inverted.
const WIDTH: f64 = 3.0;
const NEAR: f64 = 1.0;

/// The estimates of every covered texel, smoothed, and the squared bias that the smoothing may have brought, mean of the channels.
/// `inverse_distances` tells how near to each texel the things are that it gathered from.
pub(crate) fn smooth(
    surroundings: &Surroundings<'_>,
    estimates: &[Estimates],
    inverse_distances: &[f32],
) -> (Vec<Estimates>, Vec<f32>) {
    let texels = surroundings.texels;
    // A single texel's spread of four is itself noise: the neighbourhood's mean is not.
    let variances: Vec<f32> = estimates.iter().map(|e| variance(e).element_sum()).collect();
    let (noise, nearness): (Vec<f32>, Vec<f64>) = texels
        .par_iter()
        .map(|texel| {
            let (mut sum, mut near, mut count) = (0.0, 0.0, 0u32);
            for (_, _, other) in surroundings.of(texel, NOISE_RADIUS) {
                sum += variances[other];
                near += inverse_distances[other];
                count += 1;
            }
            let (noise, near) = (sum / count.max(1) as f32, near / count.max(1) as f32);
            let steps = NEAR * f64::from(near * surroundings.texel_side(texel));
            (noise, WIDTH.powi(-2) + if steps.is_finite() { steps * steps } else { 0.0 })
        })
        .unzip();
    // Each half's weights come from the other half: noise that shaped the weights would pull the mean towards what is
    // most frequent, and light is lost (Rousselle, Knaus, Zwicker, "Adaptive Rendering with Non-Local Means", 2012).
    let guides: Vec<[Vec3; 2]> =
        texels.par_iter().map(|texel| guide(surroundings, texel, estimates)).collect();
    let mut smoothed: Vec<Estimates> = (0..texels.len())
        .into_par_iter()
        .map(|index| {
            let texel = &texels[index];
            if texel.is_hidden() {
                return estimates[index];
            }
            let mut planes = [Plane::default(), Plane::default()];
            for (dx, dy, other) in surroundings.of(texel, RADIUS) {
                let nearness = (dx * dx + dy * dy) * nearness[index];
                let expected =
                    (GUIDE_SIGMAS * GUIDE_NOISE * (noise[index] + noise[other])).max(f32::MIN_POSITIVE);
                for (half, plane) in planes.iter_mut().enumerate() {
                    let difference = guides[other][1 - half] - guides[index][1 - half];
                    let edge = f64::from(difference.length_squared() / expected);
                    plane.add(dx, dy, falloff(nearness + edge), &estimates[other][half * HALF..][..HALF]);
                }
            }
            let mut smoothed = estimates[index];
            for (half, plane) in planes.iter().enumerate() {
                plane.at_center(&mut smoothed[half * HALF..][..HALF]);
            }
            smoothed
        })
        .collect();
    let mut bias = squared_bias(surroundings, estimates, &smoothed);
    // Where smoothing brings more than it takes away, the texel keeps what it gathered.
    for (index, bias) in bias.iter_mut().enumerate() {
        let raw = noise[index] / 3.0;
        *bias = (*bias - BIAS_NOISE * raw).max(0.0);
        if *bias + variance(&smoothed[index]).element_sum() / 3.0 > raw {
            (smoothed[index], *bias) = (estimates[index], 0.0);
        }
    }
    (smoothed, bias)
}

/// Texels around one over which differences are averaged with their sign, and then without it.
const BLOCK_RADIUS: i64 = 1;
const BIAS_RADIUS: i64 = 3;
/// Of the variance of what a texel gathered, the part that chance leaves in its squared bias: four times that variance for one scramble, a ninth
/// of it in a block, of which the radius holds 49/9, twice for two halves: 4 / 9 / sqrt(2 * 49 / 9).
const BIAS_NOISE: f32 = 0.135;

/// The smoothed value of one half against the raw values of the other, which know nothing of it: the product of its differences
/// to two scrambles, each averaged over a block, has the square of the bias as its mean, and the smoothed value's own variance.
/// (A single texel's squared difference says the same with ten times the noise.) May be negative, by chance.
fn squared_bias(surroundings: &Surroundings<'_>, raw: &[Estimates], smoothed: &[Estimates]) -> Vec<f32> {
    let half = |estimates: &Estimates, half: usize| [estimates[half * HALF], estimates[half * HALF + 1]];
    let differences: Vec<[[Vec3; HALF]; 2]> = raw
        .par_iter()
        .zip(smoothed)
        .map(|(raw, smoothed)| {
            [0, 1].map(|side| {
                let [a, b] = half(smoothed, side);
                half(raw, 1 - side).map(|raw| 0.5 * (a + b) - raw)
            })
        })
        .collect();
    let of_blocks: Vec<f32> = surroundings
        .texels
        .par_iter()
        .zip(smoothed)
        .map(|(texel, smoothed)| {
            let (mut sums, mut count) = ([[Vec3::ZERO; HALF]; 2], 0u32);
            for (_, _, other) in surroundings.of(texel, BLOCK_RADIUS) {
                for (sums, differences) in sums.iter_mut().zip(&differences[other]) {
                    for (sum, difference) in sums.iter_mut().zip(differences) {
                        *sum += *difference;
                    }
                }
                count += 1;
            }
            let scale = 1.0 / (count.max(1) * count.max(1)) as f32;
            let of_half = |side: usize| {
                let [a, b] = half(smoothed, side);
                let own = 0.25 * ((a - b) * (a - b)).element_sum();
                (sums[side][0] * sums[side][1]).element_sum() * scale - own
            };
            (of_half(0) + of_half(1)) / 6.0
        })
        .collect();
    surroundings
        .texels
        .par_iter()
        .map(|texel| {
            let (mut sum, mut count) = (0.0, 0u32);
            for (_, _, other) in surroundings.of(texel, BIAS_RADIUS) {
                sum += of_blocks[other];
                count += 1;
            }
            sum / count.max(1) as f32
        })
        .collect()
}

/// Scrambles of one half.
const HALF: usize = SCRAMBLES / 2;
/// Variance of a guide over that of a texel's mean: twice for a half, a ninth for nine texels.
const GUIDE_NOISE: f32 = 2.0 / 9.0;
/// Squared differences of this many variances weigh e⁻¹.
const GUIDE_SIGMAS: f32 = 8.0;
/// Reach over which a texel's noise is averaged, and that of its guides, in texels.
const NOISE_RADIUS: i64 = 2;
const GUIDE_RADIUS: i64 = 1;

/// The means of both halves over the texels next to one.
fn guide(surroundings: &Surroundings<'_>, texel: &Texel, estimates: &[Estimates]) -> [Vec3; 2] {
    let (mut sums, mut count) = ([Vec3::ZERO; 2], 0u32);
    for (_, _, other) in surroundings.of(texel, GUIDE_RADIUS) {
        for (half, sum) in sums.iter_mut().enumerate() {
            *sum += estimates[other][half * HALF..][..HALF].iter().sum::<Vec3>();
        }
        count += HALF as u32;
    }
    sums.map(|sum| sum / count.max(1) as f32)
}

/// Who lies around whom.
pub(crate) struct Surroundings<'a> {
    scene: &'a BakeScene,
    layout: &'a LightmapLayout,
    texels: &'a [Texel],
    charts: &'a [u32],
    /// Covered texel of each texel of all maps, and its triangle.
    place: Vec<(u32, u32)>,
}

impl<'a> Surroundings<'a> {
    pub fn new(
        scene: &'a BakeScene,
        layout: &'a LightmapLayout,
        texels: &'a [Texel],
        charts: &'a [u32],
    ) -> Self {
        let mut place = vec![(u32::MAX, u32::MAX); layout.texels];
        for (index, texel) in texels.iter().enumerate().filter(|(_, texel)| !texel.is_hidden()) {
            place[texel.index as usize] = (index as u32, texel.triangle);
        }
        Self { scene, layout, texels, charts, place }
    }

    /// Length of a texel's side on its surface, canonical units.
    fn texel_side(&self, texel: &Texel) -> f32 {
        let triangle = &self.scene.triangles[texel.triangle as usize];
        let [a, b, c] = triangle.uv;
        (2.0 * triangle.area / (b - a).perp_dot(c - a).abs()).sqrt()
    }

    /// Texels of the same chart and about the same normal, with their offsets.
    pub fn of(&'a self, texel: &'a Texel, radius: i64) -> impl Iterator<Item = (f64, f64, usize)> + 'a {
        self.every(texel, radius, 1)
    }

    /// Those of them in every `step`th row and column from the texel's.
    pub fn every(
        &'a self,
        texel: &'a Texel,
        steps: i64,
        step: i64,
    ) -> impl Iterator<Item = (f64, f64, usize)> + 'a {
        let map = &self.layout.maps[texel.object as usize];
        let (width, height) = (i64::from(map.width), i64::from(map.height));
        let (x, y) = (i64::from(texel.x), i64::from(texel.y));
        let within = |from: i64, size: i64| {
            // As many steps each way as stay on the map.
            -steps.min(from / step)..=steps.min((size - 1 - from) / step)
        };
        let columns = within(x, width);
        within(y, height).flat_map(move |row| {
            let first = map.first as i64 + (y + row * step) * width + x;
            columns.clone().filter_map(move |column| {
                let (other, triangle) = self.place[(first + column * step) as usize];
                (triangle == texel.triangle || self.goes_on(texel.triangle, triangle)).then_some((
                    (column * step) as f64,
                    (row * step) as f64,
                    other as usize,
                ))
            })
        })
    }

    /// Whether light may be compared over two triangles.
    fn goes_on(&self, triangle: u32, other: u32) -> bool {
        other != u32::MAX
            && self.charts[triangle as usize] == self.charts[other as usize]
            && self.scene.triangles[triangle as usize].normal.dot(self.scene.triangles[other as usize].normal)
                > 0.9
    }
}

/// (1 - x/16)^16: e^-x within .013, and nothing beyond 16.
fn falloff(x: f64) -> f64 {
    let mut power = (1.0 - x * (1.0 / 16.0)).max(0.0);
    for _ in 0..4 {
        power *= power;
    }
    power
}

/// Mean of the scrambles.
pub(crate) fn mean(estimates: &Estimates) -> Vec3 {
    estimates.iter().sum::<Vec3>() / SCRAMBLES as f32
}

/// Variance of that mean.
pub(crate) fn variance(estimates: &Estimates) -> Vec3 {
    let mean = mean(estimates);
    let squares: Vec3 = estimates.iter().map(|&e| (e - mean) * (e - mean)).sum();
    squares / (SCRAMBLES * (SCRAMBLES - 1)) as f32
}

/// Weighted sums of a plane a + b x + c y through the values of one half.
#[derive(Default)]
struct Plane {
    moments: [f64; 6],
    sums: [[DVec3; HALF]; 3],
}

/// Square texels of spread below which a slope counts as unknown.
const RIDGE: f64 = 0.002;

impl Plane {
    fn add(&mut self, x: f64, y: f64, weight: f64, values: &[Vec3]) {
        for (moment, term) in self.moments.iter_mut().zip([1.0, x, y, x * x, x * y, y * y]) {
            *moment += weight * term;
        }
        for (sums, term) in self.sums.iter_mut().zip([1.0, x, y]) {
            for (sum, value) in sums.iter_mut().zip(values) {
                *sum += value.as_dvec3() * (weight * term);
            }
        }
    }

    /// Writes the plane's values at (0, 0); leaves what is there if they are not finite.
    fn at_center(&self, values: &mut [Vec3]) {
        let [_, sx, sy, sxx, sxy, syy] = self.moments.map(|moment| moment / self.moments[0]);
        let spread = DMat2::from_cols(
            DVec2::new(sxx - sx * sx + RIDGE, sxy - sx * sy),
            DVec2::new(sxy - sx * sy, syy - sy * sy + RIDGE),
        );
        let towards = spread.inverse() * DVec2::new(-sx, -sy);
        for (k, value) in values.iter_mut().enumerate() {
            let [mean, with_x, with_y] = self.sums.map(|sums| sums[k] / self.moments[0]);
            let fitted = mean + (with_x - mean * sx) * towards.x + (with_y - mean * sy) * towards.y;
            if fitted.is_finite() {
                *value = fitted.max(DVec3::ZERO).as_vec3();
            }
        }
    }
}
