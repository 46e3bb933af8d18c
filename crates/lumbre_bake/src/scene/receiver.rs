//! A point that receives light, as sources and rays see it. Not what it shows: that is a texel or a patch.

use glam::Vec3;

/// A point of a receiver.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Receiver {
    /// On the surface.
    pub position: Vec3,
    /// Just off it.
    pub origin: Vec3,
    /// Unit, of the side that receives.
    pub geometric_normal: Vec3,
    /// Unit, smooth.
    pub normal: Vec3,
}
