//! Room for lightmap coordinates where a material's textures read `uv1`: they move to `uv0` if nothing reads that. Not the
//! unwrap that takes their place.

use std::sync::Arc;

use lumbre_mesh::TriangleMesh;
use lumbre_scene::MaterialTextures;

use super::{Object, PlacedPrimitive};
use crate::BakeError;

/// Which of a mesh's two sets of coordinates a material's textures read.
pub(crate) fn sets_read(textures: Option<&MaterialTextures>) -> [bool; 2] {
    let mut read = [false; 2];
    for texture in textures.into_iter().flat_map(MaterialTextures::references) {
        read[usize::from(texture.tex_coord != 0)] = true;
    }
    read
}

/// The textures, reading `uv0`.
pub(crate) fn reading_first(textures: &MaterialTextures) -> MaterialTextures {
    let mut textures = textures.clone();
    for texture in textures.references_mut() {
        texture.tex_coord = 0;
    }
    textures
}

/// The object with `uv1` free for the lightmap, and the parts of which `uv1` became `uv0`.
///
/// # Errors
/// [`BakeError::CoordinatesInUse`] where both sets are read and differ: a mesh has no third.
pub(crate) fn free_second(object: &Object) -> Result<(Object, Vec<bool>), BakeError> {
    let mut freed = object.clone();
    let mut moved = vec![false; object.primitives.len()];
    for (part, moved) in freed.primitives.iter_mut().zip(&mut moved) {
        match sets_read(part.textures.as_ref()) {
            [_, false] => {}
            [true, true] if part.mesh.uv0 != part.mesh.uv1 => {
                return Err(BakeError::CoordinatesInUse { object: object.name.clone() });
            }
            [_, true] => {
                part.mesh = Arc::new(TriangleMesh { uv0: part.mesh.uv1.clone(), ..(*part.mesh).clone() });
                part.textures = part.textures.as_ref().map(reading_first);
                *moved = true;
            }
        }
    }
    Ok((freed, moved))
}

/// A part's textures, which read `uv0` if its `uv1` has moved there.
pub(crate) fn textures_of(part: &PlacedPrimitive, moved: bool) -> Option<MaterialTextures> {
    if moved { part.textures.as_ref().map(reading_first) } else { part.textures.clone() }
}
