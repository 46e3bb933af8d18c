//! The plane that a flat mesh lies in, for mirrors. Not flat shading, which gives every triangle a normal of its own: that is `flat`.

use glam::DVec3;

use crate::TriangleMesh;

/// The plane of a flat mesh, in its own space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeshPlane {
    /// A point on it, in metres.
    pub point: DVec3,
    /// Its unit normal, towards the side from which the triangles wind counter-clockwise.
    pub normal: DVec3,
}

/// The farthest that a vertex may stand off the plane, as a part of the mesh's extent: what positions in f32 lose.
const FLATNESS: f64 = 1e-5;
/// The cosine of the largest angle between a vertex normal and the plane's, 1 mrad.
const ALONG_NORMAL: f64 = 1.0 - 0.5e-6;

impl TriangleMesh {
    /// The plane in which all triangles lie, facing the same side, with vertex normals (where there are any) that stand on it. `None` where
    /// the mesh is not flat, has no area, or an index is out of range.
    pub fn plane(&self) -> Option<MeshPlane> {
        let corner = |vertex: u32| self.positions.get(vertex as usize).map(|position| position.as_dvec3());
        let first = corner(*self.indices.first()?)?;
        // Twice the vector area: triangles that lie in one plane add up to its normal.
        let (mut area, mut extent) = (DVec3::ZERO, 0.0_f64);
        for triangle in self.triangles() {
            let [Some(a), Some(b), Some(c)] = triangle.map(corner) else { return None };
            area += (b - a).cross(c - a);
            extent = [a, b, c].iter().fold(extent, |extent, corner| extent.max(corner.distance(first)));
        }
        let normal = area.try_normalize()?;
        let slack = FLATNESS * extent;
        for triangle in self.triangles() {
            let [Some(a), Some(b), Some(c)] = triangle.map(corner) else { return None };
            let flat = [a, b, c].iter().all(|corner| normal.dot(*corner - first).abs() <= slack);
            // A sliver's winding is lost in rounding, and it covers no pixel.
            let faces_away = normal.dot((b - a).cross(c - a)) < -slack * extent;
            let upright = triangle.iter().all(|&vertex| match self.normals.get(vertex as usize) {
                Some(vertex_normal) => normal.dot(vertex_normal.as_dvec3()) >= ALONG_NORMAL,
                None => true,
            });
            if !flat || faces_away || !upright {
                return None;
            }
        }
        Some(MeshPlane { point: first, normal })
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;

    /// A square of side 2 in the plane y = 0.5, facing up, far from the origin.
    fn square() -> TriangleMesh {
        let at = |x: f32, z: f32| Vec3::new(1000.0 + x, 0.5, z);
        TriangleMesh {
            positions: vec![at(-1.0, 1.0), at(1.0, 1.0), at(1.0, -1.0), at(-1.0, -1.0)],
            normals: vec![Vec3::Y; 4],
            indices: vec![0, 1, 2, 0, 2, 3],
            ..TriangleMesh::default()
        }
    }

    #[test]
    fn a_square_lies_in_its_plane() {
        let plane = square().plane().unwrap();
        assert!((plane.normal - DVec3::Y).length() < 1e-12 && plane.point.y == 0.5, "{plane:?}");
        let without_normals = TriangleMesh { normals: Vec::new(), ..square() };
        assert_eq!(without_normals.plane(), Some(plane));
    }

    #[test]
    fn what_is_bent_folded_back_or_smoothed_is_not_flat() {
        let mut bent = square();
        bent.positions[3].y += 0.01;
        let mut folded = square();
        folded.indices = vec![0, 1, 2, 0, 3, 2];
        let mut overlapping = square();
        overlapping.indices.extend([0, 2, 1]);
        let mut smoothed = square();
        smoothed.normals[2] = Vec3::new(0.01, 1.0, 0.0).normalize();
        let mut unfinished = square();
        unfinished.indices[5] = 4;
        for mesh in [bent, folded, overlapping, smoothed, unfinished, TriangleMesh::default()] {
            assert_eq!(mesh.plane(), None);
        }
    }
}
