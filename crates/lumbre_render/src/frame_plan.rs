//! What is decided about a frame before its graph is declared: formats, samples, and how radiance is
//! converted to the target's values.

use crate::extract::{MirrorSurface, RefractorSurface};
use crate::facts::SceneFacts;
use crate::statistics::Uploads;
use crate::warm_up::WarmUps;
use crate::{Display, FrameOptions, FrameTarget, Gpu, Viewport};

/// How radiance is converted to the target's values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Ending {
    /// The lit shaders write radiance directly into the target.
    Direct,
    /// The lit shaders write the target's final values; there is no display pass.
    Folded,
    /// A separate pass converts the linear frame.
    DisplayPass,
}

/// The plan of a frame: formats, samples, and how it ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct FramePlan {
    /// Format of the linear frame.
    pub linear_format: wgpu::TextureFormat,
    /// Format that lit colours are drawn into.
    pub lit_format: wgpu::TextureFormat,
    pub samples: u32,
    pub ending: Ending,
}

impl FramePlan {
    /// Plans a frame for an eight-bit target. `radiance` is true if something needs the linear frame.
    pub fn new(
        facts: &SceneFacts,
        options: &FrameOptions,
        target: wgpu::TextureFormat,
        radiance: bool,
    ) -> Self {
        let samples = facts.samples;
        let linear_format = wgpu::TextureFormat::Rgba16Float;
        // Blending or averaging encoded colours would be wrong, and an eight-bit target hides the values that
        // the probe looks for.
        let folded = !radiance && facts.transparent == 0 && samples == 1 && !options.probe;
        match folded {
            true => Self { linear_format, lit_format: target, samples, ending: Ending::Folded },
            false => Self { linear_format, lit_format: linear_format, samples, ending: Ending::DisplayPass },
        }
    }

    /// Like [`new`](Self::new), also considering what the device supports.
    pub fn for_device(
        facts: &SceneFacts,
        options: &FrameOptions,
        radiance: bool,
        (gpu, target, exposure): (&Gpu, &FrameTarget, f32),
    ) -> Self {
        // Without a display pass, the depth buffer would have to be as large as the whole texture.
        let radiance = radiance || target.viewport.is_some();
        let mut plan = Self::new(facts, options, target.format, radiance);
        let wide = wgpu::TextureFormat::Rgba32Float;
        let features = gpu.device.features();
        // Without these features WebGPU guarantees neither blending nor multisampling of 32-bit floats.
        let flags = gpu.adapter.get_texture_format_features(wide).flags;
        let resolves = features.contains(wgpu::Features::TEXTURE_ADAPTER_SPECIFIC_FORMAT_FEATURES)
            && flags.sample_count_supported(plan.samples)
            && flags.contains(wgpu::TextureFormatFeatureFlags::MULTISAMPLE_RESOLVE);
        let blends = features.contains(wgpu::Features::FLOAT32_BLENDABLE);
        let blended = facts.transparent > 0 || facts.refractive > 0 || facts.calls_for_mirrors(options);
        let wide_works = (!blended || blends) && (plan.samples == 1 || resolves);
        if wide_works && (options.full_precision || target.format == wide) {
            plan.linear_format = wide;
        }
        let linear = options.display == Display::Linear && exposure == 1.0;
        if wide_works && target.format == wide && linear && !radiance {
            plan.ending = Ending::Direct;
            plan.lit_format = wide;
        } else if plan.ending == Ending::DisplayPass {
            plan.lit_format = plan.linear_format;
        }
        plan
    }

    /// Returns what effects need to know about the frame.
    pub fn shape(&self, target: &FrameTarget, display: Display, exposure: f32) -> FrameShape {
        let (display, exposure) = match self.ending {
            Ending::Direct => (Display::Linear, 1.0),
            Ending::Folded | Ending::DisplayPass => (display, exposure),
        };
        FrameShape {
            size: [target.width, target.height],
            linear_format: self.linear_format,
            lit_format: self.lit_format,
            target_format: target.format,
            viewport: target.viewport,
            samples: self.samples,
            display,
            exposure,
            display_pass: self.ending == Ending::DisplayPass,
            shadow_atlas: None,
            mirrors: None,
            refractors: Vec::new(),
            uploads: Uploads::default(),
            warm_ups: None,
        }
    }
}

/// The formats and sizes of a frame, for [`Effect::prepare`](crate::effects::Effect::prepare).
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct FrameShape {
    /// Width and height of the frame, and of the textures on the [`Board`](crate::effects::Board), in texels.
    pub size: [u32; 2],
    /// The part of the target that the frame fills, if it is not all of it.
    pub viewport: Option<Viewport>,
    /// Format of [`Board::linear`](crate::effects::Board::linear).
    pub linear_format: wgpu::TextureFormat,
    /// Format that passes of [`Board::lit_pass`](crate::effects::Board::lit_pass) draw into.
    pub lit_format: wgpu::TextureFormat,
    /// Format of [`Board::target`](crate::effects::Board::target).
    pub target_format: wgpu::TextureFormat,
    /// Samples per pixel of [`Board::depth`](crate::effects::Board::depth) and of the targets of
    /// [`Board::lit_pass`](crate::effects::Board::lit_pass).
    pub samples: u32,
    /// How radiance is converted to the target's values.
    pub display: Display,
    /// Factor on radiance before the display.
    pub exposure: f32,
    /// Whether a separate pass does the conversion.
    pub display_pass: bool,
    /// The atlas of shadow maps, if the frame has any.
    pub(crate) shadow_atlas: Option<ShadowAtlas>,
    /// The views in mirrors, parents before children; `None` before the frame is decided.
    pub(crate) mirrors: Option<Vec<MirrorShape>>,
    /// The transmissive surfaces that the camera sees.
    pub(crate) refractors: Vec<RefractorSurface>,
    /// What has been uploaded for the frame.
    pub(crate) uploads: Uploads,
    /// The warm-up device, if pipelines are to be warmed up.
    pub(crate) warm_ups: Option<WarmUps>,
}

/// The atlas of shadow maps, whether any of them has to be drawn, and how many pipelines draw them.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct ShadowAtlas {
    pub view: wgpu::TextureView,
    pub planes: wgpu::TextureView,
    pub stale: bool,
    pub pipelines: usize,
}

/// What the mirror effect needs to know about one view in a mirror.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct MirrorShape {
    /// The view that sees the mirrors: 0 is the camera's, 1 is the first view in a mirror.
    pub parent: usize,
    /// The part of the frame that the mirrors cover: upper left corner, width and height in texels.
    pub pixels: [u32; 4],
    /// Whether anything that is visible in it is blended.
    pub transparent: bool,
    pub surfaces: Vec<MirrorSurface>,
}
