//! The graph of a frame: which passes there are, what each calls for, what each draws into. The passes read as the frame is made.

use glam::Vec3;
use lumbre_graph::{
    Executor, Frame, Graph, Imports, LoadOp, RasterContext, TextureDescriptor, TextureHandle,
};
use lumbre_optics::FlatRule;

use crate::display::DisplayPass;
use crate::draws::{Batch, Draws};
use crate::extract::{LitPass, Traits};
use crate::mesh_buffers::MeshBuffers;
use crate::pipelines::{DEPTH_FORMAT, Pipelines};
use crate::shader::{DisplayVariant, Feature};
use crate::{Display, FrameOptions, FrameTarget, Gpu, RenderError};

/// The largest finite half float.
const LARGEST_HALF: Vec3 = Vec3::splat(65504.0);

/// What draws over the finished frame.
pub(crate) type Overlay<'a> = Box<dyn FnOnce(&mut wgpu::RenderPass<'static>) + 'a>;

/// Decisions about a frame: formats, samples, and what the scene calls for.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FramePlan {
    /// Of the linear frame.
    pub format: wgpu::TextureFormat,
    pub samples: u32,
    /// The target takes the linear values as they are: there is no display pass.
    pub direct: bool,
    lightmaps_on: bool,
    lightmapped: bool,
    opaque: bool,
    transparent: bool,
}

/// What the passes draw with.
pub(crate) struct Prepared<'a> {
    pub gpu: &'a Gpu,
    pub draws: &'a Draws,
    pub pipelines: &'a Pipelines,
    pub meshes: &'a MeshBuffers,
    pub flat_rule: FlatRule,
    /// Of group 0, for variants without clusters and with them.
    pub frame_groups: [Option<&'a wgpu::BindGroup>; 2],
    pub display: &'a DisplayPass,
    pub display_key: Option<(DisplayVariant, wgpu::TextureFormat)>,
    pub background: Vec3,
}

impl FramePlan {
    /// Takes the census of the objects. Without `choose_formats` the plan is that of any eight-bit target.
    pub fn new<'t>(objects: impl IntoIterator<Item = &'t Traits>, options: &FrameOptions) -> Self {
        let mut plan = Self {
            format: wgpu::TextureFormat::Rgba16Float,
            samples: if options.multisample { 4 } else { 1 },
            direct: false,
            lightmaps_on: options.lightmaps,
            lightmapped: false,
            opaque: false,
            transparent: false,
        };
        for traits in objects {
            // Whether a lightmapped mesh is there does not depend on whether lightmaps are switched on.
            plan.lightmapped |= traits.pass(true) == LitPass::Lightmap;
            plan.opaque |= traits.pass(options.lightmaps) == LitPass::Forward;
            plan.transparent |= traits.pass(options.lightmaps) == LitPass::Transparent;
        }
        plan
    }

    /// A colour as the linear frame can hold it.
    pub fn in_range(&self, color: Vec3) -> Vec3 {
        match self.format {
            wgpu::TextureFormat::Rgba16Float => color.clamp(-LARGEST_HALF, LARGEST_HALF),
            _ => color,
        }
    }

    /// Chooses the format of the linear frame from what the device has.
    pub fn choose_formats(&mut self, gpu: &Gpu, target: &FrameTarget, options: &FrameOptions, exposure: f32) {
        let wide = wgpu::TextureFormat::Rgba32Float;
        let features = gpu.device.features();
        // Without these features WebGPU promises neither blending nor multisampling of 32-bit floats.
        let flags = gpu.adapter.get_texture_format_features(wide).flags;
        let resolves = features.contains(wgpu::Features::TEXTURE_ADAPTER_SPECIFIC_FORMAT_FEATURES)
            && flags.sample_count_supported(self.samples)
            && flags.contains(wgpu::TextureFormatFeatureFlags::MULTISAMPLE_RESOLVE);
        let blends = features.contains(wgpu::Features::FLOAT32_BLENDABLE);
        let wide_works = (!self.transparent || blends) && (self.samples == 1 || resolves);
        let linear = options.display == Display::Linear && exposure == 1.0;
        self.direct = wide_works && target.format == wide && linear;
        if self.direct || options.full_precision && wide_works {
            self.format = wide;
        }
    }
}

/// Declares the frame's graph and runs it.
pub(crate) fn run_graph(
    executor: &mut Executor,
    prepared: &Prepared<'_>,
    plan: &FramePlan,
    target: &FrameTarget,
    overlay: Option<Overlay<'_>>,
) -> Result<Frame, RenderError> {
    let described = TextureDescriptor::new_2d(target.width, target.height, target.format);
    let graph = declare(plan, described.usage(target.texture.usage()), Some(prepared), overlay);
    let imports = Imports::new().texture("target", &target.view);
    Ok(executor.execute(&prepared.gpu.device, &prepared.gpu.queue, graph, &imports, &mut ())?)
}

/// The passes of a frame. Without `prepared` they can be compiled and explained, not run.
pub(crate) fn declare<'a>(
    plan: &FramePlan,
    target: TextureDescriptor,
    prepared: Option<&'a Prepared<'a>>,
    overlay: Option<Overlay<'a>>,
) -> Graph<'a> {
    let mut graph = Graph::new("frame");
    let described = |format| TextureDescriptor::new_2d(target.size.width, target.size.height, format);
    let mut shown = graph.import_texture("target", target);
    let mut depth = graph.texture("depth", described(DEPTH_FORMAT).samples(plan.samples));
    let mut lit = LitTargets {
        linear: (!plan.direct).then(|| graph.texture("linear frame", described(plan.format))),
        samples: (plan.samples > 1)
            .then(|| graph.texture("samples", described(plan.format).samples(plan.samples))),
    };

    let clear = prepared.map_or(Vec3::ZERO, |prepared| prepared.background).as_dvec3();
    let clear = wgpu::Color { r: clear.x, g: clear.y, b: clear.z, a: 1.0 };
    lit.pass(&mut graph, "background", &[], LoadOp::Clear(clear), &mut shown)
        .depth(&mut depth, LoadOp::Clear(0.0))
        .run(|_| Ok(()));

    let calls_for = [(plan.lightmapped, "lightmapped mesh"), (plan.lightmaps_on, "lightmaps switched on")];
    lit.pass(&mut graph, "lightmap", &calls_for, LoadOp::Load, &mut shown)
        .depth(&mut depth, LoadOp::Load)
        .run(move |context| draw_batches(context, prepared, |draws| &draws.lightmapped));

    let calls_for = [(plan.opaque, "opaque mesh without a lightmap")];
    lit.pass(&mut graph, "forward", &calls_for, LoadOp::Load, &mut shown)
        .depth(&mut depth, LoadOp::Load)
        .run(move |context| draw_batches(context, prepared, |draws| &draws.opaque));

    let calls_for = [(plan.transparent, "transparent material")];
    lit.pass(&mut graph, "transparent", &calls_for, LoadOp::Load, &mut shown)
        .depth(&mut depth, LoadOp::Load)
        .run(move |context| draw_batches(context, prepared, |draws| &draws.transparent));

    if let Some(linear) = lit.linear {
        display_pass(&mut graph, prepared, linear, &mut shown);
    }
    graph.raster_pass("overlay").calls_for(overlay.is_some(), "overlay").color(&mut shown, LoadOp::Load).run(
        move |context| {
            if let Some(overlay) = overlay {
                overlay(context.pass);
            }
            Ok(())
        },
    );
    graph
}

/// Where lit colours are drawn: into the samples, if there are several per pixel, and from there or at once into the linear frame,
/// if there is a display pass after it, or else the target.
struct LitTargets {
    linear: Option<TextureHandle>,
    samples: Option<TextureHandle>,
}

impl LitTargets {
    fn pass<'g, 'a>(
        &mut self,
        graph: &'g mut Graph<'a>,
        name: &'static str,
        calls_for: &[(bool, &'static str)],
        load: LoadOp<wgpu::Color>,
        shown: &mut TextureHandle,
    ) -> lumbre_graph::PassBuilder<'g, 'a, lumbre_graph::Raster, ()> {
        let result = self.linear.as_mut().unwrap_or(shown);
        let mut pass = graph.raster_pass(name);
        for (there, what) in calls_for {
            pass = pass.calls_for(*there, *what);
        }
        match &mut self.samples {
            Some(samples) => pass.color(samples, load).resolve(result),
            None => pass.color(result, load),
        }
    }
}

fn display_pass<'a>(
    graph: &mut Graph<'a>,
    prepared: Option<&'a Prepared<'a>>,
    linear: TextureHandle,
    shown: &mut TextureHandle,
) {
    graph.raster_pass("display").samples(&linear).color(shown, LoadOp::Clear(wgpu::Color::BLACK)).run(
        move |context| {
            let view = context.resources.view(&linear)?;
            if let Some((prepared, key)) = prepared.and_then(|p| Some((p, p.display_key.as_ref()?))) {
                prepared.display.draw(context.resources.device, context.pass, key, view);
            }
            Ok(())
        },
    );
}

fn draw_batches<'a>(
    context: &mut RasterContext<'_>,
    prepared: Option<&'a Prepared<'a>>,
    batches: impl FnOnce(&'a Draws) -> &'a [Batch],
) -> lumbre_graph::BodyResult {
    let Some(prepared) = prepared else { return Ok(()) };
    let pass = &mut *context.pass;
    let mut bound = None;
    for batch in batches(prepared.draws) {
        let (Some(pipeline), Some(mesh)) =
            (prepared.pipelines.get(&batch.pipeline), prepared.meshes.get(batch.mesh))
        else {
            continue;
        };
        let slices = mesh.slices(&pipeline.attributes, pipeline.flat.then_some(prepared.flat_rule));
        if slices.count == 0 {
            continue;
        }
        pass.set_pipeline(&pipeline.pipeline);
        let clustered = batch.pipeline.variant.has(Feature::Clusters);
        if bound != Some(clustered) {
            let Some(group) = prepared.frame_groups[usize::from(clustered)] else { continue };
            pass.set_bind_group(0, group, &[]);
            bound = Some(clustered);
        }
        if let Some(set) = &batch.texture_set {
            pass.set_bind_group(1, &set.bind_group, &[]);
        }
        if let Some(lightmap) = &batch.lightmap {
            pass.set_bind_group(2, &**lightmap, &[]);
        }
        for (slot, buffer) in (0..).zip(&slices.attributes) {
            pass.set_vertex_buffer(slot, buffer.slice(..));
        }
        match slices.indices {
            Some(indices) => {
                pass.set_index_buffer(indices.slice(..), wgpu::IndexFormat::Uint32);
                pass.draw_indexed(0..slices.count, 0, batch.instances.clone());
            }
            None => pass.draw(0..slices.count, batch.instances.clone()),
        }
    }
    Ok(())
}
