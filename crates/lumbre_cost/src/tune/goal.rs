//! The goal of tuning, and which settings reach it best.

use crate::{ErrorOf, Point, Spread};

/// The limits that settings have to keep.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Goal {
    /// Largest time of a frame in milliseconds, at the slowest camera.
    pub milliseconds: Option<f64>,
    /// Largest relative RMSE against the most accurate settings, at the camera with the largest error.
    pub error: Option<f64>,
}

/// Errors that differ by no more than this look alike: a quarter of a step of eight bits, in a picture of
/// medium grey.
const ALIKE: f64 = 0.002;

/// Returns true if two errors look alike.
pub(crate) fn look_alike(a: f64, b: f64) -> bool {
    (a - b).abs() <= ALIKE
}

/// Returns true if a time and an error keep the limits.
pub(crate) fn keeps(goal: Goal, time: Spread, error: ErrorOf) -> bool {
    goal.milliseconds.is_none_or(|most| time.median <= most)
        && goal.error.is_none_or(|most| error.relative_rmse <= most)
}

/// Returns the settings that reach the goal best: with a time limit, those with the least error, or the
/// cheapest of those that look alike; otherwise the fastest.
pub(crate) fn choose(points: &[Point], goal: Goal) -> Option<usize> {
    let known = points
        .iter()
        .enumerate()
        .filter_map(|(place, point)| Some((place, point.milliseconds?, point.error?)));
    let kept: Vec<(usize, f64, f64)> = known
        .filter(|(_, time, error)| keeps(goal, *time, *error))
        .map(|(place, time, error)| (place, time.median, error.relative_rmse))
        .collect();
    let least = kept.iter().map(|(.., error)| *error).fold(f64::INFINITY, f64::min);
    let most = if goal.milliseconds.is_some() { least + ALIKE } else { f64::INFINITY };
    let alike = kept.into_iter().filter(|(.., error)| *error <= most);
    alike.min_by(|a, b| a.1.total_cmp(&b.1).then(a.2.total_cmp(&b.2))).map(|(place, ..)| place)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{ErrorOf, Spread};

    fn point(time: f64, error: f64) -> Point {
        let milliseconds = Spread::of(&[0.98 * time, time, 1.02 * time]);
        Point {
            milliseconds,
            error: Some(ErrorOf { relative_rmse: error, ..ErrorOf::default() }),
            ..Point::default()
        }
    }

    #[test]
    fn a_planted_optimum_is_chosen() {
        let points =
            [point(40.0, 0.0), point(20.0, 0.01), point(19.0, 0.2), point(5.0, 0.4), point(20.2, 0.01)];
        let within = |milliseconds, error| choose(&points, Goal { milliseconds, error });
        assert_eq!(within(Some(100.0), None), Some(0));
        assert_eq!(within(Some(30.0), None), Some(1), "of two with the same error the cheaper");
        assert_eq!(within(Some(19.5), None), Some(2));
        assert_eq!(within(None, Some(0.05)), Some(1));
        assert_eq!(within(None, Some(0.5)), Some(3));
        assert_eq!(within(Some(30.0), Some(0.05)), Some(1));
        let alike = [point(40.0, 0.0), point(30.0, 0.001), point(20.0, 0.003)];
        assert_eq!(
            choose(&alike, Goal { milliseconds: Some(50.0), error: None }),
            Some(1),
            "what looks alike is cheaper"
        );
        assert_eq!(within(Some(4.0), None), None);
        assert_eq!(within(Some(30.0), Some(0.001)), None);
    }
}
