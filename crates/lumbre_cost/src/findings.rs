//! Turns points into sentences: which series is the cheapest for which error, where this changes, and where
//! the times do not decide it; and formats the numbers in them.

use crate::fronts::stretches;
use crate::{ErrorOf, Point, Spread};

/// Returns sentences that say which series is the cheapest for which error: the range of small errors that
/// one series reaches in the least time, the range of large errors for which one series is at least as cheap
/// as all others, and what lies between them. `place` names the scene, as in " in the room". `None` if fewer
/// than two series have times and errors.
pub fn cheapest_by_error(points: &[&Point], place: &str) -> Option<String> {
    let mut series: Vec<&str> = Vec::new();
    for point in points.iter().filter(|point| point.error.is_some() && point.milliseconds.is_some()) {
        if !series.contains(&point.series.as_str()) {
            series.push(&point.series);
        }
    }
    let found = stretches(points);
    let (finest, coarsest) = (found.first()?, found.last()?);
    if series.len() < 2 {
        return None;
    }
    let mut sentences = Vec::new();
    // The range from the smallest error upwards in which the winners stay the same.
    let fine = found.iter().take_while(|stretch| same(&stretch.cheapest, &finest.cheapest)).count();
    let end = found[fine - 1].to;
    let range = match end.is_infinite() {
        true => format!("At every error{place} down to {}", percent(finest.from)),
        false => format!("Below {} of error{place}, down to {},", percent(end), percent(finest.from)),
    };
    sentences.push(match &finest.cheapest[..] {
        [only] => {
            let finest = smallest(points, &only.series).unwrap_or(only);
            format!("{range} the cheapest is {} ({}: {}).", only.series, finest.label, cost_of(finest))
        }
        several => {
            let what = if found[..fine].iter().any(|stretch| stretch.by_error) {
                "times and errors"
            } else {
                "times"
            };
            format!("{range} the {what} do not decide between {}.", names_of(several))
        }
    });
    // The range from the largest error downwards in which one series is always among the cheapest.
    if fine < found.len() {
        let rest = &found[fine..];
        let lasting = |point: &&&Point| {
            rest.iter()
                .rev()
                .take_while(|stretch| stretch.cheapest.iter().any(|c| c.series == point.series))
                .count()
        };
        if let Some(winner) = coarsest.cheapest.iter().max_by_key(lasting) {
            let coarse = lasting(&winner);
            let stretches = &rest[rest.len() - coarse..];
            let mut level: Vec<&str> = Vec::new();
            for point in stretches.iter().flat_map(|stretch| &stretch.cheapest) {
                if point.series != winner.series && !level.contains(&point.series.as_str()) {
                    level.push(&point.series);
                }
            }
            let from = stretches[0].from;
            let level = match level.is_empty() {
                true => String::new(),
                false => {
                    format!(", in parts of this range not distinguishable from {}", listed(&level, "and"))
                }
            };
            sentences.push(format!("Above {} the cheapest is {}{level}.", percent(from), winner.series));
            let between = &rest[..rest.len() - coarse];
            if !between.is_empty() {
                let all: Vec<&Point> =
                    between.iter().flat_map(|stretch| stretch.cheapest.iter().copied()).collect();
                let range = format!("Between {} and {}", percent(end), percent(from));
                let names = names_of(&all);
                sentences.push(match same(&all[..1], &between[0].cheapest) && between.len() == 1 {
                    true => format!("{range} the cheapest is {names}."),
                    false => format!("{range} the cheapest series changes several times ({names})."),
                });
            }
        }
    }
    let contends = |name: &str| found.iter().any(|s| s.cheapest.iter().any(|point| point.series == name));
    let never: Vec<&str> = series.iter().copied().filter(|name| !contends(name)).collect();
    if !never.is_empty() {
        sentences.push(format!("Never the cheapest: {}.", listed(&never, "and")));
    }
    Some(sentences.join(" "))
}

/// Returns true if two lists contain points of the same series.
fn same(a: &[&Point], b: &[&Point]) -> bool {
    a.len() == b.len() && a.iter().all(|point| b.iter().any(|other| other.series == point.series))
}

/// Returns the names of the points' series, each once.
fn names_of(points: &[&Point]) -> String {
    let mut names: Vec<&str> = Vec::new();
    for point in points {
        if !names.contains(&point.series.as_str()) {
            names.push(&point.series);
        }
    }
    listed(&names, "and")
}

/// Returns the point of a series with the smallest error.
fn smallest<'a>(points: &[&'a Point], series: &str) -> Option<&'a Point> {
    let own = points.iter().filter(|point| point.series == series && point.milliseconds.is_some());
    let known = own.filter_map(|point| Some((*point, point.error?.reached())));
    known.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(point, _)| point)
}

/// Returns a point's time and error in words.
pub fn cost_of(point: &Point) -> String {
    let time = point.milliseconds.as_ref().map(milliseconds);
    let error = point.error.map(|error| format!("{} of error", error_of(&error)));
    time.into_iter().chain(error).collect::<Vec<_>>().join(", ")
}

/// Returns an error in per cent with its uncertainty; if the uncertainty exceeds the error, the largest value
/// that it may have.
pub fn error_of(error: &ErrorOf) -> String {
    let ErrorOf { relative_rmse, uncertainty, .. } = *error;
    match uncertainty {
        0.0 => percent(relative_rmse),
        _ if error.is_below_uncertainty() => format!("at most {}", percent(error.reached())),
        open => format!("{} ± {}", percent(relative_rmse), percent(open)),
    }
}

/// Returns the ratio of the first times to the second, as the median with its interval over pairs from the
/// same round. `None` without any pairs.
pub fn ratio_of(first: &[f64], second: &[f64]) -> Option<Spread> {
    let ratios: Vec<f64> = first.iter().zip(second).map(|(a, b)| a / b.max(1e-9)).collect();
    Spread::of_median(&ratios)
}

/// Returns whether a ratio is above 1, or `None` if its interval contains 1 or there are too few rounds.
pub fn is_above_one(ratio: &Spread) -> Option<bool> {
    match (ratio.rounds >= Spread::MIN_PAIRS_TO_DISTINGUISH, ratio.lower > 1.0, ratio.upper < 1.0) {
        (true, true, _) => Some(true),
        (true, _, true) => Some(false),
        _ => None,
    }
}

/// Returns a ratio of times with its interval; if it is not distinguishable from 1, that is said, with the
/// number of rounds.
pub fn factor(ratio: &Spread) -> String {
    let [median, lower, upper] = [ratio.median, ratio.lower, ratio.upper].map(rounded);
    let open = match is_above_one(ratio) {
        Some(_) => String::new(),
        None => format!(", not distinguishable from 1 in {}", rounds(ratio.rounds)),
    };
    format!("{median} ({lower} to {upper}{open})")
}

/// Returns how many times the second time the first one is, by their medians and ranges; if the ranges
/// overlap, that is said, with the number of rounds.
pub fn times_of(first: &Spread, second: &Spread) -> String {
    let [median, lower, upper] =
        [first.median / second.median, first.lower / second.upper, first.upper / second.lower].map(rounded);
    match first.is_below(second) || second.is_below(first) {
        true => format!("{median} times the time ({lower} to {upper})"),
        false => format!(
            "a time that is not distinguishable in {} ({lower} to {upper} of it)",
            rounds(first.rounds.min(second.rounds))
        ),
    }
}

/// "1 round", "2 rounds".
pub fn rounds(count: usize) -> String {
    format!("{count} {}", if count == 1 { "round" } else { "rounds" })
}

/// Returns a number with about three digits.
pub fn rounded(value: f64) -> String {
    let size = value.abs();
    match size {
        _ if value == 0.0 => "0".to_owned(),
        _ if !(1e-3..1e6).contains(&size) => format!("{value:.1e}"),
        _ if size >= 100.0 => format!("{value:.0}"),
        _ if size >= 10.0 => format!("{value:.1}"),
        _ if size >= 1.0 => format!("{value:.2}"),
        _ => format!("{value:.3}"),
    }
}

/// Returns a number with about three digits, without trailing zeros.
pub fn short(value: f64) -> String {
    let text = rounded(value);
    match text.contains('.') && !text.contains('e') {
        true => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
        false => text,
    }
}

/// Returns a count, with a fraction only if it has one.
pub fn counted(value: f64) -> String {
    if value.fract() == 0.0 && value.abs() < 1e9 { format!("{value}") } else { rounded(value) }
}

/// Returns a fraction in per cent.
pub fn percent(share: f64) -> String {
    format!("{} %", rounded(100.0 * share))
}

/// Returns a time with half the width of its range.
pub fn milliseconds(time: &Spread) -> String {
    match time.rounds {
        1 => format!("{} ms", rounded(time.median)),
        _ => format!("{} ± {} ms", rounded(time.median), rounded(time.half_width())),
    }
}

/// "a", "a and b", "a, b and c".
pub fn listed(names: &[&str], word: &str) -> String {
    match names {
        [] => String::new(),
        [only] => (*only).to_owned(),
        [first @ .., last] => format!("{} {word} {last}", first.join(", ")),
    }
}

/// Returns the names with a verb in the singular or plural.
pub fn listed_with(names: &[&str], one: &str, several: &str, word: &str) -> String {
    format!("{} {}", listed(names, word), if names.len() == 1 { one } else { several })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_about_three_digits() {
        let shown = [0.0, 1234567.0, 123.4, 12.34, 1.234, 0.1234, 0.0001].map(rounded);
        assert_eq!(shown, ["0", "1.2e6", "123", "12.3", "1.23", "0.123", "1.0e-4"]);
        assert_eq!(
            (percent(0.0123), listed(&["a", "b", "c"], "and")),
            ("1.23 %".into(), "a, b and c".into())
        );
    }

    #[test]
    fn a_factor_is_told_from_one_by_its_interval() {
        let ratio = |first: &[f64], second: &[f64]| ratio_of(first, second).as_ref().and_then(is_above_one);
        assert_eq!(ratio(&[2.0, 2.1, 2.2, 2.1, 2.0], &[1.0; 5]), Some(true));
        assert_eq!(ratio(&[1.0; 5], &[2.0, 2.1, 2.2, 2.1, 2.0]), Some(false));
        assert_eq!(ratio(&[0.9, 1.1, 1.1, 1.2, 1.1], &[1.0; 5]), None);
        assert_eq!(ratio(&[2.0; 4], &[1.0; 4]), None, "four pairs prove little");
        let nothing = ratio_of(&[0.9, 1.1, 1.2, 1.0, 1.0], &[1.0; 5]).map(|ratio| factor(&ratio));
        assert_eq!(nothing.as_deref(), Some("1.00 (0.900 to 1.20, not distinguishable from 1 in 5 rounds)"));
    }

    #[test]
    fn times_are_compared_only_where_they_lie_apart() {
        let spread = |lower, median, upper, rounds| Spread { lower, median, upper, rounds };
        let short = spread(0.9, 1.0, 1.1, 3);
        assert_eq!(times_of(&spread(1.8, 2.0, 2.2, 3), &short), "2.00 times the time (1.64 to 2.44)");
        let open = "a time that is not distinguishable in 3 rounds (0.909 to 2.44 of it)";
        assert_eq!(times_of(&spread(1.0, 2.0, 2.2, 3), &short), open);
        let once = times_of(&spread(9.0, 9.0, 9.0, 1), &short);
        assert!(once.starts_with("a time that is not distinguishable in 1 round "), "{once}");
    }
}
