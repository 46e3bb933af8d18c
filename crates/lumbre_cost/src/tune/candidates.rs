//! The ways to draw a level that may still be chosen: determines what a stage has to measure, and drops what
//! another way beats.

use super::draw_settings::{Choices, DrawSettings, Stage};
use super::goal::{Goal, choose};
use crate::{Point, Spread, pareto_front};

/// What is known so far about the ways to draw a level.
#[derive(Default)]
pub(crate) struct Candidates {
    /// The ways.
    pub settings: Vec<DrawSettings>,
    /// A point for each of them.
    pub points: Vec<Point>,
    /// The ways of the last measurement. Only their times can be compared, since they are from the same
    /// rounds.
    latest: Vec<usize>,
}

/// Largest number of ways that a stage goes on from: those that no other one beats, or an even selection of
/// them.
const MAX_CARRIED_ON: usize = 5;

impl Candidates {
    /// Returns what a stage has to measure: the ways that may still be chosen, and those that differ from the
    /// best of them in what the stage chooses.
    pub fn next(&self, stage: Stage, choices: &Choices) -> Vec<DrawSettings> {
        if self.latest.is_empty() {
            let reference = choices.reference();
            let others = stage.others(reference, choices);
            return [reference].into_iter().chain(others).collect();
        }
        let running: Vec<DrawSettings> = self.contenders().iter().map(|&one| self.settings[one]).collect();
        let points: Vec<Point> = self.contenders().iter().map(|&one| self.points[one].clone()).collect();
        let place = |point: &Point| points.iter().position(|other| std::ptr::eq(other, point));
        let front: Vec<usize> = pareto_front(&points).into_iter().filter_map(place).collect();
        let mut ways = running.clone();
        for from in evenly(&front, MAX_CARRIED_ON) {
            for other in stage.others(running[from], choices) {
                if !ways.contains(&other) {
                    ways.push(other);
                }
            }
        }
        // If there is nothing to choose, nothing has to be measured again.
        if ways.len() == running.len() { Vec::new() } else { ways }
    }

    /// Begins to take a new measurement, whose times cannot be compared with earlier ones.
    pub fn begin(&mut self) {
        self.latest.clear();
    }

    /// Takes the time of a way, and its point if the way is new. `point` gets the label of a new way; a way
    /// without a point is dropped.
    ///
    /// # Errors
    /// Those of `point`.
    pub fn take<E>(
        &mut self,
        way: DrawSettings,
        milliseconds: Option<Spread>,
        point: impl FnOnce(String) -> Result<Option<Point>, E>,
    ) -> Result<(), E> {
        let place = match self.settings.iter().position(|known| *known == way) {
            Some(place) => place,
            None => {
                let label = way.label(self.settings.first().unwrap_or(&way));
                let Some(point) = point(label)? else { return Ok(()) };
                self.settings.push(way);
                self.points.push(point);
                self.points.len() - 1
            }
        };
        self.points[place].milliseconds = milliseconds;
        self.latest.push(place);
        Ok(())
    }

    /// Takes the time of a way, and its point, which replaces that of an earlier measurement. A way without a point is
    /// dropped.
    pub fn take_anew(&mut self, way: DrawSettings, milliseconds: Option<Spread>, point: Option<Point>) {
        let Some(point) = point else { return };
        let point = Point { milliseconds, ..point };
        let place = self.place(&way).unwrap_or(self.settings.len());
        if place == self.settings.len() {
            self.settings.push(way);
            self.points.push(point);
        } else {
            self.points[place] = point;
        }
        self.latest.push(place);
    }

    /// Returns the index of a way, or `None` if it was not measured.
    pub fn place(&self, way: &DrawSettings) -> Option<usize> {
        self.settings.iter().position(|known| known == way)
    }

    /// Returns the ways of the last measurement that no other one beats in time and error by their medians,
    /// from the cheapest to the most accurate.
    pub fn front(&self) -> Vec<usize> {
        let points = || self.latest.iter().map(|&place| &self.points[place]);
        let place =
            |point: &Point| self.latest.iter().copied().find(|&at| std::ptr::eq(&self.points[at], point));
        pareto_front(points()).into_iter().filter_map(place).collect()
    }

    /// Returns the one of these ways that reaches a goal best, if one does.
    pub fn chosen(&self, among: &[usize], goal: Goal) -> Option<usize> {
        let points: Vec<Point> = among.iter().map(|&place| self.points[place].clone()).collect();
        choose(&points, goal).map(|one| among[one])
    }

    /// Returns the ways of the last measurement.
    pub fn latest(&self) -> &[usize] {
        &self.latest
    }

    /// Returns those of the last measurement that no other one beats.
    pub fn contenders(&self) -> Vec<usize> {
        let latest: Vec<&Point> = self.latest.iter().map(|&one| &self.points[one]).collect();
        let kept = (0..latest.len()).filter(|&one| !is_beaten(one, &latest));
        kept.map(|one| self.latest[one]).collect()
    }
}

/// Returns at most `most` of the indices, evenly spread and including the first and the last.
fn evenly(all: &[usize], most: usize) -> Vec<usize> {
    let last = all.len().saturating_sub(1);
    match all.len() <= most {
        true => all.to_vec(),
        false => (0..most).map(|place| all[place * last / (most - 1)]).collect(),
    }
}

/// Returns true if another way is as accurate and takes less time, with quartiles that do not overlap.
fn is_beaten(one: usize, points: &[&Point]) -> bool {
    let known = |point: &Point| Some((point.milliseconds?, point.error?.relative_rmse));
    let Some((time, error)) = known(points[one]) else { return true };
    let others = points.iter().enumerate().filter(|(place, _)| *place != one);
    others.filter_map(|(_, other)| known(other)).any(|(other, its)| its <= error && other.is_below(&time))
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
    fn a_clear_winner_beats_and_one_within_the_quartiles_does_not() {
        let beaten = |points: &[Point]| is_beaten(4, &points.iter().collect::<Vec<_>>());
        let ways = |fifth: f64| {
            [point(40.0, 0.0), point(20.0, 0.01), point(9.0, 0.5), point(9.0, 0.5), point(fifth, 0.01)]
        };
        assert!(beaten(&ways(30.0)) && !beaten(&ways(20.2)));
    }

    #[test]
    fn a_few_of_many_are_spread_over_them() {
        assert_eq!(evenly(&[3, 1, 2], 5), [3, 1, 2]);
        assert_eq!(evenly(&[0, 1, 2, 3, 4, 5, 6, 7, 8], 5), [0, 2, 4, 6, 8]);
        assert_eq!(evenly(&[0, 1, 2, 3, 4, 5], 5), [0, 1, 2, 3, 5]);
    }
}
