//! A point that receives light, as sources and rays see it. Not what it shows: that is a texel or a patch.

use glam::Vec3;

use super::BakeScene;
use super::material::Side;

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

impl Receiver {
    /// A point on one side of a triangle, with the facet's normal as its smooth one. `at` are the barycentric weights of the
    /// second and third vertex.
    pub fn on_facet(scene: &BakeScene, triangle: u32, side: Side, at: (f32, f32)) -> Self {
        let surface = &scene.triangles[triangle as usize];
        let position = surface.position(at.0, at.1);
        let origin = scene.off_surface(triangle, side, position);
        let normal = surface.side_normal(side);
        Self { position, origin, geometric_normal: normal, normal }
    }
}
