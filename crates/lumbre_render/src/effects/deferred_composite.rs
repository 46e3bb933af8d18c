//! Draws the pixels that compute shaders have lit from the G-buffer into the frame: a triangle behind all
//! surfaces, which leaves out pixels without a deferred surface. Not their lighting, which is in
//! shaders/deferred_lighting.wesl. Twin of the bindings: shaders/deferred_composite.wesl.

use std::collections::HashMap;

use crate::error::EffectError;
use crate::g_buffer;
use crate::pending::Pending;
use crate::target::DEPTH_FORMAT;
use crate::{Gpu, RenderError, full_screen, shader};

const NAME: &str = "deferred composite";

/// What draws lit pixels into frames, by the format of the frame.
#[derive(Debug, Default)]
pub(super) struct Composites {
    made: HashMap<wgpu::TextureFormat, Pending<Composite>>,
}

/// What draws lit pixels into frames of one format.
#[derive(Clone, Debug)]
pub(super) struct Composite {
    layout: wgpu::BindGroupLayout,
    pipeline: wgpu::RenderPipeline,
}

impl Composites {
    /// Returns the composite for a format, which is created if it does not exist.
    pub fn make(&mut self, gpu: &Gpu, format: wgpu::TextureFormat) -> Result<Composite, EffectError> {
        let pending = self.pending(gpu, format, true);
        pending.wait().cloned().map_err(|error| error.to_string().into())
    }

    /// Starts to create the composite for a format. Returns true if it exists.
    pub fn begin(&mut self, gpu: &Gpu, format: wgpu::TextureFormat) -> Result<bool, EffectError> {
        Ok(self.pending(gpu, format, false).is_there(false)?)
    }

    fn pending(&mut self, gpu: &Gpu, format: wgpu::TextureFormat, wait: bool) -> &Pending<Composite> {
        self.made.entry(format).or_insert_with(|| {
            let device = gpu.device.clone();
            let make = move || Ok(Composite::new(&device, format)?);
            if wait { Pending::make(make) } else { Pending::begin(gpu, make) }
        })
    }

    /// Returns the number of pipelines created so far.
    pub fn made(&self) -> usize {
        self.made.values().filter(|pending| matches!(pending.get(), Some(Ok(_)))).count()
    }
}

impl Composite {
    fn new(device: &wgpu::Device, format: wgpu::TextureFormat) -> Result<Self, RenderError> {
        let lit = wgpu::BindingType::Texture {
            sample_type: wgpu::TextureSampleType::Float { filterable: false },
            view_dimension: wgpu::TextureViewDimension::D2,
            multisampled: false,
        };
        let layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some(NAME),
            entries: &[g_buffer::entry(wgpu::ShaderStages::FRAGMENT, 0, lit)],
        });
        let module = shader::compile(device, "deferred_composite", &[])?;
        let pipeline_layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some(NAME),
            bind_group_layouts: &[Some(&layout)],
            immediate_size: 0,
        });
        // The triangle lies behind all surfaces, and depth is reversed: only pixels with a surface run the shader.
        let depth = wgpu::DepthStencilState {
            format: DEPTH_FORMAT,
            depth_write_enabled: Some(false),
            depth_compare: Some(wgpu::CompareFunction::LessEqual),
            stencil: Default::default(),
            bias: Default::default(),
        };
        let target = (format, Some(depth));
        let pipeline = full_screen::pipeline(device, NAME, &module, Some(&pipeline_layout), target);
        Ok(Self { layout, pipeline })
    }

    /// Draws the lit pixels, in a pass with a depth buffer. `parallel` says whether the lines of sight are.
    pub fn draw(
        &self,
        device: &wgpu::Device,
        pass: &mut wgpu::RenderPass<'static>,
        lit_pixels: &wgpu::TextureView,
        parallel: bool,
    ) {
        let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some(NAME),
            layout: &self.layout,
            entries: &[g_buffer::texture(0, lit_pixels)],
        });
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &group, &[]);
        let parallel = u32::from(parallel);
        pass.draw(0..3, parallel..parallel + 1);
    }
}
