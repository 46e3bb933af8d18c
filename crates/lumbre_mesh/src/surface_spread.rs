//! How large the triangles of a mesh are and how curved, in a handful of numbers: what interpolated lighting may be off by follows from them. Not the lighting.

use glam::DVec3;

use crate::TriangleMesh;

/// Triangles of about the same curvature: the largest of each over all of them. Lengths are in metres of the mesh.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TriangleClass {
    /// The longest edge.
    pub edge: f64,
    /// The longest difference between two unit normals of a triangle's vertices, 0 to 2. A triangle of which some vertices have a normal and others have none counts as 2.
    pub normals: f64,
    /// The longest difference between the unit normal of a triangle and that of one of its vertices, 0 to 2.
    pub face_normals: f64,
}

/// All directions within an angle of an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NormalCone {
    /// Unit.
    pub axis: DVec3,
    /// Radians, 0 to π.
    pub half_angle: f64,
}

/// The triangles of a mesh that have an area.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SurfaceSpread {
    /// None is within another in all three numbers. Empty for a mesh without area.
    pub classes: Vec<TriangleClass>,
    /// Holds the normals of all triangles and vertices; none where they point everywhere.
    pub normals: Option<NormalCone>,
}

impl SurfaceSpread {
    /// Of a mesh whose indices are in range; triangles that are not, or that are not finite, are left out.
    pub fn of(mesh: &TriangleMesh) -> Self {
        let mut classes = [TriangleClass::default(); CLASSES];
        let mut sum = DVec3::ZERO;
        for triangle in triangles(mesh) {
            let class = triangle.class();
            let of_same = &mut classes[class_number(class.normals)];
            of_same.edge = of_same.edge.max(class.edge);
            of_same.normals = of_same.normals.max(class.normals);
            of_same.face_normals = of_same.face_normals.max(class.face_normals);
            sum += triangle.normal;
        }
        let found: Vec<TriangleClass> = classes.into_iter().filter(|class| class.edge > 0.0).collect();
        let outside = |(index, class): &(usize, &TriangleClass)| {
            let within = |(other, larger): (usize, &TriangleClass)| {
                let same = larger == *class;
                let covers = larger.edge >= class.edge
                    && larger.normals >= class.normals
                    && larger.face_normals >= class.face_normals;
                other != *index && covers && (!same || other < *index)
            };
            !found.iter().enumerate().any(within)
        };
        let classes = found.iter().enumerate().filter(outside).map(|(_, class)| *class).collect();
        Self { classes, normals: normal_cone(mesh, sum) }
    }
}

/// Curvatures from below 2^-12 to 2 by powers of two.
const CLASSES: usize = 14;

fn class_number(normals: f64) -> usize {
    let doubled = (normals.max(f64::MIN_POSITIVE).log2().ceil() + 12.0).clamp(0.0, CLASSES as f64 - 1.0);
    doubled as usize
}

fn normal_cone(mesh: &TriangleMesh, sum: DVec3) -> Option<NormalCone> {
    let axis = sum.try_normalize()?;
    let mut cosine = 1.0_f64;
    for triangle in triangles(mesh) {
        let corners = triangle.corner_normals.into_iter().filter(|normal| *normal != DVec3::ZERO);
        for normal in corners.chain([triangle.normal]) {
            cosine = cosine.min(normal.dot(axis));
        }
    }
    // The rounding of the normals' f32, of which the cosine of a small angle knows nothing.
    Some(NormalCone { axis, half_angle: cosine.clamp(-1.0, 1.0).acos() + 1e-3 })
}

/// A triangle with an area.
struct Triangle {
    corners: [DVec3; 3],
    /// Unit.
    normal: DVec3,
    /// Unit, or zero.
    corner_normals: [DVec3; 3],
}

fn triangles(mesh: &TriangleMesh) -> impl Iterator<Item = Triangle> + '_ {
    mesh.triangles().filter_map(|triangle| {
        let place = |vertex: u32| mesh.positions.get(vertex as usize).map(|place| place.as_dvec3());
        let corners = [place(triangle[0])?, place(triangle[1])?, place(triangle[2])?];
        let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).try_normalize()?;
        let of_vertex = |vertex: u32| {
            let normal = mesh.normals.get(vertex as usize).map_or(DVec3::ZERO, |normal| normal.as_dvec3());
            normal.try_normalize().unwrap_or(DVec3::ZERO)
        };
        Some(Triangle { corners, normal, corner_normals: triangle.map(of_vertex) })
    })
}

impl Triangle {
    fn class(&self) -> TriangleClass {
        let longest = |of: &[DVec3; 3]| {
            let sides = [of[1] - of[0], of[2] - of[1], of[0] - of[2]];
            sides.into_iter().map(DVec3::length).fold(0.0, f64::max)
        };
        let missing = self.corner_normals.iter().filter(|normal| **normal == DVec3::ZERO).count();
        TriangleClass {
            edge: longest(&self.corners),
            normals: if missing == 1 || missing == 2 { 2.0 } else { longest(&self.corner_normals) },
            face_normals: self
                .corner_normals
                .iter()
                .map(|normal| (*normal - self.normal).length())
                .fold(0.0, f64::max),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes;

    #[test]
    fn a_plane_has_one_class_without_curvature() {
        let spread = SurfaceSpread::of(&shapes::plane(4.0, 2.0, 2, 2));
        assert_eq!(spread.classes.len(), 1);
        let class = spread.classes[0];
        assert!((class.edge - 5.0_f64.sqrt()).abs() < 1e-6, "the diagonal of 2 x 1: {class:?}");
        assert_eq!((class.normals, class.face_normals), (0.0, 0.0));
        assert!(spread.normals.unwrap().half_angle < 2e-3);
    }

    #[test]
    fn a_finer_sphere_is_less_curved_by_triangle_and_points_everywhere() {
        let of = |segments| SurfaceSpread::of(&shapes::uv_sphere(1.0, segments, segments / 2));
        let (coarse, fine) = (of(16), of(64));
        let largest =
            |spread: &SurfaceSpread| spread.classes.iter().map(|class| class.normals).fold(0.0, f64::max);
        // Normals of a unit sphere are its points: the difference of normals is the edge.
        let edge = coarse.classes.iter().map(|class| class.edge).fold(0.0, f64::max);
        assert!((largest(&coarse) - edge).abs() < 1e-5, "{coarse:?}");
        assert!((largest(&coarse) / largest(&fine) - 4.0).abs() < 0.2, "{coarse:?} {fine:?}");
        assert!(fine.normals.is_none_or(|cone| cone.half_angle > 3.0), "{:?}", fine.normals);
    }

    #[test]
    fn no_class_is_within_another_and_every_triangle_is_within_one() {
        // A large flat rectangle with a small ball on it.
        let mut mesh = shapes::plane(10.0, 10.0, 1, 1);
        let ball = shapes::uv_sphere(0.1, 24, 12);
        let first = mesh.positions.len() as u32;
        mesh.positions.extend(&ball.positions);
        mesh.normals.extend(&ball.normals);
        mesh.uv0.clear();
        mesh.uv1.clear();
        mesh.indices.extend(ball.indices.iter().map(|index| index + first));
        let spread = SurfaceSpread::of(&mesh);
        assert!((2..=4).contains(&spread.classes.len()), "{spread:?}");
        let covers = |a: &TriangleClass, b: &TriangleClass| {
            a.edge >= b.edge && a.normals >= b.normals && a.face_normals >= b.face_normals
        };
        for (index, class) in spread.classes.iter().enumerate() {
            let others = spread.classes.iter().enumerate().filter(|(other, _)| *other != index);
            assert!(others.into_iter().all(|(_, other)| !covers(other, class)), "{spread:?}");
        }
        for triangle in triangles(&mesh) {
            assert!(spread.classes.iter().any(|class| covers(class, &triangle.class())));
        }
    }

    #[test]
    fn triangles_without_area_do_not_count_and_half_given_normals_are_the_worst() {
        let mut mesh = shapes::plane(1.0, 1.0, 1, 1);
        mesh.positions.iter_mut().for_each(|place| place.x = 0.0);
        assert_eq!(SurfaceSpread::of(&mesh), SurfaceSpread::default());
        let mut mesh = shapes::plane(1.0, 1.0, 1, 1);
        mesh.normals[0] = glam::Vec3::ZERO;
        assert!(SurfaceSpread::of(&mesh).classes.iter().any(|class| class.normals == 2.0));
        mesh.normals.clear();
        let classes = SurfaceSpread::of(&mesh).classes;
        assert_eq!((classes.len(), classes[0].normals, classes[0].face_normals), (1, 0.0, 1.0));
    }
}
