//! Builds a `BakeScene` and its layout from objects in one step, for the tests of later stages.

use std::sync::Arc;

use lumbre_mesh::TriangleMesh;

use super::{
    BakeScene, Canonical, Layouter, LightmapLayout, PlacedPrimitive, SceneObject, StaticScene, density_of,
};
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

/// The same for a scene that is a single mesh.
pub(crate) fn mesh_laid_out(mesh: TriangleMesh, options: &BakeOptions) -> (LightmapLayout, BakeScene) {
    let placed = PlacedPrimitive { mesh: Arc::new(mesh), ..PlacedPrimitive::default() };
    let objects = vec![SceneObject::new("mesh", vec![placed])];
    let input = StaticScene { objects, ..StaticScene::default() }.checked().unwrap();
    laid_out(&input.objects, input.space(), options)
}
