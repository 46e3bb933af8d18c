//! Splits vertices on the seams between charts, so that each chart has a copy of its own.

use glam::{DVec2, Vec2};

use crate::TriangleMesh;

/// Gives each vertex one lightmap coordinate per chart that uses it.
pub(crate) struct VertexSplitter<'a> {
    mesh: &'a TriangleMesh,
    sources: Vec<u32>,
    uv1: Vec<Vec2>,
    indices: Vec<u32>,
    /// For each vertex, the last chart that used it and the copy it has there. This suffices as charts are
    /// assigned in turn.
    current: Vec<(u32, u32)>,
}

impl<'a> VertexSplitter<'a> {
    pub fn new(mesh: &'a TriangleMesh) -> Self {
        let vertices = mesh.positions.len();
        Self {
            mesh,
            sources: (0..vertices as u32).collect(),
            uv1: vec![Vec2::ZERO; vertices],
            indices: mesh.indices.clone(),
            current: vec![(u32::MAX, u32::MAX); vertices],
        }
    }

    /// Sets the lightmap coordinates of a triangle's corners. All triangles of a chart must be assigned
    /// consecutively.
    pub fn assign(&mut self, chart: u32, triangle: u32, uv: [DVec2; 3]) {
        for (corner, uv) in uv.into_iter().enumerate() {
            let at = triangle as usize * 3 + corner;
            let source = self.mesh.indices[at];
            let (last_chart, _) = self.current[source as usize];
            if last_chart != chart {
                let copy = if last_chart == u32::MAX {
                    source
                } else {
                    self.sources.push(source);
                    self.uv1.push(Vec2::ZERO);
                    self.sources.len() as u32 - 1
                };
                self.current[source as usize] = (chart, copy);
                self.uv1[copy as usize] = uv.as_vec2().clamp(Vec2::ZERO, Vec2::ONE);
            }
            self.indices[at] = self.current[source as usize].1;
        }
    }

    /// The mesh with `uv1`, and the original vertex for each of its vertices.
    pub fn finish(self) -> (TriangleMesh, Vec<u32>) {
        let mut mesh = self.mesh.with_vertices(&self.sources, self.indices);
        mesh.uv1 = self.uv1;
        (mesh, self.sources)
    }
}
