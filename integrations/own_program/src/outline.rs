//! Outlines: a rim around chosen objects, seen through whatever stands before them. An effect over the finished picture.

use std::collections::HashMap;
use std::sync::atomic::{AtomicU64, Ordering};

use bevy_ecs::prelude::*;
use glam::Vec3;
use lumbre_graph::{LoadOp, wgpu};
use lumbre_render::effects::{Board, Effect, EffectWork, FrameGraph, Stage};
use lumbre_render::{EffectError, FrameOptions, FrameShape, Gpu, SceneFacts};

/// Draws a rim around an object.
#[derive(Component, Clone, Copy, Debug, PartialEq)]
pub struct Outlined {
    /// In the numbers of the screen, 0 to 1.
    pub color: Vec3,
}

/// The effect: `Renderer::builder().with(OutlineEffect::new(3.0))`. A World without an [`Outlined`] object does not call for it.
pub struct OutlineEffect {
    /// Width of the rim in pixels.
    width: f32,
    outlined: HashMap<Entity, Vec3>,
    device: Option<OnDevice>,
    pipelines_made: usize,
    /// Bytes, so far.
    uploaded: AtomicU64,
}

struct OnDevice {
    format: wgpu::TextureFormat,
    shape_layout: wgpu::BindGroupLayout,
    rim_layout: wgpu::BindGroupLayout,
    shape: wgpu::RenderPipeline,
    rim: wgpu::RenderPipeline,
    width: wgpu::Buffer,
    /// One record for each outlined object, a stride apart.
    records: wgpu::Buffer,
    capacity: u64,
}

/// A matrix and a colour.
const RECORD: u64 = 80;
/// What WebGPU promises of offsets into uniform buffers.
const STRIDE: u64 = 256;
const SHAPES: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;

impl OutlineEffect {
    /// Rims of this width in pixels, up to 16.
    pub fn new(width: f32) -> Self {
        Self {
            width: width.clamp(1.0, 16.0),
            outlined: HashMap::new(),
            device: None,
            pipelines_made: 0,
            uploaded: AtomicU64::new(0),
        }
    }
}

/// The colours of the objects that are to be outlined.
fn found(world: &mut World) -> HashMap<Entity, Vec3> {
    let mut query = world.query::<(Entity, &Outlined)>();
    query.iter(world).map(|(entity, outlined)| (entity, outlined.color)).collect()
}

impl Effect for OutlineEffect {
    fn name(&self) -> &'static str {
        "outline"
    }

    fn stage(&self) -> Stage {
        Stage::Picture
    }

    fn extract(&mut self, world: &mut World, _: &SceneFacts, _: &FrameOptions) -> bool {
        self.outlined = found(world);
        !self.outlined.is_empty()
    }

    fn is_unchanged(&mut self, world: &mut World) -> bool {
        found(world) == self.outlined
    }

    fn prepare(&mut self, gpu: &Gpu, frame: &FrameShape) -> Result<(), EffectError> {
        let (count, format) = (self.outlined.len() as u64, frame.target_format);
        if self.device.as_ref().is_none_or(|device| device.format != format || device.capacity < count) {
            self.device = Some(OnDevice::new(&gpu.device, format, count.next_power_of_two()));
            self.pipelines_made += 2;
        }
        if let Some(device) = &self.device {
            let width = self.width.to_le_bytes();
            gpu.queue.write_buffer(&device.width, 0, &width);
            *self.uploaded.get_mut() += width.len() as u64;
        }
        Ok(())
    }

    fn work(&self) -> EffectWork {
        EffectWork::new(self.uploaded.load(Ordering::Relaxed), self.pipelines_made)
    }

    fn draws_objects(&self) -> bool {
        true
    }

    fn declare<'a>(&'a self, graph: &mut FrameGraph<'a>, board: &mut Board) {
        let there = !self.outlined.is_empty();
        let mut shapes = board.texture(graph, "outlined shapes", SHAPES);
        graph
            .raster_pass("outlined shapes")
            .requires(there, "outlined object")
            .color(&mut shapes, LoadOp::Clear(wgpu::Color::TRANSPARENT))
            .run(move |context| {
                let Some(device) = &self.device else { return Ok(()) };
                let mut records = Vec::new();
                context.pass.set_pipeline(&device.shape);
                let group = device.shape_group(context.resources.device);
                for object in context.user.objects() {
                    let Some(color) = self.outlined.get(&object.entity) else { continue };
                    let offset = records.len();
                    records.resize(offset + STRIDE as usize, 0);
                    let numbers = object.clip_from_mesh.to_cols_array().into_iter().chain(color.to_array());
                    for (place, number) in records[offset..].chunks_exact_mut(4).zip(numbers) {
                        place.copy_from_slice(&number.to_le_bytes());
                    }
                    context.pass.set_bind_group(0, &group, &[offset as u32]);
                    object.draw(context.pass);
                }
                // Written before any pass of this frame runs.
                context.resources.queue.write_buffer(&device.records, 0, &records);
                self.uploaded.fetch_add(records.len() as u64, Ordering::Relaxed);
                Ok(())
            });
        graph
            .raster_pass("outline")
            .requires(there, "outlined object")
            .samples(&shapes)
            .color(&mut board.target, LoadOp::Load)
            .run(move |context| {
                let Some(device) = &self.device else { return Ok(()) };
                let group = device.rim_group(context.resources.device, context.resources.view(&shapes)?);
                context.pass.set_pipeline(&device.rim);
                context.pass.set_bind_group(0, &group, &[]);
                context.pass.draw(0..3, 0..1);
                Ok(())
            });
    }
}

impl OnDevice {
    fn new(device: &wgpu::Device, format: wgpu::TextureFormat, capacity: u64) -> Self {
        let uniform = |binding, visibility, has_dynamic_offset| wgpu::BindGroupLayoutEntry {
            binding,
            visibility,
            ty: wgpu::BindingType::Buffer {
                ty: wgpu::BufferBindingType::Uniform,
                has_dynamic_offset,
                min_binding_size: None,
            },
            count: None,
        };
        let texture = wgpu::BindGroupLayoutEntry {
            binding: 0,
            visibility: wgpu::ShaderStages::FRAGMENT,
            ty: wgpu::BindingType::Texture {
                sample_type: wgpu::TextureSampleType::Float { filterable: false },
                view_dimension: wgpu::TextureViewDimension::D2,
                multisampled: false,
            },
            count: None,
        };
        let layout = |entries: &[wgpu::BindGroupLayoutEntry]| {
            device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
                label: Some("outline"),
                entries,
            })
        };
        let shape_layout = layout(&[uniform(0, wgpu::ShaderStages::VERTEX_FRAGMENT, true)]);
        let rim_layout = layout(&[texture, uniform(1, wgpu::ShaderStages::FRAGMENT, false)]);
        let module = device.create_shader_module(wgpu::include_wgsl!("outline.wgsl"));
        let positions = wgpu::VertexBufferLayout {
            array_stride: 12,
            step_mode: wgpu::VertexStepMode::Vertex,
            attributes: &wgpu::vertex_attr_array![0 => Float32x3],
        };
        let make = |group: &wgpu::BindGroupLayout,
                    [vertex, fragment]: [&str; 2],
                    buffers: &[Option<wgpu::VertexBufferLayout<'_>>],
                    format: wgpu::TextureFormat| {
            let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
                label: Some("outline"),
                bind_group_layouts: &[Some(group)],
                immediate_size: 0,
            });
            device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
                label: Some("outline"),
                layout: Some(&layout),
                vertex: wgpu::VertexState {
                    module: &module,
                    entry_point: Some(vertex),
                    compilation_options: Default::default(),
                    buffers,
                },
                primitive: Default::default(),
                depth_stencil: None,
                multisample: Default::default(),
                fragment: Some(wgpu::FragmentState {
                    module: &module,
                    entry_point: Some(fragment),
                    compilation_options: Default::default(),
                    targets: &[Some(wgpu::ColorTargetState::from(format))],
                }),
                multiview_mask: None,
                cache: None,
            })
        };
        let positions = [Some(positions)];
        let shape = make(&shape_layout, ["shape_vertex", "shape"], &positions, SHAPES);
        let rim = make(&rim_layout, ["rim_vertex", "rim"], &[], format);
        let buffer = |size| {
            device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("outline"),
                size,
                usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            })
        };
        let (width, records) = (buffer(16), buffer(STRIDE * capacity));
        Self { format, shape_layout, rim_layout, shape, rim, width, records, capacity }
    }

    fn shape_group(&self, device: &wgpu::Device) -> wgpu::BindGroup {
        let record =
            wgpu::BufferBinding { buffer: &self.records, offset: 0, size: wgpu::BufferSize::new(RECORD) };
        device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("outlined shapes"),
            layout: &self.shape_layout,
            entries: &[wgpu::BindGroupEntry { binding: 0, resource: wgpu::BindingResource::Buffer(record) }],
        })
    }

    fn rim_group(&self, device: &wgpu::Device, shapes: &wgpu::TextureView) -> wgpu::BindGroup {
        device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("outline"),
            layout: &self.rim_layout,
            entries: &[
                wgpu::BindGroupEntry { binding: 0, resource: wgpu::BindingResource::TextureView(shapes) },
                wgpu::BindGroupEntry { binding: 1, resource: self.width.as_entire_binding() },
            ],
        })
    }
}
