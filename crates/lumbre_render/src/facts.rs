//! The facts that decide what a frame does: the scene's census, and how many objects each pass would draw.
//! Passes, shader variants, light lists and the output of `explain` all follow from these. Counting is not
//! done here: objects and lights are counted where they are extracted.

use std::sync::Arc;

use lumbre_scene::{Census, ObjectCensus, RefractiveShape, SceneSettings};

use crate::FrameOptions;
use crate::extract::LightSet;
use crate::g_buffer::GBufferContents;
use crate::rendering_path::{self, ChosenPath};

/// The facts about a scene and the options of its frame.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct SceneFacts {
    /// Counts of everything in the scene that can be drawn, wherever the camera looks.
    pub census: Arc<Census>,
    /// Opaque objects that are not lit by a lightmap, without refractive ones. Like all counts here, this
    /// includes only objects that are not hidden.
    pub opaque: usize,
    /// Opaque objects with a lightmap, without refractive ones, whether lightmaps are switched on or not.
    pub lightmapped: usize,
    /// Objects through which what lies behind them is drawn; 0 if refraction is switched off.
    pub refractive: usize,
    /// Objects that are blended.
    pub transparent: usize,
    /// Lights that shine, except ambient ones. Each face of an emissive object that lights others counts as
    /// one.
    pub lights: u32,
    /// How many of these lights ask for a shadow.
    pub shadow_lights: u32,
    /// Samples per pixel.
    pub samples: u32,
    /// Whether opaque surfaces are lit forward or deferred.
    pub(crate) path: ChosenPath,
    /// Whether the refracted light of surfaces with many triangles is added pixel by pixel.
    pub(crate) refracts_by_pixel: bool,
    /// The shapes of the objects through which what lies behind them is drawn.
    pub(crate) refractive_shapes: Vec<RefractiveShape>,
    /// The contents of the G-buffer, if the frame is shaded deferred.
    pub(crate) g_buffer: Option<GBufferContents>,
    /// The scene's settings: ambient light, fog, background, rates of evaluation.
    pub settings: SceneSettings,
}

impl SceneFacts {
    /// Derives the facts from counts of objects, lights and usable irradiance volumes, for a frame of this
    /// size. `software` is true on a software rasterizer.
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
        let shapes = RefractiveShape::ALL.into_iter().zip(objects.refractive_shapes);
        let shapes = shapes.filter(|(_, count)| options.refraction && *count > 0);
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
            refracts_by_pixel: rendering_path::refracts_by_pixel(options, objects, (samples, software)),
            refractive_shapes: shapes.map(|(shape, _)| shape).collect(),
            g_buffer: path
                .is_deferred()
                .then_some(GBufferContents { details, lit_in_compute: path.is_lit_in_compute() }),
            settings: *settings,
        }
    }

    /// Returns true if the views in mirrors are to be drawn, where a mirror is in sight.
    pub(crate) fn calls_for_mirrors(&self, options: &FrameOptions) -> bool {
        options.mirror_depth > 0 && self.census.planar_mirrors > 0
    }

    /// Returns true if any object of the frame is lit by an irradiance volume.
    pub(crate) fn calls_for_irradiance_volumes(&self, options: &FrameOptions) -> bool {
        options.irradiance_volumes && self.census.lit_by_volume > 0
    }
}
