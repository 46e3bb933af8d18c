//! Draws the G-buffer: the nearest of the surfaces that are lit deferred, before any of them is lit. The
//! passes of opaque surfaces then read it ([`GBuffer`]) and light their own surfaces in it. If compute shaders
//! light it, a pass of its own does so for all surfaces, and the first pass of opaque surfaces draws the result.

use bevy_ecs::world::World;
use lumbre_graph::{
    ComputeContext, LoadOp, PassResources, RasterContext, TextureDescriptor, TextureHandle, TextureWrite,
};

use super::deferred_composite::{Composite, Composites};
use super::{Board, Effect, EffectWork, FrameGraph, Stage};
use crate::error::EffectError;
use crate::extract::LitPass;
use crate::facts::SceneFacts;
use crate::frame_plan::FrameShape;
use crate::frame_scene::FrameScene;
use crate::g_buffer::{self, GBufferContents};
use crate::{FrameOptions, Gpu};

#[derive(Debug, Default)]
pub(super) struct GBufferPass {
    contents: Option<GBufferContents>,
    composites: Composites,
    /// What draws the pixels that compute shaders have lit, in a frame that has been prepared.
    composite: Option<Composite>,
}

/// The G-buffer of a frame, stored on the [`Board`].
#[derive(Clone)]
pub(super) struct GBuffer {
    surfaces: TextureHandle,
    details: Option<TextureHandle>,
    lit: Option<LitPixels>,
}

/// The pixels that compute shaders have lit.
#[derive(Clone)]
struct LitPixels {
    pixels: TextureHandle,
    composite: Option<Composite>,
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

    fn ready(&mut self, gpu: &Gpu, frame: &FrameShape) -> Result<bool, EffectError> {
        match self.contents {
            Some(GBufferContents { lit_in_compute: true, .. }) => {
                self.composites.begin(gpu, frame.lit_format)
            }
            _ => Ok(true),
        }
    }

    fn prepare(&mut self, gpu: &Gpu, frame: &FrameShape) -> Result<(), EffectError> {
        let in_compute = self.contents.is_some_and(|contents| contents.lit_in_compute);
        self.composite = if in_compute { Some(self.composites.make(gpu, frame.lit_format)?) } else { None };
        Ok(())
    }

    fn work(&self) -> EffectWork {
        EffectWork::new(0, self.composites.made())
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
        let Some(contents) = self.contents else { return };
        let mut g_buffer = GBuffer { surfaces, details, lit: None };
        if contents.lit_in_compute {
            let mut pixels = board.texture(graph, "lit pixels", g_buffer::LIT_FORMAT);
            let pass = board.lit(graph.compute_pass(g_buffer::COMPUTE_PASS));
            let pass = g_buffer.textures().fold(pass, |pass, texture| pass.samples(&texture));
            let from = g_buffer.clone();
            pass.writes(&mut pixels, TextureWrite::Storage)
                .run(move |context| from.light_in_compute(context, &pixels));
            g_buffer.lit = Some(LitPixels { pixels, composite: self.composite.clone() });
        }
        board.insert(g_buffer);
    }
}

/// Declares a pass of opaque surfaces, which lights its surfaces in the G-buffer and draws its others.
pub(super) fn opaque_pass<'a>(
    graph: &mut FrameGraph<'a>,
    board: &mut Board,
    lit_pass: LitPass,
    calls: &[(bool, &'static str)],
) {
    let g_buffer = board.get::<GBuffer>().cloned();
    let pass = board.lit_pass(graph, lit_pass.name(), LoadOp::Load);
    let pass = calls.iter().fold(pass, |pass, (there, what)| pass.requires(*there, *what));
    let read = g_buffer.iter().flat_map(GBuffer::read_by_opaque_passes);
    let pass = read.fold(pass, |pass, texture| pass.samples(&texture));
    pass.depth(&mut board.depth, LoadOp::Load).run(move |context| {
        if let Some(g_buffer) = g_buffer {
            g_buffer.light(context, lit_pass)?;
        }
        context.user.draw_opaque(context.pass, lit_pass);
        Ok(())
    });
}

impl GBuffer {
    fn textures(&self) -> impl Iterator<Item = TextureHandle> {
        [Some(self.surfaces), self.details].into_iter().flatten()
    }

    /// Returns the textures that passes of opaque surfaces read.
    fn read_by_opaque_passes(&self) -> impl Iterator<Item = TextureHandle> {
        let fragments_read = [Some(self.surfaces), self.details];
        self.lit.as_ref().map_or(fragments_read, |lit| [Some(lit.pixels), None]).into_iter().flatten()
    }

    /// Lights the surfaces of all passes in compute shaders.
    fn light_in_compute(
        &self,
        context: &mut ComputeContext<'_, FrameScene<'_>>,
        pixels: &TextureHandle,
    ) -> Result<(), EffectError> {
        let scene = &context.user;
        let Some(classes) = scene.lit_classes() else { return Ok(()) };
        let (surfaces, details) = self.views(&context.resources)?;
        let lit = (context.resources.view(pixels)?, classes);
        let device = context.resources.device;
        let group = g_buffer::compute_group(device, scene.g_buffer_compute_layout(), surfaces, details, lit);
        scene.light_in_compute(context.pass, &group);
        Ok(())
    }

    /// Lights the surfaces of a pass, or draws what compute shaders have lit.
    fn light(
        &self,
        context: &mut RasterContext<'_, FrameScene<'_>>,
        lit_pass: LitPass,
    ) -> Result<(), EffectError> {
        let scene = &context.user;
        if !scene.lights_deferred(lit_pass) {
            return Ok(());
        }
        if let Some(LitPixels { pixels, composite }) = &self.lit {
            let drawn_before = lit_pass == LitPass::Forward && scene.lights_deferred(LitPass::Lightmap);
            if let Some(composite) = composite.as_ref().filter(|_| !drawn_before) {
                let pixels = context.resources.view(pixels)?;
                composite.draw(context.resources.device, context.pass, pixels, scene.is_parallel());
            }
            return Ok(());
        }
        let (surfaces, details) = self.views(&context.resources)?;
        let device = context.resources.device;
        let group = g_buffer::group(device, scene.g_buffer_layout(), surfaces, details);
        scene.light_deferred(context.pass, lit_pass, &group);
        Ok(())
    }

    /// Returns the views of the surfaces and their details.
    fn views<'r>(
        &self,
        resources: &PassResources<'r>,
    ) -> Result<(&'r wgpu::TextureView, Option<&'r wgpu::TextureView>), EffectError> {
        let view = |handle: &TextureHandle| resources.view(handle);
        Ok((view(&self.surfaces)?, self.details.as_ref().map(view).transpose()?))
    }
}
