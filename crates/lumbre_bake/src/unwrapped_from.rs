//! What a bake's mesh was before it got its lightmap coordinates: the next bake of the same World reads that, and so knows what has not
//! changed. Not the unwrap.

use std::sync::Arc;

use bevy_ecs::prelude::Component;
use lumbre_mesh::TriangleMesh;
use lumbre_scene::{MaterialTextures, Mesh};

/// Beside a [`Mesh`] that a bake has made: what it made it of. Another mesh that takes its place later, or a change of it, counts instead.
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

    /// The mesh as it was before.
    pub fn mesh(&self) -> &Arc<TriangleMesh> {
        &self.source.0
    }

    /// What a bake reads of an entity with such a mesh and such textures: what they were made of, if these are the ones.
    pub(crate) fn read(
        own: Option<&Self>,
        mesh: &Mesh,
        textures: Option<&MaterialTextures>,
    ) -> (Arc<TriangleMesh>, Option<MaterialTextures>) {
        let now = || (Arc::clone(&mesh.0), textures.cloned());
        let Some(own) = own.filter(|own| Arc::ptr_eq(&own.made.0, &mesh.0)) else { return now() };
        let moved = own.source.1 != own.made.1;
        match (moved, own.made.1.as_ref() == textures) {
            // Textures that the bake has left alone may be exchanged: they read what they have always read.
            (false, _) => (Arc::clone(&own.source.0), textures.cloned()),
            (true, true) => own.source.clone(),
            // Made for the coordinates as they are now.
            (true, false) => now(),
        }
    }
}
