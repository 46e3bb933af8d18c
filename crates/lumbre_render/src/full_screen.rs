//! Pipelines that draw a triangle over the whole target, with the entry points `vertex` and `fragment` of a module.
//! Not what they draw: display, planes of shadow maps, pixels that compute shaders have lit, and probes each have a
//! shader of their own.

/// Creates a pipeline without vertex buffers or blending, for a target of one sample, and for passes with a depth buffer
/// if `depth_stencil` is given. Without a `layout`, the shader's bindings give it.
pub(crate) fn pipeline(
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
