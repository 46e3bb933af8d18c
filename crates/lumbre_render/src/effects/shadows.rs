//! Draws the shadow maps that changed into the atlas, which the lit surfaces read. Which maps there are is
//! decided in `shadows`.

use bevy_ecs::world::World;
use lumbre_graph::{Imports, LoadOp, TextureDescriptor};

use super::{Board, Effect, EffectWork, FrameGraph, Stage};
use crate::error::EffectError;
use crate::facts::SceneFacts;
use crate::frame_plan::{FrameShape, ShadowAtlas};
use crate::target::DEPTH_FORMAT;
use crate::{FrameOptions, Gpu};

#[derive(Debug, Default)]
pub(super) struct Shadows {
    /// Whether a light asks for a shadow, and whether shadows are switched on.
    called_for: [bool; 2],
    atlas: Option<ShadowAtlas>,
    work: EffectWork,
}

impl Effect for Shadows {
    fn name(&self) -> &'static str {
        "shadow maps"
    }

    fn stage(&self) -> Stage {
        Stage::Light
    }

    fn extract(&mut self, _: &mut World, facts: &SceneFacts, options: &FrameOptions) -> bool {
        self.called_for = [facts.shadow_lights > 0, options.shadows];
        self.atlas = None;
        self.called_for == [true, true]
    }

    fn is_unchanged(&mut self, _: &mut World) -> bool {
        true
    }

    fn prepare(&mut self, _: &Gpu, frame: &FrameShape) -> Result<(), EffectError> {
        self.atlas.clone_from(&frame.shadow_atlas);
        self.work.of_renderer += frame.uploads.shadows;
        self.work.pipelines_made = self.atlas.as_ref().map_or(0, |atlas| atlas.pipelines);
        Ok(())
    }

    fn work(&self) -> EffectWork {
        self.work
    }

    fn imports(&self, imports: Imports) -> Imports {
        match &self.atlas {
            Some(atlas) => imports.texture("shadow atlas", &atlas.view),
            None => imports,
        }
    }

    fn declare<'a>(&'a self, graph: &mut FrameGraph<'a>, board: &mut Board) {
        let [asked, switched_on] = self.called_for;
        // In an explanation without a device the size is not known.
        let side = self.atlas.as_ref().map_or(1, |atlas| atlas.view.texture().width());
        let described = TextureDescriptor::new_2d(side, side, DEPTH_FORMAT);
        let (mut atlas, load) = match &self.atlas {
            // Maps that did not change are kept from an earlier frame.
            Some(_) => (graph.import_texture("shadow atlas", described), LoadOp::Load),
            None => (graph.texture("shadow atlas", described), LoadOp::Clear(0.0)),
        };
        let mut pass = graph
            .raster_pass(self.name())
            .requires(asked, "light that asks for a shadow")
            .requires(switched_on, "shadows switched on");
        if let Some(atlas) = &self.atlas {
            pass = pass.requires(atlas.stale, "shadow map that changed");
        }
        pass.depth(&mut atlas, load).run(|context| {
            context.user.draw_shadow_maps(context.pass);
            Ok(())
        });
        if asked && switched_on {
            board.lit_by(atlas);
        }
    }
}
