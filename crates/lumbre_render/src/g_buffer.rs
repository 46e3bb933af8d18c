//! The G-buffer of deferred shading: which surfaces can be lit from it, with which variants, and how it is
//! bound. Its pass is `effects::g_buffer`; what a frame draws with it is decided in `draws`. Layout twin of
//! shaders/g_buffer.wesl.

use lumbre_optics::Shading;

use crate::Gpu;
use crate::extract::{LitPass, Window};
use crate::shader::{Feature, Variant};

/// What the G-buffer of a frame holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct GBufferContents {
    /// Lightmap coordinates, and the tint by which textures and vertex colours modulate light. Only frames
    /// with any of these have details.
    pub details: bool,
    /// Compute shaders light it, instead of fragments.
    pub lit_in_compute: bool,
}

/// Format of each of its textures. Two of them use all 32 bytes per sample that every device can write at
/// once.
pub(crate) const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba32Uint;
/// Format of the pixels that compute shaders light. It holds the values of every target exactly.
pub(crate) const LIT_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba32Float;
/// Pixels that a workgroup of the compute shader lights along each axis, as in shaders/deferred_lighting.wesl.
const WORKGROUP_SIDE: u32 = 8;
/// The largest class number; 0 means none.
pub(crate) const LAST_CLASS: u32 = 0xff;
/// The largest instance index that it can store.
pub(crate) const LAST_INSTANCE: u32 = (1 << 23) - 1;

/// The shader variants of a deferred surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct DeferredVariants {
    /// Draws the surface into the G-buffer.
    pub geometry: Variant,
    /// Lights the surface, together with all others that use the same variant.
    pub lighting: Variant,
}

/// The pass that lights the G-buffer in compute shaders.
pub(crate) const COMPUTE_PASS: &str = "deferred lighting";

/// What a dispatch of deferred lighting lights: the class with this number, from this pixel on. It is as long as
/// dynamic offsets of uniforms are apart on every device. Twin: `LitClass` in shaders/deferred_lighting.wesl.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub(crate) struct LitClass {
    corner: [u32; 2],
    number: u32,
    clears: u32,
    padding: [u32; 60],
}

/// A dispatch of deferred lighting: what it lights, and its workgroups along both axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct LitDispatch {
    pub class: LitClass,
    pub workgroups: [u32; 2],
}

impl LitDispatch {
    /// Creates the dispatch for a class: its number, and the pixels that its surfaces may cover in a frame of
    /// this size. The first dispatch covers the whole frame and clears what it does not light.
    pub fn new(number: u32, window: &Window, size: [u32; 2]) -> Self {
        let first = number == 1;
        let [x, y, width, height] = if first { [0, 0, size[0], size[1]] } else { window.pixels(size) };
        let class = LitClass { corner: [x, y], number, clears: u32::from(first), padding: [0; 60] };
        Self { class, workgroups: [width, height].map(|pixels| pixels.div_ceil(WORKGROUP_SIDE)) }
    }
}

/// Features that write the details of the G-buffer, or that are needed to compute them.
const DETAILED: [Feature; 5] =
    [Feature::Uv0, Feature::Uv1, Feature::BaseColorTexture, Feature::VertexColor, Feature::Lightmap];

/// Features that need what the G-buffer has no room for: material parameters that vary over the surface,
/// tangent frames, derivatives within the same surface, and coverage.
const FORWARD_ONLY: [Feature; 7] = [
    Feature::EmissiveTexture,
    Feature::MetallicRoughnessTexture,
    Feature::NormalTexture,
    Feature::OcclusionTexture,
    Feature::SpecularAntialiasing,
    Feature::Alpha,
    Feature::AlphaMask,
];

impl DeferredVariants {
    /// Returns the variants of a surface that a pass would draw with `forward`, if the frame has a G-buffer.
    /// `None` if the G-buffer has no room for what `forward` reads, or if no light is evaluated in fragments.
    pub fn of(forward: &Variant, pass: LitPass, contents: Option<GBufferContents>) -> Option<Self> {
        let contents = contents.filter(|_| matches!(pass, LitPass::Lightmap | LitPass::Forward))?;
        let has = |feature: &Feature| forward.has(*feature);
        let lit_per_fragment =
            has(&Feature::Lit) && has(&Feature::Lights) && forward.shading == Shading::Phong;
        let detailed = DETAILED.iter().any(has);
        if !lit_per_fragment || FORWARD_ONLY.iter().any(has) || (detailed && !contents.details) {
            return None;
        }
        let mut geometry = Variant::new(Shading::Phong, Default::default());
        for feature in DETAILED.into_iter().chain([Feature::Lit, Feature::Lights]) {
            geometry.set(feature, has(&feature));
        }
        geometry.set(Feature::GBuffer, true);
        geometry.set(Feature::GBufferDetails, contents.details);
        let tinted = has(&Feature::BaseColorTexture) || has(&Feature::VertexColor);
        let read = [Feature::Uv0, Feature::Uv1, Feature::BaseColorTexture];
        let mut lighting = forward.without(&read);
        lighting.set(Feature::VertexColor, tinted);
        lighting.set(Feature::Deferred, true);
        lighting.set(Feature::InCompute, contents.lit_in_compute);
        // Keeps variants that read details from standing in for this one in frames without them.
        lighting.set(Feature::GBufferDetails, contents.details);
        Some(Self { geometry, lighting })
    }
}

/// Binding of a texture of the G-buffer.
pub(crate) const TEXTURE_BINDING: wgpu::BindingType = wgpu::BindingType::Texture {
    sample_type: wgpu::TextureSampleType::Uint,
    view_dimension: wgpu::TextureViewDimension::D2,
    multisampled: false,
};

/// Creates the layout of group 1 of deferred lighting in fragments: the two textures. Without details, the
/// first texture is bound twice.
pub(crate) fn layout(gpu: &Gpu) -> wgpu::BindGroupLayout {
    let of = |binding| entry(wgpu::ShaderStages::FRAGMENT, binding, TEXTURE_BINDING);
    gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some("g-buffer"),
        entries: &[of(0), of(1)],
    })
}

/// Creates the layout of group 1 of deferred lighting in a compute shader: the two textures, the texture of lit
/// pixels, and a [`LitClass`] at a dynamic offset.
pub(crate) fn compute_layout(gpu: &Gpu) -> wgpu::BindGroupLayout {
    let of = |binding, ty| entry(wgpu::ShaderStages::COMPUTE, binding, ty);
    let lit = wgpu::BindingType::StorageTexture {
        access: wgpu::StorageTextureAccess::WriteOnly,
        format: LIT_FORMAT,
        view_dimension: wgpu::TextureViewDimension::D2,
    };
    let class = wgpu::BindingType::Buffer {
        ty: wgpu::BufferBindingType::Uniform,
        has_dynamic_offset: true,
        min_binding_size: wgpu::BufferSize::new(size_of::<LitClass>() as u64),
    };
    gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some("g-buffer in a compute shader"),
        entries: &[of(0, TEXTURE_BINDING), of(1, TEXTURE_BINDING), of(2, lit), of(3, class)],
    })
}

/// Returns an entry of a layout.
pub(crate) fn entry(
    visibility: wgpu::ShaderStages,
    binding: u32,
    ty: wgpu::BindingType,
) -> wgpu::BindGroupLayoutEntry {
    wgpu::BindGroupLayoutEntry { binding, visibility, ty, count: None }
}

/// Creates group 1 of deferred lighting in fragments.
pub(crate) fn group(
    device: &wgpu::Device,
    layout: &wgpu::BindGroupLayout,
    surfaces: &wgpu::TextureView,
    details: Option<&wgpu::TextureView>,
) -> wgpu::BindGroup {
    device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some("g-buffer"),
        layout,
        entries: &[texture(0, surfaces), texture(1, details.unwrap_or(surfaces))],
    })
}

/// Creates group 1 of deferred lighting in a compute shader. `classes` holds a [`LitClass`] at each dynamic
/// offset.
pub(crate) fn compute_group(
    device: &wgpu::Device,
    layout: &wgpu::BindGroupLayout,
    surfaces: &wgpu::TextureView,
    details: Option<&wgpu::TextureView>,
    (lit, classes): (&wgpu::TextureView, &wgpu::Buffer),
) -> wgpu::BindGroup {
    let class = wgpu::BufferBinding {
        buffer: classes,
        offset: 0,
        size: wgpu::BufferSize::new(size_of::<LitClass>() as u64),
    };
    device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some("g-buffer in a compute shader"),
        layout,
        entries: &[
            texture(0, surfaces),
            texture(1, details.unwrap_or(surfaces)),
            texture(2, lit),
            wgpu::BindGroupEntry { binding: 3, resource: wgpu::BindingResource::Buffer(class) },
        ],
    })
}

/// Returns an entry of a bind group.
pub(crate) fn texture(binding: u32, view: &wgpu::TextureView) -> wgpu::BindGroupEntry<'_> {
    wgpu::BindGroupEntry { binding, resource: wgpu::BindingResource::TextureView(view) }
}
