//! Which choice is the cheapest for an error that may be left: Pareto fronts, and the stretches of errors that one series wins. A claim is made
//! only where the quartiles of the times lie apart. Not the sentences about it.

use crate::{Point, Spread};

/// The points that no other one beats in time and error at once, from the largest error to the smallest. Of equals the first.
pub fn pareto_front<'a>(points: impl IntoIterator<Item = &'a Point>) -> Vec<&'a Point> {
    let mut known: Vec<(&Point, f64, f64)> = points
        .into_iter()
        .filter_map(|point| Some((point, point.error?.relative_rmse, point.milliseconds?.median)))
        .collect();
    // From the cheapest on, each has to be better than all before it.
    known.sort_by(|a, b| a.2.total_cmp(&b.2).then(a.1.total_cmp(&b.1)));
    let mut least = f64::INFINITY;
    known.retain(|(_, error, _)| {
        let better = *error < least;
        least = least.min(*error);
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
    /// The cheapest point of each series that may be the cheapest: one where the times decide, several where they do not. By their medians.
    pub cheapest: Vec<&'a Point>,
}

/// Walks from the smallest error that any point reaches to the largest, and says who gets there in the least time. A series gets to an error by
/// its cheapest point whose error is at most that. Next to each other stand stretches that different series win.
pub fn stretches<'a>(points: &[&'a Point]) -> Vec<Stretch<'a>> {
    let mut known: Vec<(&Point, f64, Spread)> = points
        .iter()
        .filter_map(|point| Some((*point, point.error?.relative_rmse, point.milliseconds?)))
        .collect();
    known.sort_by(|a, b| a.1.total_cmp(&b.1));
    let mut found: Vec<Stretch<'a>> = Vec::new();
    for at in 0..known.len() {
        let (from, to) = (known[at].1, known.get(at + 1).map_or(f64::INFINITY, |next| next.1));
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
        let cheapest: Vec<&Point> = best
            .iter()
            .enumerate()
            .filter(|(place, (_, time))| *place == 0 || !first.is_below(time))
            .map(|(_, (point, _))| *point)
            .collect();
        let names = |points: &[&Point]| {
            let mut names: Vec<String> = points.iter().map(|point| point.series.clone()).collect();
            names.sort();
            names
        };
        match found.last_mut().filter(|last| names(&last.cheapest) == names(&cheapest)) {
            Some(last) => (last.to, last.cheapest) = (to, cheapest),
            None => found.push(Stretch { from, to, cheapest }),
        }
    }
    found
}
