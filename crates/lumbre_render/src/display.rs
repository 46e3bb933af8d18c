//! The display pass: from the linear frame to the numbers of the target. Not the lighting before it.

use std::collections::HashMap;

use wgpu::util::DeviceExt;

use crate::shader::{self, DisplayVariant};
use crate::{Display, Gpu, RenderError};

/// Pipelines and the uniform of the display pass.
#[derive(Debug)]
pub(crate) struct DisplayPass {
    layout: wgpu::BindGroupLayout,
    pipelines: HashMap<(DisplayVariant, wgpu::TextureFormat), wgpu::RenderPipeline>,
    uniform: wgpu::Buffer,
    exposure: f32,
}

impl DisplayPass {
    pub fn new(gpu: &Gpu) -> Self {
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
        let layout = gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("display"),
            entries: &[entry(0, texture), entry(1, uniform)],
        });
        let uniform = gpu.device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
            label: Some("exposure"),
            contents: bytemuck::bytes_of(&[1.0_f32; 4]),
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
        });
        Self { layout, pipelines: HashMap::new(), uniform, exposure: 1.0 }
    }

    /// Makes the pipeline for a target and writes the exposure if it changed; answers with the key for `draw`.
    pub fn prepare(
        &mut self,
        gpu: &Gpu,
        display: Display,
        format: wgpu::TextureFormat,
        exposure: f32,
    ) -> Result<(DisplayVariant, wgpu::TextureFormat), RenderError> {
        let encode = display == Display::Srgb && !format.is_srgb();
        let key = (DisplayVariant { display, encode }, format);
        if !self.pipelines.contains_key(&key) {
            let pipeline = self.make(gpu, key)?;
            self.pipelines.insert(key, pipeline);
        }
        if exposure != self.exposure {
            self.exposure = exposure;
            gpu.queue.write_buffer(&self.uniform, 0, bytemuck::bytes_of(&exposure));
        }
        Ok(key)
    }

    fn make(
        &self,
        gpu: &Gpu,
        (variant, format): (DisplayVariant, wgpu::TextureFormat),
    ) -> Result<wgpu::RenderPipeline, RenderError> {
        let module = shader::compile(&gpu.device, "display", &variant.flags())?;
        let layout = gpu.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some("display"),
            bind_group_layouts: &[Some(&self.layout)],
            immediate_size: 0,
        });
        Ok(gpu.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some("display"),
            layout: Some(&layout),
            vertex: wgpu::VertexState {
                module: &module,
                entry_point: Some("vertex"),
                compilation_options: Default::default(),
                buffers: &[],
            },
            primitive: Default::default(),
            depth_stencil: None,
            multisample: Default::default(),
            fragment: Some(wgpu::FragmentState {
                module: &module,
                entry_point: Some("fragment"),
                compilation_options: Default::default(),
                targets: &[Some(format.into())],
            }),
            multiview_mask: None,
            cache: None,
        }))
    }

    /// Draws `frame` through the pipeline that `prepare` made.
    pub fn draw(
        &self,
        device: &wgpu::Device,
        pass: &mut wgpu::RenderPass<'static>,
        key: &(DisplayVariant, wgpu::TextureFormat),
        frame: &wgpu::TextureView,
    ) {
        let Some(pipeline) = self.pipelines.get(key) else { return };
        let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("display"),
            layout: &self.layout,
            entries: &[
                wgpu::BindGroupEntry { binding: 0, resource: wgpu::BindingResource::TextureView(frame) },
                wgpu::BindGroupEntry { binding: 1, resource: self.uniform.as_entire_binding() },
            ],
        });
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, &group, &[]);
        pass.draw(0..3, 0..1);
    }
}
