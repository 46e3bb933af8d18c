//! Draws opaque surfaces without a lightmap: flat, Gouraud and Phong shading in one pass over all lights.

use bevy_ecs::world::World;

use super::{Board, Effect, FrameGraph, Stage, g_buffer};
use crate::FrameOptions;
use crate::extract::LitPass;
use crate::facts::SceneFacts;

#[derive(Debug, Default)]
pub(super) struct Forward {
    opaque: bool,
}

impl Effect for Forward {
    fn name(&self) -> &'static str {
        "forward"
    }

    fn stage(&self) -> Stage {
        Stage::Opaque
    }

    fn extract(&mut self, _: &mut World, facts: &SceneFacts, _: &FrameOptions) -> bool {
        self.opaque = facts.opaque > 0;
        self.opaque
    }

    fn is_unchanged(&mut self, _: &mut World) -> bool {
        true
    }

    fn declare<'a>(&'a self, graph: &mut FrameGraph<'a>, board: &mut Board) {
        let calls = [(self.opaque, "opaque mesh without a lightmap")];
        g_buffer::opaque_pass(graph, board, LitPass::Forward, &calls);
    }
}
