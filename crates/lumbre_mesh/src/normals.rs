//! Normals from geometry: of a face, and averaged over the faces around a point. Not normal maps.

use glam::{DVec3, Vec3};

use crate::{Adjacency, MeshError, TriangleMesh, weld_positions};

/// What a face counts for in the average at a vertex.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum NormalWeight {
    /// Every face alike: the plain sum of unit normals of documents \[I\] and \[M\]. Depends on how a polygon is cut into triangles.
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

/// A mesh with averaged normals, and where there was none to average.
#[derive(Clone, Debug, PartialEq)]
pub struct SmoothNormals {
    /// The mesh.
    pub mesh: TriangleMesh,
    /// Vertices around which the faces cancel: they have the normal of their first face.
    pub cancelled: usize,
    /// Vertices without a face that has a normal: theirs is zero, and they take ambient light only.
    pub missing: usize,
}

impl SmoothNormals {
    /// One sentence about the mesh of that name if any vertex fell back, for a log: once a mesh, not once a vertex.
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

/// The mesh with smooth normals: at each point of space the normalized sum of the faces around it,
/// N = sum w_k N_k / |sum w_k N_k|. Vertices at the same position share it.
///
/// Where the sum cancels, the normal is that of the first face of the vertex that has one; a vertex with no such
/// face gets zero. The result counts both.
///
/// Against a smooth surface the error falls with the square of the edges' length where the faces around a vertex lie point by point
/// opposite each other, as on a regular grid, and with the length itself where they do not, whatever the weight, as long as no
/// triangle's angle comes near 180 degrees.
///
/// Source: document \[I\], Gouraud (uniform weight); \[M\] 1.6.2 and figure 2.5, where the divisor is printed as sum |N_k|.
///
/// # Errors
/// [`MeshError`] where the mesh is not sound.
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
        // A sum of unit vectors is exact to some 1e-16 of its weights: less than that has cancelled.
        let average = if sum.length() <= 1e-12 * weights { None } else { sum.try_normalize() };
        match (average, around.iter().find_map(|&t| faces[t as usize])) {
            (Some(average), _) => Around::Average(average.as_vec3()),
            (None, Some(first)) => Around::Cancelled(first.as_vec3()),
            (None, None) => Around::Nothing,
        }
    };
    let mut found = vec![Around::Nothing; mesh.positions.len()];
    for (vertex, &point) in welded.iter().enumerate() {
        // The first vertex at a point comes before the others.
        found[vertex] = if point as usize == vertex { average(point) } else { found[point as usize] };
    }
    let count = |is: fn(&Around) -> bool| found.iter().filter(|around| is(around)).count();
    let cancelled = count(|around| matches!(around, Around::Cancelled(_)));
    let missing = count(|around| matches!(around, Around::Nothing));
    let normals = found.iter().map(Around::normal).collect();
    Ok(SmoothNormals { mesh: TriangleMesh { normals, ..mesh.clone() }, cancelled, missing })
}

/// What the faces around a point come to.
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
            // atan2 keeps its accuracy for slivers, where acos does not.
            to(1).cross(to(2)).length().atan2(to(1).dot(to(2)))
        }
    }
}
