//! Render pipelines of the forward shader's variants, made when a draw first asks for one. Which draw asks for which: `draws`.

use std::collections::HashMap;
use std::collections::hash_map::Entry;

use lumbre_optics::Shading;

use crate::mesh_buffers::Attribute;
use crate::shader::{self, Feature, Variant};
use crate::shadows;
use crate::target::DEPTH_FORMAT;
use crate::texture_sets::TextureSets;
use crate::{Gpu, RenderError};

/// Everything that a pipeline is made from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) struct PipelineKey {
    pub variant: Variant,
    pub format: wgpu::TextureFormat,
    pub samples: u32,
    /// The transform turns counter-clockwise triangles clockwise.
    pub mirrored: bool,
    pub double_sided: bool,
    pub blend: bool,
    /// The material textures that are bound: the layout of their group. An unlit variant does not read all of them.
    pub texture_mask: u8,
}

/// A pipeline and the attributes that it reads, in the order of its vertex buffers.
#[derive(Debug)]
pub(crate) struct Pipeline {
    pub pipeline: wgpu::RenderPipeline,
    pub attributes: Vec<Attribute>,
    /// Whether it draws three vertices per triangle, without indices.
    pub flat: bool,
}

/// All pipelines made so far.
#[derive(Debug)]
pub(crate) struct Pipelines {
    frame_layout: wgpu::BindGroupLayout,
    clustered_layout: wgpu::BindGroupLayout,
    shadow_layout: wgpu::BindGroupLayout,
    modules: HashMap<Variant, wgpu::ShaderModule>,
    pipelines: HashMap<PipelineKey, Pipeline>,
}

impl Pipelines {
    pub fn new(gpu: &Gpu) -> Self {
        let [frame_layout, clustered_layout] = [false, true].map(|clustered| frame_layout(gpu, clustered));
        let shadow_layout = shadows::receiver_layout(gpu);
        Self {
            frame_layout,
            clustered_layout,
            shadow_layout,
            modules: HashMap::new(),
            pipelines: HashMap::new(),
        }
    }

    /// The layout of group 0, of variants that read clusters' lists or of those that do not.
    pub fn frame_layout(&self, clustered: bool) -> &wgpu::BindGroupLayout {
        if clustered { &self.clustered_layout } else { &self.frame_layout }
    }

    /// The layout of group 3, of variants that read shadow maps.
    pub fn shadow_layout(&self) -> &wgpu::BindGroupLayout {
        &self.shadow_layout
    }

    /// Number of shader variants compiled so far.
    pub fn variants(&self) -> usize {
        self.modules.len()
    }

    /// Makes the pipeline of a key unless it is there.
    pub fn prepare(
        &mut self,
        gpu: &Gpu,
        sets: &mut TextureSets,
        key: PipelineKey,
    ) -> Result<(), RenderError> {
        if self.pipelines.contains_key(&key) {
            return Ok(());
        }
        let module = match self.modules.entry(key.variant) {
            Entry::Occupied(known) => known.into_mut(),
            Entry::Vacant(new) => new.insert(shader::compile(&gpu.device, "forward", &key.variant.flags())?),
        };
        let textures = sets.layout(gpu, key.texture_mask);
        let lightmap = key.variant.has(Feature::Lightmap).then(|| sets.lightmap_layout(gpu));
        let frame = match key.variant.has(Feature::Clusters) {
            true => &self.clustered_layout,
            false => &self.frame_layout,
        };
        let shadows = key.variant.has(Feature::Shadows).then_some(&self.shadow_layout);
        let groups = [Some(frame), textures.as_ref(), lightmap.as_ref(), shadows];
        let used = groups.iter().rposition(Option::is_some).map_or(0, |last| last + 1);
        let pipeline = make(gpu, module, &groups[..used], key)?;
        self.pipelines.insert(key, pipeline);
        Ok(())
    }

    /// A pipeline that `prepare` made.
    pub fn get(&self, key: &PipelineKey) -> Option<&Pipeline> {
        self.pipelines.get(key)
    }
}

/// The attributes that a variant reads, by shader location.
pub(crate) fn attributes(variant: &Variant) -> Vec<Attribute> {
    let lit = variant.has(Feature::Lit);
    Attribute::ALL
        .into_iter()
        .filter(|attribute| match attribute {
            Attribute::Position => true,
            Attribute::Normal => lit,
            Attribute::Uv0 => variant.has(Feature::Uv0),
            Attribute::Uv1 => variant.has(Feature::Uv1),
            Attribute::Color => variant.has(Feature::VertexColor),
            Attribute::Centroid => lit && variant.shading == Shading::Flat,
            Attribute::Tangent => variant.has(Feature::NormalTexture),
        })
        .collect()
}

/// Whether a variant draws three vertices per triangle: flat shading, and lit at all.
pub(crate) fn is_flat(variant: &Variant) -> bool {
    variant.has(Feature::Lit) && variant.shading == Shading::Flat
}

fn frame_layout(gpu: &Gpu, clustered: bool) -> wgpu::BindGroupLayout {
    let entry = |visibility, binding, ty| wgpu::BindGroupLayoutEntry {
        binding,
        visibility,
        ty: wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None },
        count: None,
    };
    let (storage, uniform) =
        (wgpu::BufferBindingType::Storage { read_only: true }, wgpu::BufferBindingType::Uniform);
    let both = wgpu::ShaderStages::VERTEX_FRAGMENT;
    let mut entries = vec![entry(both, 0, uniform)];
    entries.extend((1..=5).map(|binding| entry(both, binding, storage)));
    if clustered {
        let fragment = wgpu::ShaderStages::FRAGMENT;
        entries.extend(
            [(6, uniform), (7, storage), (8, uniform), (9, storage)]
                .map(|(binding, ty)| entry(fragment, binding, ty)),
        );
    }
    gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some(if clustered { "frame with clusters" } else { "frame" }),
        entries: &entries,
    })
}

fn make(
    gpu: &Gpu,
    module: &wgpu::ShaderModule,
    groups: &[Option<&wgpu::BindGroupLayout>],
    key: PipelineKey,
) -> Result<Pipeline, RenderError> {
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
    let label = key.variant.to_string();
    let scope = gpu.device.push_error_scope(wgpu::ErrorFilter::Validation);
    let layout = gpu.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some("forward"),
        bind_group_layouts: groups,
        immediate_size: 0,
    });
    let pipeline = gpu.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some(&label),
        layout: Some(&layout),
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
            depth_write_enabled: Some(!key.blend),
            // Reversed-Z: nearer is greater. Equal passes: of coplanar faces the one drawn last is seen.
            depth_compare: Some(wgpu::CompareFunction::GreaterEqual),
            stencil: Default::default(),
            bias: Default::default(),
        }),
        multisample: wgpu::MultisampleState { count: key.samples, ..Default::default() },
        fragment: Some(wgpu::FragmentState {
            module,
            entry_point: Some("fragment"),
            compilation_options: Default::default(),
            targets: &[Some(wgpu::ColorTargetState {
                format: key.format,
                blend: key.blend.then_some(wgpu::BlendState::ALPHA_BLENDING),
                write_mask: wgpu::ColorWrites::ALL,
            })],
        }),
        multiview_mask: None,
        cache: None,
    });
    match pollster::block_on(scope.pop()) {
        None => Ok(Pipeline { pipeline, attributes, flat: is_flat(&key.variant) }),
        Some(error) => Err(RenderError::Shader { variant: label, message: error.to_string() }),
    }
}
