//! How far a bake has come, the time it may take, and the way to end it. Not a drawing of a bar.

use std::ops::ControlFlow;
use std::time::{Duration, Instant};

use crate::checkpoint::tape::Place;
use crate::checkpoint::{Record, Tape};
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
}

/// The stages in their order, with their usual share of the time.
const STAGES: [(&str, f32); 10] = [
    ("layout", 0.03),
    ("hierarchy", 0.02),
    ("direct light", 0.2),
    ("form factors", 0.1),
    ("radiosity", 0.05),
    ("final gather", 0.48),
    ("probes", 0.05),
    ("resolution", 0.02),
    ("texels", 0.03),
    ("seams", 0.02),
];

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

    /// Whether the time is up.
    pub fn late(&self) -> bool {
        self.limit.is_some_and(|limit| self.seconds() >= limit.as_secs_f64())
    }
}

/// Reports to the caller, notes the time of each stage, and keeps what was computed.
pub(crate) struct Watch<'a> {
    callback: &'a mut dyn FnMut(Progress) -> ControlFlow<()>,
    clock: Clock,
    stage: Option<(&'static str, Instant)>,
    /// From where to where in the running stage the work that reports now leads.
    part: (f32, f32),
    pub tape: Tape,
}

impl<'a> Watch<'a> {
    pub fn new(callback: &'a mut dyn FnMut(Progress) -> ControlFlow<()>, limit: Option<Duration>) -> Self {
        let clock = Clock { begun: Instant::now(), before: 0.0, limit };
        Self { callback, clock, stage: None, part: (0.0, 1.0), tape: Tape::default() }
    }

    /// The time as it is, to be asked from other threads.
    pub fn clock(&self) -> Clock {
        self.clock
    }

    /// Seconds since the bake began.
    pub fn seconds(&self) -> f64 {
        self.clock.seconds()
    }

    /// Ends the stage before and begins another.
    pub fn stage(&mut self, stage: &'static str, report: &mut BakeReport) -> Result<(), BakeError> {
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
            report.stages.push(StageTime { stage: stage.to_owned(), seconds: begun.elapsed().as_secs_f64() });
        }
    }

    /// Reports a fraction of the running stage, or of its pass.
    ///
    /// # Errors
    /// [`BakeError::Cancelled`] if the caller wants no more.
    pub fn advance(&mut self, stage_fraction: f32) -> Result<(), BakeError> {
        let (index, stage) = self.running();
        let before: f32 = STAGES[..index].iter().map(|(_, share)| share).sum();
        let (from, to) = self.part;
        let stage_fraction = from + (to - from) * stage_fraction.clamp(0.0, 1.0);
        let fraction = before + STAGES[index].1 * stage_fraction;
        match (self.callback)(Progress { stage, stage_fraction, fraction: fraction.min(1.0) }) {
            ControlFlow::Continue(()) => Ok(()),
            ControlFlow::Break(()) => {
                self.tape.flush();
                Err(BakeError::Cancelled { stage })
            }
        }
    }

    /// The running stage and its place in the order.
    fn running(&self) -> (usize, &'static str) {
        let stage = self.stage.map_or("layout", |(stage, _)| stage);
        (STAGES.iter().position(|(name, _)| *name == stage).unwrap_or(STAGES.len() - 1), stage)
    }

    fn place(&self, start: usize, of: usize) -> Place {
        Place { stage: self.running().0 as u8, of, start }
    }

    /// The values from `start` on, if an interrupted bake has computed them. None of them: it had no more time for the rest.
    pub fn recall<T: Record>(&mut self, start: usize, of: usize) -> Option<Vec<T>> {
        let (values, seconds) = self.tape.next(self.place(start, of))?;
        self.clock = Clock { begun: Instant::now(), before: seconds, ..self.clock };
        Some(values)
    }

    /// Keeps values, against an interruption.
    pub fn keep<T: Record>(&mut self, start: usize, of: usize, values: &[T]) {
        let (place, seconds) = (self.place(start, of), self.seconds());
        self.tape.record(place, values, seconds);
    }
}
