//! Adjacency of a triangle list: the triangles around a vertex and along an edge. No geometry.

use std::collections::BTreeMap;

/// The adjacency of an indexed triangle list.
#[derive(Clone, Debug)]
pub struct Adjacency {
    /// `fans[vertex_starts[v]..vertex_starts[v + 1]]` are the triangles of vertex v.
    vertex_starts: Vec<u32>,
    fans: Vec<u32>,
    /// All edges, sorted by their vertices.
    edges: Vec<Edge>,
    /// `triangle_edges[t][k]` is the edge from corner k to corner k + 1 of triangle t.
    triangle_edges: Vec<[u32; 3]>,
    /// The triangles of an edge are `edge_triangles[edge.first..edge.first + edge.count]`.
    edge_triangles: Vec<u32>,
}

/// An undirected edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Edge {
    vertices: [u32; 2],
    first: u32,
    count: u32,
}

impl Adjacency {
    /// Builds the adjacency of triangles whose indices are below `vertex_count`; other triangles are ignored.
    ///
    /// Pass the indices through [`weld_positions`](crate::weld_positions) first to connect triangles across
    /// split vertices.
    pub fn new(triangles: &[[u32; 3]], vertex_count: usize) -> Self {
        let valid = |t: &[u32; 3]| t.iter().all(|&vertex| (vertex as usize) < vertex_count);
        let mut vertex_starts = vec![0u32; vertex_count + 1];
        let mut keyed = Vec::with_capacity(triangles.len() * 3);
        for (triangle, index) in triangles.iter().zip(0u32..).filter(|(t, _)| valid(t)) {
            for corner in 0..3 {
                vertex_starts[triangle[corner] as usize + 1] += 1;
                let (a, b) = (triangle[corner], triangle[(corner + 1) % 3]);
                keyed.push(([a.min(b), a.max(b)], index, corner));
            }
        }
        for vertex in 0..vertex_count {
            vertex_starts[vertex + 1] += vertex_starts[vertex];
        }
        let mut next = vertex_starts.clone();
        let mut fans = vec![0u32; keyed.len()];
        for (triangle, index) in triangles.iter().zip(0u32..).filter(|(t, _)| valid(t)) {
            for &vertex in triangle {
                fans[next[vertex as usize] as usize] = index;
                next[vertex as usize] += 1;
            }
        }
        keyed.sort_unstable();
        let mut edges: Vec<Edge> = Vec::new();
        let mut triangle_edges = vec![[u32::MAX; 3]; triangles.len()];
        let mut edge_triangles = Vec::with_capacity(keyed.len());
        for (vertices, triangle, corner) in keyed {
            if edges.last().is_none_or(|edge| edge.vertices != vertices) {
                edges.push(Edge { vertices, first: edge_triangles.len() as u32, count: 0 });
            }
            let index = edges.len() - 1;
            edges[index].count += 1;
            edge_triangles.push(triangle);
            triangle_edges[triangle as usize][corner] = index as u32;
        }
        Self { vertex_starts, fans, edges, triangle_edges, edge_triangles }
    }

    /// The triangles that use a vertex, in ascending order. A triangle that uses it twice is listed twice.
    pub fn triangles_of_vertex(&self, vertex: u32) -> &[u32] {
        let at = |index: usize| self.vertex_starts.get(index).map_or(0, |&start| start as usize);
        self.fans.get(at(vertex as usize)..at(vertex as usize + 1)).unwrap_or_default()
    }

    /// The triangles that use the edge between two vertices, in ascending order; empty if there is no such
    /// edge.
    pub fn triangles_of_edge(&self, a: u32, b: u32) -> &[u32] {
        let key = [a.min(b), a.max(b)];
        let found = self.edges.binary_search_by_key(&key, |edge| edge.vertices);
        found.map_or(&[], |index| self.edge(index))
    }

    /// The triangles that share the edge from `corner` to `corner + 1` of a triangle, including itself.
    pub fn across(&self, triangle: u32, corner: usize) -> &[u32] {
        let edge = self.triangle_edges.get(triangle as usize).and_then(|edges| edges.get(corner));
        edge.map_or(&[], |&edge| self.edge(edge as usize))
    }

    fn edge(&self, index: usize) -> &[u32] {
        self.edges.get(index).map_or(&[], |edge| {
            let first = edge.first as usize;
            self.edge_triangles.get(first..first + edge.count as usize).unwrap_or_default()
        })
    }

    /// Number of distinct edges.
    pub fn edge_count(&self) -> usize {
        self.edges.len()
    }

    /// The number of edges by their number of triangles: one on a border, two inside a surface, three or more
    /// where the mesh is not a manifold.
    pub fn edge_valences(&self) -> BTreeMap<u32, usize> {
        let mut valences = BTreeMap::new();
        for edge in &self.edges {
            *valences.entry(edge.count).or_default() += 1;
        }
        valences
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_triangles_share_an_edge() {
        let adjacency = Adjacency::new(&[[0, 1, 2], [2, 1, 3], [7, 0, 1]], 5);
        assert_eq!(adjacency.triangles_of_edge(2, 1), [0, 1]);
        assert_eq!(adjacency.triangles_of_edge(0, 3), []);
        assert_eq!(adjacency.across(0, 1), [0, 1]);
        assert_eq!(adjacency.across(0, 0), [0]);
        assert_eq!(adjacency.triangles_of_vertex(1), [0, 1]);
        assert_eq!(adjacency.triangles_of_vertex(4), []);
        assert_eq!(adjacency.triangles_of_vertex(99), []);
        assert_eq!(adjacency.across(2, 0), []); // vertex 7 does not exist
        assert_eq!(adjacency.edge_count(), 5);
        assert_eq!(adjacency.edge_valences(), BTreeMap::from([(1, 4), (2, 1)]));
    }
}
