//! Normals from geometry: face normals, and vertex normals averaged over the adjacent faces. Normal maps are
//! elsewhere.

use glam::{DVec3, Vec3};

use crate::{Adjacency, MeshError, TriangleMesh, weld_positions};

/// The weight of a face in the average at a vertex.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum NormalWeight {
    /// Equal weights: the plain sum of unit normals of documents \[I\] and \[M\]. Depends on how a polygon is
    /// triangulated.
    Uniform,
    /// By the area of the face, so that large faces dominate.
    Area,
    /// By the face's angle at the vertex (Thürmer and Wüthrich 1998), which is independent of the
    /// triangulation.
    #[default]
    Angle,
}

/// The unit normal of a counter-clockwise triangle, computed in f64.
///
/// `None` if the triangle is degenerate or a coordinate is not finite.
pub fn face_normal(triangle: &[Vec3; 3]) -> Option<Vec3> {
    face_normal_f64(&triangle.map(|vertex| vertex.as_dvec3())).map(|normal| normal.as_vec3())
}

fn face_normal_f64([a, b, c]: &[DVec3; 3]) -> Option<DVec3> {
    (*b - *a).cross(*c - *a).try_normalize()
}

/// A mesh with averaged normals, and the number of vertices that have no average.
#[derive(Clone, Debug, PartialEq)]
pub struct SmoothNormals {
    /// The mesh.
    pub mesh: TriangleMesh,
    /// Number of vertices at which the face normals cancel; these have the normal of their first face.
    pub cancelled: usize,
    /// Number of vertices without any face that has a normal; theirs is zero, so they receive ambient light
    /// only.
    pub missing: usize,
}

impl SmoothNormals {
    /// A message about the mesh, named `name`, if any vertex has no average: one per mesh, for a log.
    pub fn remark(&self, name: &str) -> Option<String> {
        let Self { cancelled, missing, .. } = self;
        (cancelled + missing > 0).then(|| {
            format!(
                "mesh \"{name}\": the normals around {cancelled} vertices cancel and {missing} have no face with an area; \
                 they take their first face's normal, or none"
            )
        })
    }
}

/// The mesh with smooth normals: the normalized weighted sum over the faces around each position, N = sum w_k
/// N_k / |sum w_k N_k|. Vertices at the same position share it.
///
/// Where the sum cancels, the normal is that of the vertex's first face that has one; a vertex without such a
/// face gets zero. The result counts both.
///
/// Compared with a smooth surface, the error falls with the square of the edge length where the faces around
/// a vertex are symmetric about it, as on a regular grid, and with the edge length itself elsewhere. This
/// holds for every weight, as long as no angle of a triangle comes near 180 degrees.
///
/// Source: document \[I\], Gouraud (uniform weight); \[M\] 1.6.2 and figure 2.5, where the divisor is printed
/// as sum |N_k|.
///
/// # Errors
/// [`MeshError`] if the mesh is invalid.
pub fn compute_smooth_normals(mesh: &TriangleMesh, weight: NormalWeight) -> Result<SmoothNormals, MeshError> {
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
        // A sum of unit vectors has a rounding error of about 1e-16 times its weights. A shorter sum has
        // cancelled.
        let average = if sum.length() <= 1e-12 * weights { None } else { sum.try_normalize() };
        match (average, around.iter().find_map(|&t| faces[t as usize])) {
            (Some(average), _) => Around::Average(average.as_vec3()),
            (None, Some(first)) => Around::Cancelled(first.as_vec3()),
            (None, None) => Around::Nothing,
        }
    };
    let mut found = vec![Around::Nothing; mesh.positions.len()];
    for (vertex, &point) in welded.iter().enumerate() {
        // Welding refers to the first vertex at a position, so its result is known already.
        found[vertex] = if point as usize == vertex { average(point) } else { found[point as usize] };
    }
    let count = |is: fn(&Around) -> bool| found.iter().filter(|around| is(around)).count();
    let cancelled = count(|around| matches!(around, Around::Cancelled(_)));
    let missing = count(|around| matches!(around, Around::Nothing));
    let normals = found.iter().map(Around::normal).collect();
    Ok(SmoothNormals { mesh: TriangleMesh { normals, ..mesh.clone() }, cancelled, missing })
}

/// The result for the faces around a position.
#[derive(Clone, Copy)]
enum Around {
    Average(Vec3),
    Cancelled(Vec3),
    Nothing,
}

impl Around {
    fn normal(&self) -> Vec3 {
        match self {
            Self::Average(normal) | Self::Cancelled(normal) => *normal,
            Self::Nothing => Vec3::ZERO,
        }
    }
}

fn face_weight(weight: NormalWeight, triangle: &[u32; 3], vertex: u32, corners: &[DVec3; 3]) -> f64 {
    let [a, b, c] = *corners;
    match weight {
        NormalWeight::Uniform => 1.0,
        NormalWeight::Area => 0.5 * (b - a).cross(c - a).length(),
        NormalWeight::Angle => {
            let corner = triangle.iter().position(|&v| v == vertex).unwrap_or(0);
            let to = |next: usize| corners[(corner + next) % 3] - corners[corner];
            // atan2 stays accurate for slivers, where acos does not.
            to(1).cross(to(2)).length().atan2(to(1).dot(to(2)))
        }
    }
}
