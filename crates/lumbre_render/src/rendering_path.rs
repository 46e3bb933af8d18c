//! Chooses whether opaque surfaces of a frame are lit forward or deferred, and says why. How deferred shading
//! works is described in `g_buffer`.

use std::fmt::{Display, Formatter};

use lumbre_optics::Shading;
use lumbre_scene::{ObjectCensus, SceneSettings};

use crate::extract::LightSet;
use crate::{FrameOptions, RenderingPath};

/// With at least this many lights with a range, a software rasterizer gains by deferred shading. With fewer,
/// drawing the G-buffer costs about what it saves.
const ENOUGH_LIGHTS: u32 = 64;
/// Most pixels of the frame per triangle of the scene at which it gains. Blocks of 16 pixels are shaded for
/// each triangle, and larger triangles fill them.
const MAX_PIXELS: u64 = 16;

/// The rendering path of a frame, by the reason for it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum ChosenPath {
    /// The options chose it.
    Asked(RenderingPath),
    /// Several samples per pixel, of which the G-buffer would hold only one.
    SeveralSamples,
    /// Surfaces are lit at vertices, or their highlights are filtered within pixels, so the G-buffer would be
    /// empty.
    NotDeferrable,
    /// The light loop is short.
    FewLights(u32),
    /// The triangles of the scene are large in a frame with this many pixels.
    LargeTriangles { triangles: usize, pixels: u64 },
    /// This many objects have lightmaps, each of which would have to be lit separately.
    Lightmaps(usize),
    /// Small triangles under many lights: deferred on a software rasterizer.
    ManyLights { lights: u32, triangles: usize, software: bool },
}

impl ChosenPath {
    /// Chooses the path of a frame of this size.
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
            RenderingPath::Auto if pixels > MAX_PIXELS * triangles as u64 => {
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
                "forward: {triangles} triangles are less than one for every {MAX_PIXELS} of the frame's {pixels} pixels"
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
