//! Declares the render graph of a frame and runs it: the effects' passes in the order of their stages, then
//! the overlay and the copy of the light counts.

use lumbre_graph::{BufferDescriptor, BufferRead, Executor, Frame, Imports, LoadOp, TextureDescriptor};

use crate::effects::{Board, Effect, FrameGraph};
use crate::frame_bindings::FrameBuffer;
use crate::frame_plan::FramePlan;
use crate::frame_scene::FrameScene;
use crate::{FrameTarget, Gpu, RenderError, Viewport};

/// Draws over the finished frame.
pub(crate) type Overlay<'a> = Box<dyn FnOnce(&mut wgpu::RenderPass<'static>) + 'a>;

/// What comes after all effects.
#[derive(Default)]
pub(crate) struct Last<'a> {
    pub overlay: Option<Overlay<'a>>,
    /// The buffer that lit passes count lights in, and the buffer that it is copied to.
    pub counts: Option<[wgpu::Buffer; 2]>,
}

/// A buffer that surfaces are lit from, with its name in the graph.
pub(crate) type LightBuffer = (&'static str, FrameBuffer, wgpu::BufferUsages);

/// Declares the frame's graph and runs it.
pub(crate) fn run_graph<'a>(
    executor: &mut Executor,
    gpu: &Gpu,
    (effects, declared, plan): (&'a [Box<dyn Effect>], &[bool], &FramePlan),
    (target, light): (&FrameTarget, &[(&'static str, FrameBuffer, wgpu::Buffer)]),
    scene: &mut FrameScene<'a>,
    last: Last<'a>,
) -> Result<Frame, RenderError> {
    let (width, height) = (target.texture.width(), target.texture.height());
    let described = TextureDescriptor::new_2d(width, height, target.format);
    let effects =
        || effects.iter().zip(declared).filter(|(_, declared)| **declared).map(|(effect, _)| effect);
    let buffers = light.iter().map(|(name, buffer, bound)| (*name, *buffer, bound.usage()));
    let target_usage = described.usage(target.texture.usage());
    let graph = declare(effects(), plan, (target_usage, target.viewport, &mut { buffers }), last);
    let imports = Imports::new().texture("target", &target.view);
    let imports = light.iter().fold(imports, |imports, (name, _, bound)| imports.buffer(*name, bound));
    let imports = effects().fold(imports, |imports, effect| effect.imports(imports));
    Ok(executor.execute_with(&gpu.device, &gpu.queue, graph, &imports, scene)?)
}

/// Declares the passes of a frame.
pub(crate) fn declare<'a>(
    effects: impl IntoIterator<Item = &'a Box<dyn Effect>>,
    plan: &FramePlan,
    (target, viewport, light): (TextureDescriptor, Option<Viewport>, &mut dyn Iterator<Item = LightBuffer>),
    Last { overlay, counts }: Last<'a>,
) -> FrameGraph<'a> {
    let mut graph = FrameGraph::with_user("frame");
    let mut board = Board::new(&mut graph, plan, target, viewport);
    for (name, buffer, usage) in light {
        let handle = graph.import_buffer(name, BufferDescriptor::new(4).usage(usage));
        let read = if buffer.is_uniform() { BufferRead::Uniform } else { BufferRead::Storage };
        board.lit_by_buffer(handle, read);
    }
    for effect in effects {
        graph.set_owner(effect.name());
        effect.declare(&mut graph, &mut board);
    }
    graph.set_owner("overlay");
    graph
        .raster_pass("overlay")
        .requires(overlay.is_some(), "overlay")
        .color(&mut board.target, LoadOp::Load)
        .run(move |context| {
            if let Some(overlay) = overlay {
                overlay(context.pass);
            }
            Ok(())
        });
    if let Some([counts, copy]) = counts {
        // This is part of the frame's own commands; a separate submission would have to wait for them.
        graph.set_owner("light counts");
        let pass = graph.transfer_pass("light counts").after("overlay");
        pass.side_effect("brings counts of lights to memory").run(move |context| {
            context.encoder.copy_buffer_to_buffer(&counts, 0, &copy, 0, counts.size());
            Ok(())
        });
    }
    graph
}
