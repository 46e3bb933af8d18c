//! The graph of a frame: the effects' passes in the order of their stages, and the overlay.

use lumbre_graph::{Executor, Frame, Imports, LoadOp, TextureDescriptor};

use crate::effects::{Board, Effect, FrameGraph};
use crate::frame_plan::FramePlan;
use crate::frame_scene::FrameScene;
use crate::{FrameTarget, Gpu, RenderError};

/// What draws over the finished frame.
pub(crate) type Overlay<'a> = Box<dyn FnOnce(&mut wgpu::RenderPass<'static>) + 'a>;

/// Declares the frame's graph and runs it.
pub(crate) fn run_graph<'a>(
    executor: &mut Executor,
    gpu: &Gpu,
    (effects, plan): (&'a [Box<dyn Effect>], &FramePlan),
    target: &FrameTarget,
    scene: &mut FrameScene<'a>,
    overlay: Option<Overlay<'a>>,
) -> Result<Frame, RenderError> {
    let described = TextureDescriptor::new_2d(target.width, target.height, target.format);
    let graph = declare(effects, plan, described.usage(target.texture.usage()), overlay);
    let imports = Imports::new().texture("target", &target.view);
    let imports = effects.iter().fold(imports, |imports, effect| effect.imports(imports));
    Ok(executor.execute_with(&gpu.device, &gpu.queue, graph, &imports, scene)?)
}

/// The passes of a frame.
pub(crate) fn declare<'a>(
    effects: &'a [Box<dyn Effect>],
    plan: &FramePlan,
    target: TextureDescriptor,
    overlay: Option<Overlay<'a>>,
) -> FrameGraph<'a> {
    let mut graph = FrameGraph::with_user("frame");
    let mut board = Board::new(&mut graph, plan, target);
    for effect in effects {
        effect.declare(&mut graph, &mut board);
    }
    graph
        .raster_pass("overlay")
        .calls_for(overlay.is_some(), "overlay")
        .color(&mut board.target, LoadOp::Load)
        .run(move |context| {
            if let Some(overlay) = overlay {
                overlay(context.pass);
            }
            Ok(())
        });
    graph
}
