//! How far a bake has come, the time it may take, and the way to end it. Not a drawing of a bar.

use std::ops::ControlFlow;
use std::sync::{Condvar, Mutex, PoisonError};
use std::time::{Duration, Instant};

use crate::cancel_token::CancelToken;
use crate::checkpoint::checkpoint_file::ChunkKey;
use crate::checkpoint::{CheckpointFile, Record};
use crate::{BakeError, BakeReport, StageTime};

/// How far a bake has come.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Progress {
    /// What is being done, in words.
    pub stage: &'static str,
    /// How much of this stage is done, in [0, 1].
    pub stage_fraction: f32,
    /// How much of the whole is done, in [0, 1], by the usual shares of the stages.
    pub fraction: f32,
    /// Estimated relative RMSE of the lightmap as it is now, once one is known.
    pub error: Option<f64>,
}

/// What is told of a bake that runs, and the answer whether it should go on.
pub(crate) type Callback<'a> = dyn FnMut(Progress) -> ControlFlow<()> + Send + 'a;

/// How often the caller is asked while something takes long.
const TICK: Duration = Duration::from_millis(50);

/// The stages, in their order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Stage {
    Layout,
    Hierarchy,
    DirectLight,
    FormFactors,
    Radiosity,
    FinalGather,
    Probes,
    Resolution,
    Texels,
    Seams,
}

/// What is known of a stage before it begins.
struct StageShare {
    /// In words.
    name: &'static str,
    /// Its usual share of the time.
    of_time: f32,
    /// The share of a time limit by which it takes no more samples: so that every stage has done something roughly before one does it well.
    of_limit: f64,
}

impl Stage {
    const ALL: [Self; 10] = [
        Self::Layout,
        Self::Hierarchy,
        Self::DirectLight,
        Self::FormFactors,
        Self::Radiosity,
        Self::FinalGather,
        Self::Probes,
        Self::Resolution,
        Self::Texels,
        Self::Seams,
    ];

    fn share(self) -> StageShare {
        let (name, of_time, of_limit) = match self {
            Self::Layout => ("layout", 0.03, 1.0),
            Self::Hierarchy => ("hierarchy", 0.02, 1.0),
            Self::DirectLight => ("direct light", 0.2, 0.42),
            Self::FormFactors => ("form factors", 0.1, 0.52),
            Self::Radiosity => ("radiosity", 0.05, 0.52),
            Self::FinalGather => ("final gather", 0.48, 0.86),
            Self::Probes => ("probes", 0.05, 0.93),
            Self::Resolution => ("resolution", 0.02, 0.95),
            Self::Texels => ("texels", 0.03, 1.0),
            Self::Seams => ("seams", 0.02, 1.0),
        };
        StageShare { name, of_time, of_limit }
    }
}

/// The time that a bake has taken and may take.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Clock {
    begun: Instant,
    /// Seconds of the bakes that this one continues.
    before: f64,
    limit: Option<Duration>,
}

impl Clock {
    /// Seconds since the bake began, those of bakes that it continues included.
    pub fn seconds(&self) -> f64 {
        self.before + self.begun.elapsed().as_secs_f64()
    }

    /// The same clock with a share of the limit.
    pub fn until(&self, share: f64) -> Self {
        Self { limit: self.limit.map(|limit| limit.mul_f64(share)), ..*self }
    }

    /// How many samples of those that are `wanted` there is time for, in all, when the ones that there `are` took so many seconds. Without a limit: all.
    pub fn affordable(&self, are: u32, wanted: u32, seconds: f64) -> u32 {
        let Some(limit) = self.limit else { return wanted };
        let left = (limit.as_secs_f64() - self.seconds()).max(0.0);
        let more = f64::from(are) * left / seconds.max(1e-6);
        wanted.min(are.saturating_add(more as u32))
    }

    /// Whether more than a share of the time is gone. Never, without a limit.
    pub fn is_past(&self, share: f64) -> bool {
        self.until(share).is_over()
    }

    /// Whether the time is up.
    pub fn is_over(&self) -> bool {
        self.limit.is_some_and(|limit| self.seconds() >= limit.as_secs_f64())
    }
}

/// Reports to the caller, notes the time of each stage, and keeps what was computed.
pub(crate) struct BakeMonitor<'a> {
    callback: &'a mut Callback<'a>,
    clock: Clock,
    is_cut_short: bool,
    stage: Option<(Stage, Instant)>,
    /// From where to where in the running stage the work that reports now leads.
    part: (f32, f32),
    error: Option<f64>,
    stop: CancelToken,
    pub checkpoint: CheckpointFile,
}

impl<'a> BakeMonitor<'a> {
    pub fn new(callback: &'a mut Callback<'a>, limit: Option<Duration>) -> Self {
        let clock = Clock { begun: Instant::now(), before: 0.0, limit };
        let (stop, checkpoint) = (CancelToken::default(), CheckpointFile::default());
        Self {
            callback,
            clock,
            stage: None,
            part: (0.0, 1.0),
            error: None,
            is_cut_short: false,
            stop,
            checkpoint,
        }
    }

    /// Ends when this token is cancelled, too.
    pub fn cancelled_by(self, stop: CancelToken) -> Self {
        Self { stop, ..self }
    }

    /// What loops look at while [`BakeMonitor::run_interruptible`] waits for them.
    pub fn stop(&self) -> &CancelToken {
        &self.stop
    }

    /// Something was left out for want of time.
    pub fn cut_short(&mut self) {
        self.is_cut_short = true;
    }

    /// Whether anything was left out for want of time so far, or would be now.
    pub fn is_late(&self) -> bool {
        self.is_cut_short || self.clock().is_over()
    }

    /// The estimated error so far, for the caller.
    pub fn note_error(&mut self, error: f64) {
        self.error = Some(error);
    }

    /// The time as it is, to be asked from other threads: the running stage's share of it.
    pub fn clock(&self) -> Clock {
        self.clock.until(self.running().share().of_limit)
    }

    /// Seconds since the bake began.
    pub fn seconds(&self) -> f64 {
        self.clock.seconds()
    }

    /// Ends the stage before and begins another.
    pub fn stage(&mut self, stage: Stage, report: &mut BakeReport) -> Result<(), BakeError> {
        self.end_stage(report);
        self.stage = Some((stage, Instant::now()));
        self.part = (0.0, 1.0);
        self.advance(0.0)
    }

    /// What comes now is one of several passes of the running stage: it takes so much, in [0, 1], of what is left of the stage.
    pub fn pass(&mut self, share: f32) {
        let begun = if self.part.1 < 1.0 { self.part.1 } else { 0.0 };
        self.part = (begun, begun + (1.0 - begun) * share);
    }

    /// Notes the time of the running stage.
    pub fn end_stage(&mut self, report: &mut BakeReport) {
        if let Some((stage, begun)) = self.stage.take() {
            report.stages.push(StageTime {
                stage: stage.share().name.to_owned(),
                seconds: begun.elapsed().as_secs_f64(),
            });
        }
    }

    /// Reports a fraction of the running stage, or of its pass.
    ///
    /// # Errors
    /// [`BakeError::Cancelled`] if the caller wants no more.
    pub fn advance(&mut self, stage_fraction: f32) -> Result<(), BakeError> {
        let progress = self.progress(stage_fraction);
        if (self.callback)(progress).is_break() {
            self.stop.cancel();
        }
        self.unless_stopped()
    }

    /// Does something that may take long, from a fraction of the running stage or its pass on. Meanwhile the caller is asked again and again, from a thread of its own,
    /// whether to go on; if not, the work finds [`BakeMonitor::stop`] set, and what it returns is forgotten. No value depends on the asking.
    ///
    /// # Errors
    /// [`BakeError::Cancelled`] if the caller wants no more.
    pub fn run_interruptible<T>(
        &mut self,
        stage_fraction: f32,
        work: impl FnOnce() -> T,
    ) -> Result<T, BakeError> {
        let progress = self.progress(stage_fraction);
        let (callback, stop, done) = (&mut *self.callback, &self.stop, Done::default());
        let result = std::thread::scope(|scope| {
            let ask = || {
                while !done.after(TICK) {
                    if callback(progress).is_break() {
                        stop.cancel();
                        return;
                    }
                }
            };
            // Without such a thread nobody is asked before the work is done.
            let _asked = std::thread::Builder::new().name("bake progress".into()).spawn_scoped(scope, ask);
            // Also if the work panics: the scope waits for the thread.
            let _finally = Finally(&done);
            work()
        });
        self.unless_stopped()?;
        Ok(result)
    }

    /// As [`BakeMonitor::run_interruptible`], of work that cannot be asked to end: on a thread of its own, which goes on alone for a while where nobody wants its
    /// result any more.
    ///
    /// # Errors
    /// [`BakeError::Cancelled`] if the caller wants no more.
    pub fn run_detached<T: Send + 'static>(
        &mut self,
        stage_fraction: f32,
        work: impl FnOnce() -> T + Send + 'static,
    ) -> Result<T, BakeError> {
        let (sender, receiver) = std::sync::mpsc::sync_channel(1);
        // Behind a lock, so that it is still there where no thread can be had.
        let work = std::sync::Arc::new(Mutex::new(Some(work)));
        let taken = std::sync::Arc::clone(&work);
        let take = |from: &Mutex<Option<_>>| from.lock().unwrap_or_else(PoisonError::into_inner).take();
        let thread = std::thread::Builder::new().name("bake detached".into()).spawn(move || {
            if let Some(work) = take(&taken) {
                // Nobody may be there to take it.
                let _ = sender.send(work());
            }
        });
        let Ok(thread) = thread else {
            return match take(&work) {
                Some(work) => self.run_interruptible(stage_fraction, work),
                None => self.cancelled(),
            };
        };
        loop {
            match receiver.recv_timeout(TICK) {
                Ok(result) => {
                    self.unless_stopped()?;
                    return Ok(result);
                }
                Err(std::sync::mpsc::RecvTimeoutError::Timeout) => self.advance(stage_fraction)?,
                Err(std::sync::mpsc::RecvTimeoutError::Disconnected) => match thread.join() {
                    Err(panic) => std::panic::resume_unwind(panic),
                    // It sends before it ends.
                    Ok(()) => return self.cancelled(),
                },
            }
        }
    }

    fn cancelled<T>(&mut self) -> Result<T, BakeError> {
        self.checkpoint.flush();
        Err(BakeError::Cancelled { stage: self.running().share().name })
    }

    fn progress(&self, stage_fraction: f32) -> Progress {
        let stage = self.running();
        let StageShare { name, of_time, .. } = stage.share();
        let before: f32 =
            Stage::ALL.iter().take_while(|other| **other != stage).map(|other| other.share().of_time).sum();
        let (from, to) = self.part;
        let stage_fraction = from + (to - from) * stage_fraction.clamp(0.0, 1.0);
        let fraction = (before + of_time * stage_fraction).min(1.0);
        Progress { stage: name, stage_fraction, fraction, error: self.error }
    }

    fn unless_stopped(&mut self) -> Result<(), BakeError> {
        if self.stop.is_cancelled() { self.cancelled() } else { Ok(()) }
    }

    /// The running stage; the first one before any has begun.
    fn running(&self) -> Stage {
        self.stage.map_or(Stage::Layout, |(stage, _)| stage)
    }

    fn chunk_key(&self, start: usize, of: usize) -> ChunkKey {
        ChunkKey { stage: self.running() as u8, of, start }
    }

    /// The values from `start` on, if an interrupted bake has computed them. None of them: it had no more time for the rest.
    pub fn load_chunk<T: Record>(&mut self, start: usize, of: usize) -> Option<Vec<T>> {
        let (values, seconds) = self.checkpoint.next(self.chunk_key(start, of))?;
        self.clock = Clock { begun: Instant::now(), before: seconds, ..self.clock };
        Some(values)
    }

    /// Keeps values, against an interruption.
    pub fn store_chunk<T: Record>(&mut self, start: usize, of: usize, values: &[T]) {
        let (key, seconds) = (self.chunk_key(start, of), self.seconds());
        self.checkpoint.record(key, values, seconds);
    }
}

/// Whether some work is done, for who waits for it.
#[derive(Default)]
struct Done {
    done: Mutex<bool>,
    told: Condvar,
}

impl Done {
    /// Whether it is, after so long at most.
    fn after(&self, time: Duration) -> bool {
        let done = self.done.lock().unwrap_or_else(PoisonError::into_inner);
        let waited = self.told.wait_timeout_while(done, time, |done| !*done);
        *waited.unwrap_or_else(PoisonError::into_inner).0
    }
}

/// Says that it is, whatever happens.
struct Finally<'a>(&'a Done);

impl Drop for Finally<'_> {
    fn drop(&mut self) {
        *self.0.done.lock().unwrap_or_else(PoisonError::into_inner) = true;
        self.0.told.notify_all();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn who_asks_for_the_end_while_something_runs_gets_it() {
        let mut asked = 0;
        let mut callback = |progress: Progress| {
            asked += 1;
            assert_eq!((progress.stage, progress.stage_fraction), ("layout", 0.25));
            if asked < 3 { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
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
        assert_eq!(asked, 3);
    }

    #[test]
    fn what_is_quick_asks_nobody_and_errors_are_told_on() {
        let mut told = Vec::new();
        let mut callback = |progress: Progress| {
            told.push(progress.error);
            ControlFlow::Continue(())
        };
        let mut monitor = BakeMonitor::new(&mut callback, None);
        assert_eq!(monitor.run_interruptible(0.0, || 7), Ok(7));
        monitor.advance(0.0).unwrap();
        monitor.note_error(0.25);
        monitor.advance(1.0).unwrap();
        assert_eq!(told, [None, Some(0.25)]);
    }

    #[test]
    fn what_runs_apart_is_waited_for_or_left_to_itself() {
        let mut carry_on = |_| ControlFlow::Continue(());
        let slow = || {
            std::thread::sleep(3 * TICK);
            7
        };
        assert_eq!(BakeMonitor::new(&mut carry_on, None).run_detached(0.0, slow), Ok(7));
        let (mut no_more, begun) = (|_| ControlFlow::Break(()), Instant::now());
        let ended = BakeMonitor::new(&mut no_more, None)
            .run_detached(0.0, || std::thread::sleep(Duration::from_secs(60)));
        assert_eq!(ended, Err(BakeError::Cancelled { stage: "layout" }));
        assert!(begun.elapsed() < Duration::from_secs(30));
    }

    #[test]
    #[should_panic(expected = "as it should")]
    fn a_panic_apart_is_the_callers() {
        let mut callback = |_| ControlFlow::Continue(());
        let _ = BakeMonitor::new(&mut callback, None).run_detached(0.0, || panic!("as it should"));
    }

    #[test]
    #[should_panic(expected = "as it should")]
    fn a_panic_of_the_work_ends_the_asking() {
        let mut callback = |_| ControlFlow::Continue(());
        let _ = BakeMonitor::new(&mut callback, None).run_interruptible(0.0, || panic!("as it should"));
    }
}
