//! Builds a `BakeScene` and its layout from objects in one step, for the tests of later stages.

use super::{BakeScene, Canonical, LightmapLayout, SceneObject, density_of, lay_out};
use crate::BakeOptions;
use crate::cancel_token::CancelToken;

/// The layout of the objects at the density that the options request, and the scene of their triangles.
pub(crate) fn laid_out(
    objects: &[SceneObject],
    space: Canonical,
    options: &BakeOptions,
) -> (LightmapLayout, BakeScene) {
    let (density, stop, mut warnings) =
        (density_of(objects, space, options), CancelToken::default(), Vec::new());
    let layout = lay_out(objects, space, density, options, &stop, &mut warnings).unwrap();
    let scene = BakeScene::new(objects, &layout, space, &stop, &mut warnings).unwrap();
    (layout, scene)
}
