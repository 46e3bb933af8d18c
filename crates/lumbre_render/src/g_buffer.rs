//! The G-buffer of deferred shading: which surfaces can be lit from it, with which variants, and how it is
//! bound. Its pass is `effects::g_buffer`; what a frame draws with it is decided in `draws`. Layout twin of
//! shaders/g_buffer.wesl.

use lumbre_optics::Shading;

use crate::Gpu;
use crate::extract::LitPass;
use crate::shader::{Feature, Variant};

/// What the G-buffer of a frame holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct GBufferContents {
    /// Lightmap coordinates, and the tint by which textures and vertex colours modulate light. Only frames
    /// with any of these have details.
    pub details: bool,
}

/// Format of each of its textures. Two of them use all 32 bytes per sample that every device can write at
/// once.
pub(crate) const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba32Uint;
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
        // Keeps variants that read details from standing in for this one in frames without them.
        lighting.set(Feature::GBufferDetails, contents.details);
        Some(Self { geometry, lighting })
    }
}

/// Creates the layout of group 1 of deferred lighting: the two textures. Without details, the first texture
/// is bound twice.
pub(crate) fn layout(gpu: &Gpu) -> wgpu::BindGroupLayout {
    let entry = |binding| wgpu::BindGroupLayoutEntry {
        binding,
        visibility: wgpu::ShaderStages::FRAGMENT,
        ty: wgpu::BindingType::Texture {
            sample_type: wgpu::TextureSampleType::Uint,
            view_dimension: wgpu::TextureViewDimension::D2,
            multisampled: false,
        },
        count: None,
    };
    gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some("g-buffer"),
        entries: &[entry(0), entry(1)],
    })
}

/// Creates group 1 of deferred lighting.
pub(crate) fn group(
    device: &wgpu::Device,
    layout: &wgpu::BindGroupLayout,
    surfaces: &wgpu::TextureView,
    details: Option<&wgpu::TextureView>,
) -> wgpu::BindGroup {
    let entry =
        |binding, view| wgpu::BindGroupEntry { binding, resource: wgpu::BindingResource::TextureView(view) };
    device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some("g-buffer"),
        layout,
        entries: &[entry(0, surfaces), entry(1, details.unwrap_or(surfaces))],
    })
}
