//! What a caller chooses for one frame. What the scene calls for is not chosen here: the census decides it.

use bevy_ecs::entity::Entity;
use bevy_ecs::resource::Resource;
use lumbre_optics::{FlatRule, ReflectionModel, Shading};

/// How linear radiance becomes the numbers of the target.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub enum Display {
    /// The numbers as they are (after exposure).
    Linear,
    /// OpenGL's clamp to [0, 1]: per vertex before interpolation where a colour is computed per vertex, and again at the end.
    Clamp,
    /// For people: a tone curve, then the sRGB encoding.
    #[default]
    Srgb,
}

impl Display {
    /// Every choice.
    pub const ALL: &'static [Self] = &[Self::Linear, Self::Clamp, Self::Srgb];

    /// The name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Linear => "linear",
            Self::Clamp => "clamp",
            Self::Srgb => "srgb",
        }
    }

    /// The choice with that name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|display| display.name() == name)
    }
}

/// What is measured. Measuring costs: queries, and merged passes that can no longer overlap.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub enum Measure {
    /// Nothing.
    #[default]
    Nothing,
    /// CPU and GPU time per pass.
    Time,
    /// Times, and vertex and fragment invocations.
    TimeAndInvocations,
    /// The same, and how many lights each pass tests and how many of these contribute ([`LightCount`](crate::LightCount)): by shader variants of their own, which count. They draw
    /// the same picture and take longer, so that the times are not those of the frame. A plan that is made without a frame ([`Renderer::explain`](crate::Renderer::explain)) does not
    /// name them.
    Lights,
}

/// What becomes of a frame that calls for pipelines that are not there yet: the scene's first spot light, shadow or texture, say.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub enum MissingPipelines {
    /// The frame waits for them, and shows all that it should: for pictures that are kept.
    #[default]
    Wait,
    /// They are made on another thread, and until they are there frames go on with those that are: a light of a kind that no earlier frame had stays dark, its
    /// shadow out, a texture plain; and so do options that were changed. For windows. The first frame of a World or of a target's format waits all the same.
    Background,
}

/// By which lists a fragment finds its lights. What is drawn is the same to rounding: a light that is in no list adds nothing there.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub enum LightLists {
    /// By clusters where the scene has many lights with a range, else by objects.
    #[default]
    Auto,
    /// A list for each object, by its bounding box.
    Objects,
    /// A list for each cluster of pixels and depths, for lights with a range under Phong shading.
    Clusters,
    /// Every light for every object: brute force, to compare with.
    Everything,
}

/// Whether surfaces are lit where they are drawn, or after all of them are drawn. What is drawn is the same to rounding, but for coplanar surfaces of both kinds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub enum RenderingPath {
    /// Deferred on a software rasterizer where many lights meet small triangles, else forward: 64 lights that fragments find by clusters, and a triangle for every 16 pixels of
    /// the frame, without lightmaps. A software rasterizer shades whole blocks of pixels for each triangle, and
    /// small triangles fill little of a block.
    #[default]
    Auto,
    /// Each surface is lit where it is drawn.
    Forward,
    /// Opaque surfaces under Phong shading are drawn into a G-buffer, and what is seen of them is lit once. Those are lit forward as ever that have textures for
    /// anything but their base colour, are cut out by alpha, have their highlights filtered, or are lit by no light or by more than 255 lightmaps; and so is every surface of a frame
    /// with several samples per pixel. Of coplanar surfaces one that is lit forward is seen before one that is not.
    Deferred,
}

impl RenderingPath {
    /// Every choice.
    pub const ALL: &'static [Self] = &[Self::Auto, Self::Forward, Self::Deferred];

    /// The name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::Forward => "forward",
            Self::Deferred => "deferred",
        }
    }

    /// The choice with that name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|path| path.name() == name)
    }
}

/// Choices for one frame.
#[derive(Resource, Clone, Debug, PartialEq)]
pub struct FrameOptions {
    /// The camera; else the one with `ActiveCamera`, else the first.
    pub camera: Option<Entity>,
    /// Shades every object this way, whatever it or the scene says.
    pub shading: Option<Shading>,
    /// Takes this specular model instead of the scene's.
    pub reflection: Option<ReflectionModel>,
    /// Evaluates flat shading by this rule instead of the scene's.
    pub flat_rule: Option<FlatRule>,
    /// Filters highlights within pixels under Phong shading, or not, whatever the scene says.
    pub specular_antialiasing: Option<bool>,
    /// By which lists lights are found.
    pub light_lists: LightLists,
    /// No tile of pixels that has a list of lights of its own has a shorter side than this, in pixels: what is finer costs more lists and saves lights. The renderer has tiles of 32 pixels and of powers
    /// of two above that, up to 1024, and one of the whole frame; where lists would be too many it takes coarser ones by itself.
    pub finest_cluster_tile: u32,
    /// Whether opaque surfaces are lit where they are drawn, or afterwards.
    pub rendering_path: RenderingPath,
    /// Uses the lightmaps. Without them static lights shade lightmapped meshes like any other.
    pub lightmaps: bool,
    /// Lights what has no lightmap by the irradiance volumes of a bake, where there are any. Without them it takes the scene's ambient light.
    pub irradiance_volumes: bool,
    /// Draws the shadows of lights that ask for them.
    pub shadows: bool,
    /// How often light is mirrored on its way to the camera, at most, where it meets flat mirrors: 1 shows a mirror, 2 a mirror in a mirror, 0 none. What a mirror shows is
    /// drawn like the frame; it costs as much as what is in it, in as many pixels as the mirror has.
    pub mirror_depth: u32,
    /// Draws what lies behind surfaces that light passes through, bent as they bend it. Without it they are opaque.
    pub refraction: bool,
    /// Four samples per pixel instead of one, or not, whatever the scene says; one where neither says anything.
    pub multisample: Option<bool>,
    /// From radiance to the target's numbers.
    pub display: Display,
    /// Factor on radiance, instead of the camera's.
    pub exposure: Option<f32>,
    /// f32 instead of f16 per channel until the display pass: for measuring, not for games.
    pub full_precision: bool,
    /// What becomes of the frame where pipelines are missing.
    pub missing_pipelines: MissingPipelines,
    /// Leaves the target alone, and the GPU, where nothing has changed since this renderer's last frame and that one went into the same texture: the plan says
    /// `Unchanged` of each pass. For targets that nobody else writes to.
    pub keep_unchanged: bool,
    /// What is measured.
    pub measure: Measure,
    /// Looks for NaN and infinities after every pass.
    pub probe: bool,
}

impl Default for FrameOptions {
    fn default() -> Self {
        Self {
            camera: None,
            shading: None,
            reflection: None,
            flat_rule: None,
            specular_antialiasing: None,
            light_lists: LightLists::Auto,
            finest_cluster_tile: 32,
            rendering_path: RenderingPath::Auto,
            lightmaps: true,
            irradiance_volumes: true,
            shadows: true,
            mirror_depth: 2,
            refraction: true,
            multisample: None,
            display: Display::Srgb,
            exposure: None,
            full_precision: false,
            missing_pipelines: MissingPipelines::Wait,
            keep_unchanged: false,
            measure: Measure::Nothing,
            probe: false,
        }
    }
}
