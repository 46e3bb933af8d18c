//! Frees `uv1` for lightmap coordinates where a material's textures read it: the textures' coordinates move to `uv0` if
//! nothing reads that, and normal and occlusion maps, which no bake reads, are dropped if necessary. The unwrap that
//! then fills `uv1` is in `lightmap_layout`.

use std::sync::Arc;

use lumbre_mesh::TriangleMesh;
use lumbre_scene::MaterialTextures;

use super::{PlacedPrimitive, SceneObject};
use crate::BakeError;

/// Which of a mesh's two sets of texture coordinates a material's textures read.
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

/// Whether both of a mesh's sets are read, and differ.
fn reads_different_sets(mesh: &TriangleMesh, textures: Option<&MaterialTextures>) -> bool {
    sets_read(textures) == [true, true] && mesh.uv0 != mesh.uv1
}

/// The textures of a mesh, all reading `uv0`. If they read two different sets, the normal and occlusion maps on `uv1`
/// are dropped, since there is no set left for them.
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

/// The object with `uv1` free for the lightmap, and for each primitive whether its textures were changed to read `uv0`.
///
/// # Errors
/// [`BakeError::CoordinatesInUse`] if both sets are read, differ, and `uv1` is read by more than normal and occlusion
/// maps: a mesh has no third set.
pub(crate) fn free_second(object: &SceneObject) -> Result<(SceneObject, Vec<bool>), BakeError> {
    let mut freed = object.clone();
    let mut moved = vec![false; object.primitives.len()];
    for (primitive, moved) in freed.primitives.iter_mut().zip(&mut moved) {
        let Some(textures) = primitive.textures.as_ref().filter(|textures| sets_read(Some(textures))[1])
        else {
            continue;
        };
        let read_first = reading_first(&primitive.mesh, textures);
        if reads_different_sets(&primitive.mesh, Some(textures)) {
            if sets_read(Some(&without_second_surface_maps(textures)))[1] {
                return Err(BakeError::CoordinatesInUse { object: object.name.clone() });
            }
        } else {
            primitive.mesh =
                Arc::new(TriangleMesh { uv0: primitive.mesh.uv1.clone(), ..(*primitive.mesh).clone() });
        }
        primitive.textures = Some(read_first);
        *moved = true;
    }
    Ok((freed, moved))
}

/// A primitive's textures, changed to read `uv0` if `moved`.
pub(crate) fn textures_of(primitive: &PlacedPrimitive, moved: bool) -> Option<MaterialTextures> {
    let read_first = |textures| reading_first(&primitive.mesh, textures);
    if moved { primitive.textures.as_ref().map(read_first) } else { primitive.textures.clone() }
}
