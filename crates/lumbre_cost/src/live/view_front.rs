//! The Pareto front of the ways to draw a view, and how to choose from it: by a time, by an error, or the
//! next step in either direction.

use crate::tune::{DrawSettings, choose};
use crate::{ErrorOf, Goal, Point, Spread};

/// Smaller differences of errors are rounding errors of 32-bit floats.
const ROUNDING: f64 = 1e-6;

/// A way to draw a view, with its time and its error.
#[derive(Clone, Debug, PartialEq)]
pub struct Priced {
    /// Its name.
    pub label: String,
    /// The settings.
    pub settings: DrawSettings,
    /// Milliseconds of a frame.
    pub milliseconds: Spread,
    /// Relative RMSE against the most accurate way.
    pub error: f64,
}

/// The measurements of a view.
#[derive(Clone, Debug, PartialEq)]
pub struct ViewFront {
    /// The ways that no other one beats, from the cheapest to the most accurate; at least one.
    pub ways: Vec<Priced>,
    /// The way in which it was drawn when the measurement began.
    pub now: Priced,
}

impl ViewFront {
    /// Returns the way with the least error within a time, and the cheapest of those that look alike; the
    /// cheapest of all if none is fast enough.
    pub fn within_milliseconds(&self, most: f64) -> usize {
        self.best(Goal { milliseconds: Some(most), error: None }).unwrap_or(0)
    }

    /// Returns the cheapest way within an error; the most accurate of all if none is accurate enough.
    pub fn within_error(&self, most: f64) -> usize {
        self.best(Goal { milliseconds: None, error: Some(most) }).unwrap_or(self.ways.len().saturating_sub(1))
    }

    /// Returns the most accurate way that takes less time than this one, with quartiles that do not overlap.
    pub fn next_cheaper(&self, than: &Priced) -> Option<usize> {
        let cheaper = |way: &Priced| way.milliseconds.is_below(&than.milliseconds);
        self.ways.iter().rposition(cheaper)
    }

    /// Returns the cheapest way whose error is smaller than that of this one.
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
    use lumbre_scene::{LightmapEncoding, ShadowFilter};

    use super::*;

    fn way(milliseconds: f64, error: f64) -> Priced {
        let settings = DrawSettings {
            shading: Shading::Phong,
            shadows: true,
            shadow_filter: ShadowFilter::Soft,
            shadow_resolution: 1.0,
            light_threshold: 0.0,
            multisample: true,
            lightmap_reduction: 1,
            lightmap_format: LightmapEncoding::Rgb16Float,
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
        // One way is as accurate as now in a third of the time, another one is better in less time: both are
        // steps forward.
        assert_eq!((front.next_cheaper(&front.now), front.next_better(&front.now)), (Some(2), Some(2)));
        assert_eq!(
            (front.next_cheaper(&front.ways[1]), front.next_better(&front.ways[1])),
            (Some(0), Some(2))
        );
        assert_eq!((front.next_cheaper(&front.ways[0]), front.next_better(&front.ways[3])), (None, None));
        // Nothing is cheaper if the quartiles overlap.
        assert_eq!(front.next_cheaper(&way(5.1, 0.4)), None);
    }
}
