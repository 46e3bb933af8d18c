//! Prepares a bake before any light is computed: the lightmap layout, the scene with its hierarchies, and the light
//! sources. Layout and scene have steps that cannot be interrupted, so they run on a detached thread. The work itself
//! is in `scene` and `sources`.

use std::sync::Arc;

use crate::monitor::BakeMonitor;
use crate::report::StageNotes;
use crate::scene::{BakeScene, Canonical, Layouter, LightmapLayout, StaticScene};
use crate::sources::emitters::{coarse_textures, emitters};
use crate::sources::light_sources::shines_inside_only;
use crate::sources::{Emitter, Sources};
use crate::{BakeError, BakeOptions};

/// What is decided before anything is laid out.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BakePlan {
    /// The space that the bake works in.
    pub space: Canonical,
    /// Texels per canonical unit.
    pub density: f64,
    /// Bytes per covered texel for samples of the former bake and for the next one.
    pub sample_bytes: u64,
}

/// Lays out the lightmap of every object.
pub(crate) fn layout(
    input: &Arc<StaticScene>,
    plan: &BakePlan,
    options: &BakeOptions,
    monitor: &mut BakeMonitor<'_>,
) -> Result<(LightmapLayout, StageNotes), BakeError> {
    let BakePlan { space, density, .. } = *plan;
    let (input, options, stop) = (Arc::clone(input), *options, monitor.stop().clone());
    monitor.run_detached(0.0, move || {
        let mut layouter = Layouter { space, density, options: &options, stop: &stop, warnings: Vec::new() };
        let layout = layouter.lay_out(&input.objects)?;
        Ok((layout, StageNotes::of_warnings(layouter.warnings)))
    })?
}

/// The scene with its hierarchies, the layout of its maps and the triangles that emit light.
type SceneToBake = (BakeScene, LightmapLayout, Vec<Emitter>);

/// Builds the scene with its hierarchies, and finds the triangles that emit light. Also returns `layout`, which the
/// detached thread takes by value.
pub(crate) fn scene(
    input: &Arc<StaticScene>,
    layout: LightmapLayout,
    space: Canonical,
    monitor: &mut BakeMonitor<'_>,
) -> Result<(SceneToBake, StageNotes), BakeError> {
    let (shared_input, stop) = (Arc::clone(input), monitor.stop().clone());
    let (scene, layout, warnings) = monitor.run_detached(0.0, move || {
        let mut warnings = Vec::new();
        let scene = BakeScene::new(&shared_input.objects, &layout, space, &stop, &mut warnings);
        (scene, layout, warnings)
    })?;
    let mut scene = scene?;
    let emitters = monitor.run_interruptible(0.8, || emitters(&scene))?;
    scene.dark_outside = shines_inside_only(&scene, &emitters, &input.lights, input.sky);
    Ok(((scene, layout, emitters), StageNotes::of_warnings(warnings)))
}

/// Collects the light sources. The notes name the kinds of sources that the scene does not have, and warn of emissive
/// textures with finer detail than is sampled.
pub(crate) fn sources<'a>(
    input: &StaticScene,
    scene: &'a BakeScene,
    emitters: Vec<Emitter>,
    monitor: &mut BakeMonitor<'_>,
) -> Result<(Sources<'a>, StageNotes), BakeError> {
    let sources =
        monitor.run_interruptible(0.9, || Sources::new(scene, emitters, input.lights.clone(), input.sky))?;
    if sources.is_empty() {
        return Ok((sources, StageNotes::default()));
    }
    let missing = [
        (sources.emitters.is_empty(), "area light: no surface emits"),
        (!sources.has_sky(), "sky light: the scene has no sky"),
        (sources.lights.is_empty(), "punctual light: no point, spot or directional light is static or mixed"),
    ];
    let skipped = missing.into_iter().filter(|(is_missing, _)| *is_missing).map(|(_, why)| why.to_owned());
    let warnings = monitor.run_interruptible(1.0, || coarse_textures(scene))?;
    let notes = StageNotes { warnings, skipped: skipped.collect(), ..StageNotes::default() };
    Ok((sources, notes))
}
