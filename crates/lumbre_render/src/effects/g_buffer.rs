//! Draws the G-buffer: the nearest of the surfaces that are lit deferred, before any of them is lit. The
//! passes of opaque surfaces then read it ([`GBuffer`]) and light their own surfaces in it.

use bevy_ecs::world::World;
use lumbre_graph::{LoadOp, RasterContext, TextureDescriptor, TextureHandle};

use super::{Board, Effect, FrameGraph, Stage};
use crate::FrameOptions;
use crate::error::EffectError;
use crate::extract::LitPass;
use crate::facts::SceneFacts;
use crate::frame_scene::FrameScene;
use crate::g_buffer::{self, GBufferContents};

#[derive(Debug, Default)]
pub(super) struct GBufferPass {
    contents: Option<GBufferContents>,
}

/// The G-buffer of a frame, stored on the [`Board`].
#[derive(Clone, Copy)]
pub(super) struct GBuffer {
    surfaces: TextureHandle,
    details: Option<TextureHandle>,
}

impl Effect for GBufferPass {
    fn name(&self) -> &'static str {
        "g-buffer"
    }

    fn stage(&self) -> Stage {
        Stage::Opaque
    }

    fn extract(&mut self, _: &mut World, facts: &SceneFacts, _: &FrameOptions) -> bool {
        self.contents = facts.g_buffer;
        self.contents.is_some()
    }

    fn is_unchanged(&mut self, _: &mut World) -> bool {
        true
    }

    fn declare<'a>(&'a self, graph: &mut FrameGraph<'a>, board: &mut Board) {
        let [width, height] = board.size;
        // A frame with a G-buffer has one sample per pixel; in any other frame the G-buffer matches the depth
        // buffer.
        let described = TextureDescriptor::new_2d(width, height, g_buffer::FORMAT).samples(board.samples);
        let mut surfaces = graph.texture("surfaces", described);
        let detailed = self.contents.is_some_and(|contents| contents.details);
        let mut details = detailed.then(|| graph.texture("details of surfaces", described));
        let nothing = LoadOp::Clear(wgpu::Color::TRANSPARENT);
        let mut pass = graph
            .raster_pass(self.name())
            .requires(self.contents.is_some(), "deferred shading")
            .color(&mut surfaces, nothing);
        if let Some(details) = &mut details {
            pass = pass.color(details, nothing);
        }
        // Depths that an effect at the background stage has drawn are kept.
        pass.depth(&mut board.depth, LoadOp::Load).run(|context| {
            context.user.draw_g_buffer(context.pass);
            Ok(())
        });
        if self.contents.is_some() {
            board.insert(GBuffer { surfaces, details });
        }
    }
}

/// Declares a pass of opaque surfaces, which lights its surfaces in the G-buffer and draws its others.
pub(super) fn opaque_pass<'a>(
    graph: &mut FrameGraph<'a>,
    board: &mut Board,
    lit_pass: LitPass,
    calls: &[(bool, &'static str)],
) {
    let g_buffer = board.get::<GBuffer>().copied();
    let pass = board.lit_pass(graph, lit_pass.name(), LoadOp::Load);
    let pass = calls.iter().fold(pass, |pass, (there, what)| pass.requires(*there, *what));
    let textures = g_buffer.iter().flat_map(|of| [Some(of.surfaces), of.details]).flatten();
    let pass = textures.fold(pass, |pass, texture| pass.samples(&texture));
    pass.depth(&mut board.depth, LoadOp::Load).run(move |context| {
        if let Some(g_buffer) = g_buffer {
            g_buffer.light(context, lit_pass)?;
        }
        context.user.draw_opaque(context.pass, lit_pass);
        Ok(())
    });
}

impl GBuffer {
    /// Lights the surfaces of a pass.
    fn light(
        &self,
        context: &mut RasterContext<'_, FrameScene<'_>>,
        lit_pass: LitPass,
    ) -> Result<(), EffectError> {
        let scene = &context.user;
        if !scene.lights_deferred(lit_pass) {
            return Ok(());
        }
        let view = |handle: &TextureHandle| context.resources.view(handle);
        let details = self.details.as_ref().map(view).transpose()?;
        let layout = scene.g_buffer_layout();
        let group = g_buffer::group(context.resources.device, layout, view(&self.surfaces)?, details);
        scene.light_deferred(context.pass, lit_pass, &group);
        Ok(())
    }
}
