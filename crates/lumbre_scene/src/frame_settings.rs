//! What a level asks of every frame that shows it: samples, where lights end, how finely shadows are drawn. Prices, and no part of the light: bakes and rays do not read them.

/// How frames of a scene are drawn, where a program leaves it open. The default is the most accurate but for the samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrameSettings {
    /// Whether a pixel has four samples instead of one; the program's choice if there is none.
    pub multisample: Option<bool>,
    /// Radiance, W/(m² sr), that a lamp gives a white surface that faces it, below which it ends: nearer lamps with a range end where they ended before. 0: lamps
    /// without a range have no end.
    pub light_threshold: f32,
    /// Texels of a shadow map beside the usual number, along a side: 1 for shadows about as sharp as the picture, 0.5 for half as many each way.
    /// From [`SHADOW_RESOLUTIONS`](Self::SHADOW_RESOLUTIONS).
    pub shadow_resolution: f32,
    /// How a surface reads a shadow map.
    pub shadow_filter: ShadowFilter,
}

/// How many texels of a shadow map a surface looks at, and over which width.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub enum ShadowFilter {
    /// One: edges have the steps of the map.
    Hard,
    /// Nine about the point, weighed (percentage-closer filtering; Reeves, Salesin and Cook, SIGGRAPH 1987): edges are a texel wide, whatever size a light has.
    PercentageCloser,
    /// As many as the light's size asks for, 44 (percentage-closer soft shadows; Fernando, SIGGRAPH sketches 2005); the nine for a light without a size.
    #[default]
    Soft,
}

impl FrameSettings {
    /// The least and the largest resolution of shadows.
    pub const SHADOW_RESOLUTIONS: [f32; 2] = [0.0625, 4.0];

    /// The resolution of shadows, within [`SHADOW_RESOLUTIONS`](Self::SHADOW_RESOLUTIONS); NaN is 1.
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
            shadow_resolution: 1.0,
            shadow_filter: ShadowFilter::Soft,
        }
    }
}

impl ShadowFilter {
    /// Every choice, the cheapest first.
    pub const ALL: &'static [Self] = &[Self::Hard, Self::PercentageCloser, Self::Soft];

    /// The name in files and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Hard => "hard",
            Self::PercentageCloser => "percentage-closer",
            Self::Soft => "soft",
        }
    }

    /// The choice with that name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|filter| filter.name() == name)
    }
}
