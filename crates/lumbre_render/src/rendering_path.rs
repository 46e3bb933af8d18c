//! Whether opaque surfaces of a frame are lit where they are drawn or afterwards, and why. How the latter is done is `g_buffer`'s.

use std::fmt::{Display, Formatter};

use lumbre_optics::Shading;
use lumbre_scene::{ObjectCensus, SceneSettings};

use crate::extract::LightSet;
use crate::{FrameOptions, RenderingPath};

/// From so many lights with a range on, a software rasterizer gains by deferred shading: under fewer, drawing the G-buffer costs about what it saves.
const ENOUGH_LIGHTS: u32 = 64;
/// Pixels of the frame for each triangle of the scene up to which it gains: blocks of 16 pixels are shaded for each triangle, and larger triangles fill them.
const MOST_PIXELS: u64 = 16;

/// The path of a frame, by what decided it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum ChosenPath {
    /// The options.
    Asked(RenderingPath),
    /// Several samples of a pixel, of which the G-buffer would hold one.
    SeveralSamples,
    /// Surfaces that are lit at vertices, or whose highlights are filtered within pixels: the G-buffer would be empty.
    NotDeferrable,
    /// A light loop that is short.
    FewLights(u32),
    /// Triangles of the scene that are large in a frame of so many pixels.
    LargeTriangles { triangles: usize, pixels: u64 },
    /// Lightmaps, each of which would be lit apart.
    Lightmaps(usize),
    /// Small triangles under many lights: a software rasterizer defers.
    ManyLights { lights: u32, triangles: usize, software: bool },
}

impl ChosenPath {
    /// The path of a frame of this size.
    pub fn new(
        (options, settings): (&FrameOptions, &SceneSettings),
        lights: &LightSet,
        objects: &ObjectCensus,
        (samples, software, [width, height]): (u32, bool, [u32; 2]),
    ) -> Self {
        let pixels = u64::from(width) * u64::from(height);
        let shading = options.shading.unwrap_or(settings.shading);
        let filtered = options.specular_antialiasing.unwrap_or(settings.specular_antialiasing);
        let lit_by_pixel = matches!(shading, Shading::Phong | Shading::Auto { .. }) && !filtered;
        let (triangles, lightmapped) = (objects.triangles, objects.lightmapped);
        let clustered = match lights.are_clustered(options.light_lists) {
            true => lights.inverse_square.all + lights.ranged.all,
            false => 0,
        };
        match options.rendering_path {
            RenderingPath::Forward => Self::Asked(RenderingPath::Forward),
            _ if samples > 1 => Self::SeveralSamples,
            RenderingPath::Deferred => Self::Asked(RenderingPath::Deferred),
            RenderingPath::Auto if !lit_by_pixel => Self::NotDeferrable,
            RenderingPath::Auto if clustered < ENOUGH_LIGHTS => Self::FewLights(clustered),
            RenderingPath::Auto if pixels > MOST_PIXELS * triangles as u64 => {
                Self::LargeTriangles { triangles, pixels }
            }
            RenderingPath::Auto if options.lightmaps && lightmapped > 0 => Self::Lightmaps(lightmapped),
            RenderingPath::Auto => Self::ManyLights { lights: clustered, triangles, software },
        }
    }

    pub fn is_deferred(self) -> bool {
        matches!(self, Self::Asked(RenderingPath::Deferred) | Self::ManyLights { software: true, .. })
    }
}

impl Display for ChosenPath {
    fn fmt(&self, out: &mut Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Asked(path) => write!(out, "{}, as was asked", path.name()),
            Self::SeveralSamples => write!(out, "forward: a G-buffer has one sample of each pixel"),
            Self::NotDeferrable => {
                write!(out, "forward: surfaces are lit at vertices, or highlights are filtered within pixels")
            }
            Self::FewLights(lights) => {
                write!(out, "forward: fragments find {lights} lights by clusters, fewer than {ENOUGH_LIGHTS}")
            }
            Self::LargeTriangles { triangles, pixels } => write!(
                out,
                "forward: {triangles} triangles are less than one for every {MOST_PIXELS} of the frame's {pixels} pixels"
            ),
            Self::Lightmaps(objects) => {
                write!(out, "forward: {objects} objects have lightmaps, and each map would be lit apart")
            }
            Self::ManyLights { lights, triangles, software: true } => write!(
                out,
                "deferred: a processor draws {triangles} triangles, whose fragments find {lights} lights by clusters"
            ),
            Self::ManyLights { lights, triangles, software: false } => write!(
                out,
                "forward on a GPU; deferred where a processor draws: fragments of {triangles} triangles find {lights} lights by clusters"
            ),
        }
    }
}
