//! Draws blended surfaces over what lies behind them, the farthest first.

use bevy_ecs::world::World;
use lumbre_graph::LoadOp;

use super::{Board, Effect, FrameGraph, Stage};
use crate::FrameOptions;
use crate::extract::LitPass;
use crate::facts::SceneFacts;

#[derive(Debug, Default)]
pub(super) struct Transparent {
    blended: bool,
}

impl Effect for Transparent {
    fn name(&self) -> &'static str {
        "transparent"
    }

    fn stage(&self) -> Stage {
        Stage::Transparent
    }

    fn extract(&mut self, _: &mut World, facts: &SceneFacts, _: &FrameOptions) -> bool {
        self.blended = facts.transparent > 0;
        self.blended
    }

    fn is_unchanged(&mut self, _: &mut World) -> bool {
        true
    }

    fn declare<'a>(&'a self, graph: &mut FrameGraph<'a>, board: &mut Board) {
        board
            .lit_pass(graph, self.name(), LoadOp::Load)
            .requires(self.blended, "transparent material")
            .depth(&mut board.depth, LoadOp::Load)
            .run(|context| {
                context.user.draw(context.pass, LitPass::Transparent);
                Ok(())
            });
    }
}
