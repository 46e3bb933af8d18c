//! A surface point at which arriving light is computed. The result is stored in a texel or a patch, not here.

use glam::Vec3;

use super::BakeScene;
use super::material::Side;

/// A point on a surface that receives light.
#[derive(Clone, Copy, Debug, Default)]
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
