//! The plane of a flat mesh, for planar mirrors. Flat shading, with a normal per triangle, is in `flat`.

use glam::DVec3;

use crate::TriangleMesh;

/// The plane of a flat mesh, in mesh space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeshPlane {
    /// A point on it, in metres.
    pub point: DVec3,
    /// Its unit normal, on the side from which the triangles are counter-clockwise.
    pub normal: DVec3,
}

/// Largest distance of a vertex from the plane as a fraction of the mesh's extent, to allow for positions
/// rounded to f32.
const FLATNESS: f64 = 1e-5;
/// Cosine of the largest angle between a vertex normal and the plane's normal, 1 mrad.
const ALONG_NORMAL: f64 = 1.0 - 0.5e-6;

impl TriangleMesh {
    /// The plane that contains all triangles, if they all face the same side and the vertex normals, if any,
    /// are perpendicular to it. `None` if the mesh is not flat, has no area, or has an index out of range.
    pub fn plane(&self) -> Option<MeshPlane> {
        let corner = |vertex: u32| self.positions.get(vertex as usize).map(|position| position.as_dvec3());
        let first = corner(*self.indices.first()?)?;
        // Twice the vector area, which has the direction of the plane's normal.
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
            // The winding of a sliver is unreliable, and it covers no pixel.
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
