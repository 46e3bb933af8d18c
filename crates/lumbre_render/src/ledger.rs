//! The ledger of measured frames whose results are still on their way from the device. Each frame's account
//! is completed when all of them have arrived; what an account holds is defined in `accounting`.

use std::collections::VecDeque;
use std::sync::Arc;
use std::time::Instant;

use lumbre_graph::GraphReport;

use crate::accounting::{Accounting, FrameShares, LightCount, Waited};
use crate::light_counter::PassCounts;
use crate::stage_clock::milliseconds;

/// Largest number of open frames: more than the graph measures at once.
const MAX_OPEN: usize = 8;

/// A frame whose results have not all arrived.
#[derive(Debug)]
pub(crate) struct OpenFrame {
    pub frame: u64,
    pub begun: Instant,
    pub shares: FrameShares,
    /// Whether its lights are counted.
    pub counts_lights: bool,
    /// Why some lights are not counted.
    pub notes: Vec<String>,
    pub report: Option<GraphReport>,
    pub lights: Option<PassCounts>,
}

/// Open and completed accounts.
#[derive(Debug, Default)]
pub(crate) struct Ledger {
    open: VecDeque<OpenFrame>,
    /// An unmeasured frame was drawn since, so a wait is not for the open frames alone.
    passed_over: bool,
    /// The last frame, if its account was completed before it was waited for. This happens if nothing of it
    /// is measured on the device, so that its report is there at once.
    settled_at_once: Option<OpenFrame>,
    newest: Option<Arc<Accounting>>,
}

impl Ledger {
    pub fn open(&mut self, frame: OpenFrame) {
        if self.open.len() == MAX_OPEN {
            self.open.pop_front();
        }
        self.open.push_back(frame);
        (self.passed_over, self.settled_at_once) = (false, None);
    }

    /// Records that an unmeasured frame was drawn.
    pub fn pass_over(&mut self) {
        (self.passed_over, self.settled_at_once) = (true, None);
    }

    /// Adds the graph's measurements to their frame.
    pub fn note_report(&mut self, report: &GraphReport) {
        if let Some(frame) =
            self.open.iter_mut().find(|open| open.frame == report.frame && open.report.is_none())
        {
            frame.report = Some(report.clone());
        }
    }

    /// Adds a frame's light counts.
    pub fn note_lights(&mut self, number: u64, lights: PassCounts) {
        if let Some(frame) = self.open.iter_mut().find(|open| open.frame == number) {
            frame.lights = Some(lights);
        }
    }

    /// Completes the newest frame whose results have all arrived, and drops those before it. `waited` is the
    /// time at which waiting for the last frame began, if it was waited for until now.
    pub fn settle(&mut self, waited: Option<Instant>) {
        let is_complete =
            |open: &OpenFrame| open.report.is_some() && (open.lights.is_some() || !open.counts_lights);
        let newest = self.open.iter().rposition(is_complete);
        let is_last = newest.is_none_or(|newest| newest + 1 == self.open.len()) && !self.passed_over;
        let complete = newest.and_then(|newest| self.open.drain(..=newest).next_back());
        let Some(frame) = complete.or_else(|| self.settled_at_once.take_if(|_| waited.is_some())) else {
            return;
        };
        let waited = waited.filter(|_| is_last).map(|since| Waited {
            wall_ms: milliseconds(frame.begun.elapsed()),
            waiting_ms: milliseconds(since.elapsed()),
        });
        self.newest = frame.account(waited).map(Arc::new);
        self.settled_at_once = Some(frame).filter(|_| is_last && waited.is_none());
    }

    /// Returns the newest completed account.
    pub fn newest(&self) -> Option<&Arc<Accounting>> {
        self.newest.as_ref()
    }
}

impl OpenFrame {
    /// Returns the frame's account, or `None` without its report.
    fn account(&self, waited: Option<Waited>) -> Option<Accounting> {
        let mut report = self.report.clone()?;
        report.notes.extend(self.notes.iter().cloned());
        let lights = |pass: &str| -> Option<LightCount> { self.lights.as_ref()?.of(pass) };
        Some(Accounting::new(&self.shares, &report, lights, waited))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lightmap_texels::LightmapMemory;
    use crate::statistics::{CpuStages, Uploads};

    fn frame(frame: u64, counts_lights: bool) -> OpenFrame {
        let shares = FrameShares {
            stages: CpuStages::default(),
            uploads: Uploads::default(),
            lightmaps: LightmapMemory::default(),
            effects: Vec::new(),
            pipelines_made: 0,
        };
        let begun = Instant::now();
        OpenFrame { frame, begun, shares, counts_lights, notes: Vec::new(), report: None, lights: None }
    }

    fn report(frame: u64) -> GraphReport {
        GraphReport { frame, ..GraphReport::default() }
    }

    #[test]
    fn a_frame_is_settled_when_all_of_it_has_arrived_and_the_newest_such_wins() {
        let mut ledger = Ledger::default();
        (1..=3).for_each(|number| ledger.open(frame(number, number == 3)));
        ledger.settle(None);
        assert!(ledger.newest().is_none());
        ledger.note_report(&report(2));
        ledger.note_report(&report(3));
        ledger.settle(Some(Instant::now()));
        let settled = ledger.newest().unwrap();
        assert_eq!((settled.frame, settled.wall_ms), (2, None), "the lights of the third are on their way");
        ledger.note_lights(3, PassCounts::default());
        ledger.settle(Some(Instant::now()));
        let settled = ledger.newest().unwrap();
        assert_eq!(settled.frame, 3);
        assert!(settled.wall_ms >= settled.waiting_ms && settled.waiting_ms.is_some());
    }

    #[test]
    fn what_is_settled_at_once_can_be_waited_for_once() {
        let mut ledger = Ledger::default();
        ledger.open(frame(1, false));
        ledger.note_report(&report(1));
        ledger.settle(None);
        let wall = |ledger: &Ledger| ledger.newest().and_then(|settled| settled.wall_ms);
        assert_eq!(wall(&ledger), None);
        ledger.settle(Some(Instant::now()));
        let waited = wall(&ledger);
        assert!(waited.is_some());
        ledger.settle(Some(Instant::now()));
        assert_eq!(wall(&ledger), waited);
    }

    #[test]
    fn waiting_for_another_frame_is_no_frames_wall_clock() {
        let mut ledger = Ledger::default();
        ledger.open(frame(1, false));
        ledger.pass_over();
        ledger.note_report(&report(1));
        ledger.settle(Some(Instant::now()));
        assert_eq!(ledger.newest().map(|settled| settled.wall_ms), Some(None));
    }

    #[test]
    fn what_never_arrives_is_forgotten() {
        let mut ledger = Ledger::default();
        (1..=100).for_each(|number| ledger.open(frame(number, false)));
        assert_eq!(ledger.open.len(), MAX_OPEN);
    }
}
