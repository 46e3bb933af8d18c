//! What each effect of a renderer does in a frame outside of its passes: its CPU time, and what it uploaded
//! and created.

use crate::accounting::EffectShare;
use crate::effects::{Effect, EffectWork};
use crate::statistics::Uploads;

/// The shares of a frame's effects, in their order.
#[derive(Debug, Default)]
pub(crate) struct EffectShares {
    /// Milliseconds on the CPU, by effect.
    pub ms: Vec<f64>,
    /// The effects' counters at the end of the last frame.
    worked: Vec<EffectWork>,
}

impl EffectShares {
    /// Begins a frame.
    pub fn begin(&mut self, effects: &[Box<dyn Effect>]) {
        self.ms.clear();
        self.ms.resize(effects.len(), 0.0);
        self.worked.resize(effects.len(), EffectWork::default());
    }

    /// Ends a frame and returns what each effect did in it. What the effects uploaded themselves is added to
    /// the frame's uploads.
    pub fn end(&mut self, effects: &[Box<dyn Effect>], uploads: &mut Uploads) -> Vec<EffectShare> {
        let mut shares = Vec::with_capacity(effects.len());
        for ((effect, ms), worked) in effects.iter().zip(&self.ms).zip(&mut self.worked) {
            let work = effect.work();
            let own = work.uploaded_bytes.saturating_sub(worked.uploaded_bytes);
            let of_renderer = work.of_renderer.saturating_sub(worked.of_renderer);
            let pipelines_made = work.pipelines_made.saturating_sub(worked.pipelines_made);
            *worked = work;
            uploads.effects += own;
            let uploaded_bytes = own + of_renderer;
            shares.push(EffectShare { name: effect.name(), cpu_ms: *ms, uploaded_bytes, pipelines_made });
        }
        shares
    }
}
