//! Supervises a running bake: reports progress to the caller, measures stages, keeps the time limit, handles
//! cancellation, and passes finished chunks to the checkpoint. The stages and their shares of the
//! time are in `stage`; how a list is divided into chunks is in `chunks`.

use std::ops::ControlFlow;
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::time::{Duration, Instant};

use crate::cancel_token::CancelToken;
use crate::checkpoint::checkpoint_file::ChunkKey;
use crate::checkpoint::{CheckpointFile, Record};
use crate::stage::{Stage, StageProfile};
use crate::{BakeError, StageTime};

/// The progress of a running bake, as passed to the callback of [`Bake::progress`](crate::Bake::progress).
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Progress {
    /// Name of the running stage, as in [`StageTime::stage`].
    pub stage: &'static str,
    /// Completed fraction of this stage, in [0, 1].
    pub stage_fraction: f32,
    /// Completed fraction of the whole bake, in [0, 1], assuming that stages take their usual shares of the time.
    pub fraction: f32,
    /// Estimated relative RMSE of the lightmap as gathered so far; `None` before the first estimate.
    pub error: Option<f64>,
}

/// Receives the progress and answers whether the bake should continue.
pub(crate) type Callback<'a> = dyn FnMut(Progress) -> ControlFlow<()> + Send + 'a;

/// Where a pass ends at most, as a fraction of its stage: other passes may follow.
const MAX_PASS_END: f32 = 0.999;

/// Interval between calls of the progress callback during long work.
const CALLBACK_INTERVAL: Duration = Duration::from_millis(50);

/// The time that a bake has taken, and its limit.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Clock {
    begun: Instant,
    /// Seconds that the interrupted bakes had taken which this one resumes.
    resumed_seconds: f64,
    limit: Option<Duration>,
}

impl Clock {
    /// Seconds that the bake has taken, including those of interrupted bakes that it resumes.
    pub fn seconds(&self) -> f64 {
        self.resumed_seconds + self.begun.elapsed().as_secs_f64()
    }

    /// The same clock with its limit multiplied by `share`.
    pub fn until(&self, share: f64) -> Self {
        Self { limit: self.limit.map(|limit| limit.mul_f64(share)), ..*self }
    }

    /// The total number of samples, at most `wanted`, for which there is time, given that the `taken` ones so far took
    /// `seconds`. Without a time limit, all of them.
    pub fn affordable(&self, taken: u32, wanted: u32, seconds: f64) -> u32 {
        let Some(left) = self.seconds_left() else { return wanted };
        let more = f64::from(taken) * left / seconds.max(1e-6);
        wanted.min(taken.saturating_add(more as u32))
    }

    /// Seconds until the time is up, at least 0; `None` without a limit.
    pub fn seconds_left(&self) -> Option<f64> {
        self.limit.map(|limit| (limit.as_secs_f64() - self.seconds()).max(0.0))
    }

    /// Returns true if `share` of the time limit has passed; never true without a limit.
    pub fn is_past(&self, share: f64) -> bool {
        self.until(share).is_over()
    }

    /// Returns true if the time is up; never true without a limit.
    pub fn is_over(&self) -> bool {
        self.limit.is_some_and(|limit| self.seconds() >= limit.as_secs_f64())
    }
}

/// Reports progress, measures the stages, checks for cancellation, and gives access to the checkpoint.
pub(crate) struct BakeMonitor<'a> {
    callback: &'a mut Callback<'a>,
    clock: Clock,
    is_cut_short: bool,
    stage: Option<(Stage, Instant)>,
    /// The time that each finished stage took, in order.
    pub stages: Vec<StageTime>,
    /// The time of those that cast rays.
    pub casting_seconds: f64,
    /// Begin and end of the current pass, as fractions of the running stage.
    pass: (f32, f32),
    error: Option<f64>,
    stop: CancelToken,
    pub checkpoint: CheckpointFile,
}

impl<'a> BakeMonitor<'a> {
    pub fn new(callback: &'a mut Callback<'a>, limit: Option<Duration>) -> Self {
        let clock = Clock { begun: Instant::now(), resumed_seconds: 0.0, limit };
        let (stop, checkpoint) = (CancelToken::default(), CheckpointFile::default());
        Self {
            callback,
            clock,
            stage: None,
            stages: Vec::new(),
            casting_seconds: 0.0,
            pass: (0.0, 1.0),
            error: None,
            is_cut_short: false,
            stop,
            checkpoint,
        }
    }

    /// Uses the caller's token instead of a new one.
    pub fn cancelled_by(self, stop: CancelToken) -> Self {
        Self { stop, ..self }
    }

    /// The flag that long-running work polls, so that it returns early once the bake is cancelled.
    pub fn stop(&self) -> &CancelToken {
        &self.stop
    }

    /// Records that work was left out because the time was up.
    pub fn cut_short(&mut self) {
        self.is_cut_short = true;
    }

    /// Returns true if work has been left out because the time was up, or if the running stage's time is up now.
    pub fn is_late(&self) -> bool {
        self.is_cut_short || self.clock().is_over()
    }

    /// Sets the estimated error that progress reports from now on.
    pub fn note_error(&mut self, error: f64) {
        self.error = Some(error);
    }

    /// A clock whose limit is the running stage's share of the time limit. It can be copied to other threads.
    pub fn clock(&self) -> Clock {
        self.clock.until(self.running().profile().share_of_limit)
    }

    /// Seconds that the bake has taken, including those of interrupted bakes that it resumes.
    pub fn seconds(&self) -> f64 {
        self.clock.seconds()
    }

    /// Ends the running stage and begins `stage`.
    pub fn stage(&mut self, stage: Stage) -> Result<(), BakeError> {
        self.end_stage();
        self.stage = Some((stage, Instant::now()));
        self.pass = (0.0, 1.0);
        self.advance(0.0)
    }

    /// Begins one of several passes of the running stage: it makes up `share`, in [0, 1], of the rest of the stage's
    /// progress.
    pub fn pass(&mut self, share: f32) {
        let begin = if self.pass.1 < 1.0 { self.pass.1 } else { 0.0 };
        // After many passes rounding must not make the last one seem complete, or the next would begin at 0.
        self.pass = (begin, (begin + (1.0 - begin) * share).min(MAX_PASS_END));
    }

    /// Ends the running stage, and notes the time that it took.
    pub fn end_stage(&mut self) {
        if let Some((stage, begun)) = self.stage.take() {
            let StageProfile { name, casts_rays, .. } = stage.profile();
            let (stage, seconds) = (name.to_owned(), begun.elapsed().as_secs_f64());
            self.casting_seconds += if casts_rays { seconds } else { 0.0 };
            self.stages.push(StageTime { stage, seconds });
        }
    }

    /// Reports that `stage_fraction` of the running stage, or of its current pass, is done.
    pub fn advance(&mut self, stage_fraction: f32) -> Result<(), BakeError> {
        let progress = self.progress(stage_fraction);
        if (self.callback)(progress).is_break() {
            self.stop.cancel();
        }
        self.check_cancelled()
    }

    /// Runs `work` on this thread while another thread calls the progress callback regularly. If that cancels the bake,
    /// [`BakeMonitor::stop`] is set, which `work` should poll, and its result is discarded. `stage_fraction` is the
    /// progress of the running stage, or of its pass, at the beginning of `work`.
    pub fn run_interruptible<T>(
        &mut self,
        stage_fraction: f32,
        work: impl FnOnce() -> T,
    ) -> Result<T, BakeError> {
        let progress = self.progress(stage_fraction);
        let (callback, stop, done) = (&mut *self.callback, &self.stop, DoneSignal::default());
        let result = std::thread::scope(|scope| {
            let report_until_done = || {
                while !done.wait(CALLBACK_INTERVAL) {
                    if callback(progress).is_break() {
                        stop.cancel();
                        return;
                    }
                }
            };
            // If the thread cannot be started, the work still runs, only without progress.
            let builder = std::thread::Builder::new().name("bake progress".into());
            let _reporter = builder.spawn_scoped(scope, report_until_done);
            // Sent on drop, and so even if the work panics: the scope waits for the thread, which waits for the signal.
            let _signal = SignalOnDrop(&done);
            work()
        });
        self.check_cancelled()?;
        Ok(result)
    }

    /// As [`BakeMonitor::run_interruptible`], but for work that does not poll [`BakeMonitor::stop`]. It runs on a
    /// thread of its own, which is left to finish by itself if the bake is cancelled.
    pub fn run_detached<T: Send + 'static>(
        &mut self,
        stage_fraction: f32,
        work: impl FnOnce() -> T + Send + 'static,
    ) -> Result<T, BakeError> {
        let done = Arc::new(DoneSignal::default());
        let done_in_thread = Arc::clone(&done);
        let spawned = std::thread::Builder::new().name("bake detached".into()).spawn(move || {
            let _signal = SignalOnDrop(&done_in_thread);
            work()
        });
        let thread = spawned.map_err(|error| BakeError::Threads { reason: error.to_string() })?;
        while !done.wait(CALLBACK_INTERVAL) {
            self.advance(stage_fraction)?;
        }
        let result = thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic));
        self.check_cancelled()?;
        Ok(result)
    }

    fn progress(&self, stage_fraction: f32) -> Progress {
        let stage = self.running();
        let (begin, end) = self.pass;
        let stage_fraction = begin + (end - begin) * stage_fraction.clamp(0.0, 1.0);
        let fraction = stage.share_of_bake_before() + stage.profile().share_of_bake * stage_fraction;
        Progress {
            stage: stage.profile().name,
            stage_fraction,
            fraction: fraction.min(1.0),
            error: self.error,
        }
    }

    fn check_cancelled(&mut self) -> Result<(), BakeError> {
        if self.stop.is_cancelled() {
            self.checkpoint.flush();
            return Err(BakeError::Cancelled { stage: self.running().profile().name });
        }
        Ok(())
    }

    /// The running stage; before any has begun, the first one.
    fn running(&self) -> Stage {
        self.stage.map_or(Stage::Layout, |(stage, _)| stage)
    }

    fn chunk_key(&self, start: usize, of: usize) -> ChunkKey {
        ChunkKey { stage: self.running() as u8, of, start }
    }

    /// The values of a list of `of` from `start` on, if the checkpoint has them. An empty list means that the
    /// interrupted bake had no time left for the rest.
    pub fn load_chunk<T: Record>(&mut self, start: usize, of: usize) -> Option<Vec<T>> {
        let (values, seconds) = self.checkpoint.next(self.chunk_key(start, of))?;
        self.clock = Clock { begun: Instant::now(), resumed_seconds: seconds, ..self.clock };
        Some(values)
    }

    /// Stores the values of a list of `of` from `start` on in the checkpoint.
    pub fn store_chunk<T: Record>(&mut self, start: usize, of: usize, values: &[T]) {
        let (key, seconds) = (self.chunk_key(start, of), self.seconds());
        self.checkpoint.record(key, values, seconds);
    }
}

/// Tells another thread that work is done.
#[derive(Default)]
struct DoneSignal {
    done: Mutex<bool>,
    changed: Condvar,
}

impl DoneSignal {
    /// Waits until the work is done, but at most for `timeout`; returns true if it is done.
    fn wait(&self, timeout: Duration) -> bool {
        let done = self.done.lock().unwrap_or_else(PoisonError::into_inner);
        let waited = self.changed.wait_timeout_while(done, timeout, |done| !*done);
        *waited.unwrap_or_else(PoisonError::into_inner).0
    }
}

/// Gives the signal when it is dropped.
struct SignalOnDrop<'a>(&'a DoneSignal);

impl Drop for SignalOnDrop<'_> {
    fn drop(&mut self) {
        *self.0.done.lock().unwrap_or_else(PoisonError::into_inner) = true;
        self.0.changed.notify_all();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn callback_can_cancel_running_work() {
        let mut calls = 0;
        let mut callback = |progress: Progress| {
            calls += 1;
            assert_eq!((progress.stage, progress.stage_fraction), ("layout", 0.25));
            if calls < 3 { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
        };
        let mut monitor = BakeMonitor::new(&mut callback, None);
        let stop = monitor.stop().clone();
        let begun = Instant::now();
        let ended = monitor.run_interruptible(0.25, || {
            while !stop.is_cancelled() && begun.elapsed() < Duration::from_secs(60) {
                std::thread::sleep(Duration::from_millis(1));
            }
        });
        assert_eq!(ended, Err(BakeError::Cancelled { stage: "layout" }));
        assert!(begun.elapsed() < Duration::from_secs(30));
        assert_eq!(calls, 3);
    }

    #[test]
    fn progress_never_goes_back_however_many_passes_a_stage_has() {
        let mut fractions = Vec::new();
        let mut callback = |progress: Progress| {
            fractions.push(progress.stage_fraction);
            ControlFlow::Continue(())
        };
        let mut monitor = BakeMonitor::new(&mut callback, None);
        for _ in 0..100 {
            monitor.pass(0.5);
            monitor.advance(0.5).unwrap();
            monitor.advance(1.0).unwrap();
        }
        assert!(fractions.is_sorted() && fractions.iter().all(|fraction| *fraction <= 1.0), "{fractions:?}");
    }

    #[test]
    fn quick_work_makes_no_callback_and_progress_carries_the_error() {
        let mut errors = Vec::new();
        let mut callback = |progress: Progress| {
            errors.push(progress.error);
            ControlFlow::Continue(())
        };
        let mut monitor = BakeMonitor::new(&mut callback, None);
        assert_eq!(monitor.run_interruptible(0.0, || 7), Ok(7));
        monitor.advance(0.0).unwrap();
        monitor.note_error(0.25);
        monitor.advance(1.0).unwrap();
        assert_eq!(errors, [None, Some(0.25)]);
    }

    #[test]
    fn detached_work_is_waited_for_or_abandoned_on_cancel() {
        let mut carry_on = |_| ControlFlow::Continue(());
        let slow = || {
            std::thread::sleep(3 * CALLBACK_INTERVAL);
            7
        };
        assert_eq!(BakeMonitor::new(&mut carry_on, None).run_detached(0.0, slow), Ok(7));
        let (mut cancel, begun) = (|_| ControlFlow::Break(()), Instant::now());
        let ended = BakeMonitor::new(&mut cancel, None)
            .run_detached(0.0, || std::thread::sleep(Duration::from_secs(60)));
        assert_eq!(ended, Err(BakeError::Cancelled { stage: "layout" }));
        assert!(begun.elapsed() < Duration::from_secs(30));
    }

    #[test]
    #[should_panic(expected = "as it should")]
    fn panic_of_detached_work_reaches_the_caller() {
        let mut callback = |_| ControlFlow::Continue(());
        let _ = BakeMonitor::new(&mut callback, None).run_detached(0.0, || panic!("as it should"));
    }

    #[test]
    #[should_panic(expected = "as it should")]
    fn panic_of_interruptible_work_ends_the_progress_thread() {
        let mut callback = |_| ControlFlow::Continue(());
        let _ = BakeMonitor::new(&mut callback, None).run_interruptible(0.0, || panic!("as it should"));
    }
}
