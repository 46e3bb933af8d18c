//! Surfaces over which light is compared and smoothed: triangles of one chart whose normals are about the same. Not the texels on them.

use glam::Vec3;

/// Triangles of one chart with the very same normal, in texels of one group.
#[derive(Clone, Copy)]
pub(crate) struct Surface {
    pub chart: u32,
    pub normal: Vec3,
    pub group: u32,
}

/// No texel, no surface.
pub(crate) const NONE: u32 = u32::MAX;

/// Whether light may be compared over two surfaces.
pub(crate) fn goes_on(surfaces: &[Surface], surface: u32, other: u32) -> bool {
    let [Some(own), Some(other)] = [surface, other].map(|index| surfaces.get(index as usize)) else {
        return false;
    };
    own.chart == other.chart && own.group == other.group && own.normal.dot(other.normal) > 0.9
}
