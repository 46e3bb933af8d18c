//! Remembers the mesh from which a bake made an unwrapped one. The next bake of the same World reads that original, and
//! so recognises objects that have not changed. The unwrap itself is in `scene`.

use std::sync::Arc;

use bevy_ecs::prelude::Component;
use lumbre_mesh::TriangleMesh;
use lumbre_scene::{MaterialTextures, Mesh};

/// Component that records from which mesh and textures a bake made the entity's unwrapped [`Mesh`]. It is ignored once
/// the entity has been given another mesh.
#[derive(Component, Clone, Debug)]
pub struct UnwrappedFrom {
    source: (Arc<TriangleMesh>, Option<MaterialTextures>),
    made: (Arc<TriangleMesh>, Option<MaterialTextures>),
}

impl UnwrappedFrom {
    pub(crate) fn new(
        source: (Arc<TriangleMesh>, Option<MaterialTextures>),
        made: (Arc<TriangleMesh>, Option<MaterialTextures>),
    ) -> Self {
        Self { source, made }
    }

    /// The mesh as it was before the bake.
    pub fn mesh(&self) -> &Arc<TriangleMesh> {
        &self.source.0
    }

    /// The mesh and textures that a bake has to read for an entity: the originals if the entity still has the unwrapped
    /// mesh, otherwise its current ones.
    pub(crate) fn read(
        unwrapped: Option<&Self>,
        mesh: &Mesh,
        textures: Option<&MaterialTextures>,
    ) -> (Arc<TriangleMesh>, Option<MaterialTextures>) {
        let current = || (Arc::clone(&mesh.0), textures.cloned());
        let unwrapped = unwrapped.filter(|unwrapped| Arc::ptr_eq(&unwrapped.made.0, &mesh.0));
        let Some(unwrapped) = unwrapped else { return current() };
        let bake_changed_textures = unwrapped.source.1 != unwrapped.made.1;
        match (bake_changed_textures, unwrapped.made.1.as_ref() == textures) {
            // The bake has not redirected textures to other coordinates, so they fit the original mesh even if they
            // were replaced since.
            (false, _) => (Arc::clone(&unwrapped.source.0), textures.cloned()),
            (true, true) => unwrapped.source.clone(),
            // These textures were chosen for the coordinates of the unwrapped mesh.
            (true, false) => current(),
        }
    }
}
