//! A scene as light meets it, from objects, in one step: what the tests of later stages begin with.

use super::{BakeScene, Canonical, LightmapLayout, SceneObject, density_of, lay_out};
use crate::BakeOptions;
use crate::cancel_token::CancelToken;

/// Objects laid out as densely as the options ask, and their triangles.
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
