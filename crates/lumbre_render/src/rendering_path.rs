//! Chooses whether opaque surfaces of a frame are lit forward or deferred, and says why; and whether refracted light is
//! added pixel by pixel. How deferred shading works is described in `g_buffer`, and refraction in `effects::refraction`.

use std::fmt::{Display, Formatter};

use lumbre_optics::Shading;
use lumbre_scene::{ObjectCensus, SceneSettings};

use crate::extract::LightSet;
use crate::{FrameOptions, RenderingPath};

/// With at least this many lights with a range, a software rasterizer gains by deferred shading. With fewer,
/// drawing the G-buffer costs about what it saves.
const ENOUGH_LIGHTS: u32 = 64;
/// The same of a GPU. An NVIDIA H100 draws 64 balls of 73,000 triangles at 1920 x 1080 under 1024 lights in 0.91 and
/// under 10,000 in 0.64 of the time of forward shading, measured with lighting in fragment shaders.
const ENOUGH_LIGHTS_ON_A_GPU: u32 = 1024;
/// Most pixels of the frame per triangle of the scene at which it gains. Blocks of 16 pixels are shaded for
/// each triangle, and larger triangles fill them.
const MAX_PIXELS: u64 = 16;
/// The same of a GPU; the H100 gained with 28, by fragment shaders.
const MAX_PIXELS_ON_A_GPU: u64 = 32;

/// Triangles of a refractive surface from which on a software rasterizer gains by light that is added pixel by pixel: it
/// traces rays for whole blocks of pixels for each triangle. A pane fills its blocks anyway.
pub(crate) const MANY_REFRACTIVE_TRIANGLES: usize = 64;

/// Chooses whether the light of refractive surfaces with [`MANY_REFRACTIVE_TRIANGLES`] is added pixel by pixel: on a
/// software rasterizer or where the options ask for deferred shading, if the scene's have so many on average. Like the
/// rendering path, the choice depends on the scene and not on the view. Front faces are drawn with one sample per pixel.
pub(crate) fn refracts_by_pixel(
    options: &FrameOptions,
    objects: &ObjectCensus,
    (samples, software): (u32, bool),
) -> bool {
    let may = match options.rendering_path {
        RenderingPath::Forward => false,
        RenderingPath::Deferred | RenderingPath::DeferredCompute => true,
        RenderingPath::Auto => software,
    };
    let many = objects.refractive_triangles >= MANY_REFRACTIVE_TRIANGLES * objects.refractive;
    may && many && samples == 1 && objects.refractive > 0
}

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
    FewLights { lights: u32, software: bool },
    /// The triangles of the scene are large in a frame with this many pixels.
    LargeTriangles { triangles: usize, pixels: u64, most: u64 },
    /// This many objects have lightmaps, each of which would have to be lit separately.
    Lightmaps(usize),
    /// Small triangles under many lights: deferred.
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
            true => lights.with_range(),
            false => 0,
        };
        let (enough, most) = match software {
            true => (ENOUGH_LIGHTS, MAX_PIXELS),
            false => (ENOUGH_LIGHTS_ON_A_GPU, MAX_PIXELS_ON_A_GPU),
        };
        match options.rendering_path {
            RenderingPath::Forward => Self::Asked(RenderingPath::Forward),
            _ if samples > 1 => Self::SeveralSamples,
            asked @ (RenderingPath::Deferred | RenderingPath::DeferredCompute) => Self::Asked(asked),
            RenderingPath::Auto if !lit_by_pixel => Self::NotDeferrable,
            RenderingPath::Auto if clustered < enough => Self::FewLights { lights: clustered, software },
            RenderingPath::Auto if pixels > most * triangles as u64 => {
                Self::LargeTriangles { triangles, pixels, most }
            }
            RenderingPath::Auto if options.lightmaps && lightmapped > 0 => Self::Lightmaps(lightmapped),
            RenderingPath::Auto => Self::ManyLights { lights: clustered, triangles, software },
        }
    }

    pub fn is_deferred(self) -> bool {
        match self {
            Self::Asked(path) => path != RenderingPath::Forward,
            Self::ManyLights { .. } => true,
            _ => false,
        }
    }

    /// Returns true if compute shaders light the G-buffer: if the options ask for it, or where deferred shading was
    /// chosen on a GPU.
    pub fn is_lit_in_compute(self) -> bool {
        match self {
            Self::Asked(path) => path == RenderingPath::DeferredCompute,
            Self::ManyLights { software, .. } => !software,
            _ => false,
        }
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
            Self::FewLights { lights, software } => {
                let (who, enough) = match software {
                    true => ("a processor", ENOUGH_LIGHTS),
                    false => ("a GPU", ENOUGH_LIGHTS_ON_A_GPU),
                };
                write!(
                    out,
                    "forward: fragments find {lights} lights by clusters, and {who} gains from {enough} on"
                )
            }
            Self::LargeTriangles { triangles, pixels, most } => write!(
                out,
                "forward: {triangles} triangles are less than one for every {most} of the frame's {pixels} pixels"
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
                "deferred: a GPU draws {triangles} triangles, and lights their pixels in compute shaders, which find \
                 {lights} lights by clusters"
            ),
        }
    }
}
