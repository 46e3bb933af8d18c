//! Surfaces over which light is compared and smoothed: triangles of one chart whose normals are about the same. The
//! texels on them are in `texel_rows`.

use glam::Vec3;

/// Triangles of one chart with exactly the same normal, in texels of one group.
#[derive(Clone, Copy)]
pub(crate) struct Surface {
    pub chart: u32,
    pub normal: Vec3,
    pub group: u32,
}

/// The surface of a cell without a texel.
pub(crate) const NONE: u32 = u32::MAX;

/// Whether light is continuous over two surfaces, so that texels on them are neighbours: of one chart and one group,
/// with similar normals.
pub(crate) fn is_continuous(surfaces: &[Surface], surface: u32, other: u32) -> bool {
    let [Some(first), Some(second)] = [surface, other].map(|index| surfaces.get(index as usize)) else {
        return false;
    };
    first.chart == second.chart && first.group == second.group && first.normal.dot(second.normal) > 0.9
}
