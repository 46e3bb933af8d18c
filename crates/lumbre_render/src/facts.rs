//! The facts that decide what a frame does: the scene's census, and how many objects each pass draws of it. Passes, shader variants and light lists follow from these,
//! and so does what `explain` prints. Not the counting: objects and lights are counted where they are extracted.

use std::sync::Arc;

use lumbre_scene::{Census, ObjectCensus, SceneSettings};

use crate::FrameOptions;
use crate::extract::LightSet;
use crate::g_buffer::GBufferContents;
use crate::rendering_path::ChosenPath;

/// What a scene and the options of a frame come to.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct SceneFacts {
    /// What there is of everything: of what can be drawn, wherever the camera looks.
    pub census: Arc<Census>,
    /// Shown opaque objects that are not lit by a lightmap, without those that refract.
    pub opaque: usize,
    /// Shown opaque objects with a lightmap, whether lightmaps are switched on or not.
    pub lightmapped: usize,
    /// Shown objects through which what lies behind them is drawn, if that is switched on.
    pub refractive: usize,
    /// Shown objects that are blended.
    pub transparent: usize,
    /// Lights that shine, ambient ones apart; each face of an emissive object that lights others is one.
    pub lights: u32,
    /// Of these, the lights that ask for a shadow.
    pub shadow_lights: u32,
    /// Samples of a pixel.
    pub samples: u32,
    /// Whether opaque surfaces are lit where they are drawn or afterwards.
    pub(crate) path: ChosenPath,
    /// What they are lit from afterwards, as far as they can be.
    pub(crate) g_buffer: Option<GBufferContents>,
    /// What the scene sets: ambient light, fog, background, rates of evaluation.
    pub settings: SceneSettings,
}

impl SceneFacts {
    /// Of objects, lights, and so many irradiance volumes that can be used, for a frame of this size; `software` on a software rasterizer.
    pub(crate) fn new(
        objects: &ObjectCensus,
        lights: &LightSet,
        irradiance_volumes: usize,
        settings: &SceneSettings,
        options: &FrameOptions,
        (software, size): (bool, [u32; 2]),
    ) -> Self {
        let (refractive, lightmapped_refractive) = match options.refraction {
            true => (objects.refractive, objects.lightmapped_refractive),
            false => (0, 0),
        };
        let lightmapped = objects.lightmapped - objects.lightmapped_blended - lightmapped_refractive;
        let samples = if options.multisample.or(settings.frame.multisample) == Some(true) { 4 } else { 1 };
        let path = ChosenPath::new((options, settings), lights, objects, (samples, software, size));
        let details = lightmapped > 0 || objects.textured > 0 || objects.vertex_colors > 0;
        let by_lightmap = if options.lightmaps { lightmapped } else { 0 };
        Self {
            census: Arc::new(Census::new(objects, lights.census, irradiance_volumes, settings)),
            opaque: objects.meshes - objects.alpha_blend - refractive - by_lightmap,
            lightmapped,
            refractive,
            transparent: objects.alpha_blend,
            lights: lights.every.all,
            shadow_lights: lights.every.shadows.lights,
            samples,
            path,
            g_buffer: path.is_deferred().then_some(GBufferContents { details }),
            settings: *settings,
        }
    }

    /// Whether what mirrors show is drawn as views of their own, where any is in sight.
    pub(crate) fn calls_for_mirrors(&self, options: &FrameOptions) -> bool {
        options.mirror_depth > 0 && self.census.planar_mirrors > 0
    }

    /// Whether anything of a frame is lit by an irradiance volume.
    pub(crate) fn calls_for_irradiance_volumes(&self, options: &FrameOptions) -> bool {
        options.irradiance_volumes && self.census.lit_by_volume > 0
    }
}
