//! A surface point at which arriving light is computed. The result is stored in a texel or a patch, not here.

use glam::Vec3;

/// A point on a surface that receives light.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Receiver {
    /// On the surface.
    pub position: Vec3,
    /// Just off the surface, where rays start.
    pub origin: Vec3,
    /// Unit geometric normal of the receiving side.
    pub geometric_normal: Vec3,
    /// Unit shading normal.
    pub normal: Vec3,
}
