//! Features: what an object, its material, the lights and the frame need within the shaders, with one file
//! for each subject. A shader variant has these features and no others; features that make others unnecessary
//! are handled in `Variant::reduced`. Passes are chosen in `effects`.

mod alpha;
mod display;
mod fog;
mod irradiance_volume;
mod light_counts;
mod lightmap;
mod lights;
mod metal;
mod specular;
mod specular_antialiasing;
mod textures;
mod two_sided;

pub(crate) use fog::{fog_feature, fog_flags};
use lumbre_optics::{ReflectionModel, Shading};
use lumbre_scene::{ObjectTraits, SceneSettings, ShadowFilter};

use crate::extract::LightSet;
use crate::facts::SceneFacts;
use crate::frame_plan::Ending;
use crate::g_buffer::GBufferContents;
use crate::light_counter::CountedStages;
use crate::shader::{DisplayVariant, Feature, Variant};
use crate::{Display, FrameOptions};

/// What all variants of a frame have in common.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FrameFeatures {
    pub shading: Option<Shading>,
    pub reflection: Option<ReflectionModel>,
    pub lightmaps: bool,
    /// Whether transmissive surfaces have a pass of their own.
    pub refraction: bool,
    /// Whether objects without a lightmap are lit by an irradiance volume.
    pub irradiance_volumes: bool,
    pub specular_antialiasing: bool,
    pub clamp: bool,
    /// Whether the frame is kept in half floats.
    pub half: bool,
    pub lights: LightSet,
    /// Whether a surface reads a single texel of a shadow map.
    pub hard_shadows: bool,
    /// Whether fragments find lights with a range by clusters.
    pub clustered: bool,
    /// Set if the lit shaders write the target's final values.
    pub display: Option<DisplayVariant>,
    /// The contents of the G-buffer, if the frame is shaded deferred.
    pub g_buffer: Option<GBufferContents>,
    /// The stages in which lights are counted: none, unless the frame is measured this way.
    pub counted: CountedStages,
}

impl FrameFeatures {
    /// Returns the features of views in mirrors. Lights are counted only in passes that have a row in the
    /// account.
    pub fn in_mirrors(&self) -> Self {
        Self { counted: CountedStages::default(), g_buffer: None, ..*self }
    }

    /// Derives the features from options and settings, for a frame with these facts and lights and this
    /// ending, in a target of this format. `half` is true if its radiance is kept in half floats.
    pub fn new(
        options: &FrameOptions,
        settings: &SceneSettings,
        facts: &SceneFacts,
        lights: LightSet,
        (ending, target, half): (Ending, wgpu::TextureFormat, bool),
    ) -> Self {
        Self {
            shading: options.shading,
            reflection: options.reflection,
            specular_antialiasing: options.specular_antialiasing.unwrap_or(settings.specular_antialiasing),
            lightmaps: options.lightmaps,
            refraction: options.refraction,
            irradiance_volumes: facts.calls_for_irradiance_volumes(options),
            clamp: options.display == Display::Clamp,
            half,
            lights,
            hard_shadows: settings.frame.shadow_filter == ShadowFilter::Hard,
            clustered: lights.are_clustered(options.light_lists),
            display: (ending == Ending::Folded).then(|| DisplayVariant::new(options.display, target)),
            g_buffer: facts.g_buffer,
            counted: CountedStages::default(),
        }
    }
}

/// An object in a frame, for which the features of each subject are chosen.
struct Subject<'a> {
    object: &'a ObjectTraits,
    settings: &'a SceneSettings,
    frame: &'a FrameFeatures,
    shading: Shading,
    /// Whether the object is lit at all.
    lit: bool,
}

impl Subject<'_> {
    /// Returns true if light is evaluated at vertices.
    fn is_lit_per_vertex(&self) -> bool {
        self.lit && self.shading != Shading::Phong
    }
}

/// Returns the shading that an object asks for in such a frame, which may be `Shading::Auto`.
pub(crate) fn asked_shading(
    object: &ObjectTraits,
    settings: &SceneSettings,
    frame: &FrameFeatures,
) -> Shading {
    frame.shading.or(object.shading).unwrap_or(settings.shading)
}

/// Returns the specular model of an object in such a frame.
pub(crate) fn asked_reflection(
    object: &ObjectTraits,
    settings: &SceneSettings,
    frame: &FrameFeatures,
) -> ReflectionModel {
    frame.reflection.or(object.reflection).unwrap_or(settings.reflection)
}

/// Returns the variant that draws an object in such a frame with this shading, which must not be
/// `Shading::Auto`.
pub(crate) fn variant(
    object: &ObjectTraits,
    shading: Shading,
    settings: &SceneSettings,
    frame: &FrameFeatures,
) -> Variant {
    let reflection = asked_reflection(object, settings, frame);
    let subject = Subject { object, settings, frame, shading, lit: !object.unlit };
    let mut variant = Variant::new(shading, reflection);
    variant.set(Feature::Lit, subject.lit);
    variant.set(Feature::VertexColor, object.vertex_color);
    variant.set(Feature::LocalViewer, settings.local_viewer);
    for call in [
        textures::call,
        alpha::call,
        two_sided::call,
        lightmap::call,
        irradiance_volume::call,
        metal::call,
        lights::call,
        light_counts::call,
        specular::call,
        specular_antialiasing::call,
        fog::call,
        display::call,
    ] {
        call(&subject, &mut variant);
    }
    textures::coordinates(object, variant.reduced())
}
