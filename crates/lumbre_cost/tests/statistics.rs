//! Fronts, ranges and sentences for points whose answer is known, and two reports with a planted difference.

#![allow(clippy::unwrap_used, reason = "helpers of tests, which clippy does not count as tests")]

use lumbre_cost::{
    Change, CostReport, DRIFT_OF_MACHINES, ErrorOf, NOISE_OF_RUNS, Point, Spread, Study, What,
    cheapest_by_error, compare_reports, pareto_front, stretches,
};

/// A point of a series: an error as a fraction, and milliseconds with quartiles this far to either side.
fn point(series: &str, label: &str, error: f64, ms: f64, beside: f64) -> Point {
    Point {
        series: series.into(),
        label: label.into(),
        milliseconds: Some(Spread { lower: ms - beside, median: ms, upper: ms + beside, rounds: 9 }),
        error: Some(ErrorOf { relative_rmse: error, ..ErrorOf::default() }),
        counts: [("rays".to_owned(), 1000.0)].into(),
        ..Point::default()
    }
}

/// Two curves that cross between errors of 4 % and 2 %: "quick" costs 1 + 1/e, "fine" 20 + 0.1/e, with e in
/// per cent.
fn crossing(beside: f64) -> Vec<Point> {
    let errors = [16.0, 8.0, 4.0, 2.0, 1.0];
    let mut points = Vec::new();
    for error in errors {
        let label = format!("{error} %");
        points.push(point("quick", &label, error / 100.0, 1.0 + 80.0 / error, beside));
        points.push(point("fine", &label, error / 100.0, 28.0 + 8.0 / error, beside));
    }
    points
}

#[test]
fn a_crossing_at_a_known_place_is_found() {
    let points = crossing(0.1);
    let found: Vec<&Point> = points.iter().collect();
    let found = stretches(&found);
    // At 4 %: 21 against 30. At 2 %: 41 against 32. At 1 %: 81 against 36.
    let names: Vec<(f64, f64, Vec<&str>)> = found
        .iter()
        .map(|s| (s.from, s.to, s.cheapest.iter().map(|point| point.series.as_str()).collect()))
        .collect();
    assert_eq!(names, [(0.01, 0.04, vec!["fine"]), (0.04, f64::INFINITY, vec!["quick"])]);
    let all: Vec<&Point> = points.iter().collect();
    let said = cheapest_by_error(&all, "").unwrap();
    assert!(
        said.starts_with("Below 4.00 % of error, down to 1.00 %, the cheapest is fine (1 %: 36.0 ± 0.100 ms"),
        "{said}"
    );
    assert!(said.contains("Above 4.00 % the cheapest is quick."), "{said}");
}

#[test]
fn curves_that_do_not_cross_have_one_winner() {
    let mut points = Vec::new();
    for error in [0.08, 0.04, 0.02] {
        points.push(point("quick", "a", error, 1.0 / error, 0.1));
        points.push(point("slow", "a", error, 3.0 / error, 0.1));
    }
    let all: Vec<&Point> = points.iter().collect();
    let found = stretches(&all);
    assert_eq!(found.len(), 1);
    assert_eq!((found[0].from, found[0].to, found[0].cheapest.len()), (0.02, f64::INFINITY, 1));
    let said = cheapest_by_error(&all, "").unwrap();
    assert!(said.starts_with("At every error down to 2.00 % the cheapest is quick ("), "{said}");
    assert!(said.ends_with("Never the cheapest: slow."), "{said}");
}

#[test]
fn times_within_each_others_quartiles_decide_nothing() {
    let points = crossing(60.0);
    let all: Vec<&Point> = points.iter().collect();
    assert!(stretches(&all).iter().all(|stretch| stretch.cheapest.len() == 2));
    let said = cheapest_by_error(&all, "").unwrap();
    assert!(said.contains("the times do not decide between"), "{said}");
    assert!(!said.contains("cheapest is"), "{said}");
}

/// "fine" has the smaller error by the numbers and is slower, but the reference does not distinguish the two
/// errors.
#[test]
fn errors_within_what_the_reference_leaves_open_decide_nothing() {
    let with = |series: &str, error: f64, ms: f64, uncertainty: f64| Point {
        error: Some(ErrorOf { relative_rmse: error, uncertainty, ..ErrorOf::default() }),
        ..point(series, "a", error, ms, 0.1)
    };
    let told = |uncertainty: f64| {
        let points = [with("quick", 0.022, 1.0, uncertainty), with("fine", 0.020, 9.0, uncertainty)];
        let all: Vec<&Point> = points.iter().collect();
        let found = stretches(&all);
        (found[0].cheapest.len(), found[0].by_error, cheapest_by_error(&all, "").unwrap())
    };
    let (cheapest, by_error, said) = told(0.0001);
    assert_eq!((cheapest, by_error), (1, false));
    assert!(said.starts_with("Below 2.20 % of error, down to 2.00 %, the cheapest is fine"), "{said}");
    let (cheapest, by_error, said) = told(0.005);
    assert_eq!((cheapest, by_error), (2, true));
    assert!(said.contains("the times and errors do not decide between fine and quick"), "{said}");
    // What is certainly slower is ruled out nevertheless.
    let points = [with("slow", 0.022, 20.0, 0.005), with("fine", 0.020, 9.0, 0.005)];
    assert_eq!(stretches(&points.iter().collect::<Vec<_>>())[0].cheapest.len(), 1);
}

#[test]
fn one_series_is_compared_with_nothing() {
    let points = [point("only", "a", 0.1, 1.0, 0.1), point("only", "b", 0.01, 9.0, 0.1)];
    assert_eq!(cheapest_by_error(&points.iter().collect::<Vec<_>>(), ""), None);
}

#[test]
fn the_front_holds_what_is_not_beaten_in_both() {
    let points = [
        point("a", "beaten", 0.10, 5.0, 0.1),
        point("a", "quickest", 0.20, 1.0, 0.1),
        point("b", "nearest", 0.01, 9.0, 0.1),
        point("b", "between", 0.05, 4.0, 0.1),
        point("b", "as near and slower", 0.05, 6.0, 0.1),
        Point { label: "without a time".into(), milliseconds: None, ..point("b", "", 0.001, 1.0, 0.1) },
    ];
    let front: Vec<&str> = pareto_front(&points).iter().map(|point| point.label.as_str()).collect();
    assert_eq!(front, ["quickest", "between", "nearest"]);
    // By trying all pairs.
    for tried in &points {
        let (Some(time), Some(error)) = (tried.milliseconds, tried.error) else { continue };
        let beaten = points.iter().any(|other| match (other.milliseconds, other.error) {
            (Some(t), Some(e)) => {
                t.median <= time.median
                    && e.relative_rmse <= error.relative_rmse
                    && (t.median < time.median || e.relative_rmse < error.relative_rmse)
            }
            _ => false,
        });
        assert_eq!(front.contains(&tried.label.as_str()), !beaten, "{}", tried.label);
    }
}

fn report(points: Vec<Point>) -> CostReport {
    CostReport {
        studies: vec![Study { name: "bake".into(), points, ..Study::default() }],
        ..CostReport::default()
    }
}

#[test]
fn a_planted_slow_down_is_found_and_noise_is_not() {
    let before = report(vec![point("final", "a", 0.01, 10.0, 1.0), point("final", "b", 0.02, 5.0, 1.0)]);
    let slower = report(vec![point("final", "a", 0.01, 20.0, 1.0), point("final", "b", 0.02, 5.9, 1.0)]);
    let changes = compare_reports(&before, &slower, 1.1);
    assert_eq!(changes.len(), 1, "{changes:?}");
    assert!(changes[0].is_slower() && !changes[0].is_worse());
    assert_eq!(
        changes[0].to_string(),
        "bake, final, a: 20.0 ± 1.00 ms instead of 10.0 ± 1.00 ms (2.00 times)"
    );
    // In the other direction it is a change, but not for the worse.
    let back = compare_reports(&slower, &before, 1.1);
    assert!(back.len() == 1 && !back[0].is_slower() && !back[0].is_worse(), "{back:?}");
    assert!(compare_reports(&before, &slower, 2.5).is_empty());
}

/// Half of a study that takes four times as long is found, although the ratios then scatter widely.
#[test]
fn a_study_of_which_half_is_slower_is_found() {
    let (before, mut after) = (drifted(1.0), drifted(1.0));
    let half = after.studies[0].points.len() / 2;
    for point in &mut after.studies[0].points[..half] {
        let time = point.milliseconds.as_mut().unwrap();
        (time.lower, time.median, time.upper) = (4.0 * time.lower, 4.0 * time.median, 4.0 * time.upper);
    }
    let found = compare_reports(&before, &after, 1.1);
    assert_eq!(found.iter().filter(|change| change.is_slower()).count(), half, "{found:?}");
}

/// Two dozen points, of which each takes `drift` times as long as usual, up to a tenth more or less.
fn drifted(drift: f64) -> CostReport {
    let times = (0..24).map(|number: u32| {
        let noise = 1.0 + 0.1 * f64::from((7 * number) % 11).sin();
        let usual = 2.0 + 3.0 * f64::from(number);
        let ms = if drift == 1.0 { usual } else { usual * drift * noise };
        point("final", &format!("{number}"), 0.01, ms, 0.02 * ms)
    });
    report(times.collect())
}

#[test]
fn a_drift_of_the_machine_is_no_slow_down_and_one_slower_point_is_found_in_it() {
    let before = drifted(1.0);
    for drift in [1.75, 0.5, 1.01] {
        let after = drifted(drift);
        let same = compare_reports(&before, &after, 1.1);
        assert!(!same.iter().any(Change::is_slower), "{drift}: {same:?}");
        let named = same.iter().filter(|change| matches!(change.what, What::Drift { .. })).count();
        assert_eq!((named, same.len()), (usize::from(drift != 1.01), usize::from(drift != 1.01)), "{same:?}");
        for planted in [0, 9, 23] {
            let mut slower = after.clone();
            let point = &mut slower.studies[0].points[planted];
            point.milliseconds = point.milliseconds.map(|time| time.times(1.3 * NOISE_OF_RUNS));
            let found = compare_reports(&before, &slower, 1.1);
            let slow: Vec<&Change> = found.iter().filter(|change| change.is_slower()).collect();
            assert!(slow.len() == 1 && slow[0].point == format!("final, {planted}"), "{drift}: {found:?}");
            assert!(slow[0].to_string().contains("times relative to its study"), "{}", slow[0]);
        }
    }
    // A program that is slower in all points is found if no machine drifts so far.
    let found = compare_reports(&before, &drifted(1.2 * DRIFT_OF_MACHINES), 1.1);
    assert!(found.len() == 1 && found[0].is_slower(), "{found:?}");
    assert!(found[0].to_string().starts_with("bake: its 24 times are "), "{}", found[0]);
}

#[test]
fn a_planted_error_and_a_planted_count_are_found() {
    let before = report(vec![point("final", "a", 0.01, 10.0, 1.0)]);
    let mut worse = before.clone();
    worse.studies[0].points[0].error = Some(ErrorOf { relative_rmse: 0.012, ..ErrorOf::default() });
    worse.studies[0].points[0].counts.insert("rays".into(), 1200.0);
    let changes = compare_reports(&before, &worse, 1.1);
    assert_eq!(changes.len(), 2, "{changes:?}");
    assert!(changes.iter().all(|change| change.is_worse()));
    assert!(changes.iter().any(|change| matches!(change.what, What::Error { .. })));
    assert!(compare_reports(&before, &worse, 1.3).is_empty());
    assert!(compare_reports(&worse, &before, 1.1).iter().all(|change| !change.is_worse()));
    // Differences within the references' uncertainty are no change.
    let open = ErrorOf { relative_rmse: 0.012, uncertainty: 0.01, ..ErrorOf::default() };
    worse.studies[0].points[0].error = Some(open);
    let open = compare_reports(&before, &worse, 1.1);
    assert!(open.iter().all(|change| !matches!(change.what, What::Error { .. })), "{open:?}");
}

#[test]
fn what_is_gone_is_worse_and_what_is_new_is_not() {
    let both = report(vec![point("final", "a", 0.01, 10.0, 1.0), point("final", "b", 0.02, 5.0, 1.0)]);
    let one = report(vec![point("final", "a", 0.01, 10.0, 1.0)]);
    let gone = compare_reports(&both, &one, 1.1);
    assert!(gone.len() == 1 && gone[0].is_worse(), "{gone:?}");
    let new = compare_reports(&one, &both, 1.1);
    assert!(new.len() == 1 && !new[0].is_worse(), "{new:?}");
    assert!(compare_reports(&one, &CostReport::default(), 1.1)[0].is_worse());
}

#[test]
fn what_shrinks_comes_or_goes_is_reported_and_fails_only_where_something_is_lost() {
    let before = report(vec![point("final", "a", 0.02, 10.0, 0.1)]);
    let changed = |change: &dyn Fn(&mut Point)| {
        let mut after = before.clone();
        change(&mut after.studies[0].points[0]);
        let found = compare_reports(&before, &after, 1.1);
        assert_eq!(found.len(), 1, "{found:?}");
        (found[0].is_worse(), found[0].is_slower(), found[0].to_string())
    };
    let named = |text: &str| format!("bake, final, a: {text}");
    let shrunk = changed(&|point| *point.counts.get_mut("rays").unwrap() = 500.0);
    assert_eq!(shrunk, (false, false, named("rays 500 instead of 1000 (0.500 times)")));
    let new = changed(&|point| {
        point.counts.insert("texels".into(), 3.0);
    });
    assert_eq!(new, (false, false, named("texels is counted for the first time")));
    let better = changed(&|point| point.error.as_mut().unwrap().relative_rmse = 0.01);
    assert_eq!(better, (false, false, named("error 1.00 % instead of 2.00 % (0.500 times)")));
    let quicker = changed(&|point| {
        point.milliseconds = Some(Spread { lower: 4.9, median: 5.0, upper: 5.1, rounds: 9 });
    });
    assert_eq!(quicker, (false, false, named("5.00 ± 0.100 ms instead of 10.0 ± 0.100 ms (0.500 times)")));
    let untimed = changed(&|point| point.milliseconds = None);
    assert_eq!(untimed, (false, false, named("no longer has a time")));
    let unjudged = changed(&|point| point.error = None);
    assert_eq!(unjudged, (true, false, named("no longer has an error")));
    // In the other direction, what is lost is gained.
    let mut without = before.clone();
    (without.studies[0].points[0].milliseconds, without.studies[0].points[0].error) = (None, None);
    let gained = compare_reports(&without, &before, 1.1);
    assert!(gained.len() == 2 && gained.iter().all(|change| !change.is_worse()), "{gained:?}");
}

#[test]
fn studies_by_different_methods_are_not_compared() {
    let mut before = report(vec![point("final", "a", 0.02, 10.0, 0.1)]);
    let mut after = report(vec![point("final", "a", 0.20, 90.0, 0.1)]);
    (before.studies[0].method, after.studies[0].method) = (1, 2);
    let found = compare_reports(&before, &after, 1.1);
    assert_eq!(found.len(), 1, "{found:?}");
    assert_eq!(found[0].to_string(), "bake: was measured by method 2 instead of 1, and is not compared");
    assert!(!found[0].is_worse());
}

#[test]
fn a_count_that_comes_from_nothing_or_goes_is_seen() {
    let mut before = report(vec![point("final", "a", 0.01, 10.0, 1.0)]);
    let after = before.clone();
    before.studies[0].points[0].counts.insert("rays".into(), 0.0);
    assert!(compare_reports(&before, &after, 1.1)[0].is_worse());
    let mut without = after.clone();
    without.studies[0].points[0].counts.clear();
    let gone = compare_reports(&after, &without, 1.1);
    assert!(gone.len() == 1 && gone[0].is_worse(), "{gone:?}");
    assert_eq!(gone[0].to_string(), "bake, final, a: rays is no longer counted");
}
