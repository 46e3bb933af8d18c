//! What comes before the light: where the texels are, the scene as light meets it, and what shines in it. The first two have steps that cannot be
//! asked to end and so run apart from the caller's thread. Not the steps themselves.

use std::sync::Arc;

use crate::monitor::BakeMonitor;
use crate::scene::{BakeScene, Canonical, LightmapLayout, StaticScene, lay_out};
use crate::sources::emitters::{Emitter, coarse_textures, emitters};
use crate::sources::light_sources::{Sources, shines_inside_only};
use crate::{BakeError, BakeOptions, BakeReport};

/// Lays out every object, with so many texels per canonical unit.
///
/// # Errors
/// [`BakeError`] of the layout, or that nobody waits for it.
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

/// The scene, with its hierarchy, the layout again, and the triangles that shine.
///
/// # Errors
/// [`BakeError`] of the scene, or that nobody waits for it.
pub(crate) fn scene(
    input: &Arc<StaticScene>,
    layout: LightmapLayout,
    space: Canonical,
    monitor: &mut BakeMonitor<'_>,
    report: &mut BakeReport,
) -> Result<(BakeScene, LightmapLayout, Vec<Emitter>), BakeError> {
    let (own, stop) = (Arc::clone(input), monitor.stop().clone());
    let (scene, layout, warnings) = monitor.run_detached(0.0, move || {
        let mut warnings = Vec::new();
        let scene = BakeScene::new(&own.objects, &layout, space, &stop, &mut warnings);
        (scene, layout, warnings)
    })?;
    report.warnings.extend(warnings);
    let mut scene = scene?;
    let emitters = monitor.run_interruptible(0.8, || emitters(&scene))?;
    scene.dark_outside = shines_inside_only(&scene, &emitters, &input.lights, input.sky);
    report.triangles = scene.triangles.iter().filter(|triangle| !triangle.is_hidden_duplicate).count();
    Ok((scene, layout, emitters))
}

/// What shines in the scene. The report names the kinds of light that there are none of, and textures that shine in finer detail than is sampled.
///
/// # Errors
/// [`BakeError::Cancelled`].
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
