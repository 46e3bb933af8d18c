//! Meshes for flat shading: one normal and one centroid per triangle.

use glam::Vec3;

use crate::TriangleMesh;
use crate::normals::face_normal;

/// A triangle with vertices of its own, and the values for which flat shading is evaluated once.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FlatTriangle {
    /// Corners in metres.
    pub positions: [Vec3; 3],
    /// Unit face normal; zero for a degenerate triangle.
    pub normal: Vec3,
    /// Mean of the corners, in metres, computed in f64.
    pub centroid: Vec3,
}

/// The triangles of a mesh for flat shading, in order. Triangles with an index out of range are left out;
/// [`TriangleMesh::validate`] reports them.
pub fn flat_triangles(mesh: &TriangleMesh) -> impl Iterator<Item = FlatTriangle> + '_ {
    mesh.triangles().filter_map(|triangle| {
        let [a, b, c] = triangle.map(|vertex| mesh.positions.get(vertex as usize).copied());
        let positions = [a?, b?, c?];
        let [a, b, c] = positions.map(|position| position.as_dvec3());
        let centroid = ((a + b + c) / 3.0).as_vec3();
        Some(FlatTriangle { positions, normal: face_normal(&positions).unwrap_or_default(), centroid })
    })
}

/// The mesh with three separate vertices for every triangle, all with the face normal, as glTF requires for
/// meshes without normals. Other attributes are copied. Degenerate triangles get zero normals.
///
/// Triangles with an index out of range are left out; [`TriangleMesh::validate`] reports them.
pub fn flat_shaded(mesh: &TriangleMesh) -> TriangleMesh {
    let in_range = |t: &[u32; 3]| t.iter().all(|&vertex| (vertex as usize) < mesh.positions.len());
    let sources: Vec<u32> = mesh.triangles().filter(in_range).flatten().collect();
    let without_normals = TriangleMesh { normals: Vec::new(), ..mesh.clone() };
    let mut flat = without_normals.with_vertices(&sources, (0..sources.len() as u32).collect());
    flat.normals = flat_triangles(mesh).flat_map(|triangle| [triangle.normal; 3]).collect();
    flat
}

/// Adds flat normals to a mesh without normals, as glTF 2.0 requires (section 3.7.2.1). Vertices are split by
/// triangle.
///
/// A mesh with normals is returned unchanged.
pub fn compute_flat_normals(mesh: TriangleMesh) -> TriangleMesh {
    if mesh.normals.is_empty() { flat_shaded(&mesh) } else { mesh }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec2;

    #[test]
    fn every_triangle_gets_its_own_vertices() {
        let mesh = TriangleMesh {
            positions: vec![Vec3::ZERO, Vec3::X * 3.0, Vec3::Y * 3.0, Vec3::Z * 3.0],
            uv0: vec![Vec2::ZERO, Vec2::X, Vec2::Y, Vec2::ONE],
            indices: vec![0, 1, 2, 0, 3, 1, 0, 1, 1, 0, 1, 9],
            ..TriangleMesh::default()
        };
        let flat = flat_shaded(&mesh);
        assert_eq!(flat.indices, (0..9).collect::<Vec<u32>>());
        assert_eq!(flat.normals[..3], [Vec3::Z; 3]);
        assert_eq!(flat.normals[3..6], [Vec3::Y; 3]);
        assert_eq!(flat.normals[6..], [Vec3::ZERO; 3]);
        assert_eq!(flat.uv0[4], Vec2::ONE);
        let triangles: Vec<_> = flat_triangles(&mesh).collect();
        assert_eq!(triangles.len(), 3);
        assert_eq!(triangles[0].centroid, Vec3::new(1.0, 1.0, 0.0));
        assert_eq!(triangles[2].centroid, Vec3::X * 2.0);
    }

    #[test]
    fn the_centroid_neither_overflows_nor_drifts() {
        let far = Vec3::splat(f32::MAX);
        let mesh = TriangleMesh { positions: vec![far; 3], indices: vec![0, 1, 2], ..Default::default() };
        let triangle = flat_triangles(&mesh).next().unwrap();
        assert_eq!((triangle.centroid, triangle.normal), (far, Vec3::ZERO));
    }
}
