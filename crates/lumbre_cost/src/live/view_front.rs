//! The ways to draw a view that no other one beats, and how one gets from one to the next: by a time, by an error, or a step at a time. Not their measuring.

use crate::tune::{DrawSettings, choose};
use crate::{ErrorOf, Goal, Point, Spread};

/// Smaller differences of errors are rounding of 32-bit floats, and no gain.
const ROUNDING: f64 = 1e-6;

/// A way to draw a view, with its two prices.
#[derive(Clone, Debug, PartialEq)]
pub struct Priced {
    /// What it is called.
    pub label: String,
    /// The settings.
    pub settings: DrawSettings,
    /// Milliseconds of a frame.
    pub milliseconds: Spread,
    /// Relative RMSE against the most accurate way.
    pub error: f64,
}

/// What was measured of a view.
#[derive(Clone, Debug, PartialEq)]
pub struct ViewFront {
    /// The ways that no other one beats, from the cheapest to the most accurate; at least one.
    pub ways: Vec<Priced>,
    /// How it was drawn when it was measured.
    pub now: Priced,
}

impl ViewFront {
    /// The way with the least error within a time, and the cheapest of those that look alike; the cheapest of all where none is quick enough.
    pub fn within_milliseconds(&self, most: f64) -> usize {
        self.best(Goal { milliseconds: Some(most), error: None }).unwrap_or(0)
    }

    /// The cheapest way within an error; the most accurate of all where none is near enough.
    pub fn within_error(&self, most: f64) -> usize {
        self.best(Goal { milliseconds: None, error: Some(most) }).unwrap_or(self.ways.len().saturating_sub(1))
    }

    /// The most accurate way that takes less time than this one, quartiles and all.
    pub fn next_cheaper(&self, than: &Priced) -> Option<usize> {
        let cheaper = |way: &Priced| way.milliseconds.is_below(&than.milliseconds);
        self.ways.iter().rposition(cheaper)
    }

    /// The cheapest way whose error is smaller than this one's.
    pub fn next_better(&self, than: &Priced) -> Option<usize> {
        self.ways.iter().position(|way| way.error < than.error - ROUNDING)
    }

    fn best(&self, goal: Goal) -> Option<usize> {
        let points: Vec<Point> = self
            .ways
            .iter()
            .map(|way| Point {
                milliseconds: Some(way.milliseconds),
                error: Some(ErrorOf { relative_rmse: way.error, ..ErrorOf::default() }),
                ..Point::default()
            })
            .collect();
        choose(&points, goal)
    }
}

#[cfg(test)]
mod tests {
    use lumbre_optics::Shading;
    use lumbre_scene::ShadowFilter;

    use super::*;

    fn way(milliseconds: f64, error: f64) -> Priced {
        let settings = DrawSettings {
            shading: Shading::Phong,
            shadows: true,
            shadow_filter: ShadowFilter::Soft,
            shadow_resolution: 1.0,
            light_threshold: 0.0,
            multisample: true,
        };
        let times = [0.98 * milliseconds, milliseconds, 1.02 * milliseconds];
        let milliseconds = Spread::of(&times).expect("there are times");
        Priced { label: String::new(), settings, milliseconds, error }
    }

    #[test]
    fn times_and_errors_lead_to_places_on_the_front() {
        let ways = vec![way(5.0, 0.4), way(10.0, 0.05), way(20.0, 0.01), way(40.0, 0.0)];
        let front = ViewFront { ways, now: way(30.0, 0.05) };
        assert_eq!([4.0, 5.0, 12.0, 20.0, 1e3].map(|ms| front.within_milliseconds(ms)), [0, 0, 1, 2, 3]);
        assert_eq!([1.0, 0.4, 0.3, 0.01, 1e-9].map(|error| front.within_error(error)), [0, 0, 1, 2, 3]);
        // As accurate as now for a third of the time, and better for less: both are steps forward.
        assert_eq!((front.next_cheaper(&front.now), front.next_better(&front.now)), (Some(2), Some(2)));
        assert_eq!(
            (front.next_cheaper(&front.ways[1]), front.next_better(&front.ways[1])),
            (Some(0), Some(2))
        );
        assert_eq!((front.next_cheaper(&front.ways[0]), front.next_better(&front.ways[3])), (None, None));
        // Within the quartiles nothing is cheaper.
        assert_eq!(front.next_cheaper(&way(5.1, 0.4)), None);
    }
}
