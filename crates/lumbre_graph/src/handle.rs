//! Handles: names for one *version* of a texture or a buffer of one graph.
//!
//! Reading takes `&handle`. Writing takes `&mut handle` and advances it to the version that the write makes, so
//! that later reads through it see what was written. A handle owns nothing: it is an index and free to copy. A copy
//! made before a write still names the older version, and writing through such a stale copy is the error
//! [`TwoWriters`](crate::GraphError::TwoWriters). A handle is not the GPU object, which a pass gets from its
//! context.

use std::marker::PhantomData;

/// The resource kind of a [`BufferHandle`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Buffer {}

/// The resource kind of a [`TextureHandle`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Texture {}

/// One version of a texture.
pub type TextureHandle = Handle<Texture>;

/// One version of a buffer.
pub type BufferHandle = Handle<Buffer>;

/// One version of a resource of one graph.
pub struct Handle<K> {
    pub(crate) graph: u64,
    pub(crate) resource: u32,
    pub(crate) version: u32,
    kind: PhantomData<K>,
}

impl<K> Handle<K> {
    pub(crate) fn new(graph: u64, resource: u32) -> Self {
        Self { graph, resource, version: 0, kind: PhantomData }
    }

    /// Returns the number of writes between the resource's declaration and this handle.
    #[must_use]
    pub fn version(&self) -> u32 {
        self.version
    }
}

// Written by hand, because a derive would require the same traits of `K`, which is only a marker.
impl<K> Clone for Handle<K> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<K> Copy for Handle<K> {}

impl<K> PartialEq for Handle<K> {
    fn eq(&self, other: &Self) -> bool {
        (self.graph, self.resource, self.version) == (other.graph, other.resource, other.version)
    }
}

impl<K> Eq for Handle<K> {}

impl<K> std::fmt::Debug for Handle<K> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Handle(graph {}, resource {}, version {})", self.graph, self.resource, self.version)
    }
}
