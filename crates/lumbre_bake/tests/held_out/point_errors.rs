//! The errors of a bake at reference points, relative to the mean irradiance, and how much of them is the reference's
//! own noise. The look-up in the maps is in `common`; errors relative to the light around a point are in
//! `local_errors`.

use bevy_ecs::world::World;
use glam::DVec3;

use super::local_errors::{LocalErrors, local_errors};
use super::path_tracer::Irradiance;
use crate::common;

/// Statistics of the errors relative to the mean irradiance; each known channel of a point counts as one value.
#[derive(Clone, Debug, Default)]
pub struct PointErrors {
    /// The number of points that lie on a lightmapped surface.
    pub points: usize,
    /// The number of points that lie on none.
    pub missed: usize,
    /// Mean expected irradiance, W/m².
    pub mean: f64,
    pub median: f64,
    pub p95: f64,
    pub rmse: f64,
    /// The root mean square of the reference's standard errors; `rmse` includes it.
    pub noise: f64,
    pub bias: f64,
    /// The standard error of `bias` due to the reference's noise.
    pub bias_noise: f64,
    /// Channels for which the reference is exactly 0 and the map is not: their number, and the largest value.
    pub leaks: (usize, f64),
    /// Position, normal, irradiance in the map, expected irradiance and its standard error; the worst points first.
    pub rows: Vec<[DVec3; 5]>,
    /// The errors relative to the light around the points.
    pub local: LocalErrors,
}

impl PointErrors {
    /// The RMSE with the variance of the reference's noise subtracted.
    pub fn rmse_without_noise(&self) -> f64 {
        (self.rmse.powi(2) - self.noise.powi(2)).max(0.0).sqrt()
    }
}

impl std::fmt::Display for PointErrors {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let [median, p95, rmse, without_noise, noise, bias, bias_noise] = [
            self.median,
            self.p95,
            self.rmse,
            self.rmse_without_noise(),
            self.noise,
            self.bias,
            self.bias_noise,
        ]
        .map(|x| 100.0 * x);
        write!(
            f,
            "{} points ({} missed), mean E {:.4}: median {median:.2}, p95 {p95:.2}, RMSE {rmse:.2} (without the reference's \
             noise of {noise:.2}: {without_noise:.2}), bias {bias:+.2} ± {bias_noise:.2} %; {} leaks, at most {:.2e}",
            self.points, self.missed, self.mean, self.leaks.0, self.leaks.1
        )
    }
}

/// Returns the points for the same scene at another scale.
pub fn scaled(points: &[Irradiance], scale: f64) -> Vec<Irradiance> {
    points.iter().map(|p| Irradiance { position: p.position * scale, ..*p }).collect()
}

/// Measures the errors of a baked world at the points.
pub fn measure(world: &mut World, points: &[Irradiance]) -> PointErrors {
    let surfaces = common::lightmapped(world);
    let mut result = PointErrors::default();
    let mut pairs = Vec::new();
    for point in points {
        let reference = common::ReferencePoint {
            position: point.position,
            normal: point.normal,
            irradiance: point.value,
        };
        match common::look_up(&surfaces, &reference) {
            Some(value) => {
                pairs.push((*point, value));
                result.rows.push([point.position, point.normal, value, point.value, point.error]);
            }
            None => result.missed += 1,
        }
    }
    result.local = local_errors(&pairs);
    let known_channels = |row: &[DVec3; 5]| {
        let row = *row;
        (0..3).filter(move |&c| row[3][c].is_finite()).map(move |c| [row[2][c], row[3][c], row[4][c]])
    };
    let values: Vec<[f64; 3]> = result.rows.iter().flat_map(known_channels).collect();
    let count = values.len() as f64;
    let mean = values.iter().map(|[_, expected, _]| expected).sum::<f64>() / count;
    let mut errors: Vec<f64> =
        values.iter().map(|[value, expected, _]| (value - expected).abs() / mean).collect();
    errors.sort_by(f64::total_cmp);
    result.points = result.rows.len();
    result.mean = mean;
    result.median = errors[errors.len() / 2];
    result.p95 = errors[errors.len() * 95 / 100];
    result.rmse = (errors.iter().map(|e| e * e).sum::<f64>() / count).sqrt();
    result.noise = (values.iter().map(|[_, _, e]| e * e).sum::<f64>() / count).sqrt() / mean;
    result.bias = values.iter().map(|[value, expected, _]| value - expected).sum::<f64>() / (count * mean);
    // The channels of a point are measured by the same paths, so that they are not independent.
    result.bias_noise = result.noise / (count / 3.0).sqrt();
    for [value, ..] in values.iter().filter(|[value, expected, _]| *expected == 0.0 && *value != 0.0) {
        result.leaks = (result.leaks.0 + 1, result.leaks.1.max(*value));
    }
    let error = |row: &[DVec3; 5]| {
        known_channels(row).map(|[value, expected, _]| (value - expected).abs()).fold(0.0, f64::max)
    };
    result.rows.sort_by(|a, b| error(b).total_cmp(&error(a)));
    result
}
