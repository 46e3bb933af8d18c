//! Draws reflections in flat mirrors. Each plane of mirrors in sight has a view of its own, which is drawn
//! like the frame; its radiance, times the reflected fraction, is added to the reflective surfaces. Which
//! views there are is decided in `mirror_views`. Nothing is approximated here except reflections deeper than
//! the frame's limit. Curved surfaces are drawn without reflections.
//!
//! ```text
//!   view in a mirror ──► mirrors in it ──► blended surfaces in it ──► mirrors of the frame
//! ```

use std::collections::HashMap;

use bevy_ecs::world::World;
use glam::Vec3;
use lumbre_graph::{
    LoadOp, PassBuilder, PassResources, Raster, RasterContext, RunError, TextureDescriptor, TextureHandle,
};
use lumbre_scene::SceneSettings;

use super::background::LARGEST_HALF;
use super::surface_uniforms::SurfaceUniforms;
use super::{Board, Effect, EffectWork, FrameGraph, Stage};
use crate::error::EffectError;
use crate::extract::{LitPass, MirrorData};
use crate::facts::SceneFacts;
use crate::features::{fog_feature, fog_flags};
use crate::frame_bindings::FrameBuffer;
use crate::frame_plan::{FrameShape, MirrorShape};
use crate::frame_scene::FrameScene;
use crate::layout::radiance;
use crate::mesh_buffers::Attribute;
use crate::pending::Pending;
use crate::shader::{self, Feature};
use crate::target::DEPTH_FORMAT;
use crate::{FrameOptions, Gpu, RenderError};

#[derive(Debug, Default)]
pub(super) struct Mirrors {
    /// Whether the scene has flat mirrors, and whether mirrors are switched on.
    called_for: [bool; 2],
    fog: Option<Feature>,
    /// The background's radiance, with alpha 0 because it is not a surface.
    clear: wgpu::Color,
    /// The views of this frame, once it is decided.
    views: Option<Vec<MirrorShape>>,
    key: Option<Key>,
    size: [u32; 2],
    device: Option<OnDevice>,
}

/// On the board: the reflections in flat transmissive surfaces, by the slots of their objects. They are added
/// together with what is visible through these surfaces.
#[derive(Debug, Default)]
pub(super) struct MirrorPictures(pub HashMap<usize, TextureHandle>);

/// What a pipeline depends on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
struct Key {
    format: wgpu::TextureFormat,
    samples: u32,
    fog: Option<Feature>,
}

#[derive(Debug)]
struct OnDevice {
    /// The layouts of a view with the objects, and of a surface with its reflection.
    layouts: [wgpu::BindGroupLayout; 2],
    pipelines: HashMap<Key, Pending<wgpu::RenderPipeline>>,
    surfaces: SurfaceUniforms,
}

impl Effect for Mirrors {
    fn name(&self) -> &'static str {
        "mirrors"
    }

    fn stage(&self) -> Stage {
        Stage::Opaque
    }

    fn extract(&mut self, _: &mut World, facts: &SceneFacts, options: &FrameOptions) -> bool {
        self.called_for = [facts.census.planar_mirrors > 0, options.mirror_depth > 0];
        self.fog = facts.settings.fog.as_ref().map(|fog| fog_feature(&fog.mode));
        let background = radiance(SceneSettings::shown_background(&facts.settings));
        let [r, g, b] = background.clamp(-LARGEST_HALF, LARGEST_HALF).as_dvec3().to_array();
        self.clear = wgpu::Color { r, g, b, a: 0.0 };
        self.views = None;
        facts.calls_for_mirrors(options)
    }

    fn is_unchanged(&mut self, _: &mut World) -> bool {
        true
    }

    fn needs_radiance(&self) -> bool {
        true
    }

    fn ready(&mut self, gpu: &Gpu, frame: &FrameShape) -> Result<bool, EffectError> {
        let key = self.key_of(frame);
        let device = self.device.get_or_insert_with(|| OnDevice::new(gpu));
        device.pipeline(gpu, key, false)
    }

    fn prepare(&mut self, gpu: &Gpu, frame: &FrameShape) -> Result<(), EffectError> {
        (self.key, self.size) = (None, frame.size);
        self.views.clone_from(&frame.mirrors);
        let surfaces = self.views.iter().flatten().flat_map(|view| &view.surfaces);
        let data: Vec<MirrorData> = surfaces.map(|surface| surface.data).collect();
        if !data.is_empty() {
            let key = self.key_of(frame);
            let device = self.device.get_or_insert_with(|| OnDevice::new(gpu));
            device.pipeline(gpu, key, true)?;
            device.surfaces.write(gpu, &data);
            self.key = Some(key);
        }
        Ok(())
    }

    fn work(&self) -> EffectWork {
        let made = |device: &OnDevice| {
            device.pipelines.values().filter(|pipeline| matches!(pipeline.get(), Some(Ok(_)))).count()
        };
        self.device.as_ref().map_or_else(EffectWork::default, |device| {
            EffectWork::new(device.surfaces.uploaded, made(device))
        })
    }

    fn declare<'a>(&'a self, graph: &mut FrameGraph<'a>, board: &mut Board) {
        let [in_scene, switched_on] = self.called_for;
        let called_for = in_scene && switched_on;
        let views = self.views.as_deref().unwrap_or_default();
        // Children come before their parents, which show the children's pictures.
        let mut pictures: Vec<Option<TextureHandle>> = vec![None; views.len()];
        for index in (0..views.len()).rev().filter(|_| called_for) {
            pictures[index] = Some(self.declare_view(graph, board, (index, &views[index]), &pictures));
        }
        let shown = self.seen_from(0, &pictures);
        let mut of_glass = MirrorPictures::default();
        for (index, picture) in &shown {
            let glass = views[*index].surfaces.iter().filter(|surface| surface.refracts);
            of_glass.0.extend(glass.map(|surface| (surface.slot, *picture)));
        }
        board.insert(of_glass);
        let pass = board
            .lit_pass(graph, self.name(), LoadOp::Load)
            .requires(in_scene, "flat mesh that mirrors")
            .requires(switched_on, "mirrors switched on")
            // In an explanation without a device this is not known.
            .requires(self.views.is_none() || !shown.is_empty(), "mirror in sight");
        let pass = shown.iter().fold(pass, |pass, (_, picture)| pass.samples(picture));
        pass.depth(&mut board.depth, LoadOp::Load).run(move |context| self.add_to(0, context, &shown));
    }
}

impl Mirrors {
    fn key_of(&self, frame: &FrameShape) -> Key {
        Key { format: frame.lit_format, samples: frame.samples, fog: self.fog }
    }

    /// Returns the views in the mirrors that a view sees, with their pictures: 0 is the camera's view, 1 the
    /// first view in a mirror.
    fn seen_from(&self, parent: usize, pictures: &[Option<TextureHandle>]) -> Vec<(usize, TextureHandle)> {
        let views = self.views.iter().flatten().zip(pictures).enumerate();
        views
            .filter(|(_, (view, _))| view.parent == parent)
            .filter_map(|(index, (_, p))| Some((index, (*p)?)))
            .collect()
    }

    /// Declares the passes of a view in a mirror, given the pictures of the views that it sees. Returns its
    /// own picture.
    fn declare_view<'a>(
        &'a self,
        graph: &mut FrameGraph<'a>,
        board: &Board,
        (index, view): (usize, &'a MirrorShape),
        pictures: &[Option<TextureHandle>],
    ) -> TextureHandle {
        let number = index + 1;
        let mut targets = Targets::new(graph, board, number);
        let pass = targets.pass(graph, format!("mirror view {number}"), LoadOp::Clear(self.clear));
        board.lit(pass).run(move |context| {
            confine(context.pass, view.pixels);
            context.user.draw_view(context.pass, LitPass::Lightmap, number);
            context.user.draw_view(context.pass, LitPass::Forward, number);
            // Refractive surfaces are opaque in mirrors.
            context.user.draw_view(context.pass, LitPass::Refraction, number);
            confine(context.pass, self.whole());
            Ok(())
        });
        let shown = self.seen_from(number, pictures);
        if !shown.is_empty() {
            let pass = targets.pass(graph, format!("mirrors in view {number}"), LoadOp::Load);
            let pass = shown.iter().fold(pass, |pass, (_, picture)| pass.samples(picture));
            pass.run(move |context| self.add_to(number, context, &shown));
        }
        if view.transparent {
            let pass = targets.pass(graph, format!("mirrored transparent {number}"), LoadOp::Load);
            board.lit(pass).run(move |context| {
                confine(context.pass, view.pixels);
                context.user.draw_view(context.pass, LitPass::Transparent, number);
                confine(context.pass, self.whole());
                Ok(())
            });
        }
        targets.picture
    }

    /// Adds reflections to the surfaces of a view, from the picture of each view in a mirror.
    fn add_to(
        &self,
        parent: usize,
        context: &mut RasterContext<'_, FrameScene<'_>>,
        shown: &[(usize, TextureHandle)],
    ) -> Result<(), EffectError> {
        let (Some(views), Some(device), Some(key)) = (&self.views, &self.device, &self.key) else {
            return Ok(());
        };
        let Some(Ok(pipeline)) = device.pipelines.get(key).and_then(Pending::get) else { return Ok(()) };
        let Some(bound) = context.user.view_and_transforms(parent) else { return Ok(()) };
        context.pass.set_pipeline(pipeline);
        let seen_from = device.view_group(context.resources.device, bound);
        context.pass.set_bind_group(0, &seen_from, &[]);
        for (index, picture) in shown {
            let Some(group) = device.picture_group(&context.resources, picture)? else { continue };
            confine(context.pass, views[*index].pixels);
            let before: usize = views[..*index].iter().map(|view| view.surfaces.len()).sum();
            for (surface, place) in views[*index].surfaces.iter().zip(before..) {
                if parent == 0 && surface.refracts {
                    continue;
                }
                context.pass.set_bind_group(1, &group, &[SurfaceUniforms::offset(place)]);
                context.user.draw_shape(context.pass, surface.slot, &[Attribute::Position]);
            }
        }
        confine(context.pass, self.whole());
        Ok(())
    }

    fn whole(&self) -> [u32; 4] {
        let [width, height] = self.size;
        [0, 0, width, height]
    }
}

/// Restricts a pass to a part of its targets: x and y of the upper left corner, width and height.
fn confine(pass: &mut wgpu::RenderPass<'static>, [x, y, width, height]: [u32; 4]) {
    pass.set_scissor_rect(x, y, width, height);
}

/// The textures that a view in a mirror is drawn into.
struct Targets {
    /// Radiance, one sample per pixel.
    picture: TextureHandle,
    multisampled: Option<TextureHandle>,
    depth: TextureHandle,
}

impl Targets {
    fn new(graph: &mut FrameGraph<'_>, board: &Board, number: usize) -> Self {
        let [width, height] = board.size;
        let described = |format, samples| TextureDescriptor::new_2d(width, height, format).samples(samples);
        let (format, samples) = (board.linear_format, board.samples);
        let mut texture = |name: &str, format, samples| {
            graph.texture(format!("mirror {name} {number}"), described(format, samples))
        };
        Self {
            picture: texture("picture", format, 1),
            multisampled: (samples > 1).then(|| texture("samples", format, samples)),
            depth: texture("depth", DEPTH_FORMAT, samples),
        }
    }

    /// Begins a pass that draws over the existing content, or clears it.
    fn pass<'g, 'a>(
        &mut self,
        graph: &'g mut FrameGraph<'a>,
        name: String,
        load: LoadOp<wgpu::Color>,
    ) -> PassBuilder<'g, 'a, Raster, FrameScene<'a>> {
        let pass = graph.raster_pass(name);
        let pass = match &mut self.multisampled {
            Some(samples) => pass.color(samples, load).resolve(&mut self.picture),
            None => pass.color(&mut self.picture, load),
        };
        let depths = if matches!(load, LoadOp::Clear(_)) { LoadOp::Clear(0.0) } else { LoadOp::Load };
        pass.depth(&mut self.depth, depths)
    }
}

impl OnDevice {
    fn new(gpu: &Gpu) -> Self {
        let buffer = |binding, visibility, ty, dynamic| wgpu::BindGroupLayoutEntry {
            binding,
            visibility,
            ty: wgpu::BindingType::Buffer { ty, has_dynamic_offset: dynamic, min_binding_size: None },
            count: None,
        };
        let (uniform, storage) =
            (wgpu::BufferBindingType::Uniform, wgpu::BufferBindingType::Storage { read_only: true });
        let (vertex, fragment) = (wgpu::ShaderStages::VERTEX, wgpu::ShaderStages::FRAGMENT);
        let picture = wgpu::BindGroupLayoutEntry {
            binding: 1,
            visibility: fragment,
            ty: wgpu::BindingType::Texture {
                sample_type: wgpu::TextureSampleType::Float { filterable: false },
                view_dimension: wgpu::TextureViewDimension::D2,
                multisampled: false,
            },
            count: None,
        };
        let layout = |label, entries: &[wgpu::BindGroupLayoutEntry]| {
            let described = wgpu::BindGroupLayoutDescriptor { label: Some(label), entries };
            gpu.device.create_bind_group_layout(&described)
        };
        let of_view = [
            buffer(FrameBuffer::Frame.binding(), vertex | fragment, uniform, false),
            buffer(FrameBuffer::Objects.binding(), vertex, storage, false),
        ];
        let of_surface = [buffer(0, fragment, uniform, true), picture];
        Self {
            layouts: [layout("view of mirrors", &of_view), layout("mirror", &of_surface)],
            pipelines: HashMap::new(),
            surfaces: SurfaceUniforms::default(),
        }
    }

    /// Creates a pipeline, or starts to. Returns true if it exists, which is always the case with `wait`.
    fn pipeline(&mut self, gpu: &Gpu, key: Key, wait: bool) -> Result<bool, EffectError> {
        let pipeline = self.pipelines.entry(key).or_insert_with(|| {
            let (device, layouts) = (gpu.device.clone(), self.layouts.clone());
            let make = move || Ok(make(&device, &layouts, key)?);
            if wait { Pending::make(make) } else { Pending::begin(gpu, make) }
        });
        Ok(pipeline.is_there(wait)?)
    }

    fn view_group(&self, device: &wgpu::Device, [view, transforms]: [&wgpu::Buffer; 2]) -> wgpu::BindGroup {
        let entry = |buffer: FrameBuffer, bound: &'_ wgpu::Buffer| (buffer.binding(), bound.clone());
        let bound = [entry(FrameBuffer::Frame, view), entry(FrameBuffer::Objects, transforms)];
        let entries = bound.each_ref().map(|(binding, buffer)| wgpu::BindGroupEntry {
            binding: *binding,
            resource: buffer.as_entire_binding(),
        });
        device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("view of mirrors"),
            layout: &self.layouts[0],
            entries: &entries,
        })
    }

    fn picture_group(
        &self,
        resources: &PassResources<'_>,
        picture: &TextureHandle,
    ) -> Result<Option<wgpu::BindGroup>, RunError> {
        let Some(surface) = self.surfaces.binding::<MirrorData>() else { return Ok(None) };
        let entries = [
            wgpu::BindGroupEntry { binding: 0, resource: surface },
            wgpu::BindGroupEntry {
                binding: 1,
                resource: wgpu::BindingResource::TextureView(resources.view(picture)?),
            },
        ];
        let described =
            wgpu::BindGroupDescriptor { label: Some("mirror"), layout: &self.layouts[1], entries: &entries };
        Ok(Some(resources.device.create_bind_group(&described)))
    }
}

fn make(
    device: &wgpu::Device,
    layouts: &[wgpu::BindGroupLayout; 2],
    Key { format, samples, fog }: Key,
) -> Result<wgpu::RenderPipeline, RenderError> {
    let module = shader::compile(device, "mirror", &fog_flags(fog))?;
    let pipeline_layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some("mirrors"),
        bind_group_layouts: &layouts.each_ref().map(Some),
        immediate_size: 0,
    });
    let add = wgpu::BlendComponent {
        src_factor: wgpu::BlendFactor::One,
        dst_factor: wgpu::BlendFactor::One,
        operation: wgpu::BlendOperation::Add,
    };
    let positions =
        [wgpu::VertexAttribute { format: wgpu::VertexFormat::Float32x3, offset: 0, shader_location: 0 }];
    Ok(device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some("mirrors"),
        layout: Some(&pipeline_layout),
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some("vertex"),
            compilation_options: Default::default(),
            buffers: &[Some(wgpu::VertexBufferLayout {
                array_stride: size_of::<Vec3>() as u64,
                step_mode: wgpu::VertexStepMode::Vertex,
                attributes: &positions,
            })],
        },
        // The visible side was chosen together with the view, so nothing is culled. Hidden parts fail the
        // test for equal depth.
        primitive: wgpu::PrimitiveState::default(),
        depth_stencil: Some(wgpu::DepthStencilState {
            format: DEPTH_FORMAT,
            depth_write_enabled: Some(false),
            depth_compare: Some(wgpu::CompareFunction::Equal),
            stencil: Default::default(),
            bias: Default::default(),
        }),
        multisample: wgpu::MultisampleState { count: samples, ..Default::default() },
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: Some("fragment"),
            compilation_options: Default::default(),
            targets: &[Some(wgpu::ColorTargetState {
                format,
                blend: Some(wgpu::BlendState { color: add, alpha: add }),
                write_mask: wgpu::ColorWrites::ALL,
            })],
        }),
        multiview_mask: None,
        cache: None,
    }))
}
