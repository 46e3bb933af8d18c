//! Bounds on the size and curvature of a mesh's triangles, for the whole mesh and for patches of it. The
//! renderer derives from them how far interpolated lighting can be off.

use glam::DVec3;

use crate::TriangleMesh;

/// The cone of all directions within an angle of an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NormalCone {
    /// Unit vector.
    pub axis: DVec3,
    /// In radians, 0 to π.
    pub half_angle: f64,
}

/// Bounds over triangles that are near each other and have similar normals. Lengths are in metres in mesh
/// space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfacePatch {
    /// Centre of the bounding box.
    pub center: DVec3,
    /// Half the side lengths of the bounding box.
    pub half_size: DVec3,
    /// Length of the longest edge.
    pub edge: f64,
    /// Largest length of the difference between two unit normals at vertices of the same triangle, 0 to 2. A
    /// triangle with normals at only some of its vertices counts as 2.
    pub normals: f64,
    /// Largest length of the difference between the unit normal of a triangle and that at one of its
    /// vertices. It is 0 to 2, and 1 at vertices without a normal.
    pub face_normals: f64,
    /// Contains the normals of all triangles and vertices; `None` if the triangle normals cancel.
    pub cone: Option<NormalCone>,
}

/// Bounds over the triangles of a mesh, without degenerate ones.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SurfaceSpread {
    /// Bounds over all triangles; `None` for a mesh without area.
    pub whole: Option<SurfacePatch>,
    /// A partition of the triangles into at most [`MAX_PATCHES`] patches, those with the longest edges and
    /// the largest normal differences first.
    pub patches: Vec<SurfacePatch>,
}

/// Largest number of patches of a mesh. In a mesh with fewer triangles, every triangle is a patch.
pub const MAX_PATCHES: usize = 1 << HALVINGS;
const HALVINGS: u32 = 7;

impl SurfaceSpread {
    /// Computes the bounds of a mesh. Degenerate triangles, and those with an index out of range or a
    /// coordinate that is not finite, are left out.
    pub fn of(mesh: &TriangleMesh) -> Self {
        let mut triangles: Vec<Triangle> = triangles(mesh).collect();
        if triangles.is_empty() {
            return Self::default();
        }
        let whole = SurfacePatch::of(&triangles);
        let mut patches = Vec::new();
        halve(&mut triangles, HALVINGS, whole.half_size.max_element(), &mut patches);
        let size = whole.half_size.max_element();
        // Patches with the largest expected error come first, so that a search for a violation can stop
        // early.
        let most = |patch: &SurfacePatch| patch.edge / size + patch.normals;
        patches.sort_by(|a, b| most(b).total_cmp(&most(a)));
        Self { whole: Some(whole), patches }
    }
}

/// Splits triangles `times` times into halves, each time along the axis of position or normal with the widest
/// spread.
fn halve(triangles: &mut [Triangle], times: u32, size: f64, patches: &mut Vec<SurfacePatch>) {
    if times == 0 || triangles.len() < 2 {
        patches.push(SurfacePatch::of(triangles));
        return;
    }
    let coordinates = |triangle: &Triangle| {
        let (place, normal) = (triangle.middle() / size, triangle.normal);
        [place.x, place.y, place.z, normal.x, normal.y, normal.z]
    };
    let (mut least, mut most) = ([f64::INFINITY; 6], [f64::NEG_INFINITY; 6]);
    for triangle in triangles.iter() {
        for (axis, at) in coordinates(triangle).into_iter().enumerate() {
            (least[axis], most[axis]) = (least[axis].min(at), most[axis].max(at));
        }
    }
    let width = |axis: &usize| most[*axis] - least[*axis];
    let widest = (0..6).max_by(|a, b| width(a).total_cmp(&width(b))).unwrap_or(0);
    let middle = triangles.len() / 2;
    triangles
        .select_nth_unstable_by(middle, |a, b| coordinates(a)[widest].total_cmp(&coordinates(b)[widest]));
    let (lower, upper) = triangles.split_at_mut(middle);
    halve(lower, times - 1, size, patches);
    halve(upper, times - 1, size, patches);
}

impl SurfacePatch {
    /// The bounds over at least one triangle.
    fn of(triangles: &[Triangle]) -> Self {
        let (mut min, mut max) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        let (mut edge, mut normals, mut face_normals) = (0.0_f64, 0.0_f64, 0.0_f64);
        for triangle in triangles {
            for corner in triangle.corners {
                (min, max) = (min.min(corner), max.max(corner));
            }
            edge = edge.max(longest_side(&triangle.corners));
            normals = normals.max(triangle.normal_difference());
            face_normals = face_normals.max(triangle.face_normal_difference());
        }
        let (center, half_size) = (0.5 * (min + max), 0.5 * (max - min));
        Self { center, half_size, edge, normals, face_normals, cone: normal_cone(triangles) }
    }
}

fn normal_cone(triangles: &[Triangle]) -> Option<NormalCone> {
    let axis = triangles.iter().map(|triangle| triangle.normal).sum::<DVec3>().try_normalize()?;
    let mut cosine = 1.0_f64;
    for triangle in triangles {
        let corners = triangle.corner_normals.into_iter().filter(|normal| *normal != DVec3::ZERO);
        for normal in corners.chain([triangle.normal]) {
            cosine = cosine.min(normal.dot(axis));
        }
    }
    // The margin covers the f32 rounding of the normals, to which the cosine of a small angle is insensitive.
    Some(NormalCone { axis, half_angle: cosine.clamp(-1.0, 1.0).acos() + 1e-3 })
}

/// A non-degenerate triangle.
struct Triangle {
    corners: [DVec3; 3],
    /// Unit vector.
    normal: DVec3,
    /// Unit vectors, or zero where the mesh has no normal.
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

fn longest_side(of: &[DVec3; 3]) -> f64 {
    [of[1] - of[0], of[2] - of[1], of[0] - of[2]].into_iter().map(DVec3::length).fold(0.0, f64::max)
}

impl Triangle {
    fn middle(&self) -> DVec3 {
        (self.corners[0] + self.corners[1] + self.corners[2]) / 3.0
    }

    fn normal_difference(&self) -> f64 {
        let missing = self.corner_normals.iter().filter(|normal| **normal == DVec3::ZERO).count();
        if missing == 1 || missing == 2 { 2.0 } else { longest_side(&self.corner_normals) }
    }

    fn face_normal_difference(&self) -> f64 {
        self.corner_normals.iter().map(|normal| (*normal - self.normal).length()).fold(0.0, f64::max)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes;

    #[test]
    fn a_plane_is_not_curved() {
        let spread = SurfaceSpread::of(&shapes::plane(4.0, 2.0, 2, 2));
        assert_eq!(spread.patches.len(), 8, "a patch for each triangle");
        for patch in spread.patches.iter().chain(&spread.whole) {
            assert!((patch.edge - 5.0_f64.sqrt()).abs() < 1e-6, "the diagonal of 2 x 1: {patch:?}");
            assert_eq!((patch.normals, patch.face_normals), (0.0, 0.0));
            assert!(patch.cone.unwrap().half_angle < 2e-3);
        }
        let whole = spread.whole.unwrap();
        assert_eq!((whole.center, whole.half_size), (DVec3::ZERO, DVec3::new(2.0, 0.0, 1.0)));
        assert!(spread.patches.iter().all(|patch| patch.half_size == DVec3::new(1.0, 0.0, 0.5)));
    }

    #[test]
    fn a_finer_sphere_is_less_curved_by_triangle_and_its_patches_are_small() {
        let of = |segments| SurfaceSpread::of(&shapes::uv_sphere(1.0, segments, segments / 2));
        let (coarse, fine) = (of(16), of(64));
        // The normals of a unit sphere are its points, so normal differences equal edge lengths.
        let (all_coarse, all_fine) = (coarse.whole.unwrap(), fine.whole.unwrap());
        assert!((all_coarse.normals - all_coarse.edge).abs() < 1e-5, "{all_coarse:?}");
        assert!((all_coarse.normals / all_fine.normals - 4.0).abs() < 0.2, "{all_coarse:?} {all_fine:?}");
        assert!(all_fine.cone.is_none_or(|cone| cone.half_angle > 3.0), "{all_fine:?}");
        assert_eq!(fine.patches.len(), MAX_PATCHES);
        // A round 128th of a sphere would have a half-angle of 0.18.
        let angles: Vec<f64> = fine.patches.iter().map(|patch| patch.cone.unwrap().half_angle).collect();
        assert!(angles.iter().all(|angle| *angle < 0.5), "{angles:?}");
    }

    #[test]
    fn every_triangle_is_within_a_patch_and_large_ones_do_not_share_it_with_curved_ones() {
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
        let mixed = spread.patches.iter().filter(|patch| patch.edge > 5.0 && patch.normals > 0.1);
        assert!(mixed.count() <= 2, "{:?}", spread.patches);
        for triangle in triangles(&mesh) {
            let holds = |patch: &&SurfacePatch| {
                let inside =
                    |corner: &DVec3| (*corner - patch.center).abs().cmple(patch.half_size + 1e-9).all();
                let cone = patch.cone.unwrap();
                triangle.corners.iter().all(inside)
                    && patch.edge >= longest_side(&triangle.corners)
                    && patch.normals >= triangle.normal_difference()
                    && patch.face_normals >= triangle.face_normal_difference()
                    && triangle.normal.angle_between(cone.axis) <= cone.half_angle
            };
            assert!(spread.patches.iter().any(|patch| holds(&patch)));
            assert!(spread.whole.iter().any(|patch| holds(&patch)) || spread.whole.unwrap().cone.is_none());
        }
    }

    #[test]
    fn triangles_without_area_do_not_count_and_half_given_normals_are_the_worst() {
        let mut mesh = shapes::plane(1.0, 1.0, 1, 1);
        mesh.positions.iter_mut().for_each(|place| place.x = 0.0);
        assert_eq!(SurfaceSpread::of(&mesh), SurfaceSpread::default());
        let mut mesh = shapes::plane(1.0, 1.0, 1, 1);
        mesh.normals[0] = glam::Vec3::ZERO;
        assert_eq!(SurfaceSpread::of(&mesh).whole.unwrap().normals, 2.0);
        mesh.normals.clear();
        let whole = SurfaceSpread::of(&mesh).whole.unwrap();
        assert_eq!((whole.normals, whole.face_normals), (0.0, 1.0));
    }
}
