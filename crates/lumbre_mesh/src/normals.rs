//! Normals from geometry: of a face, and averaged over the faces around a point. Not normal maps.

use glam::{DVec3, Vec3};

use crate::flat::flat_shaded;
use crate::{Adjacency, MeshError, TriangleMesh, weld_positions};

/// What a face counts for in the average at a vertex.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum NormalWeight {
    /// Every face alike: the plain sum of unit normals. Depends on how a polygon is cut into triangles.
    Uniform,
    /// By area: large faces decide.
    Area,
    /// By the face's angle at the vertex (Thürmer and Wüthrich 1998): does not depend on the cutting.
    #[default]
    Angle,
}

/// The unit normal of a counter-clockwise triangle, computed in f64.
///
/// `None` for a triangle without area or with a coordinate that is not finite.
pub fn face_normal(triangle: &[Vec3; 3]) -> Option<Vec3> {
    face_normal_f64(&triangle.map(|vertex| vertex.as_dvec3())).map(|normal| normal.as_vec3())
}

fn face_normal_f64([a, b, c]: &[DVec3; 3]) -> Option<DVec3> {
    (*b - *a).cross(*c - *a).try_normalize()
}

/// The normals of a mesh that has none: flat, as glTF 2.0 asks (section 3.7.2.1), so vertices are split.
///
/// A mesh with normals comes back unchanged.
pub fn compute_flat_normals(mesh: TriangleMesh) -> TriangleMesh {
    if mesh.normals.is_empty() { flat_shaded(&mesh) } else { mesh }
}

/// The mesh with smooth normals: at each point of space the normalized sum of the faces around it,
/// N = sum w_k N_k / |sum w_k N_k|. Vertices at the same position share it.
///
/// Where the sum cancels, the normal is that of the first face of the vertex that has one; a vertex with no such
/// face gets zero.
///
/// # Errors
/// [`MeshError`] where the mesh is not sound.
pub fn compute_smooth_normals(mesh: &TriangleMesh, weight: NormalWeight) -> Result<TriangleMesh, MeshError> {
    mesh.validate()?;
    let welded = weld_positions(&mesh.positions);
    let triangles: Vec<[u32; 3]> =
        mesh.triangles().map(|t| t.map(|vertex| welded[vertex as usize])).collect();
    let adjacency = Adjacency::new(&triangles, mesh.positions.len());
    let corners = |triangle: usize| triangles[triangle].map(|v| mesh.positions[v as usize].as_dvec3());
    let faces: Vec<Option<DVec3>> = (0..triangles.len()).map(|t| face_normal_f64(&corners(t))).collect();
    let average = |vertex: u32| {
        let around = adjacency.triangles_of_vertex(vertex);
        let mut sum = DVec3::ZERO;
        let mut weights = 0.0;
        for &triangle in around {
            let triangle = triangle as usize;
            let Some(normal) = faces[triangle] else { continue };
            let weight = face_weight(weight, &triangles[triangle], vertex, &corners(triangle));
            sum += normal * weight;
            weights += weight;
        }
        let first = around.iter().find_map(|&t| faces[t as usize]).unwrap_or_default();
        // A sum of unit vectors is exact to some 1e-16 of its weights: less than that has cancelled.
        let cancelled = sum.length() <= 1e-12 * weights;
        (if cancelled { first } else { sum.normalize_or(first) }).as_vec3()
    };
    let mut normals = vec![Vec3::ZERO; mesh.positions.len()];
    for (vertex, &point) in welded.iter().enumerate() {
        // The first vertex at a point comes before the others.
        normals[vertex] = if point as usize == vertex { average(point) } else { normals[point as usize] };
    }
    Ok(TriangleMesh { normals, ..mesh.clone() })
}

fn face_weight(weight: NormalWeight, triangle: &[u32; 3], vertex: u32, corners: &[DVec3; 3]) -> f64 {
    let [a, b, c] = *corners;
    match weight {
        NormalWeight::Uniform => 1.0,
        NormalWeight::Area => 0.5 * (b - a).cross(c - a).length(),
        NormalWeight::Angle => {
            let corner = triangle.iter().position(|&v| v == vertex).unwrap_or(0);
            let to = |next: usize| corners[(corner + next) % 3] - corners[corner];
            // atan2 keeps its accuracy for slivers, where acos does not.
            to(1).cross(to(2)).length().atan2(to(1).dot(to(2)))
        }
    }
}
