//! Finds which choice is the cheapest for an error: Pareto fronts, and the ranges of errors in which a series
//! is the cheapest. A series is only ruled out if the quartiles of the times do not overlap. The sentences
//! about it are in `findings`.

use crate::{ErrorOf, Point, Spread};

/// Returns the points that no other point beats in both time and error, from the largest error to the
/// smallest; the first of equal ones. Medians and errors that can be relied on are compared.
pub fn pareto_front<'a>(points: impl IntoIterator<Item = &'a Point>) -> Vec<&'a Point> {
    front_of(points, |point| Some((point.milliseconds?.median, point.error?.reached())))
}

/// Returns the points that no other point beats in two numbers of which less is better, ordered by the first
/// number; the first of equal ones.
pub fn front_of<'a>(
    points: impl IntoIterator<Item = &'a Point>,
    numbers: impl Fn(&Point) -> Option<(f64, f64)>,
) -> Vec<&'a Point> {
    let mut known: Vec<(&Point, f64, f64)> = points
        .into_iter()
        .filter_map(|point| numbers(point).map(|(first, second)| (point, first, second)))
        .collect();
    // From the cheapest point on, each has to be better than all before it.
    known.sort_by(|a, b| a.1.total_cmp(&b.1).then(a.2.total_cmp(&b.2)));
    let mut least = f64::INFINITY;
    known.retain(|(.., second)| {
        let better = *second < least;
        least = least.min(*second);
        better
    });
    known.into_iter().map(|(point, ..)| point).collect()
}

/// Returns the fronts of all points that can be compared with each other, which are those whose errors have
/// the same reference.
pub fn fronts_by_reference<'a>(
    points: impl IntoIterator<Item = &'a Point>,
    numbers: impl Fn(&Point) -> Option<(f64, f64)>,
) -> Vec<Vec<&'a Point>> {
    let mut groups: Vec<(Option<&str>, Vec<&Point>)> = Vec::new();
    for point in points {
        let reference = point.picture.as_ref().map(|files| files.reference.as_str());
        match groups.iter_mut().find(|(known, _)| *known == reference) {
            Some((_, group)) => group.push(point),
            None => groups.push((reference, vec![point])),
        }
    }
    groups.into_iter().map(|(_, group)| front_of(group, &numbers)).collect()
}

/// The cheapest choices within a range of errors.
#[derive(Clone, Debug, PartialEq)]
pub struct Stretch<'a> {
    /// The smallest error of the range.
    pub from: f64,
    /// The end of the range, which belongs to the next one; infinite for the last.
    pub to: f64,
    /// The cheapest point of each series that may be the cheapest, ordered by median: one if the measurements
    /// decide, several if they do not.
    pub cheapest: Vec<&'a Point>,
    /// Whether some of these are included only because the reference leaves open whether they reach the
    /// error.
    pub by_error: bool,
}

/// Returns the cheapest choices for every error, from the smallest error that any point reaches to the
/// largest.
///
/// A series reaches an error by its cheapest point whose error that can be relied on is at most that. A point that
/// may reach the error, given the uncertainty of the reference, is included too unless its time rules it out. Adjacent
/// ranges have different winners.
pub fn stretches<'a>(points: &[&'a Point]) -> Vec<Stretch<'a>> {
    let mut known: Vec<(&Point, ErrorOf, Spread)> =
        points.iter().filter_map(|point| Some((*point, point.error?, point.milliseconds?))).collect();
    known.sort_by(|a, b| a.1.reached().total_cmp(&b.1.reached()));
    let error = |at: usize| known.get(at).map_or(f64::INFINITY, |(_, error, _)| error.reached());
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::PointPicture;

    #[test]
    fn an_uncertain_reference_proves_no_small_error() {
        let point = |series: &str, ms: f64, relative_rmse: f64, uncertainty: f64| Point {
            series: series.into(),
            milliseconds: Spread::of(&[ms; 5]),
            error: Some(ErrorOf { relative_rmse, uncertainty, ..ErrorOf::default() }),
            ..Point::default()
        };
        // The reference's noise explains all of the first difference, and hardly any of the second.
        let points = [point("unknown", 1.0, 0.0, 0.27), point("known", 2.0, 0.05, 0.01)];
        let found = stretches(&points.iter().collect::<Vec<_>>());
        let ranges: Vec<(f64, &str)> =
            found.iter().map(|stretch| (stretch.from, stretch.cheapest[0].series.as_str())).collect();
        assert_eq!(ranges, [(0.05, "known"), (0.27, "unknown")]);
        assert!(found[0].by_error && found[0].cheapest.len() == 2, "{found:?}");
        let front: Vec<&str> = pareto_front(&points).iter().map(|point| point.series.as_str()).collect();
        assert_eq!(front, ["unknown", "known"]);
    }

    #[test]
    fn a_larger_error_never_counts_less() {
        let error = |relative_rmse, uncertainty| {
            ErrorOf { relative_rmse, uncertainty, ..ErrorOf::default() }.reached()
        };
        assert_eq!((error(0.0, 0.3), error(0.2, 0.0), error(0.9, 0.3)), (0.3, 0.2, 0.9));
        let steps: Vec<f64> = (0..100).map(|step| error(0.01 * f64::from(step), 0.3)).collect();
        assert!(steps.windows(2).all(|pair| pair[0] <= pair[1] && pair[1] - pair[0] < 0.011), "{steps:?}");
    }

    #[test]
    fn points_with_different_references_do_not_beat_each_other() {
        let point = |label: &str, ms: f64, error: f64, reference: &str| Point {
            label: label.into(),
            milliseconds: Spread::of(&[ms]),
            error: Some(ErrorOf { relative_rmse: error, ..ErrorOf::default() }),
            picture: Some(PointPicture { reference: reference.into(), ..PointPicture::default() }),
            ..Point::default()
        };
        let points = [
            point("quick", 1.0, 0.1, "near"),
            point("worse in both", 5.0, 0.3, "far"),
            point("beaten by its own", 2.0, 0.2, "near"),
            point("worse and alone", 9.0, 0.2, "far"),
        ];
        let fronts = fronts_by_reference(&points, |point| {
            Some((point.milliseconds?.median, point.error?.relative_rmse))
        });
        let labels: Vec<Vec<&str>> =
            fronts.iter().map(|front| front.iter().map(|point| point.label.as_str()).collect()).collect();
        assert_eq!(labels, [vec!["quick"], vec!["worse in both", "worse and alone"]]);
        assert_eq!(pareto_front(&points).len(), 1);
    }
}
