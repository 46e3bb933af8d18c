//! Creates the pipelines that a frame lacks, or starts to, and leaves out effects that are not ready.

use std::collections::HashSet;

use super::Renderer;
use crate::RenderError;
use crate::effects::BuiltIn;
use crate::frame_decision::{Decided, Seen};
use crate::frame_plan::Ending;
use crate::stage_clock::timed;

impl Renderer {
    /// Creates the missing pipelines of a frame, or starts to. Returns how many are still being created,
    /// which is 0 with `wait`.
    pub(super) fn make_pipelines(
        &mut self,
        decided: &mut Decided,
        seen: &Seen<'_>,
        wait: bool,
    ) -> Result<usize, RenderError> {
        let mut awaited = HashSet::new();
        let drawn = decided.batches().map(|batch| (batch.pipeline, batch.texture_set.as_deref()));
        let lit = decided.draws.deferred.iter().map(|class| (class.pipeline, None));
        for (key, set) in drawn.chain(lit) {
            let warm_up = || self.warm_ups.of(&self.gpu, key, (set, self.objects.lightmap_format()));
            if !self.pipelines.prepare(&self.gpu, &mut self.sets, key, wait, warm_up)? {
                awaited.insert(key);
            }
        }
        let mut count = awaited.len();
        if !decided.lights.shadows.is_empty() {
            let warm_up = || self.warm_ups.of_casters(&self.gpu);
            count += usize::from(!self.shadows.prepare(&self.gpu, wait, warm_up)?);
        }
        if !wait {
            count += self.ready_effects(decided, seen)?.iter().filter(|ready| !**ready).count();
        }
        Ok(count)
    }

    /// Returns for each effect whether it can be drawn without waiting.
    fn ready_effects(&mut self, decided: &Decided, seen: &Seen<'_>) -> Result<Vec<bool>, RenderError> {
        let mut shape = decided.decision.shape(seen);
        shape.warm_ups = Some(self.warm_ups.clone());
        let effects = self.effects.iter_mut().zip(&mut self.shares.ms).zip(&decided.called_for);
        let ready = effects.map(|((effect, ms), called)| {
            let (called, name) = (*called, effect.name());
            let ready = if called { timed(ms, || effect.ready(&self.gpu, &shape)) } else { Ok(true) };
            ready.map_err(|source| RenderError::Effect { effect: name, source })
        });
        ready.collect()
    }

    /// Leaves out effects that are not ready, or that need radiance where the former decision does not keep
    /// it.
    pub(super) fn leave_out_effects(
        &mut self,
        decided: &mut Decided,
        seen: &Seen<'_>,
    ) -> Result<(), RenderError> {
        decided.declared = self.ready_effects(decided, seen)?;
        let linear = decided.decision.plan.ending == Ending::DisplayPass;
        for (effect, declared) in self.effects.iter().zip(&mut decided.declared) {
            *declared &= !effect.needs_radiance() || linear;
        }
        for (called, declared) in decided.called_for.iter_mut().zip(&decided.declared) {
            *called &= declared;
        }
        let mut declared = self.effects.iter().zip(&decided.declared).filter(|(_, declared)| **declared);
        if !declared.any(|(effect, _)| effect.name() == BuiltIn::Refraction.name()) {
            decided.draws.draw_refractive_opaque();
        }
        Ok(())
    }
}
