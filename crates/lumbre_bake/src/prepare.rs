//! Prepares a bake before any light is computed: the lightmap layout, the scene with its hierarchies, and the light
//! sources. Layout and scene have steps that cannot be interrupted, so they run on a detached thread. The work itself
//! is in `scene` and `sources`.

use std::sync::Arc;

use crate::monitor::BakeMonitor;
use crate::scene::{BakeScene, Canonical, LightmapLayout, StaticScene, lay_out};
use crate::sources::emitters::{Emitter, coarse_textures, emitters};
use crate::sources::light_sources::{Sources, shines_inside_only};
use crate::{BakeError, BakeOptions, BakeReport};

/// Lays out the lightmap of every object, with `density` texels per canonical unit.
///
/// # Errors
/// [`BakeError`] of the layout, or [`BakeError::Cancelled`].
pub(crate) fn layout(
    input: &Arc<StaticScene>,
    space: Canonical,
    density: f64,
    options: &BakeOptions,
    monitor: &mut BakeMonitor<'_>,
    report: &mut BakeReport,
) -> Result<LightmapLayout, BakeError> {
    let (input, options, stop) = (Arc::clone(input), *options, monitor.stop().clone());
    let (layout, warnings) = monitor.run_detached(0.0, move || {
        let mut warnings = Vec::new();
        (lay_out(&input.objects, space, density, &options, &stop, &mut warnings), warnings)
    })?;
    report.warnings.extend(warnings);
    layout
}

/// Builds the scene with its hierarchies, and finds the triangles that emit light. Also returns `layout`, which the
/// detached thread takes by value.
///
/// # Errors
/// [`BakeError`] of the scene, or [`BakeError::Cancelled`].
pub(crate) fn scene(
    input: &Arc<StaticScene>,
    layout: LightmapLayout,
    space: Canonical,
    monitor: &mut BakeMonitor<'_>,
    report: &mut BakeReport,
) -> Result<(BakeScene, LightmapLayout, Vec<Emitter>), BakeError> {
    let (shared_input, stop) = (Arc::clone(input), monitor.stop().clone());
    let (scene, layout, warnings) = monitor.run_detached(0.0, move || {
        let mut warnings = Vec::new();
        let scene = BakeScene::new(&shared_input.objects, &layout, space, &stop, &mut warnings);
        (scene, layout, warnings)
    })?;
    report.warnings.extend(warnings);
    let mut scene = scene?;
    let emitters = monitor.run_interruptible(0.8, || emitters(&scene))?;
    scene.dark_outside = shines_inside_only(&scene, &emitters, &input.lights, input.sky);
    report.triangles = scene.triangles.iter().filter(|triangle| !triangle.is_hidden_duplicate).count();
    Ok((scene, layout, emitters))
}

/// Collects the light sources. The report lists the kinds of sources that the scene does not have, and warns of
/// emissive textures with finer detail than is sampled.
pub(crate) fn sources<'a>(
    input: &StaticScene,
    scene: &'a BakeScene,
    emitters: Vec<Emitter>,
    monitor: &mut BakeMonitor<'_>,
    report: &mut BakeReport,
) -> Result<Sources<'a>, BakeError> {
    let sources =
        monitor.run_interruptible(0.9, || Sources::new(scene, emitters, input.lights.clone(), input.sky))?;
    if sources.is_empty() {
        return Ok(sources);
    }
    if sources.emitters.is_empty() {
        report.skipped.push("area light: no surface emits".into());
    }
    if !sources.has_sky() {
        report.skipped.push("sky light: the scene has no sky".into());
    }
    if sources.lights.is_empty() {
        report.skipped.push("punctual light: no point, spot or directional light is static or mixed".into());
    }
    report.warnings.extend(monitor.run_interruptible(1.0, || coarse_textures(scene))?);
    Ok(sources)
}
