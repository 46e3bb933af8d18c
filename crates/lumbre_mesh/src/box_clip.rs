//! Clips a mesh by a box: triangles are cut at its sides (Sutherland and Hodgman 1974).

use glam::{DVec2, DVec3};

use crate::TriangleMesh;

/// A corner of a polygon that is being clipped.
#[derive(Clone, Copy)]
struct Corner {
    position: DVec3,
    normal: DVec3,
    uv0: DVec2,
    /// Its vertex in the mesh; `None` for corners made by clipping.
    vertex: Option<u32>,
}

impl TriangleMesh {
    /// The part of the mesh inside a box with these minimum and maximum corners in metres, whose components may
    /// be infinite. Cut triangles get new vertices with interpolated unit normals and texture coordinates of the
    /// first set; other attributes are left out.
    pub fn clipped_to_box(&self, [low, high]: [DVec3; 2]) -> Self {
        let mut clipped = Self {
            positions: self.positions.clone(),
            normals: self.normals.clone(),
            uv0: self.uv0.clone(),
            ..Self::default()
        };
        for triangle in self.triangles() {
            let mut polygon = triangle.map(|vertex| self.corner(vertex)).to_vec();
            for axis in 0..3 {
                polygon = cut(&polygon, |position| position[axis] - low[axis]);
                polygon = cut(&polygon, |position| high[axis] - position[axis]);
            }
            let vertices: Vec<u32> = polygon.iter().map(|corner| clipped.push_corner(corner)).collect();
            for pair in vertices.get(1..).unwrap_or_default().windows(2) {
                clipped.indices.extend([vertices[0], pair[0], pair[1]]);
            }
        }
        clipped.without_unused_vertices()
    }

    fn corner(&self, vertex: u32) -> Corner {
        let at = vertex as usize;
        Corner {
            position: self.positions[at].as_dvec3(),
            normal: self.normals.get(at).map_or(DVec3::ZERO, |normal| normal.as_dvec3()),
            uv0: self.uv0.get(at).map_or(DVec2::ZERO, |uv| uv.as_dvec2()),
            vertex: Some(vertex),
        }
    }

    fn push_corner(&mut self, corner: &Corner) -> u32 {
        if let Some(vertex) = corner.vertex {
            return vertex;
        }
        let number = self.positions.len() as u32;
        self.positions.push(corner.position.as_vec3());
        if !self.normals.is_empty() {
            self.normals.push(corner.normal.normalize_or_zero().as_vec3());
        }
        if !self.uv0.is_empty() {
            self.uv0.push(corner.uv0.as_vec2());
        }
        number
    }
}

/// Returns the part of a convex polygon where `side` is not negative.
fn cut(polygon: &[Corner], side: impl Fn(DVec3) -> f64) -> Vec<Corner> {
    let mut kept = Vec::with_capacity(polygon.len() + 1);
    for (number, corner) in polygon.iter().enumerate() {
        let next = &polygon[(number + 1) % polygon.len()];
        let (here, there) = (side(corner.position), side(next.position));
        if here >= 0.0 {
            kept.push(*corner);
        }
        if (here >= 0.0) != (there >= 0.0) {
            // From the inside to the outside, whichever triangle the edge belongs to: neighbours get the same
            // vertex.
            let (inner, outer, part) = match here >= 0.0 {
                true => (corner, next, here / (here - there)),
                false => (next, corner, there / (there - here)),
            };
            kept.push(Corner {
                position: inner.position.lerp(outer.position, part),
                normal: inner.normal.lerp(outer.normal, part),
                uv0: inner.uv0.lerp(outer.uv0, part),
                vertex: None,
            });
        }
    }
    kept
}
