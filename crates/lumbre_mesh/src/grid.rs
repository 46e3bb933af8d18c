//! Grids of quads, from which shapes and parametric surfaces are built.

use glam::{DVec3, Vec2};

use crate::TriangleMesh;

/// Largest number of segments, rings or columns.
pub const MAX_SEGMENTS: u32 = 2048;

/// One vertex of a grid.
pub(crate) struct GridVertex {
    pub position: DVec3,
    pub normal: DVec3,
    pub uv0: [f64; 2],
}

impl TriangleMesh {
    /// Appends a grid of `columns` by `rows` quads. Triangles are counter-clockwise where the row axis is to
    /// the left of the column axis.
    ///
    /// `vertex(column, row)` is called once per vertex. Triangles with two corners at the same position are
    /// left out.
    pub(crate) fn push_grid(&mut self, columns: u32, rows: u32, vertex: impl Fn(u32, u32) -> GridVertex) {
        let first = self.positions.len() as u32;
        for row in 0..=rows {
            for column in 0..=columns {
                let GridVertex { position, normal, uv0 } = vertex(column, row);
                // Adding 0 turns -0 into 0, so that positions on both sides of a seam are bitwise equal.
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

    /// Appends a mesh that has the same attributes as this one, or appends to an empty mesh.
    pub fn append(&mut self, other: Self) {
        let first = self.positions.len() as u32;
        self.positions.extend(other.positions);
        self.normals.extend(other.normals);
        self.uv0.extend(other.uv0);
        self.indices.extend(other.indices.into_iter().map(|index| index + first));
    }
}
