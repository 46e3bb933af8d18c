//! What comes before the light: where the texels are, and the scene as light meets it. Both have steps that cannot be asked to end and so run apart
//! from the caller's thread. Not the steps themselves.

use std::sync::Arc;

use crate::progress::Watch;
use crate::scene::{BakeScene, Canonical, LightmapLayout, Object, lay_out_with};
use crate::{BakeError, BakeOptions};

/// Lays out every object, with so many texels per canonical unit.
///
/// # Errors
/// [`BakeError`] of the layout, or that nobody waits for it.
pub(crate) fn layout(
    objects: &Arc<Vec<Object>>,
    space: Canonical,
    density: f64,
    options: &BakeOptions,
    watch: &mut Watch<'_>,
    warnings: &mut Vec<String>,
) -> Result<LightmapLayout, BakeError> {
    let (objects, options, stop) = (Arc::clone(objects), *options, watch.stop().clone());
    let (layout, more) = watch.apart(0.0, move || {
        let mut warnings = Vec::new();
        (lay_out_with(&objects, space, density, &options, &stop, &mut warnings), warnings)
    })?;
    warnings.extend(more);
    layout
}

/// The scene, with its hierarchy, and the layout again.
///
/// # Errors
/// [`BakeError`] of the scene, or that nobody waits for it.
pub(crate) fn scene(
    objects: &Arc<Vec<Object>>,
    layout: LightmapLayout,
    space: Canonical,
    watch: &mut Watch<'_>,
    warnings: &mut Vec<String>,
) -> Result<(BakeScene, LightmapLayout), BakeError> {
    let (objects, stop) = (Arc::clone(objects), watch.stop().clone());
    let (scene, layout, more) = watch.apart(0.0, move || {
        let mut warnings = Vec::new();
        let scene = BakeScene::new(&objects, &layout, space, &stop, &mut warnings);
        (scene, layout, warnings)
    })?;
    warnings.extend(more);
    Ok((scene?, layout))
}
