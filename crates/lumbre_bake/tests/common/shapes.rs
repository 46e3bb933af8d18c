//! Meshes that several tests use: rooms (boxes seen from inside) and horizontal squares.

#![allow(dead_code, reason = "each test uses only a part of this module")]

use glam::Vec3;
use lumbre_mesh::{TriangleMesh, shapes};

/// Turns a mesh inside out: reverses the winding of its triangles and its normals.
pub fn inside_out(mut mesh: TriangleMesh) -> TriangleMesh {
    mesh.indices.chunks_exact_mut(3).for_each(|triangle| triangle.swap(1, 2));
    mesh.normals.iter_mut().for_each(|normal| *normal = -*normal);
    mesh
}

/// A box about the origin whose faces look inward.
pub fn room(size: Vec3) -> TriangleMesh {
    inside_out(shapes::cuboid(size, 1))
}

/// A horizontal square about the y axis at height `y`, without normals and texture coordinates, that looks up or down.
pub fn square(side: f32, y: f32, up: bool) -> TriangleMesh {
    let h = 0.5 * side;
    let positions = [[-h, -h], [h, -h], [h, h], [-h, h]].map(|[x, z]| Vec3::new(x, y, z)).to_vec();
    let indices = if up { vec![0, 2, 1, 0, 3, 2] } else { vec![0, 1, 2, 0, 2, 3] };
    TriangleMesh { positions, indices, ..TriangleMesh::default() }
}
