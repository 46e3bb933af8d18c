//! Room for lightmap coordinates where a material's textures read `uv1`: they move to `uv0` if nothing reads that, and normal and occlusion
//! maps, which no bake reads, make way. Not the unwrap that takes their place.

use std::sync::Arc;

use lumbre_mesh::TriangleMesh;
use lumbre_scene::MaterialTextures;

use super::{PlacedPrimitive, SceneObject};
use crate::BakeError;

/// Which of a mesh's two sets of coordinates a material's textures read.
pub(crate) fn sets_read(textures: Option<&MaterialTextures>) -> [bool; 2] {
    let mut read = [false; 2];
    for texture in textures.into_iter().flat_map(MaterialTextures::references) {
        read[usize::from(texture.tex_coord != 0)] = true;
    }
    read
}

/// The textures without the normal and occlusion maps that read `uv1`.
fn without_second_surface_maps(textures: &MaterialTextures) -> MaterialTextures {
    let mut textures = textures.clone();
    textures.normal.take_if(|map| map.texture.tex_coord != 0);
    textures.occlusion.take_if(|map| map.texture.tex_coord != 0);
    textures
}

/// Whether a mesh's two sets are read, and are not the same.
fn reads_different_sets(mesh: &TriangleMesh, textures: Option<&MaterialTextures>) -> bool {
    sets_read(textures) == [true, true] && mesh.uv0 != mesh.uv1
}

/// The textures of a mesh, reading `uv0`. Where they read both sets, normal and occlusion maps on `uv1` are gone: for them there is no room.
pub(crate) fn reading_first(mesh: &TriangleMesh, textures: &MaterialTextures) -> MaterialTextures {
    let mut textures = match reads_different_sets(mesh, Some(textures)) {
        true => without_second_surface_maps(textures),
        false => textures.clone(),
    };
    for texture in textures.references_mut() {
        texture.tex_coord = 0;
    }
    textures
}

/// The object with `uv1` free for the lightmap, and the parts of which `uv1` became `uv0`.
///
/// # Errors
/// [`BakeError::CoordinatesInUse`] where both sets are read, by more than normal and occlusion maps, and differ: a mesh has no third.
pub(crate) fn free_second(object: &SceneObject) -> Result<(SceneObject, Vec<bool>), BakeError> {
    let mut freed = object.clone();
    let mut moved = vec![false; object.primitives.len()];
    for (part, moved) in freed.primitives.iter_mut().zip(&mut moved) {
        let Some(textures) = part.textures.as_ref().filter(|textures| sets_read(Some(textures))[1]) else {
            continue;
        };
        let read_first = reading_first(&part.mesh, textures);
        if reads_different_sets(&part.mesh, Some(textures)) {
            if sets_read(Some(&without_second_surface_maps(textures)))[1] {
                return Err(BakeError::CoordinatesInUse { object: object.name.clone() });
            }
        } else {
            part.mesh = Arc::new(TriangleMesh { uv0: part.mesh.uv1.clone(), ..(*part.mesh).clone() });
        }
        part.textures = Some(read_first);
        *moved = true;
    }
    Ok((freed, moved))
}

/// A part's textures, which read `uv0` if its `uv1` has moved there.
pub(crate) fn textures_of(part: &PlacedPrimitive, moved: bool) -> Option<MaterialTextures> {
    let read_first = |textures| reading_first(&part.mesh, textures);
    if moved { part.textures.as_ref().map(read_first) } else { part.textures.clone() }
}
