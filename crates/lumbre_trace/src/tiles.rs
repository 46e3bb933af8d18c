//! Distributes the pixels of a picture over all threads in square tiles. Each pixel is computed
//! independently, so that the result has the same bits on any number of threads.

use std::sync::atomic::{AtomicUsize, Ordering};

use rayon::prelude::*;

/// Side of a tile in pixels.
const SIDE: usize = 16;

/// Computes `pixel(x, y)` for every pixel, tile by tile. A tile that `stop` prevents from starting stays
/// `None`. `advance` receives the fraction of the tiles that are finished after each of them, in no
/// particular order.
pub(crate) fn for_every_pixel<T: Send>(
    (width, height): (usize, usize),
    pixel: impl Fn(usize, usize) -> T + Sync,
    stop: impl Fn() -> bool + Sync,
    advance: impl Fn(f64) + Sync,
) -> Vec<(Square, Option<Vec<T>>)> {
    let squares = squares(width, height);
    let (done, count) = (AtomicUsize::new(0), squares.len());
    squares
        .into_par_iter()
        .map(|square| {
            if stop() {
                return (square, None);
            }
            let values = square.pixels().map(|(x, y)| pixel(x, y)).collect();
            let done = 1 + done.fetch_add(1, Ordering::Relaxed);
            advance(done as f64 / count as f64);
            (square, Some(values))
        })
        .collect()
}

/// A rectangle of neighbouring pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Square {
    left: usize,
    top: usize,
    right: usize,
    bottom: usize,
}

impl Square {
    /// Returns its pixels, row by row.
    pub fn pixels(self) -> impl Iterator<Item = (usize, usize)> {
        (self.top..self.bottom).flat_map(move |y| (self.left..self.right).map(move |x| (x, y)))
    }
}

/// Returns all tiles of a picture, row by row.
fn squares(width: usize, height: usize) -> Vec<Square> {
    let rows = (0..height).step_by(SIDE);
    rows.flat_map(|top| {
        (0..width).step_by(SIDE).map(move |left| Square {
            left,
            top,
            right: (left + SIDE).min(width),
            bottom: (top + SIDE).min(height),
        })
    })
    .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_pixel_is_in_one_square() {
        let mut seen = vec![0; 37 * 50];
        for square in squares(37, 50) {
            square.pixels().for_each(|(x, y)| seen[y * 37 + x] += 1);
        }
        assert!(seen.iter().all(|count| *count == 1));
    }

    #[test]
    fn what_is_forbidden_to_begin_is_not_there() {
        let found = for_every_pixel((40, 40), |x, _| x, || true, |_| {});
        assert!(found.iter().all(|(_, values)| values.is_none()));
    }
}
