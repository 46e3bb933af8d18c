//! The options that a caller chooses for one frame. What the scene itself requires is not an option: it is
//! decided from the scene's census.

use bevy_ecs::entity::Entity;
use bevy_ecs::resource::Resource;
use lumbre_optics::{FlatRule, ReflectionModel, Shading};

/// How linear radiance is converted to the values that are stored in the target.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub enum Display {
    /// Stores the exposed radiance as it is.
    Linear,
    /// Clamps to [0, 1] as OpenGL does: per vertex before interpolation where colours are computed per
    /// vertex, and again at the end.
    Clamp,
    /// Applies a tone curve and then the sRGB encoding, for viewing.
    #[default]
    Srgb,
}

impl Display {
    /// Every choice.
    pub const ALL: &'static [Self] = &[Self::Linear, Self::Clamp, Self::Srgb];

    /// Returns the name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Linear => "linear",
            Self::Clamp => "clamp",
            Self::Srgb => "srgb",
        }
    }

    /// Returns the choice with this name, if there is one.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|display| display.name() == name)
    }
}

/// What is measured. Measuring has a cost: it adds queries, and merged passes can no longer overlap.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub enum Measure {
    /// Nothing.
    #[default]
    Nothing,
    /// CPU and GPU time of each pass.
    Time,
    /// Times, and the number of vertex and fragment shader invocations.
    TimeAndInvocations,
    /// The same, and how many lights each pass tests and how many of these contribute
    /// ([`LightCount`](crate::LightCount)). The counts come from special shader variants, which draw the same
    /// picture but take longer, so the times are not those of a normal frame. A plan that is made without a
    /// frame ([`Renderer::explain`](crate::Renderer::explain)) does not list these variants.
    Lights,
}

/// What happens to a frame that needs pipelines that do not exist yet, for example for the scene's first spot
/// light, shadow or texture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub enum MissingPipelines {
    /// The frame waits for them and shows everything that it should. For pictures that are kept.
    #[default]
    Wait,
    /// The pipelines are created on another thread, and until they are ready frames use those that exist: a
    /// light of a kind that no earlier frame had stays dark, its shadow is missing, and a texture is not
    /// shown. Changed options take effect only then, too. For windows. The first frame of a World, or of a
    /// target format, waits in any case.
    Background,
}

/// Which lists a fragment uses to find its lights. The picture is the same up to rounding, because a light
/// that is missing from a list contributes nothing there.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub enum LightLists {
    /// Lists per cluster if the scene has many lights with a range, otherwise lists per object.
    #[default]
    Auto,
    /// One list for each object, found by its bounding box.
    Objects,
    /// One list for each cluster of pixels and depths, for lights with a range under Phong shading.
    Clusters,
    /// Every light for every object: brute force, for comparison.
    Everything,
}

/// Whether surfaces are lit while they are drawn (forward) or after all of them have been drawn (deferred).
/// The picture is the same up to rounding, except where a forward-lit and a deferred surface are coplanar, and in a few
/// pixels of glass whose refracted rays pass an edge of the picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub enum RenderingPath {
    /// Deferred if many lights meet small triangles and no lightmaps: on a software rasterizer with at least 64
    /// lights that fragments find by clusters and one triangle for every 16 pixels of the frame, on a GPU with
    /// 1024 lights and a triangle for every 32 pixels, where compute shaders then light the G-buffer. Otherwise
    /// forward. Whole blocks of pixels are shaded for each triangle, and a small triangle fills little of a block.
    /// For the same reason a software rasterizer adds the refracted light of surfaces with 64 triangles or more pixel
    /// by pixel, if the scene's refractive surfaces have so many on average.
    #[default]
    Auto,
    /// Each surface is lit while it is drawn, and refracted light is added triangle by triangle.
    Forward,
    /// Opaque surfaces under Phong shading are drawn into a G-buffer, and only what is visible of them is
    /// lit, once. These surfaces are still lit forward: those with textures other than a base colour, those
    /// with an alpha mask or filtered highlights, those that no light is evaluated on, those beyond the 255
    /// combinations of shader variant and lightmap that the G-buffer can number, and all surfaces of a frame
    /// with several samples per pixel. Of coplanar surfaces, one that is lit forward hides one that is lit
    /// deferred. Refracted light of surfaces with 64 triangles or more is added pixel by pixel,
    /// unless there are several samples.
    Deferred,
    /// Like `Deferred`, but compute shaders light the G-buffer, and a full-screen triangle then copies the result
    /// into the frame. A GPU runs compute shaders on all of its compute units, but fragment shaders possibly on a few
    /// only, as cards for data centres do. The picture is that of `Deferred` up to rounding.
    DeferredCompute,
}

impl RenderingPath {
    /// Every choice.
    pub const ALL: &'static [Self] = &[Self::Auto, Self::Forward, Self::Deferred, Self::DeferredCompute];

    /// Returns the name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::Forward => "forward",
            Self::Deferred => "deferred",
            Self::DeferredCompute => "deferred-compute",
        }
    }

    /// Returns the choice with this name, if there is one.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|path| path.name() == name)
    }
}

/// Options of one frame.
#[derive(Resource, Clone, Debug, PartialEq)]
pub struct FrameOptions {
    /// The camera to draw from. Without one, the camera with `ActiveCamera` is used, or else the first one.
    pub camera: Option<Entity>,
    /// Shades every object this way, regardless of what the object or the scene asks for.
    pub shading: Option<Shading>,
    /// Uses this specular model instead of the one that the object or the scene asks for.
    pub reflection: Option<ReflectionModel>,
    /// Evaluates flat shading by this rule instead of the scene's.
    pub flat_rule: Option<FlatRule>,
    /// Switches the filtering of highlights within pixels under Phong shading on or off, regardless of the
    /// scene's setting.
    pub specular_antialiasing: Option<bool>,
    /// Which lists lights are found by.
    pub light_lists: LightLists,
    /// Lower bound of the side of a cluster's tile in pixels: finer tiles cost more lists and save lights. The
    /// renderer has tiles of 32 pixels, of powers of two above that up to 1024, and one of the whole frame;
    /// where the lists would be too many it takes coarser tiles by itself.
    pub finest_cluster_tile: u32,
    /// Whether opaque surfaces are lit forward or deferred.
    pub rendering_path: RenderingPath,
    /// Uses the lightmaps. Without them, static lights shade lightmapped meshes like any other mesh.
    pub lightmaps: bool,
    /// Lights objects without a lightmap by the irradiance volumes of a bake, where there are any. Without
    /// them, these objects take the scene's ambient light.
    pub irradiance_volumes: bool,
    /// Draws the shadows of lights that ask for them.
    pub shadows: bool,
    /// The largest number of reflections in flat mirrors on a path of light to the camera: 0 shows none, 1
    /// shows what a mirror reflects, 2 also shows a mirror in a mirror. The view in a mirror is drawn like
    /// the frame itself; it costs as much as what is visible in it, over as many pixels as the mirror covers.
    pub mirror_depth: u32,
    /// Draws what is visible through transmissive surfaces, refracted by them. Without it these surfaces are
    /// opaque.
    pub refraction: bool,
    /// Uses four samples per pixel (true) or one (false) regardless of the scene's setting. One if neither
    /// says anything.
    pub multisample: Option<bool>,
    /// How radiance is converted to the target's values.
    pub display: Display,
    /// The factor on radiance, instead of the camera's.
    pub exposure: Option<f32>,
    /// Keeps f32 instead of f16 per channel until the display pass. For measurements, not for games.
    pub full_precision: bool,
    /// What happens to the frame if pipelines are missing.
    pub missing_pipelines: MissingPipelines,
    /// Skips drawing if nothing has changed since this renderer's last frame and that frame was drawn into
    /// the same texture. The plan then says `Unchanged` for each pass. For targets that nothing else writes
    /// to.
    pub keep_unchanged: bool,
    /// What is measured.
    pub measure: Measure,
    /// Checks the result of every pass for NaN and infinities.
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
