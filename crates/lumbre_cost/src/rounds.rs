//! Times pieces of work in rounds. Each round does every piece once, so that other load on the machine
//! affects all of them alike.

use std::time::{Duration, Instant};

use crate::CostError;

/// The number of rounds.
#[derive(Clone, Copy, Debug)]
pub struct Rounds {
    /// Untimed rounds at the beginning, in which pipelines are created, buffers grow and caches fill.
    pub warm_up: usize,
    /// Smallest number of rounds, however long they take. With fewer there is no meaningful spread.
    pub min: usize,
    /// Largest number of rounds. More rounds would only measure how the load of the machine changes.
    pub max: usize,
    /// Time after which no further round begins.
    pub time: Duration,
}

/// A piece of work, which returns its duration in milliseconds.
pub type Work<'a> = Box<dyn FnMut() -> Result<f64, CostError> + 'a>;

/// Does pieces of work without timing, as often as [`Rounds::warm_up`] says. `go_on` is called before each
/// piece.
///
/// # Errors
/// The first error of the work or of `go_on`.
pub fn warm_up<'a, 'w: 'a>(
    work: impl IntoIterator<Item = &'a mut Work<'w>>,
    rounds: Rounds,
    go_on: &dyn Fn() -> Result<(), CostError>,
) -> Result<(), CostError> {
    for piece in work {
        for _ in 0..rounds.warm_up {
            go_on()?;
            piece()?;
        }
    }
    Ok(())
}

/// The times and the result of repeated work.
#[derive(Clone, Debug)]
pub struct Repeated<T> {
    /// Milliseconds of each round.
    pub times: Vec<f64>,
    /// The result of the last round.
    pub made: T,
}

/// Does pieces of work in turn, in `rounds` rounds (at least one), with the order reversed in every
/// other round. `work` gets the index of a piece and the fractions of all the work that are done before and
/// after it; it returns its duration in milliseconds and its result.
///
/// # Errors
/// The first error of the work.
pub fn repeated<T>(
    pieces: usize,
    rounds: usize,
    mut work: impl FnMut(usize, [f64; 2]) -> Result<(f64, T), CostError>,
) -> Result<Vec<Repeated<T>>, CostError> {
    let rounds = rounds.max(1);
    let mut done: Vec<Option<Repeated<T>>> = (0..pieces).map(|_| None).collect();
    for round in 0..rounds {
        for step in 0..pieces {
            let piece = if round % 2 == 0 { step } else { pieces - 1 - step };
            let share = |step: usize| (round * pieces + step) as f64 / (rounds * pieces) as f64;
            let (time, made) = work(piece, [share(step), share(step + 1)])?;
            let mut times = done[piece].take().map_or_else(Vec::new, |before| before.times);
            times.push(time);
            done[piece] = Some(Repeated { times, made });
        }
    }
    Ok(done.into_iter().flatten().collect())
}

/// Does work in rounds, after [`warm_up`]. The order is reversed in every other round, so that no piece
/// always follows the same one. `go_on` is called between any two pieces, with the fraction of rounds that
/// are done.
///
/// # Errors
/// The first error of the work or of `go_on`.
pub fn in_rounds(
    work: &mut [Work<'_>],
    rounds: Rounds,
    go_on: &dyn Fn(f64) -> Result<(), CostError>,
) -> Result<Vec<Vec<f64>>, CostError> {
    let begun = Instant::now();
    let mut times: Vec<Vec<f64>> = vec![Vec::new(); work.len()];
    for round in 0..rounds.max.max(rounds.min) {
        if round >= rounds.min && begun.elapsed() >= rounds.time {
            break;
        }
        for step in 0..work.len() {
            let by_time = begun.elapsed().as_secs_f64() / rounds.time.as_secs_f64().max(1e-9);
            let by_number = (round * work.len() + step) as f64 / (rounds.min * work.len()).max(1) as f64;
            go_on(by_time.min(by_number).min(1.0))?;
            let piece = if round % 2 == 0 { step } else { work.len() - 1 - step };
            times[piece].push(work[piece]()?);
        }
    }
    Ok(times)
}

/// Returns the milliseconds since `begun`.
pub fn milliseconds_since(begun: Instant) -> f64 {
    begun.elapsed().as_secs_f64() * 1e3
}

#[cfg(test)]
mod tests {
    use std::cell::RefCell;

    use super::*;

    #[test]
    fn rounds_are_interleaved_and_warm_ups_do_not_count() {
        let order = RefCell::new(Vec::new());
        let piece = |name: usize| -> Work<'_> {
            let order = &order;
            Box::new(move || {
                order.borrow_mut().push(name);
                Ok(name as f64)
            })
        };
        let rounds = Rounds { warm_up: 1, min: 2, max: 2, time: Duration::ZERO };
        let mut work = [piece(0), piece(1), piece(2)];
        warm_up(&mut work, rounds, &|| Ok(())).expect("nothing fails");
        let times = in_rounds(&mut work, rounds, &|_| Ok(()));
        assert_eq!(times.ok(), Some(vec![vec![0.0; 2], vec![1.0; 2], vec![2.0; 2]]));
        assert_eq!(*order.borrow(), [0, 1, 2, 0, 1, 2, 2, 1, 0]);
    }

    #[test]
    fn long_work_is_interleaved_and_keeps_what_it_made_last() {
        let mut order = Vec::new();
        let done = repeated(3, 2, |piece, [before, after]| {
            order.push(piece);
            assert!((after - before - 1.0 / 6.0).abs() < 1e-12);
            Ok((order.len() as f64, (piece, order.len())))
        });
        let done = done.expect("nothing fails");
        assert_eq!(order, [0, 1, 2, 2, 1, 0]);
        assert_eq!(done[0].times, [1.0, 6.0]);
        assert_eq!(done.iter().map(|one| one.made).collect::<Vec<_>>(), [(0, 6), (1, 5), (2, 4)]);
        let failed =
            repeated(2, 1, |piece, _| if piece == 1 { Err(CostError::Interrupted) } else { Ok((0.0, ())) });
        assert!(matches!(failed, Err(CostError::Interrupted)));
    }

    #[test]
    fn whoever_wants_it_to_end_is_heard() {
        let rounds = Rounds { warm_up: 0, min: 5, max: 5, time: Duration::from_secs(1) };
        let mut done = 0;
        let work: Work<'_> = Box::new(|| {
            done += 1;
            Ok(1.0)
        });
        let asked = RefCell::new(0);
        let ended = in_rounds(&mut [work], rounds, &|_| {
            *asked.borrow_mut() += 1;
            if *asked.borrow() > 3 { Err(CostError::Interrupted) } else { Ok(()) }
        });
        assert!(matches!(ended, Err(CostError::Interrupted)));
        assert_eq!(done, 3);
    }
}
