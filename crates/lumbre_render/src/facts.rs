//! The facts of a scene that decide what a frame does: how many objects each pass draws, which lights there are, what the scene sets. Computed once a frame, from
//! what was extracted or, for an explanation, from the World alone; passes, shader variants and light lists follow from them, and so does what `explain` prints.

use lumbre_scene::SceneSettings;

use crate::FrameOptions;
use crate::extract::{LightSet, LitPass, Traits};

/// What a scene and the options of a frame come to.
#[derive(Clone, Copy, Debug)]
#[non_exhaustive]
pub struct SceneFacts {
    /// Shown opaque objects that are not lit by a lightmap.
    pub opaque: usize,
    /// Shown opaque objects with a lightmap, whether lightmaps are switched on or not.
    pub lightmapped: usize,
    /// Shown objects that are blended.
    pub transparent: usize,
    /// Lights that are on, ambient ones apart; each face of an emissive object that lights others is one.
    pub lights: u32,
    /// Of these, the lights that ask for a shadow.
    pub shadow_lights: u32,
    /// What the scene sets: ambient light, fog, background, rates of evaluation.
    pub settings: SceneSettings,
}

impl SceneFacts {
    pub(crate) fn new<'t>(
        objects: impl IntoIterator<Item = &'t Traits>,
        lights: &LightSet,
        settings: &SceneSettings,
        options: &FrameOptions,
    ) -> Self {
        let mut facts = Self {
            opaque: 0,
            lightmapped: 0,
            transparent: 0,
            lights: lights.every.all,
            shadow_lights: lights.every.shadows.lights,
            settings: *settings,
        };
        for traits in objects {
            // Whether a lightmapped mesh is there does not depend on whether lightmaps are switched on.
            facts.lightmapped += usize::from(traits.pass(true) == LitPass::Lightmap);
            facts.opaque += usize::from(traits.pass(options.lightmaps) == LitPass::Forward);
            facts.transparent += usize::from(traits.pass(options.lightmaps) == LitPass::Transparent);
        }
        facts
    }
}
