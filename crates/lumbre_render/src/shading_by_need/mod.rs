//! Shading by need: which of flat, Gouraud and Phong shading an object takes in a view, where `Shading::Auto` asks for no more than an error. Not the bounds on that error, which
//! are `lumbre_optics::interpolation_error`, nor how often anything is shaded in the end: that is the variant that is drawn.
//!
//! ```text
//!   mesh ► spread of its triangles ─┐
//!   object ► box, reflectance ──────┼─► prediction: errors of flat and Gouraud ─┐
//!   lights that reach it ► Lamp ────┤   (kept while none of these changes and    ├─► choice: the cheapest that is within the bound
//!   eye, with room to move ─────────┘    the eye stays near where it was)        │
//!   vertices, pixels of its box ──────────────────────────► evaluations ─────────┘
//! ```

mod evaluations;
mod need;
mod prediction;
mod surface;
mod world_needs;

use glam::DVec3;
use lumbre_optics::{ErrorBound, ReflectionModel, Shading};
use lumbre_scene::{ObjectCensus, SceneSettings};

use crate::FrameOptions;
use crate::extract::{CameraView, Lamp, Object};
use crate::features::FrameFeatures;
use crate::mesh_buffers::GpuMesh;
use evaluations::Evaluations;
pub(crate) use need::Chosen;
pub use need::{ShadingNeed, ShadingNeeds};
use prediction::Prediction;
use surface::LitSurface;
pub(crate) use world_needs::WorldNeeds;

/// What a frame is shaded by, as far as predictions know it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Conditions {
    settings: SceneSettings,
    reflection: Option<ReflectionModel>,
    lightmaps: bool,
    irradiance_volumes: bool,
    specular_antialiasing: bool,
    /// Colours of vertices are clamped.
    clamp: bool,
}

impl Conditions {
    /// Of a frame with these features, and settings in which the flat rule is that of the frame.
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

/// From where a frame is seen, how large it is, and how bright.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SizedView {
    pub view: CameraView,
    /// In pixels.
    pub size: [u32; 2],
    pub exposure: f32,
}

/// Whether a frame of such objects asks for predictions.
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

/// Predictions, kept while what they follow from stays as it was.
#[derive(Debug, Default)]
pub(crate) struct ShadingByNeed {
    conditions: Option<Conditions>,
    lamps: Vec<Lamp>,
    /// By slot.
    kept: Vec<Option<Kept>>,
}

#[derive(Debug)]
struct Kept {
    /// [`Object::changed`].
    object: u64,
    /// From where it was predicted.
    eye: DVec3,
    backward: DVec3,
    prediction: Prediction,
}

impl ShadingByNeed {
    /// Begins a frame: predictions under other lights or conditions are forgotten.
    pub fn begin(&mut self, conditions: Conditions, lamps: Vec<Lamp>) {
        if self.conditions != Some(conditions) || self.lamps != lamps {
            self.kept.clear();
            self.conditions = Some(conditions);
            self.lamps = lamps;
        }
    }

    /// What an object takes. `lights` are the numbers of the lamps that reach it, looked up only if nothing is known of it.
    pub fn choose(
        &mut self,
        (slot, object): (usize, &Object),
        mesh: &GpuMesh,
        view: &SizedView,
        max_error: ErrorBound,
        lights: impl FnOnce() -> Vec<u32>,
    ) -> Chosen {
        let Some(conditions) = &self.conditions else {
            return Chosen { shading: Shading::Phong, ..Chosen::default() };
        };
        if self.kept.len() <= slot {
            self.kept.resize_with(slot + 1, || None);
        }
        let kept = &mut self.kept[slot];
        let local = conditions.settings.local_viewer;
        let holds = |kept: &&mut Kept| {
            kept.object == object.changed
                && kept.prediction.holds_from(kept.eye, kept.backward, &view.view, local)
        };
        let prediction = match kept.as_mut().filter(holds) {
            Some(kept) => kept.prediction,
            None => {
                let surface = LitSurface::of_object(object, mesh);
                let lamps = lights().into_iter().filter_map(|number| self.lamps.get(number as usize));
                let prediction = Prediction::new(&surface, conditions, &view.view, lamps);
                let (eye, backward) = (view.view.eye, view.view.basis.z_axis);
                *kept = Some(Kept { object: object.changed, eye, backward, prediction });
                prediction
            }
        };
        let lit = !self.lamps.is_empty();
        let settings = &conditions.settings;
        let evaluations = Evaluations::new(&object.traits, settings, object.into(), mesh.into(), view);
        chosen(&prediction, &evaluations, lit, view, max_error)
    }
}

/// The cheapest that is within the bound; the simpler one of two that cost the same.
fn chosen(
    prediction: &Prediction,
    evaluations: &Evaluations,
    lit: bool,
    view: &SizedView,
    max_error: ErrorBound,
) -> Chosen {
    let reason = prediction.reason;
    let errors = prediction.errors.map(|error| error * f64::from(view.exposure));
    // Without any light Phong shading evaluates a colour once for the whole object.
    if !lit || !reason.is_lit() {
        return Chosen { shading: Shading::Phong, reason, errors, error: 0.0 };
    }
    let within = |error: f64| error <= f64::from(max_error.get());
    let choices = [
        (Shading::Flat, evaluations.flat, errors[0]),
        (Shading::Gouraud, evaluations.gouraud, errors[1]),
        (Shading::Phong, evaluations.phong, 0.0),
    ];
    let cheapest = choices
        .into_iter()
        .filter(|(_, _, error)| within(*error))
        .min_by(|(_, a, _), (_, b, _)| a.total_cmp(b));
    // Phong shading is always within.
    let (shading, _, error) = cheapest.unwrap_or((Shading::Phong, 0.0, 0.0));
    Chosen { shading, reason, errors, error }
}
