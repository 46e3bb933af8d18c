//! What a bake is off at reference points, with the reference's own noise taken out. Not the lookup: that is `common`.

use bevy_ecs::world::World;
use glam::DVec3;

use super::local_errors::{LocalErrors, local_errors};
use super::path_tracer::Irradiance;
use crate::common;

/// Errors relative to the mean irradiance, all channels together.
#[derive(Clone, Debug, Default)]
pub struct Judgement {
    pub points: usize,
    pub missed: usize,
    pub mean: f64,
    pub median: f64,
    pub p95: f64,
    pub rmse: f64,
    /// The root of the mean square of the reference's standard errors; `rmse` holds it too.
    pub noise: f64,
    pub bias: f64,
    /// The standard error of the bias that the reference leaves.
    pub bias_noise: f64,
    /// Where the reference is exactly 0 and the map is not: points, and the largest value.
    pub leaks: (usize, f64),
    /// Position, normal, found, expected and the reference's error; the worst first.
    pub rows: Vec<[DVec3; 5]>,
    /// Relative to the light around the points.
    pub local: LocalErrors,
}

impl Judgement {
    /// The RMSE without the reference's noise.
    pub fn own_rmse(&self) -> f64 {
        (self.rmse.powi(2) - self.noise.powi(2)).max(0.0).sqrt()
    }
}

impl std::fmt::Display for Judgement {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let [median, p95, rmse, own, noise, bias, bias_noise] =
            [self.median, self.p95, self.rmse, self.own_rmse(), self.noise, self.bias, self.bias_noise]
                .map(|x| 100.0 * x);
        write!(
            f,
            "{} points ({} missed), mean E {:.4}: median {median:.2}, p95 {p95:.2}, RMSE {rmse:.2} (without the reference's \
             noise of {noise:.2}: {own:.2}), bias {bias:+.2} ± {bias_noise:.2} %; {} leaks, at most {:.2e}",
            self.points, self.missed, self.mean, self.leaks.0, self.leaks.1
        )
    }
}

/// The same points at another scale of the scene.
pub fn scaled(points: &[Irradiance], scale: f64) -> Vec<Irradiance> {
    points.iter().map(|p| Irradiance { position: p.position * scale, ..*p }).collect()
}

pub fn judge(world: &mut World, points: &[Irradiance]) -> Judgement {
    let surfaces = common::lightmapped(world);
    let mut found = Judgement::default();
    let mut pairs = Vec::new();
    for point in points {
        let wanted = common::ReferencePoint {
            position: point.position,
            normal: point.normal,
            irradiance: point.value,
        };
        match common::look_up(&surfaces, &wanted) {
            Some(value) => {
                pairs.push((*point, value));
                found.rows.push([point.position, point.normal, value, point.value, point.error]);
            }
            None => found.missed += 1,
        }
    }
    found.local = local_errors(&pairs);
    let known = |row: &[DVec3; 5]| {
        let row = *row;
        (0..3).filter(move |&c| row[3][c].is_finite()).map(move |c| [row[2][c], row[3][c], row[4][c]])
    };
    let values: Vec<[f64; 3]> = found.rows.iter().flat_map(known).collect();
    let count = values.len() as f64;
    let mean = values.iter().map(|[_, expected, _]| expected).sum::<f64>() / count;
    let mut errors: Vec<f64> =
        values.iter().map(|[own, expected, _]| (own - expected).abs() / mean).collect();
    errors.sort_by(f64::total_cmp);
    found.points = found.rows.len();
    found.mean = mean;
    found.median = errors[errors.len() / 2];
    found.p95 = errors[errors.len() * 95 / 100];
    found.rmse = (errors.iter().map(|e| e * e).sum::<f64>() / count).sqrt();
    found.noise = (values.iter().map(|[_, _, e]| e * e).sum::<f64>() / count).sqrt() / mean;
    found.bias = values.iter().map(|[own, expected, _]| own - expected).sum::<f64>() / (count * mean);
    found.bias_noise = found.noise / (count / 3.0).sqrt();
    for [own, ..] in values.iter().filter(|[own, expected, _]| *expected == 0.0 && *own != 0.0) {
        found.leaks = (found.leaks.0 + 1, found.leaks.1.max(*own));
    }
    let error =
        |row: &[DVec3; 5]| known(row).map(|[own, expected, _]| (own - expected).abs()).fold(0.0, f64::max);
    found.rows.sort_by(|a, b| error(b).total_cmp(&error(a)));
    found
}
