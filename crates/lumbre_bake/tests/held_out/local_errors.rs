//! The errors of a bake relative to the light around a point, as an adapted eye perceives them. Errors relative to the
//! mean of the whole scene are in `point_errors`.

use glam::DVec3;

use super::path_tracer::Irradiance;

/// A lower bound on the irradiance by which the error at a point is divided, in units of the region's mean irradiance.
const FLOOR: f64 = 0.01;
/// A higher bound: a sixteenth, as for the baker's local light, but of the region's mean instead of the level's.
const FLOOR_OF_LOCAL_LIGHT: f64 = 1.0 / 16.0;

/// Statistics of relative errors. The error at a point is the root mean square of its channels over an irradiance.
#[derive(Clone, Copy, Debug, Default)]
pub struct RelativeErrors {
    pub median: f64,
    pub p95: f64,
    /// With the variance of the reference's noise subtracted.
    pub rmse: f64,
    /// The root mean square of the reference's standard errors; the median and p95 include it.
    pub noise: f64,
    pub bias: f64,
}

/// The errors of a subset of the region's points.
#[derive(Clone, Copy, Debug, Default)]
pub struct SubsetErrors {
    pub points: usize,
    /// Relative to the point's own irradiance.
    pub to_point: RelativeErrors,
    /// The same, but at least to [`FLOOR_OF_LOCAL_LIGHT`] of the mean: gaps of a millimetre have next to no light.
    pub to_point_or_floor: RelativeErrors,
    /// Relative to the logarithmic average of the region's irradiance.
    pub to_log_average: RelativeErrors,
}

/// The errors of the points in the region.
#[derive(Clone, Copy, Debug, Default)]
pub struct LocalErrors {
    pub mean: f64,
    /// The logarithmic average of the irradiance (the exponential of the mean logarithm), to which an eye adapts.
    pub log_average: f64,
    /// Mean irradiance of the points outside the region; NaN if there are none.
    pub outside: f64,
    pub all: SubsetErrors,
    /// The points that are not near the edge of a shadow.
    pub away_from_edges: SubsetErrors,
}

/// The channels of `value` that are known in `expected`.
fn known_channels(value: DVec3, expected: DVec3) -> impl Iterator<Item = f64> {
    (0..3).filter(move |&channel| expected[channel].is_finite()).map(move |channel| value[channel])
}

fn mean(value: DVec3) -> f64 {
    let (sum, count) =
        known_channels(value, value).fold((0.0, 0.0), |(sum, count), x| (sum + x, count + 1.0));
    sum / count
}

fn mean_square(value: DVec3, expected: DVec3) -> f64 {
    let (sum, count) =
        known_channels(value, expected).fold((0.0, 0.0), |(sum, count), x| (sum + x * x, count + 1.0));
    sum / count
}

/// Computes the errors of reference points, each paired with the irradiance that a map shows there.
pub fn local_errors(pairs: &[(Irradiance, DVec3)]) -> LocalErrors {
    let inside: Vec<_> = pairs.iter().copied().filter(|(point, _)| point.inside).collect();
    let average = |points: &mut dyn Iterator<Item = &(Irradiance, DVec3)>| {
        let (sum, count) =
            points.fold((0.0, 0.0), |(sum, count), (point, _)| (sum + mean(point.value), count + 1.0));
        sum / count
    };
    let region = average(&mut inside.iter());
    let floor = FLOOR * region;
    let logarithms = inside.iter().map(|(point, _)| mean(point.value).max(floor).ln());
    let log_average = (logarithms.sum::<f64>() / inside.len() as f64).exp();
    let away_from_edges: Vec<_> = inside.iter().copied().filter(|(point, _)| !point.edge).collect();
    LocalErrors {
        mean: region,
        log_average,
        outside: average(&mut pairs.iter().filter(|(point, _)| !point.inside)),
        all: subset(&inside, region, log_average),
        away_from_edges: subset(&away_from_edges, region, log_average),
    }
}

/// The errors of some points of a region with this mean irradiance, and this logarithmic average.
fn subset(pairs: &[(Irradiance, DVec3)], region: f64, log_average: f64) -> SubsetErrors {
    let to_point = |floor: f64| relative_errors(pairs, |point| mean(point.value).max(floor * region));
    SubsetErrors {
        points: pairs.len(),
        to_point: to_point(FLOOR),
        to_point_or_floor: to_point(FLOOR_OF_LOCAL_LIGHT),
        to_log_average: relative_errors(pairs, |_| log_average),
    }
}

fn relative_errors(pairs: &[(Irradiance, DVec3)], divisor: impl Fn(&Irradiance) -> f64) -> RelativeErrors {
    if pairs.is_empty() {
        return RelativeErrors::default();
    }
    let count = pairs.len() as f64;
    let (mut squares, mut noise, mut bias) = (0.0, 0.0, 0.0);
    let mut errors = Vec::with_capacity(pairs.len());
    for (point, value) in pairs {
        let (difference, divisor) = (*value - point.value, divisor(point));
        let square = mean_square(difference, point.value) / (divisor * divisor);
        squares += square;
        noise += mean_square(point.error, point.value) / (divisor * divisor);
        bias += mean(difference) / divisor;
        errors.push(square.sqrt());
    }
    errors.sort_by(f64::total_cmp);
    RelativeErrors {
        median: errors[errors.len() / 2],
        p95: errors[errors.len() * 95 / 100],
        rmse: ((squares - noise) / count).max(0.0).sqrt(),
        noise: (noise / count).sqrt(),
        bias: bias / count,
    }
}

impl std::fmt::Display for LocalErrors {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "in the region: mean E {:.4}, log-average {:.4}", self.mean, self.log_average)?;
        if self.outside.is_finite() {
            write!(f, "; mean E outside {:.4}", self.outside)?;
        }
        for (subset, which) in [(&self.all, "all"), (&self.away_from_edges, "away from shadow edges")] {
            for (errors, to) in [
                (&subset.to_point, "a point's own"),
                (&subset.to_point_or_floor, "a point's own or a sixteenth of the mean"),
                (&subset.to_log_average, "the log-average"),
            ] {
                let [median, p95, rmse, noise, bias] =
                    [errors.median, errors.p95, errors.rmse, errors.noise, errors.bias].map(|x| 100.0 * x);
                write!(
                    f,
                    "\n  {which} ({}), relative to {to}: median {median:.2}, p95 {p95:.2}, RMSE {rmse:.2} (noise {noise:.2}), bias {bias:+.2} %",
                    subset.points
                )?;
            }
        }
        Ok(())
    }
}
