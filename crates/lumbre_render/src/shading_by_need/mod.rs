//! Shading by need: chooses flat, Gouraud or Phong shading for each object of a view, where `Shading::Auto`
//! only states an error bound. The bounds on the error of each kind are computed in
//! `lumbre_optics::interpolation_error`; the rate of evaluation itself is part of the variant that is drawn.
//!
//! ```text
//!   vertices, pixels of its box ──────────────► evaluations: is anything cheaper than Phong? ──┐
//!   mesh ► patches of its triangles ──┐                                                        ▼
//!   object ► place, reflectance ──────┼─► prediction: errors of flat and Gouraud ──► choice: the cheapest
//!   lights that reach it ► Lamp ──────┤   (kept while none of these changes and      within the bound
//!   eye, with room to move ───────────┘    the eye stays near its position)
//! ```

mod evaluations;
mod prediction;
mod surface;
mod world_needs;

use glam::DVec3;
use lumbre_optics::{ErrorBound, ReflectionModel, Shading};
use lumbre_scene::{ObjectCensus, SceneSettings};

use crate::FrameOptions;
use crate::extract::{CameraView, Lamp, Object, Objects};
use crate::features::FrameFeatures;
use crate::mesh_buffers::GpuMesh;
use crate::shading_need::{Chosen, Reason};
use evaluations::Evaluations;
use prediction::Prediction;
use surface::LitSurface;
pub(crate) use world_needs::WorldNeeds;

/// The conditions of a frame that predictions depend on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Conditions {
    settings: SceneSettings,
    reflection: Option<ReflectionModel>,
    lightmaps: bool,
    irradiance_volumes: bool,
    specular_antialiasing: bool,
    /// Whether vertex colours are clamped.
    clamp: bool,
}

impl Conditions {
    /// Creates the conditions of a frame with these features. The flat rule in `settings` must be that of the
    /// frame.
    pub fn new(settings: &SceneSettings, frame: &FrameFeatures) -> Self {
        Self {
            settings: *settings,
            reflection: frame.reflection,
            lightmaps: frame.lightmaps,
            irradiance_volumes: frame.irradiance_volumes,
            specular_antialiasing: frame.specular_antialiasing,
            clamp: frame.clamp,
        }
    }
}

/// The view of a frame, its size and its exposure.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SizedView {
    pub view: CameraView,
    /// In pixels.
    pub size: [u32; 2],
    pub exposure: f32,
}

/// Returns true if a frame of such objects needs predictions.
pub(crate) fn is_shaded_by_need(
    objects: &ObjectCensus,
    options: &FrameOptions,
    settings: &SceneSettings,
) -> bool {
    match options.shading {
        Some(shading) => matches!(shading, Shading::Auto { .. }),
        None => objects.shaded_by_need(settings.shading) > 0,
    }
}

/// Predictions, kept as long as nothing changes that they follow from.
#[derive(Debug, Default)]
pub(crate) struct ShadingByNeed {
    conditions: Option<Conditions>,
    lamps: Vec<Lamp>,
    /// Lights that changed since the last frame, both as they were and as they are.
    moved: Vec<Lamp>,
    /// By slot.
    kept: Vec<Option<Kept>>,
}

/// If more lights than this change in a frame, all predictions are dropped.
const MAX_MOVED: usize = 128;

#[derive(Debug)]
struct Kept {
    /// The value of [`Object::changed`].
    object: u64,
    /// The viewer that it was predicted for.
    eye: DVec3,
    backward: DVec3,
    prediction: Prediction,
}

impl ShadingByNeed {
    /// Begins a frame: drops predictions that were made under other conditions or that depend on lights that
    /// changed.
    pub fn begin(&mut self, conditions: Conditions, lamps: Vec<Lamp>, objects: &Objects) {
        self.moved.clear();
        if lamps.len() == self.lamps.len() {
            let moved = self.lamps.iter().zip(&lamps).filter(|(before, now)| before != now);
            let moved = moved.take(MAX_MOVED + 1).flat_map(|(before, now)| [before.clone(), now.clone()]);
            self.moved.extend(moved);
        }
        let known = self.conditions == Some(conditions) && lamps.len() == self.lamps.len();
        if !known || self.moved.len() > 2 * MAX_MOVED {
            self.kept.clear();
        } else if !self.moved.is_empty() {
            for (slot, object) in objects.iter() {
                let Some(kept) = self.kept.get_mut(slot) else { continue };
                let touches =
                    |lamp: &Lamp| lamp.reach.touches(object.entity, object.center, object.half_size);
                if kept.is_some() && self.moved.iter().any(touches) {
                    *kept = None;
                }
            }
        }
        self.conditions = Some(conditions);
        self.lamps = lamps;
    }

    /// Chooses the shading of an object. `lights` returns the indices of the lights that reach it, and is
    /// called only if there is no valid prediction.
    pub fn choose(
        &mut self,
        (slot, object): (usize, &Object),
        mesh: &GpuMesh,
        view: &SizedView,
        max_error: ErrorBound,
        lights: impl FnOnce() -> Vec<u32>,
    ) -> Chosen {
        let Some(conditions) = &self.conditions else { return Chosen::default() };
        if self.kept.len() <= slot {
            self.kept.resize_with(slot + 1, || None);
        }
        let kept = &mut self.kept[slot];
        let local = conditions.settings.local_viewer;
        let holds = |kept: &&mut Kept, enough: f64| {
            kept.object == object.changed
                && kept.prediction.suffices(enough)
                && kept.prediction.holds_from(kept.eye, kept.backward, &view.view, local)
        };
        let lamps = &self.lamps;
        let predict = |enough| match kept.as_mut().filter(|kept| holds(kept, enough)) {
            Some(kept) => kept.prediction,
            None => {
                let surface = LitSurface::new(
                    &object.traits,
                    object.reflectance,
                    mesh.spread(),
                    object.world_from_mesh,
                );
                let lamps = lights().into_iter().filter_map(|number| lamps.get(number as usize));
                let prediction = Prediction::new(&surface, conditions, &view.view, enough, lamps);
                let (eye, backward) = (view.view.eye, view.view.basis.z_axis);
                *kept = Some(Kept { object: object.changed, eye, backward, prediction });
                prediction
            }
        };
        let settings = &conditions.settings;
        let evaluations = Evaluations::new(&object.traits, settings, object.into(), mesh.into(), view);
        let lit = !lamps.is_empty() && !object.traits.unlit;
        chosen(&evaluations, lit, view.exposure, max_error, predict)
    }
}

/// Chooses the cheapest shading within the bound; of two with the same cost the simpler one. `predict` is
/// called, for errors up to a given radiance, only if something may be cheaper than Phong shading.
fn chosen(
    evaluations: &Evaluations,
    lit: bool,
    exposure: f32,
    max_error: ErrorBound,
    predict: impl FnOnce(f64) -> Prediction,
) -> Chosen {
    let phong = |reason, errors| Chosen { shading: Shading::Phong, reason, errors, error: 0.0 };
    // Without any light, Phong shading evaluates one colour for the whole object.
    if !lit {
        return phong(Reason::Unlit, [0.0; 2]);
    }
    let Evaluations { flat, gouraud, phong: by_fragments } = *evaluations;
    if by_fragments < flat && by_fragments < gouraud {
        return phong(Reason::FewPixels, [f64::INFINITY; 2]);
    }
    let (exposure, most) = (f64::from(exposure), f64::from(max_error.get()));
    let enough = if exposure > 0.0 { most / exposure } else { f64::INFINITY };
    let prediction = predict(enough);
    let errors = prediction.errors.map(|error| error * exposure);
    let choices = [(Shading::Flat, flat, errors[0]), (Shading::Gouraud, gouraud, errors[1])];
    let cheapest = choices
        .into_iter()
        .filter(|(_, cost, error)| *cost <= by_fragments && *error <= most)
        .min_by(|(_, a, _), (_, b, _)| a.total_cmp(b));
    match cheapest {
        Some((shading, _, error)) => Chosen { shading, reason: prediction.reason, errors, error },
        None => phong(prediction.reason, errors),
    }
}
