//! Builds a `BakeScene` and its layout from objects in one step, for the tests of later stages.

use super::{BakeScene, Canonical, Layouter, LightmapLayout, SceneObject, density_of};
use crate::BakeOptions;
use crate::cancel_token::CancelToken;

/// The layout of the objects at the density that the options request, and the scene of their triangles.
pub(crate) fn laid_out(
    objects: &[SceneObject],
    space: Canonical,
    options: &BakeOptions,
) -> (LightmapLayout, BakeScene) {
    let (density, stop) = (density_of(objects, space, options), CancelToken::default());
    let mut layouter = Layouter { space, density, options, stop: &stop, warnings: Vec::new() };
    let layout = layouter.lay_out(objects).unwrap();
    let scene = BakeScene::new(objects, &layout, space, &stop, &mut layouter.warnings).unwrap();
    (layout, scene)
}
