//! The finite-value probe: inspects every float texture after the pass that wrote it, and names the first pass and
//! texel with NaN or Inf. It does not inspect buffers, 3D textures, or formats that can hold neither value
//! (normalized, integer, depth, shared exponent).

use crate::access::Part;
use crate::resource::Label;
use crate::run::report::NonFinite;

/// Bytes from one result to the next: the largest alignment that a device may require of a storage buffer's offset.
pub(crate) const STRIDE: u64 = 256;

/// Bytes of one result, which is `Found` in finite_probe.wgsl.
const RESULT_BYTES: u64 = 32;

/// The value of `first` in a result if nothing was found.
const NONE: u32 = u32::MAX;

/// One inspection of one part of a texture after one pass.
#[derive(Clone, Debug)]
pub(crate) struct Probed {
    pub pass: Label,
    pub resource: Label,
    pub part: Part,
    /// Width in texels, which turns the index into a column and a row.
    pub width: u32,
}

/// Returns what the earliest inspection with a find has found.
pub(crate) fn first(probed: &[Probed], bytes: &[u8]) -> Option<NonFinite> {
    let word = |at: usize| {
        let chunk = bytes.get(at..).and_then(<[u8]>::first_chunk::<4>);
        chunk.map_or(NONE, |chunk| u32::from_le_bytes(*chunk))
    };
    probed.iter().enumerate().find_map(|(index, look)| {
        let at = index * STRIDE as usize;
        let texel = word(at);
        (texel != NONE).then(|| NonFinite {
            pass: look.pass.clone(),
            resource: look.resource.clone(),
            mip: look.part.mip,
            layer: look.part.layer,
            x: texel % look.width,
            y: texel / look.width,
            sample: word(at + 4),
            value: std::array::from_fn(|channel| f32::from_bits(word(at + 16 + 4 * channel))),
        })
    })
}

struct Pipelines {
    layout: wgpu::BindGroupLayout,
    find: wgpu::ComputePipeline,
    fetch: wgpu::ComputePipeline,
}

/// Records inspections of textures. Created when first switched on.
pub struct FiniteProbe {
    single: Pipelines,
    multisampled: Pipelines,
    results: wgpu::Buffer,
}

impl FiniteProbe {
    /// Creates the probe's pipelines, with room for `looks` results.
    pub(crate) fn new(device: &wgpu::Device, looks: usize) -> Self {
        Self {
            single: pipelines(device, "texture_2d<f32>", "1u", false),
            multisampled: pipelines(device, "texture_multisampled_2d<f32>", "textureNumSamples(image)", true),
            results: results(device, looks),
        }
    }

    /// Makes room for `looks` results and resets them, before the frame's first pass runs.
    pub(crate) fn begin(&mut self, device: &wgpu::Device, queue: &wgpu::Queue, looks: usize) {
        if self.results.size() < looks as u64 * STRIDE {
            self.results = results(device, looks);
        }
        queue.write_buffer(&self.results, 0, &vec![0xff; looks * STRIDE as usize]);
    }

    pub(crate) fn results(&self) -> &wgpu::Buffer {
        &self.results
    }

    /// Records inspection number `index`, of a view of one part with this size in texels.
    pub(crate) fn look(
        &self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        view: &wgpu::TextureView,
        size: [u32; 2],
        index: usize,
    ) {
        let multisampled = view.texture().sample_count() > 1;
        let Pipelines { layout, find, fetch } = if multisampled { &self.multisampled } else { &self.single };
        let found = wgpu::BufferBinding {
            buffer: &self.results,
            offset: index as u64 * STRIDE,
            size: wgpu::BufferSize::new(RESULT_BYTES),
        };
        let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("finite probe"),
            layout,
            entries: &[
                wgpu::BindGroupEntry { binding: 0, resource: wgpu::BindingResource::TextureView(view) },
                wgpu::BindGroupEntry { binding: 1, resource: wgpu::BindingResource::Buffer(found) },
            ],
        });
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some("finite probe"),
            timestamp_writes: None,
        });
        pass.set_bind_group(0, &group, &[]);
        pass.set_pipeline(find);
        pass.dispatch_workgroups(size[0].div_ceil(8), size[1].div_ceil(8), 1);
        pass.set_pipeline(fetch);
        pass.dispatch_workgroups(1, 1, 1);
    }
}

fn results(device: &wgpu::Device, looks: usize) -> wgpu::Buffer {
    device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("finite probe results"),
        size: looks.max(1) as u64 * STRIDE,
        usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    })
}

fn pipelines(device: &wgpu::Device, image: &str, samples: &str, multisampled: bool) -> Pipelines {
    let source = include_str!("finite_probe.wgsl").replace("IMAGE", image).replace("SAMPLES", samples);
    // This also replaces the two words in the header comment, which does no harm.
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some("finite probe"),
        source: wgpu::ShaderSource::Wgsl(source.into()),
    });
    let entry = |binding: u32, ty: wgpu::BindingType| wgpu::BindGroupLayoutEntry {
        binding,
        visibility: wgpu::ShaderStages::COMPUTE,
        ty,
        count: None,
    };
    let layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some("finite probe"),
        entries: &[
            entry(
                0,
                wgpu::BindingType::Texture {
                    sample_type: wgpu::TextureSampleType::Float { filterable: false },
                    view_dimension: wgpu::TextureViewDimension::D2,
                    multisampled,
                },
            ),
            entry(
                1,
                wgpu::BindingType::Buffer {
                    ty: wgpu::BufferBindingType::Storage { read_only: false },
                    has_dynamic_offset: false,
                    min_binding_size: wgpu::BufferSize::new(RESULT_BYTES),
                },
            ),
        ],
    });
    let pipeline_layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some("finite probe"),
        bind_group_layouts: &[Some(&layout)],
        immediate_size: 0,
    });
    let pipeline = |entry_point: &str| {
        device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some("finite probe"),
            layout: Some(&pipeline_layout),
            module: &module,
            entry_point: Some(entry_point),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            cache: None,
        })
    };
    Pipelines { find: pipeline("find"), fetch: pipeline("fetch"), layout }
}
