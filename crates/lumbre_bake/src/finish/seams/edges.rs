//! The borders of charts: edges whose position, both in space and on the map, no other triangle shares. Not which of
//! them meet in space: that is `samples`.

use std::collections::HashMap;

use glam::{DVec3, Vec2, Vec3};

use crate::scene::{BakeScene, position_bits};

/// An edge of a triangle on the border of its chart.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Edge {
    pub triangle: u32,
    /// Canonical units.
    pub ends: [DVec3; 2],
    /// Lightmap coordinates of the ends, texels.
    pub uv: [Vec2; 2],
    /// Unit shading normals at the ends.
    pub normals: [Vec3; 2],
    /// Unit, in the triangle's plane, perpendicular to the edge and pointing into the triangle.
    pub inward: Vec3,
}

/// The borders of all charts, in the order of their triangles. Edges that the map collapses to a point would have no
/// samples and are left out.
pub(crate) fn borders(scene: &BakeScene) -> Vec<Edge> {
    // Two corners are the same if their object, position and map coordinates are equal bit by bit.
    let mut corners: HashMap<[u32; 6], u32> = HashMap::new();
    let mut sides: Vec<([u32; 2], u32)> = Vec::new();
    for (index, triangle) in scene.triangles.iter().enumerate() {
        let [a, b, c] = triangle.uv;
        if triangle.is_hidden_duplicate || (b - a).perp_dot(c - a) == 0.0 || !(a + b + c).is_finite() {
            continue;
        }
        let ids: [u32; 3] = std::array::from_fn(|corner| {
            let [x, y, z] = position_bits(triangle.corners[corner]);
            // Adding zero turns -0 into 0.
            let [u, v] = (triangle.uv[corner] + Vec2::ZERO).to_array().map(f32::to_bits);
            let next = corners.len() as u32;
            *corners.entry([triangle.map.0, x, y, z, u, v]).or_insert(next)
        });
        for corner in 0..3 {
            let (from, to) = (ids[corner], ids[(corner + 1) % 3]);
            // There are fewer than 2^28 triangles, so that their 3 corners fit.
            sides.push(([from.min(to), from.max(to)], index as u32 * 3 + corner as u32));
        }
    }
    sides.sort_unstable();
    let unshared = sides.chunk_by(|a, b| a.0 == b.0).filter(|same| same.len() == 1).map(|same| same[0].1);
    let mut borders: Vec<u32> = unshared.collect();
    borders.sort_unstable();
    borders.into_iter().filter_map(|side| edge(scene, side / 3, (side % 3) as usize)).collect()
}

/// The edge of a triangle from a corner to the next; `None` if it is collapsed in space or on the map.
fn edge(scene: &BakeScene, index: u32, corner: usize) -> Option<Edge> {
    let triangle = &scene.triangles[index as usize];
    let next = (corner + 1) % 3;
    let ends = [corner, next].map(|corner| triangle.corners[corner].as_dvec3());
    let along = (ends[1] - ends[0]).try_normalize()?;
    let inward = triangle.normal.as_dvec3().cross(along).normalize_or_zero().as_vec3();
    let uv = [triangle.uv[corner], triangle.uv[next]];
    if uv[0] == uv[1] || inward == Vec3::ZERO {
        return None;
    }
    let normals = match triangle.flat {
        true => [triangle.normal; 2],
        false => [triangle.normals[corner], triangle.normals[next]],
    };
    Some(Edge { triangle: index, ends, uv, normals, inward })
}

impl Edge {
    /// Its length in space, canonical units.
    pub fn length(&self) -> f64 {
        (self.ends[1] - self.ends[0]).length()
    }

    /// Its length on the map, in texels.
    pub fn texels(&self) -> f32 {
        (self.uv[1] - self.uv[0]).length()
    }
}
