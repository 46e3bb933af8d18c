//! What a bake is off relative to the light around a point, as an eye that has adapted sees it. Not relative to the mean of the whole scene:
//! that is `judgement`.

use glam::DVec3;

use super::path_tracer::Irradiance;

/// Of the mean irradiance of the region: a point that has less counts as if it had so much.
const FLOOR: f64 = 0.01;

/// Relative errors of some points, the channels' root mean square over their mean irradiance.
#[derive(Clone, Copy, Debug, Default)]
pub struct Relative {
    pub median: f64,
    pub p95: f64,
    /// Without the reference's noise.
    pub rmse: f64,
    /// The root mean square of the reference's standard errors; median and p95 hold it, too.
    pub noise: f64,
    pub bias: f64,
}

/// Of some points of a region.
#[derive(Clone, Copy, Debug, Default)]
pub struct Part {
    pub points: usize,
    /// Relative to a point's own irradiance.
    pub own: Relative,
    /// Relative to the logarithmic average of the region's irradiance.
    pub around: Relative,
}

/// Of the points in the region.
#[derive(Clone, Copy, Debug, Default)]
pub struct LocalErrors {
    pub mean: f64,
    /// The irradiance that an eye adapts to: the exponential of the mean logarithm.
    pub log_average: f64,
    /// Mean irradiance of the points that are not in the region; NaN where there are none.
    pub outside: f64,
    pub all: Part,
    /// Without those near an edge of a shadow.
    pub away: Part,
}

fn known(value: DVec3, expected: DVec3) -> impl Iterator<Item = f64> {
    (0..3).filter(move |&channel| expected[channel].is_finite()).map(move |channel| value[channel])
}

fn mean(value: DVec3) -> f64 {
    let (sum, count) = known(value, value).fold((0.0, 0.0), |(sum, count), x| (sum + x, count + 1.0));
    sum / count
}

fn mean_square(value: DVec3, expected: DVec3) -> f64 {
    let (sum, count) = known(value, expected).fold((0.0, 0.0), |(sum, count), x| (sum + x * x, count + 1.0));
    sum / count
}

/// Of points with what a map shows there.
pub fn local_errors(found: &[(Irradiance, DVec3)]) -> LocalErrors {
    let inside: Vec<_> = found.iter().copied().filter(|(point, _)| point.inside).collect();
    let average = |some: &mut dyn Iterator<Item = &(Irradiance, DVec3)>| {
        let (sum, count) =
            some.fold((0.0, 0.0), |(sum, count), (point, _)| (sum + mean(point.value), count + 1.0));
        sum / count
    };
    let region = average(&mut inside.iter());
    let floor = FLOOR * region;
    let logarithms = inside.iter().map(|(point, _)| mean(point.value).max(floor).ln());
    let log_average = (logarithms.sum::<f64>() / inside.len() as f64).exp();
    let away: Vec<_> = inside.iter().copied().filter(|(point, _)| !point.edge).collect();
    LocalErrors {
        mean: region,
        log_average,
        outside: average(&mut found.iter().filter(|(point, _)| !point.inside)),
        all: part(&inside, floor, log_average),
        away: part(&away, floor, log_average),
    }
}

fn part(found: &[(Irradiance, DVec3)], floor: f64, log_average: f64) -> Part {
    Part {
        points: found.len(),
        own: relative(found, |point| mean(point.value).max(floor)),
        around: relative(found, |_| log_average),
    }
}

fn relative(found: &[(Irradiance, DVec3)], to: impl Fn(&Irradiance) -> f64) -> Relative {
    if found.is_empty() {
        return Relative::default();
    }
    let count = found.len() as f64;
    let (mut squares, mut noise, mut bias) = (0.0, 0.0, 0.0);
    let mut errors = Vec::with_capacity(found.len());
    for (point, value) in found {
        let (off, by) = (*value - point.value, to(point));
        let square = mean_square(off, point.value) / (by * by);
        squares += square;
        noise += mean_square(point.error, point.value) / (by * by);
        bias += mean(off) / by;
        errors.push(square.sqrt());
    }
    errors.sort_by(f64::total_cmp);
    Relative {
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
        for (part, which) in [(&self.all, "all"), (&self.away, "away from shadow edges")] {
            for (errors, to) in [(&part.own, "a point's own"), (&part.around, "the log-average")] {
                let [median, p95, rmse, noise, bias] =
                    [errors.median, errors.p95, errors.rmse, errors.noise, errors.bias].map(|x| 100.0 * x);
                write!(
                    f,
                    "\n  {which} ({}), relative to {to}: median {median:.2}, p95 {p95:.2}, RMSE {rmse:.2} (noise {noise:.2}), bias {bias:+.2} %",
                    part.points
                )?;
            }
        }
        Ok(())
    }
}
