//! The outlines of a scene's objects as a parallel view shows them, for drawings: rims, creases and silhouettes
//! of the meshes, without regard to what hides them.

use glam::DVec3;
use lumbre_mesh::{Adjacency, weld_positions};

use crate::scene::{Object, Scene};

/// A straight piece of an outline.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct OutlineEdge {
    /// Both ends in the world, metres.
    pub ends: [DVec3; 2],
    /// Index of the object.
    pub object: usize,
}

/// Edges between faces that enclose a smaller cosine than this are creases (30°).
const CREASE: f64 = 0.866;
/// Faces whose normals have at least this cosine to the direction of view count as turned to it.
const FACING: f64 = 1e-6;

/// Returns the outlines inside a box in the world, seen along the unit vector `view`.
pub(crate) fn outline(scene: &Scene, view: DVec3, region: [DVec3; 2]) -> Vec<OutlineEdge> {
    let mut edges = Vec::new();
    for (index, object) in scene.objects.iter().enumerate() {
        for ends in object_outline(object, view) {
            let ends = ends.map(|end| end + scene.origin);
            edges.extend(clipped(ends, region).map(|ends| OutlineEdge { ends, object: index }));
        }
    }
    edges
}

fn object_outline(object: &Object, view: DVec3) -> Vec<[DVec3; 2]> {
    let welded = weld_positions(&object.shape.positions);
    let triangles: Vec<[u32; 3]> =
        object.shape.triangles().map(|corners| corners.map(|corner| welded[corner as usize])).collect();
    let adjacency = Adjacency::new(&triangles, object.shape.positions.len());
    let normals: Vec<DVec3> = object
        .shape
        .triangles()
        .map(|corners| {
            let [a, b, c] = object.corners(corners);
            (b - a).cross(c - a).normalize_or_zero()
        })
        .collect();
    let faces_view = |triangle: u32| normals[triangle as usize].dot(view) > FACING;
    let mut found = Vec::new();
    for (number, corners) in (0u32..).zip(&triangles) {
        for corner in 0..3 {
            let (from, to) = (corners[corner], corners[(corner + 1) % 3]);
            let shared = adjacency.triangles_of_edge(from, to);
            // Each edge once, by its first triangle.
            if from == to || shared.first() != Some(&number) {
                continue;
            }
            let is_drawn = match *shared {
                [a, b] => {
                    let cosine = normals[a as usize].dot(normals[b as usize]);
                    cosine < CREASE || faces_view(a) != faces_view(b)
                }
                _ => true,
            };
            if is_drawn {
                found.push([from, to].map(|vertex| {
                    object.place.transform_point3(object.shape.positions[vertex as usize].as_dvec3())
                }));
            }
        }
    }
    found
}

/// Returns the part of a segment inside a box (Liang and Barsky 1984).
fn clipped([from, to]: [DVec3; 2], [low, high]: [DVec3; 2]) -> Option<[DVec3; 2]> {
    let along = to - from;
    let (mut start, mut end) = (0.0_f64, 1.0_f64);
    for axis in 0..3 {
        for (speed, room) in [(-along[axis], from[axis] - low[axis]), (along[axis], high[axis] - from[axis])]
        {
            if speed == 0.0 {
                if room < 0.0 {
                    return None;
                }
            } else if speed < 0.0 {
                start = start.max(room / speed);
            } else {
                end = end.min(room / speed);
            }
        }
    }
    (start < end).then(|| [from + along * start, from + along * end])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn segments_are_cut_at_the_sides_of_the_box() {
        let region = [DVec3::ZERO, DVec3::ONE];
        let cut = clipped([DVec3::new(-1.0, 0.5, 0.5), DVec3::new(3.0, 0.5, 0.5)], region);
        assert_eq!(cut, Some([DVec3::new(0.0, 0.5, 0.5), DVec3::new(1.0, 0.5, 0.5)]));
        let inside = [DVec3::splat(0.25), DVec3::splat(0.75)];
        assert_eq!(clipped(inside, region), Some(inside));
        assert_eq!(clipped([DVec3::new(-1.0, 2.0, 0.5), DVec3::new(3.0, 2.0, 0.5)], region), None);
    }
}
