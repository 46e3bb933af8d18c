//! Draws the shadow maps that changed into the atlas, which the lit surfaces read. Which maps there are is
//! decided in `shadows`.

use bevy_ecs::world::World;
use lumbre_graph::{Imports, LoadOp, PassBuilder, Raster, TextureDescriptor};
use lumbre_scene::ShadowFilter;

use super::{Board, Effect, EffectWork, FrameGraph, Stage};
use crate::error::EffectError;
use crate::facts::SceneFacts;
use crate::frame_plan::{FrameShape, ShadowAtlas};
use crate::frame_scene::FrameScene;
use crate::shadows::{BLOCK, PLANES_FORMAT};
use crate::target::DEPTH_FORMAT;
use crate::{FrameOptions, Gpu};

#[derive(Debug, Default)]
pub(super) struct Shadows {
    /// Whether a light asks for a shadow, and whether shadows are switched on.
    called_for: [bool; 2],
    /// Whether the filter reads the maps' planes.
    planes: bool,
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
        self.planes = facts.settings.frame.shadow_filter != ShadowFilter::Hard;
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
            Some(atlas) => {
                let imports = imports.texture("shadow atlas", &atlas.view);
                if self.planes { imports.texture("shadow planes", &atlas.planes) } else { imports }
            }
            None => imports,
        }
    }

    fn declare<'a>(&'a self, graph: &mut FrameGraph<'a>, board: &mut Board) {
        // In an explanation without a device the size is not known.
        let side = self.atlas.as_ref().map_or(1, |atlas| atlas.view.texture().width());
        let described = TextureDescriptor::new_2d(side, side, DEPTH_FORMAT);
        let (mut atlas, load) = match &self.atlas {
            // Maps that did not change are kept from an earlier frame.
            Some(_) => (graph.import_texture("shadow atlas", described), LoadOp::Load),
            None => (graph.texture("shadow atlas", described), LoadOp::Clear(0.0)),
        };
        let pass = self.if_stale(graph.raster_pass(self.name()));
        pass.depth(&mut atlas, load).run(|context| {
            context.user.draw_shadow_maps(context.pass);
            Ok(())
        });
        let lights = self.called_for == [true, true];
        if self.planes {
            let side = side.div_ceil(BLOCK);
            let described = TextureDescriptor::new_2d(side, side, PLANES_FORMAT);
            let (mut planes, load) = match &self.atlas {
                Some(_) => (graph.import_texture("shadow planes", described), LoadOp::Load),
                None => (graph.texture("shadow planes", described), LoadOp::Clear(wgpu::Color::BLACK)),
            };
            let pass = self.if_stale(graph.raster_pass("shadow planes")).samples(&atlas);
            pass.color(&mut planes, load).run(|context| {
                context.user.draw_shadow_planes(context.pass);
                Ok(())
            });
            if lights {
                board.lit_by(planes);
            }
        }
        if lights {
            board.lit_by(atlas);
        }
    }
}

impl Shadows {
    /// Makes a pass run only if a map has to be drawn.
    fn if_stale<'g, 'a>(
        &self,
        pass: PassBuilder<'g, 'a, Raster, FrameScene<'a>>,
    ) -> PassBuilder<'g, 'a, Raster, FrameScene<'a>> {
        let [asked, switched_on] = self.called_for;
        let pass =
            pass.requires(asked, "light that asks for a shadow").requires(switched_on, "shadows switched on");
        match &self.atlas {
            Some(atlas) => pass.requires(atlas.stale, "shadow map that changed"),
            None => pass,
        }
    }
}
