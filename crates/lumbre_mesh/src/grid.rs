//! Grids of quads, of which shapes and surfaces are made. Not what they are bent into.

use glam::{DVec3, Vec2};

use crate::TriangleMesh;

/// Largest count of segments, rings or columns.
pub const MAX_SEGMENTS: u32 = 2048;

/// One corner of a grid.
pub(crate) struct GridVertex {
    pub position: DVec3,
    pub normal: DVec3,
    pub uv0: [f64; 2],
}

impl TriangleMesh {
    /// Appends a grid of `columns` by `rows` quads, counter-clockwise where column and row axes turn left.
    ///
    /// `vertex(column, row)` is asked once per corner. Triangles with two corners in one place are left out.
    pub(crate) fn push_grid(&mut self, columns: u32, rows: u32, vertex: impl Fn(u32, u32) -> GridVertex) {
        let first = self.positions.len() as u32;
        for row in 0..=rows {
            for column in 0..=columns {
                let GridVertex { position, normal, uv0 } = vertex(column, row);
                // Adding 0 turns -0 into 0, so that both sides of a seam are the same bits.
                self.positions.push(position.as_vec3() + 0.0);
                self.normals.push(normal.as_vec3());
                self.uv0.push(Vec2::new(uv0[0] as f32, uv0[1] as f32));
            }
        }
        let at = |column: u32, row: u32| first + row * (columns + 1) + column;
        for row in 0..rows {
            for column in 0..columns {
                let [a, b] = [at(column, row), at(column + 1, row)];
                let [c, d] = [at(column + 1, row + 1), at(column, row + 1)];
                for triangle in [[a, b, c], [a, c, d]] {
                    let [p, q, r] = triangle.map(|vertex| self.positions[vertex as usize]);
                    if p != q && q != r && r != p {
                        self.indices.extend(triangle);
                    }
                }
            }
        }
    }

    /// Removes vertices that no triangle uses.
    pub(crate) fn without_unused_vertices(self) -> Self {
        let mut renamed = vec![u32::MAX; self.positions.len()];
        let mut sources = Vec::with_capacity(self.positions.len());
        let mut indices = self.indices.clone();
        for index in &mut indices {
            let slot = &mut renamed[*index as usize];
            if *slot == u32::MAX {
                *slot = sources.len() as u32;
                sources.push(*index);
            }
            *index = *slot;
        }
        self.with_vertices(&sources, indices)
    }

    /// Appends a mesh with the same attributes as this one, or to an empty one.
    pub(crate) fn append(&mut self, other: Self) {
        let first = self.positions.len() as u32;
        self.positions.extend(other.positions);
        self.normals.extend(other.normals);
        self.uv0.extend(other.uv0);
        self.indices.extend(other.indices.into_iter().map(|index| index + first));
    }
}
