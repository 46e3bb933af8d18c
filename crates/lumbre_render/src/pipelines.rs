//! Pipelines for drawing and lighting surfaces, created when a draw first needs them, either at once
//! or on the device's worker thread. Which draw needs which pipeline is decided in `draws`.

use std::cmp::Reverse;
use std::collections::HashMap;
use std::sync::{Arc, Mutex};

use lumbre_optics::Shading;

use crate::frame_bindings::FrameBindings;
use crate::g_buffer;
use crate::irradiance_volumes;
use crate::mesh_buffers::Attribute;
use crate::pending::Pending;
use crate::shader::{self, Feature, TableAccess, Variant};
use crate::shadows;
use crate::shared_records::can_share_records;
use crate::target::DEPTH_FORMAT;
use crate::texture_sets::TextureSets;
use crate::{Gpu, RenderError};

/// Everything that a pipeline is created from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) struct PipelineKey {
    pub variant: Variant,
    pub format: wgpu::TextureFormat,
    pub samples: u32,
    /// The transform turns counter-clockwise triangles into clockwise ones.
    pub mirrored: bool,
    pub double_sided: bool,
    pub blend: bool,
    /// The bound material textures, which determine the layout of their group. An unlit variant does not read
    /// all of them.
    pub texture_mask: u8,
}

/// A pipeline and the attributes that it reads, in the order of its vertex buffers.
#[derive(Debug)]
pub(crate) struct Pipeline {
    pub pipeline: DevicePipeline,
    pub attributes: Vec<Attribute>,
    /// Whether it draws three vertices per triangle without indices.
    pub flat: bool,
}

/// What a pipeline is on the device: all of them draw but those that light the G-buffer in a compute shader.
#[derive(Debug)]
pub(crate) enum DevicePipeline {
    Render(wgpu::RenderPipeline),
    Compute(wgpu::ComputePipeline),
}

impl Pipeline {
    pub fn render(&self) -> Option<&wgpu::RenderPipeline> {
        match &self.pipeline {
            DevicePipeline::Render(pipeline) => Some(pipeline),
            DevicePipeline::Compute(_) => None,
        }
    }

    pub fn compute(&self) -> Option<&wgpu::ComputePipeline> {
        match &self.pipeline {
            DevicePipeline::Render(_) => None,
            DevicePipeline::Compute(pipeline) => Some(pipeline),
        }
    }
}

/// All pipelines made so far.
#[derive(Debug)]
pub(crate) struct Pipelines {
    frame_layouts: HashMap<FrameBindings, wgpu::BindGroupLayout>,
    shadow_layout: wgpu::BindGroupLayout,
    volume_layout: wgpu::BindGroupLayout,
    g_buffer_layout: wgpu::BindGroupLayout,
    g_buffer_compute_layout: wgpu::BindGroupLayout,
    tables: TableAccess,
    modules: Modules,
    pipelines: HashMap<PipelineKey, Pending<Pipeline>>,
}

/// A job that runs on the same thread after a pipeline was created.
pub(crate) type Afterwards = Box<dyn FnOnce() + Send>;

/// The shader modules compiled so far.
type Modules = Arc<Mutex<HashMap<Variant, wgpu::ShaderModule>>>;

impl Pipelines {
    pub fn new(gpu: &Gpu) -> Self {
        Self {
            frame_layouts: HashMap::new(),
            shadow_layout: shadows::receiver_layout(gpu),
            volume_layout: irradiance_volumes::layout(gpu),
            g_buffer_layout: g_buffer::layout(gpu),
            g_buffer_compute_layout: g_buffer::compute_layout(gpu),
            tables: TableAccess {
                in_textures: gpu.reads_tables_from_textures(),
                shared: can_share_records(gpu),
            },
            modules: Modules::default(),
            pipelines: HashMap::new(),
        }
    }

    /// Returns the layout of group 0 with these buffers.
    pub fn frame_layout(&mut self, gpu: &Gpu, bindings: FrameBindings) -> &wgpu::BindGroupLayout {
        self.frame_layouts.entry(bindings).or_insert_with(|| bindings.layout(gpu))
    }

    /// Returns the layout of group 3, for variants that read shadow maps.
    pub fn shadow_layout(&self) -> &wgpu::BindGroupLayout {
        &self.shadow_layout
    }

    /// Returns the layout of group 2, for variants that read an irradiance volume.
    pub fn volume_layout(&self) -> &wgpu::BindGroupLayout {
        &self.volume_layout
    }

    /// Returns the layout of group 1, for variants that light from the G-buffer in fragments.
    pub fn g_buffer_layout(&self) -> &wgpu::BindGroupLayout {
        &self.g_buffer_layout
    }

    /// Returns the layout of group 1, for variants that light from the G-buffer in a compute shader.
    pub fn g_buffer_compute_layout(&self) -> &wgpu::BindGroupLayout {
        &self.g_buffer_compute_layout
    }

    /// Returns the number of shader variants compiled so far.
    pub fn variants(&self) -> usize {
        self.modules.lock().map_or(0, |modules| modules.len())
    }

    /// Returns the number of pipelines created so far.
    pub fn made(&self) -> usize {
        self.pipelines.values().filter(|pipeline| matches!(pipeline.get(), Some(Ok(_)))).count()
    }

    /// Starts to create the pipeline of a key unless it exists or is being created. Returns true if it
    /// exists, which is always the case with `wait`. Without `wait`, the job that `afterwards` returns runs
    /// before the pipeline counts as existing.
    ///
    /// # Errors
    /// [`RenderError::Shader`], which is a bug in this crate.
    pub fn prepare(
        &mut self,
        gpu: &Gpu,
        sets: &mut TextureSets,
        key: PipelineKey,
        wait: bool,
        afterwards: impl FnOnce() -> Option<Afterwards>,
    ) -> Result<bool, RenderError> {
        if !self.pipelines.contains_key(&key) {
            let textures = match key.variant.has(Feature::Deferred) {
                true if key.variant.has(Feature::InCompute) => Some(self.g_buffer_compute_layout.clone()),
                true => Some(self.g_buffer_layout.clone()),
                false => sets.layout(gpu, key.texture_mask),
            };
            let baked_light = match key.variant.samples_lightmap() {
                true => Some(sets.lightmap_layout(gpu)),
                false => key.variant.has(Feature::IrradianceVolume).then(|| self.volume_layout.clone()),
            };
            let frame = self.frame_layout(gpu, FrameBindings::of(&key.variant)).clone();
            let shadows = key.variant.has(Feature::Shadows).then(|| self.shadow_layout.clone());
            let groups = [Some(frame), textures, baked_light, shadows];
            let (device, modules) = (gpu.device.clone(), Arc::clone(&self.modules));
            let tables = self.tables;
            let afterwards = if wait { None } else { afterwards() };
            let make = move || match make(&device, &modules, &groups, key, tables) {
                Ok(pipeline) => {
                    afterwards.into_iter().for_each(|afterwards| afterwards());
                    Ok(pipeline)
                }
                Err(RenderError::Shader { message, .. }) => Err(message.into()),
                Err(other) => Err(other.into()),
            };
            let pipeline = if wait { Pending::make(make) } else { Pending::begin(gpu, make) };
            self.pipelines.insert(key, pipeline);
        }
        let Some(pipeline) = self.pipelines.get(&key) else { return Ok(false) };
        pipeline
            .is_there(wait)
            .map_err(|message| RenderError::Shader { variant: key.variant.to_string(), message })
    }

    /// Returns a pipeline that `prepare` created.
    pub fn get(&self, key: &PipelineKey) -> Option<&Pipeline> {
        self.pipelines.get(key)?.get()?.ok()
    }

    /// Returns the existing pipeline that best stands in for one that is still being created: among those for
    /// the same frame and light, the one that shows most of the material.
    pub fn nearest(&self, wanted: &PipelineKey) -> Option<PipelineKey> {
        let fits = |key: &&PipelineKey| {
            let plain = PipelineKey { variant: wanted.variant, texture_mask: wanted.texture_mask, ..**key };
            plain == *wanted
                && (key.texture_mask == wanted.texture_mask || key.texture_mask == 0)
                && key.variant.is_lit_as(&wanted.variant)
        };
        let there = self.pipelines.keys().filter(|key| self.get(key).is_some());
        // The differing bits are part of the order, so ties are always broken the same way.
        there.filter(fits).copied().max_by_key(|key| {
            (key.texture_mask == wanted.texture_mask, Reverse(key.variant.differences(&wanted.variant)))
        })
    }
}

/// Returns the attributes that a variant reads, by shader location.
pub(crate) fn attributes(variant: &Variant) -> Vec<Attribute> {
    let lit = variant.has(Feature::Lit);
    Attribute::ALL
        .into_iter()
        .filter(|attribute| match attribute {
            _ if variant.has(Feature::Deferred) => false,
            Attribute::Position => true,
            Attribute::Normal => {
                let per_fragment = variant.has(Feature::Lights) || variant.has(Feature::IrradianceVolume);
                lit && (per_fragment || variant.shading != Shading::Phong)
            }
            Attribute::Uv0 => variant.has(Feature::Uv0),
            Attribute::Uv1 => variant.has(Feature::Uv1),
            Attribute::Color => variant.has(Feature::VertexColor),
            Attribute::Centroid => lit && variant.shading == Shading::Flat,
            Attribute::Tangent => variant.has(Feature::NormalTexture),
        })
        .collect()
}

/// Returns true if a variant draws three vertices per triangle: it is lit, with flat shading.
pub(crate) fn is_flat(variant: &Variant) -> bool {
    variant.has(Feature::Lit) && variant.shading == Shading::Flat
}

fn make(
    device: &wgpu::Device,
    modules: &Modules,
    groups: &[Option<wgpu::BindGroupLayout>; 4],
    key: PipelineKey,
    tables: TableAccess,
) -> Result<Pipeline, RenderError> {
    let module = &module(device, modules, key.variant, tables)?;
    let groups = groups.each_ref().map(Option::as_ref);
    let used = groups.iter().rposition(Option::is_some).map_or(0, |last| last + 1);
    let label = key.variant.to_string();
    let scope = device.push_error_scope(wgpu::ErrorFilter::Validation);
    let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some(key.variant.module()),
        bind_group_layouts: &groups[..used],
        immediate_size: 0,
    });
    let pipeline = match key.variant.has(Feature::InCompute) {
        true => DevicePipeline::Compute(device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some(&label),
            layout: Some(&layout),
            module,
            entry_point: Some("light"),
            compilation_options: Default::default(),
            cache: None,
        })),
        false => DevicePipeline::Render(render_pipeline(device, module, &layout, &key, &label)),
    };
    match pollster::block_on(scope.pop()) {
        None => {
            let (attributes, flat) = (attributes(&key.variant), is_flat(&key.variant));
            Ok(Pipeline { pipeline, attributes, flat })
        }
        Some(error) => Err(RenderError::Shader { variant: label, message: error.to_string() }),
    }
}

fn render_pipeline(
    device: &wgpu::Device,
    module: &wgpu::ShaderModule,
    layout: &wgpu::PipelineLayout,
    key: &PipelineKey,
    label: &str,
) -> wgpu::RenderPipeline {
    let attributes = attributes(&key.variant);
    let formats: Vec<[wgpu::VertexAttribute; 1]> = attributes
        .iter()
        .map(|attribute| {
            let shader_location = *attribute as u32;
            [wgpu::VertexAttribute { format: attribute.format(), offset: 0, shader_location }]
        })
        .collect();
    let buffers: Vec<_> = formats
        .iter()
        .map(|attributes| {
            Some(wgpu::VertexBufferLayout {
                array_stride: attributes[0].format.size(),
                step_mode: wgpu::VertexStepMode::Vertex,
                attributes,
            })
        })
        .collect();
    let fullscreen = key.variant.has(Feature::Deferred);
    let target = Some(wgpu::ColorTargetState {
        format: key.format,
        blend: key.blend.then_some(wgpu::BlendState::ALPHA_BLENDING),
        write_mask: wgpu::ColorWrites::ALL,
    });
    let targets = vec![target; key.variant.targets()];
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some(label),
        layout: Some(layout),
        vertex: wgpu::VertexState {
            module,
            entry_point: Some("vertex"),
            compilation_options: Default::default(),
            buffers: &buffers,
        },
        primitive: wgpu::PrimitiveState {
            front_face: if key.mirrored { wgpu::FrontFace::Cw } else { wgpu::FrontFace::Ccw },
            cull_mode: (!key.double_sided).then_some(wgpu::Face::Back),
            ..Default::default()
        },
        depth_stencil: Some(wgpu::DepthStencilState {
            format: DEPTH_FORMAT,
            depth_write_enabled: Some(!key.blend && !fullscreen),
            // Reversed-Z: nearer is greater. Equal depth passes, so of coplanar faces the last one drawn is
            // visible.
            depth_compare: Some(match fullscreen {
                // The full-screen triangle lies behind all surfaces and in front of the cleared depth, so
                // pixels without a surface run no fragment shader.
                true => wgpu::CompareFunction::LessEqual,
                false => wgpu::CompareFunction::GreaterEqual,
            }),
            stencil: Default::default(),
            bias: Default::default(),
        }),
        multisample: wgpu::MultisampleState { count: key.samples, ..Default::default() },
        fragment: Some(wgpu::FragmentState {
            module,
            entry_point: Some("fragment"),
            compilation_options: Default::default(),
            targets: &targets,
        }),
        multiview_mask: None,
        cache: None,
    })
}

/// Returns the shader module of a variant, compiling it if needed.
fn module(
    device: &wgpu::Device,
    modules: &Modules,
    variant: Variant,
    tables: TableAccess,
) -> Result<wgpu::ShaderModule, RenderError> {
    let known = modules.lock().ok().and_then(|modules| modules.get(&variant).cloned());
    if let Some(known) = known {
        return Ok(known);
    }
    let module = shader::compile(device, variant.module(), &variant.flags(tables))?;
    if let Ok(mut modules) = modules.lock() {
        modules.insert(variant, module.clone());
    }
    Ok(module)
}
