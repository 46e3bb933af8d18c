//! Which choice is the cheapest for an error that may be left: Pareto fronts, and the stretches of errors that one series wins. A claim is made
//! only where the quartiles of the times lie apart. Not the sentences about it.

use crate::{ErrorOf, Point, Spread};

/// The points that no other one beats in time and error at once, from the largest error to the smallest. Of equals the first. By medians and errors as they were found.
pub fn pareto_front<'a>(points: impl IntoIterator<Item = &'a Point>) -> Vec<&'a Point> {
    front_of(points, |point| Some((point.milliseconds?.median, point.error?.relative_rmse)))
}

/// The points that no other one beats in two numbers at once, of which less is better, from the least of the first to the least of the second. Of equals the first.
pub fn front_of<'a>(
    points: impl IntoIterator<Item = &'a Point>,
    numbers: impl Fn(&Point) -> Option<(f64, f64)>,
) -> Vec<&'a Point> {
    let mut known: Vec<(&Point, f64, f64)> = points
        .into_iter()
        .filter_map(|point| numbers(point).map(|(first, second)| (point, first, second)))
        .collect();
    // From the cheapest on, each has to be better than all before it.
    known.sort_by(|a, b| a.1.total_cmp(&b.1).then(a.2.total_cmp(&b.2)));
    let mut least = f64::INFINITY;
    known.retain(|(.., second)| {
        let better = *second < least;
        least = least.min(*second);
        better
    });
    known.into_iter().map(|(point, ..)| point).collect()
}

/// Who is the cheapest within a range of errors that may be left.
#[derive(Clone, Debug, PartialEq)]
pub struct Stretch<'a> {
    /// Errors from here …
    pub from: f64,
    /// … up to here, which is in the next stretch; infinite in the last.
    pub to: f64,
    /// The cheapest point of each series that may be the cheapest: one where the measurements decide, several where they do not. By their medians.
    pub cheapest: Vec<&'a Point>,
    /// Some of them are among these only because the reference leaves open whether they reach the error.
    pub by_error: bool,
}

/// Walks from the smallest error that any point reaches to the largest, and says who gets there in the least time. A series gets to an error by
/// its cheapest point whose error is at most that. A point whose error may be as small, for all that its reference leaves open, is not ruled out either, if its time does not rule it out. Next to each
/// other stand stretches that different series win.
pub fn stretches<'a>(points: &[&'a Point]) -> Vec<Stretch<'a>> {
    let mut known: Vec<(&Point, ErrorOf, Spread)> =
        points.iter().filter_map(|point| Some((*point, point.error?, point.milliseconds?))).collect();
    known.sort_by(|a, b| a.1.relative_rmse.total_cmp(&b.1.relative_rmse));
    let error = |at: usize| known.get(at).map_or(f64::INFINITY, |(_, error, _)| error.relative_rmse);
    let mut found: Vec<Stretch<'a>> = Vec::new();
    for at in 0..known.len() {
        let (from, to) = (error(at), error(at + 1));
        if from == to {
            continue;
        }
        let mut best: Vec<(&Point, Spread)> = Vec::new();
        for (point, _, time) in &known[..=at] {
            match best.iter_mut().find(|(other, _)| other.series == point.series) {
                Some(held) if time.median < held.1.median => *held = (*point, *time),
                Some(_) => {}
                None => best.push((*point, *time)),
            }
        }
        best.sort_by(|a, b| a.1.median.total_cmp(&b.1.median));
        let first = best[0].1;
        let mut cheapest: Vec<&Point> = best
            .iter()
            .enumerate()
            .filter(|(place, (_, time))| *place == 0 || !first.is_below(time))
            .map(|(_, (point, _))| *point)
            .collect();
        let sure = cheapest.len();
        for (point, error, time) in &known[at + 1..] {
            let may_reach = error.relative_rmse - error.uncertainty <= from;
            let is_named = cheapest.iter().any(|named| named.series == point.series);
            if may_reach && !is_named && !first.is_below(time) {
                cheapest.push(point);
            }
        }
        let by_error = cheapest.len() > sure;
        let names = |points: &[&Point]| {
            let mut names: Vec<String> = points.iter().map(|point| point.series.clone()).collect();
            names.sort();
            names
        };
        match found.last_mut().filter(|last| names(&last.cheapest) == names(&cheapest)) {
            Some(last) => (last.to, last.cheapest, last.by_error) = (to, cheapest, last.by_error || by_error),
            None => found.push(Stretch { from, to, cheapest, by_error }),
        }
    }
    found
}
