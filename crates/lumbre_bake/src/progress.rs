//! How far a bake has come, and the way to end it. Not a drawing of a bar.

use std::ops::ControlFlow;
use std::time::Instant;

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
const STAGES: [(&str, f32); 9] = [
    ("layout", 0.03),
    ("hierarchy", 0.02),
    ("direct light", 0.2),
    ("form factors", 0.1),
    ("radiosity", 0.05),
    ("final gather", 0.5),
    ("probes", 0.05),
    ("texels", 0.03),
    ("seams", 0.02),
];

/// Reports to the caller, and notes the time of each stage.
pub(crate) struct Watch<'a> {
    callback: &'a mut dyn FnMut(Progress) -> ControlFlow<()>,
    begun: Instant,
    stage: Option<(&'static str, Instant)>,
}

impl<'a> Watch<'a> {
    pub fn new(callback: &'a mut dyn FnMut(Progress) -> ControlFlow<()>) -> Self {
        Self { callback, begun: Instant::now(), stage: None }
    }

    /// Seconds since the bake began.
    pub fn seconds(&self) -> f64 {
        self.begun.elapsed().as_secs_f64()
    }

    /// Ends the stage before and begins another.
    pub fn stage(&mut self, stage: &'static str, report: &mut BakeReport) -> Result<(), BakeError> {
        self.end_stage(report);
        self.stage = Some((stage, Instant::now()));
        self.advance(0.0)
    }

    /// Notes the time of the running stage.
    pub fn end_stage(&mut self, report: &mut BakeReport) {
        if let Some((stage, begun)) = self.stage.take() {
            report.stages.push(StageTime { stage: stage.to_owned(), seconds: begun.elapsed().as_secs_f64() });
        }
    }

    /// Reports a fraction of the running stage.
    ///
    /// # Errors
    /// [`BakeError::Cancelled`] if the caller wants no more.
    pub fn advance(&mut self, stage_fraction: f32) -> Result<(), BakeError> {
        let stage = self.stage.map_or("layout", |(stage, _)| stage);
        let mut fraction = 0.0;
        for (name, share) in STAGES {
            if name == stage {
                fraction += share * stage_fraction.clamp(0.0, 1.0);
                break;
            }
            fraction += share;
        }
        match (self.callback)(Progress { stage, stage_fraction, fraction: fraction.min(1.0) }) {
            ControlFlow::Continue(()) => Ok(()),
            ControlFlow::Break(()) => Err(BakeError::Cancelled { stage }),
        }
    }
}
