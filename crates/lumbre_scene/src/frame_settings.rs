//! Quality settings that a level requests for its frames: multisampling, where lights end, whether shadows
//! are drawn, with their resolution and filter, and the format of lightmaps on the GPU. They trade quality for
//! speed in the rasterizer only; the baker and the ray tracer do not read them.

use crate::LightmapEncoding;

/// How frames of a scene are drawn where the program does not decide. The defaults are the most accurate
/// choices, except that multisampling is left to the program and lightmaps are half floats.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrameSettings {
    /// Four samples per pixel (true) or one (false); `None` leaves the choice to the program.
    pub multisample: Option<bool>,
    /// Cut-off for the range of point lights and spotlights, as radiance in W/(m² sr): a light ends at the
    /// distance where the strongest channel of a white surface facing it falls to this radiance, or at its own
    /// range if that is shorter. With 0, lights without a range are unbounded.
    pub light_threshold: f32,
    /// Whether the lights that cast shadows do so in frames. If false, each of them reaches everything.
    pub shadows: bool,
    /// Factor on the default side length of a shadow map in texels: 1 makes shadows about as sharp as the
    /// picture, 0.5 halves the texels along each side. Clamped to
    /// [`SHADOW_RESOLUTIONS`](Self::SHADOW_RESOLUTIONS).
    pub shadow_resolution: f32,
    /// How shadow maps are filtered.
    pub shadow_filter: ShadowFilter,
    /// The format of lightmaps on the GPU, whatever that of their files. Texels are clamped by
    /// [`LightmapEncoding::clamped`].
    pub lightmap_format: LightmapEncoding,
}

/// How many texels of a shadow map are sampled per shaded point, and over which width.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub enum ShadowFilter {
    /// One sample: shadow edges show the texels of the map.
    Hard,
    /// Nine weighted samples around the point (percentage-closer filtering; Reeves, Salesin and Cook,
    /// SIGGRAPH 1987): edges are one texel wide, whatever the size of the light.
    PercentageCloser,
    /// 44 samples over a width that follows the size of the light (percentage-closer soft shadows; Fernando,
    /// SIGGRAPH sketches 2005); the nine samples of `PercentageCloser` for lights without a size.
    #[default]
    Soft,
}

impl FrameSettings {
    /// The smallest and the largest factor for the shadow resolution.
    pub const SHADOW_RESOLUTIONS: [f32; 2] = [0.0625, 4.0];

    /// The shadow resolution clamped to [`SHADOW_RESOLUTIONS`](Self::SHADOW_RESOLUTIONS); NaN becomes 1.
    pub fn shadow_resolution(&self) -> f32 {
        let [least, most] = Self::SHADOW_RESOLUTIONS;
        if self.shadow_resolution.is_nan() { 1.0 } else { self.shadow_resolution.clamp(least, most) }
    }
}

impl Default for FrameSettings {
    fn default() -> Self {
        Self {
            multisample: None,
            light_threshold: 0.0,
            shadows: true,
            shadow_resolution: 1.0,
            shadow_filter: ShadowFilter::Soft,
            lightmap_format: LightmapEncoding::Rgb16Float,
        }
    }
}

impl ShadowFilter {
    /// Every filter, the cheapest first.
    pub const ALL: &'static [Self] = &[Self::Hard, Self::PercentageCloser, Self::Soft];

    /// The name in files and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Hard => "hard",
            Self::PercentageCloser => "percentage-closer",
            Self::Soft => "soft",
        }
    }

    /// The filter with this name, or `None` if there is none.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|filter| filter.name() == name)
    }
}
