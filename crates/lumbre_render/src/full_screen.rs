//! Pipelines that draw a triangle over the whole target, with the entry points `vertex` and `fragment` of a module.
//! Not what they draw: display, planes of shadow maps, pixels that compute shaders have lit, and probes each have a
//! shader of their own.

use crate::target::DEPTH_FORMAT;

/// Creates a pipeline without vertex buffers, depth or blending, for a target of one sample. Without a `layout`, the
/// shader's bindings give it.
pub(crate) fn pipeline(
    device: &wgpu::Device,
    label: &str,
    module: &wgpu::ShaderModule,
    layout: Option<&wgpu::PipelineLayout>,
    format: wgpu::TextureFormat,
) -> wgpu::RenderPipeline {
    make(device, label, module, layout, (format, None))
}

/// Like [`pipeline`], for a pass with a depth buffer, which it does not write. Depth is reversed: with a triangle behind
/// all surfaces, only pixels with a surface run the fragment shader.
pub(crate) fn pipeline_behind_surfaces(
    device: &wgpu::Device,
    label: &str,
    module: &wgpu::ShaderModule,
    layout: Option<&wgpu::PipelineLayout>,
    format: wgpu::TextureFormat,
) -> wgpu::RenderPipeline {
    let depth = wgpu::DepthStencilState {
        format: DEPTH_FORMAT,
        depth_write_enabled: Some(false),
        depth_compare: Some(wgpu::CompareFunction::LessEqual),
        stencil: Default::default(),
        bias: Default::default(),
    };
    make(device, label, module, layout, (format, Some(depth)))
}

fn make(
    device: &wgpu::Device,
    label: &str,
    module: &wgpu::ShaderModule,
    layout: Option<&wgpu::PipelineLayout>,
    (format, depth_stencil): (wgpu::TextureFormat, Option<wgpu::DepthStencilState>),
) -> wgpu::RenderPipeline {
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some(label),
        layout,
        vertex: wgpu::VertexState {
            module,
            entry_point: Some("vertex"),
            compilation_options: Default::default(),
            buffers: &[],
        },
        primitive: Default::default(),
        depth_stencil,
        multisample: Default::default(),
        fragment: Some(wgpu::FragmentState {
            module,
            entry_point: Some("fragment"),
            compilation_options: Default::default(),
            targets: &[Some(format.into())],
        }),
        multiview_mask: None,
        cache: None,
    })
}
