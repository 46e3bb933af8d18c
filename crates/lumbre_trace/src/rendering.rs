//! Sampling of a whole picture: passes over all pixels until there are enough samples, the time is over or
//! the listener interrupts. What one sample is, `estimator` says.

use std::ops::ControlFlow;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use glam::DVec3;
use smallvec::SmallVec;

use crate::checkpoint::{Keeper, PathState};
use crate::display::shown;
use crate::estimator::Estimator;
use crate::film::{Film, PixelSum};
use crate::light_aovs::LightAovs;
use crate::options::{DEFAULT_PATHS, Ended, MAXIMUM_SAMPLES, Progress};
use crate::sample_distribution::SampleDistribution;
use crate::tiles::for_every_pixel;
use crate::view::View;

/// Callback that receives the progress and decides whether to go on. It is called from several threads, but
/// never concurrently.
pub type Listener<'a> = dyn Fn(Progress) -> ControlFlow<()> + Sync + 'a;

/// Paths per pixel in one pass. The standard error is estimated from the variance between passes.
pub(crate) const PASS: u32 = 4;
/// Passes of every pixel before a standard error is trusted, since two passes may agree by chance. The noise
/// of these passes also decides the distribution of
/// [`sample_by_noise`](crate::TraceOptions::sample_by_noise).
const MIN_PASSES: u32 = 8;

/// The state that all passes of one picture share.
pub(crate) struct Rendering<'a> {
    view: &'a View,
    aovs: &'a LightAovs,
    started: Instant,
    listener: Mutex<&'a Listener<'a>>,
    interrupted: AtomicBool,
}

/// The progress of a picture before a pass.
#[derive(Clone, Copy, Default)]
struct Before {
    /// Fraction of the whole picture that is done.
    fraction: f64,
    samples: u32,
    error: Option<f64>,
}

impl<'a> Rendering<'a> {
    pub fn new(view: &'a View, aovs: &'a LightAovs, listener: &'a Listener<'a>) -> Self {
        Self {
            view,
            aovs,
            started: Instant::now(),
            listener: Mutex::new(listener),
            interrupted: AtomicBool::new(false),
        }
    }

    /// Traces ray trees: the requested number of samples per pixel, or with `adaptive` a quarter of them
    /// where neighbouring pixels hardly differ.
    pub fn ray_trees(&self) -> (Film, Ended) {
        let options = &self.view.options;
        let samples = options.samples.unwrap_or(1);
        let mut film = self.film();
        let estimator = Estimator::new(self.view, self.aovs);
        let take = |pass: u32, samples: u32, pixel| {
            let found = (samples > 0).then(|| estimator.pixel(pixel, pass, samples));
            found.into_iter().collect()
        };
        let Some(threshold) = options.adaptive.filter(|_| samples >= 4) else {
            let ended = self.pass(&mut film, 1.0, Before::default(), |_, pixel| take(0, samples, pixel));
            return (film, ended);
        };
        // A quarter of the samples everywhere, the rest only where neighbouring pixels differ.
        let first = samples / 4;
        let ended = self.pass(&mut film, 0.5, Before::default(), |_, pixel| take(0, first, pixel));
        if ended != Ended::Complete {
            return (film, ended);
        }
        let busy = busy_pixels(&film, threshold, f64::from(self.view.camera.exposure));
        let before = Before { fraction: 0.5, samples: first, error: None };
        let rest = |at: usize| if busy[at] { samples - first } else { 0 };
        let ended = self.pass(&mut film, 0.5, before, |at, pixel| take(1, rest(at), pixel));
        (film, ended)
    }

    /// Traces paths, going on from an earlier state if there is one. Each round adds one pass to every pixel
    /// or, once samples are distributed by noise, more passes to the noisier pixels.
    pub fn paths(&self, from: Option<PathState>, keeper: &Keeper<'_>) -> (Film, Ended) {
        let options = &self.view.options;
        let open_ended = options.error.is_some() || options.time.is_some();
        let most = options.samples.unwrap_or(if open_ended { MAXIMUM_SAMPLES } else { DEFAULT_PATHS });
        let rounds = most.div_ceil(PASS);
        let estimator = Estimator::new(self.view, self.aovs);
        let mut state = from.unwrap_or_else(|| PathState { round: 0, film: self.film(), distribution: None });
        let mut kept = Instant::now();
        let ended = loop {
            let error = state.film.relative_error();
            let believed = state.round >= MIN_PASSES;
            if believed && options.error.zip(error).is_some_and(|(wanted, error)| error <= wanted) {
                break Ended::Error;
            }
            if state.round >= rounds {
                break Ended::Complete;
            }
            if options.sample_by_noise && state.round == MIN_PASSES && state.distribution.is_none() {
                state.distribution = Some(SampleDistribution::of(&state.film));
            }
            if kept.elapsed() >= keeper.interval() {
                keeper.keep(&state);
                kept = Instant::now();
            }
            let round = state.round;
            let done = f64::from(round) / f64::from(rounds);
            let before = Before { fraction: self.fraction(done, error), samples: round * PASS, error };
            let share = if open_ended { 0.0 } else { 1.0 / f64::from(rounds) };
            let has: Vec<u32> = state.film.pixels.iter().map(|pixel| pixel.passes).collect();
            let distribution = &state.distribution;
            let ended = self.pass(&mut state.film, share, before, |at, pixel| {
                let wanted = match distribution {
                    Some(distribution) => distribution.passes(at, MIN_PASSES, round + 1),
                    None => round + 1,
                };
                (has[at]..wanted).map(|pass| estimator.pixel(pixel, pass, PASS)).collect()
            });
            if ended != Ended::Complete {
                break ended;
            }
            state.round += 1;
        };
        keeper.keep_at_end(&state, ended);
        (state.film, ended)
    }

    /// Estimates the progress of a picture that ends at an error or a time. The error falls with the square
    /// root of the number of samples.
    fn fraction(&self, by_samples: f64, error: Option<f64>) -> f64 {
        let options = &self.view.options;
        let by_error = options.error.zip(error).map_or(0.0, |(wanted, error)| (wanted / error).powi(2));
        let by_time =
            options.time.map_or(0.0, |time| self.started.elapsed().as_secs_f64() / time.as_secs_f64());
        by_samples.max(by_error).max(by_time).min(1.0)
    }

    fn film(&self) -> Film {
        Film::new(self.view.size(), self.aovs.aovs.len())
    }

    /// Calls `take` with the index and the coordinates of every pixel and adds the passes that it returns to
    /// the film. Tiles that were not started when the picture ended are skipped. `share` is this pass's
    /// fraction of the whole picture.
    fn pass(
        &self,
        film: &mut Film,
        share: f64,
        before: Before,
        take: impl Fn(usize, (usize, usize)) -> SmallVec<[PixelSum; 1]> + Sync,
    ) -> Ended {
        let (width, height) = self.view.size();
        let advance = |part: f64| {
            let fraction = before.fraction + share * part;
            self.tell(Progress { fraction, samples: before.samples, error: before.error });
        };
        let pixel = |x: usize, y: usize| take(y * width + x, (x, y));
        let squares = for_every_pixel((width, height), pixel, || self.is_over(), advance);
        let whole = squares.iter().all(|(_, values)| values.is_some());
        for (square, values) in squares {
            for ((x, y), sums) in square.pixels().zip(values.into_iter().flatten()) {
                sums.iter().for_each(|sum| film.add(y * width + x, sum));
            }
        }
        match (whole, self.interrupted.load(Ordering::Relaxed)) {
            (true, false) => Ended::Complete,
            (_, true) => Ended::Interrupted,
            (false, false) => Ended::Time,
        }
    }

    fn is_over(&self) -> bool {
        let time = self.view.options.time.is_some_and(|time| self.started.elapsed() >= time);
        time || self.interrupted.load(Ordering::Relaxed)
    }

    fn tell(&self, progress: Progress) {
        // While another thread reports, this report is dropped: it says nothing newer.
        let Ok(listener) = self.listener.try_lock() else { return };
        if listener(progress).is_break() {
            self.interrupted.store(true, Ordering::Relaxed);
        }
    }
}

/// Marks both pixels of every pair of neighbours that differ by more than a threshold, as displayed.
fn busy_pixels(film: &Film, threshold: f64, exposure: f64) -> Vec<bool> {
    let width = film.width;
    let height = film.pixels.len() / width;
    let shown: Vec<DVec3> = film.pixels.iter().map(|pixel| shown(pixel.mean() * exposure)).collect();
    let differs = |at: usize, other: usize| (shown[at] - shown[other]).abs().max_element() > threshold;
    let mut busy = vec![false; shown.len()];
    for y in 0..height {
        for x in 0..width {
            let at = y * width + x;
            let right = (x + 1 < width).then_some(at + 1);
            let below = (y + 1 < height).then_some(at + width);
            for other in [right, below].into_iter().flatten().filter(|other| differs(at, *other)) {
                (busy[at], busy[other]) = (true, true);
            }
        }
    }
    busy
}
