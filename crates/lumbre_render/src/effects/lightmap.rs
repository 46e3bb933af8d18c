//! Draws opaque surfaces with baked light: the lightmap's diffuse light, and what dynamic lights add to it.

use bevy_ecs::world::World;

use super::{Board, Effect, EffectWork, FrameGraph, Stage, g_buffer};
use crate::error::EffectError;
use crate::extract::LitPass;
use crate::facts::SceneFacts;
use crate::frame_plan::FrameShape;
use crate::{FrameOptions, Gpu};

#[derive(Debug, Default)]
pub(super) struct Lightmap {
    lightmapped: bool,
    switched_on: bool,
    work: EffectWork,
}

impl Effect for Lightmap {
    fn name(&self) -> &'static str {
        "lightmap"
    }

    fn stage(&self) -> Stage {
        Stage::Opaque
    }

    fn extract(&mut self, _: &mut World, facts: &SceneFacts, options: &FrameOptions) -> bool {
        (self.lightmapped, self.switched_on) = (facts.lightmapped > 0, options.lightmaps);
        self.lightmapped && self.switched_on
    }

    fn is_unchanged(&mut self, _: &mut World) -> bool {
        true
    }

    fn prepare(&mut self, _: &Gpu, frame: &FrameShape) -> Result<(), EffectError> {
        self.work.of_renderer += frame.uploads.lightmaps;
        Ok(())
    }

    fn work(&self) -> EffectWork {
        self.work
    }

    fn declare<'a>(&'a self, graph: &mut FrameGraph<'a>, board: &mut Board) {
        let calls = [(self.lightmapped, "lightmapped mesh"), (self.switched_on, "lightmaps switched on")];
        g_buffer::opaque_pass(graph, board, LitPass::Lightmap, &calls);
    }
}
