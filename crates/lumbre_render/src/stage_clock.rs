//! Times the CPU stages of a frame. Each stage begins where the previous one ended, so no time is lost
//! between them.

use std::time::{Duration, Instant};

use crate::CpuStages;

/// A clock that is read at the end of each stage.
pub(crate) struct StageClock {
    pub begun: Instant,
    last: Instant,
    stages: CpuStages,
}

impl StageClock {
    pub fn start() -> Self {
        let begun = Instant::now();
        Self { begun, last: begun, stages: CpuStages::default() }
    }

    /// Adds the time since the last call to a stage.
    pub fn lap(&mut self, stage: impl FnOnce(&mut CpuStages) -> &mut f64) {
        let now = Instant::now();
        *stage(&mut self.stages) += milliseconds(now - self.last);
        self.last = now;
    }

    /// Stores the parts of the encoding stage.
    pub fn note_execution(&mut self, execution: lumbre_graph::ExecutionStages) {
        self.stages.execution = execution;
    }

    /// Returns the stages so far and the total time.
    pub fn stages(&self) -> CpuStages {
        CpuStages { total_ms: milliseconds(self.begun.elapsed()), ..self.stages }
    }
}

/// Runs a closure and adds the time that it took, in milliseconds, to `sum`.
pub(crate) fn timed<T>(sum: &mut f64, run: impl FnOnce() -> T) -> T {
    let begun = Instant::now();
    let result = run();
    *sum += milliseconds(begun.elapsed());
    result
}

pub(crate) fn milliseconds(time: Duration) -> f64 {
    time.as_secs_f64() * 1e3
}
