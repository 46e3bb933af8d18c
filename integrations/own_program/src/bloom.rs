//! Bloom: light that scatters within a lens, so that what is too bright to be shown glows over its surroundings. An effect between light and display.

use bevy_ecs::prelude::*;
use lumbre_graph::{LoadOp, TextureDescriptor, TextureHandle, wgpu};
use lumbre_render::effects::{Board, Effect, EffectWork, FrameGraph, Stage};
use lumbre_render::{EffectError, FrameOptions, FrameShape, Gpu, SceneFacts};

/// Makes a camera's picture glow.
#[derive(Component, Clone, Copy, Debug, PartialEq)]
pub struct Bloom {
    /// The part of the light that is scattered, 0 to 1.
    pub strength: f32,
    /// How often the frame is halved, 1 to 8: each time the glow becomes twice as wide.
    pub levels: u32,
}

impl Default for Bloom {
    fn default() -> Self {
        Self { strength: 0.15, levels: 5 }
    }
}

/// The effect: `Renderer::builder().with(BloomEffect::default())`. A World without a [`Bloom`] does not call for it.
#[derive(Default)]
pub struct BloomEffect {
    bloom: Option<Bloom>,
    device: Option<OnDevice>,
    /// So far.
    work: EffectWork,
}

struct OnDevice {
    format: wgpu::TextureFormat,
    layout: wgpu::BindGroupLayout,
    downsample: wgpu::RenderPipeline,
    upsample: wgpu::RenderPipeline,
    compose: wgpu::RenderPipeline,
    strength: wgpu::Buffer,
}

/// The bloom that the World asks for.
fn found(world: &mut World) -> Option<Bloom> {
    world.query::<&Bloom>().iter(world).copied().find(|bloom| bloom.strength > 0.0)
}

impl Effect for BloomEffect {
    fn name(&self) -> &'static str {
        "bloom"
    }

    fn stage(&self) -> Stage {
        Stage::Radiance
    }

    fn extract(&mut self, world: &mut World, _: &SceneFacts, _: &FrameOptions) -> bool {
        self.bloom = found(world);
        self.bloom.is_some()
    }

    fn is_unchanged(&mut self, world: &mut World) -> bool {
        found(world) == self.bloom
    }

    fn prepare(&mut self, gpu: &Gpu, frame: &FrameShape) -> Result<(), EffectError> {
        let format = frame.linear_format;
        if self.device.as_ref().is_none_or(|device| device.format != format) {
            self.device = Some(OnDevice::new(&gpu.device, format));
            self.work.pipelines_made += 3;
        }
        if let (Some(device), Some(bloom)) = (&self.device, self.bloom) {
            let strength = bloom.strength.clamp(0.0, 1.0).to_le_bytes();
            gpu.queue.write_buffer(&device.strength, 0, &strength);
            self.work.uploaded_bytes += strength.len() as u64;
        }
        Ok(())
    }

    fn work(&self) -> EffectWork {
        self.work
    }

    fn declare<'a>(&'a self, graph: &mut FrameGraph<'a>, board: &mut Board) {
        let levels = self.bloom.map_or(1, |bloom| bloom.levels.clamp(1, 8));
        let mut pyramid = vec![board.linear];
        for level in 1..=levels {
            let [width, height] = board.size.map(|side| (side >> level).max(1));
            let shape = TextureDescriptor::new_2d(width, height, board.linear_format);
            let mut coarser = graph.texture(format!("bloom {level}"), shape);
            let finer = pyramid[pyramid.len() - 1];
            let name = format!("bloom downsample {level}");
            self.pass(graph, name, [finer, finer], &mut coarser, |device| &device.downsample);
            pyramid.push(coarser);
        }
        let mut spread = pyramid[levels as usize];
        for level in (1..levels).rev() {
            let [width, height] = board.size.map(|side| (side >> level).max(1));
            let shape = TextureDescriptor::new_2d(width, height, board.linear_format);
            let mut wider = graph.texture(format!("bloom spread {level}"), shape);
            let finer = pyramid[level as usize];
            let name = format!("bloom upsample {level}");
            self.pass(graph, name, [finer, spread], &mut wider, |device| &device.upsample);
            spread = wider;
        }
        let mut composed = board.texture(graph, "bloomed frame", board.linear_format);
        self.pass(graph, "bloom".to_owned(), [board.linear, spread], &mut composed, |device| &device.compose);
        if self.bloom.is_some() {
            // Whoever comes later reads this one.
            board.linear = composed;
        }
    }
}

impl BloomEffect {
    fn pass<'a>(
        &'a self,
        graph: &mut FrameGraph<'a>,
        name: String,
        [fine, coarse]: [TextureHandle; 2],
        into: &mut TextureHandle,
        pipeline: impl Fn(&OnDevice) -> &wgpu::RenderPipeline + 'a,
    ) {
        let mut pass =
            graph.raster_pass(name).requires(self.bloom.is_some(), "camera with bloom").samples(&fine);
        if coarse != fine {
            pass = pass.samples(&coarse);
        }
        pass.color(into, LoadOp::Clear(wgpu::Color::BLACK)).run(move |context| {
            let Some(device) = &self.device else { return Ok(()) };
            let views = [context.resources.view(&fine)?, context.resources.view(&coarse)?];
            let group = device.group(context.resources.device, views);
            context.pass.set_pipeline(pipeline(device));
            context.pass.set_bind_group(0, &group, &[]);
            context.pass.draw(0..3, 0..1);
            Ok(())
        });
    }
}

impl OnDevice {
    fn new(device: &wgpu::Device, format: wgpu::TextureFormat) -> Self {
        let entry = |binding, ty| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: wgpu::ShaderStages::FRAGMENT,
            ty,
            count: None,
        };
        let texture = wgpu::BindingType::Texture {
            sample_type: wgpu::TextureSampleType::Float { filterable: false },
            view_dimension: wgpu::TextureViewDimension::D2,
            multisampled: false,
        };
        let uniform = wgpu::BindingType::Buffer {
            ty: wgpu::BufferBindingType::Uniform,
            has_dynamic_offset: false,
            min_binding_size: None,
        };
        let layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("bloom"),
            entries: &[entry(0, texture), entry(1, texture), entry(2, uniform)],
        });
        let shader = device.create_shader_module(wgpu::include_wgsl!("bloom.wgsl"));
        let pipelines = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some("bloom"),
            bind_group_layouts: &[Some(&layout)],
            immediate_size: 0,
        });
        let make = |fragment| {
            device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
                label: Some("bloom"),
                layout: Some(&pipelines),
                vertex: wgpu::VertexState {
                    module: &shader,
                    entry_point: Some("vertex"),
                    compilation_options: Default::default(),
                    buffers: &[],
                },
                primitive: Default::default(),
                depth_stencil: None,
                multisample: Default::default(),
                fragment: Some(wgpu::FragmentState {
                    module: &shader,
                    entry_point: Some(fragment),
                    compilation_options: Default::default(),
                    targets: &[Some(format.into())],
                }),
                multiview_mask: None,
                cache: None,
            })
        };
        let strength = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("bloom strength"),
            size: 16,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let [downsample, upsample, compose] = ["downsample", "upsample", "compose"].map(make);
        Self { format, layout, downsample, upsample, compose, strength }
    }

    fn group(&self, device: &wgpu::Device, [fine, coarse]: [&wgpu::TextureView; 2]) -> wgpu::BindGroup {
        let entry = |binding, resource| wgpu::BindGroupEntry { binding, resource };
        device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("bloom"),
            layout: &self.layout,
            entries: &[
                entry(0, wgpu::BindingResource::TextureView(fine)),
                entry(1, wgpu::BindingResource::TextureView(coarse)),
                entry(2, self.strength.as_entire_binding()),
            ],
        })
    }
}
