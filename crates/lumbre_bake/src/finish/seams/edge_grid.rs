//! Finds edges near each other: one grid for each power of two of length, so that every edge lies in a few cells of
//! about its own size. Not whether the edges meet: that is `samples`.

use std::collections::HashMap;

use glam::DVec3;

use super::edges::Edge;

/// Edges of one length class, by cell.
struct Level {
    cell: f64,
    cells: HashMap<[i64; 3], Vec<u32>>,
}

/// All edges, by length class and cell.
pub(crate) struct EdgeGrid<'a> {
    edges: &'a [Edge],
    /// Distance up to which edges count as near, canonical units.
    reach: f64,
    /// The length classes in ascending order.
    levels: Vec<(i32, Level)>,
}

/// Most edges that one edge is compared with: stacked copies of one object must not take quadratic time.
const MAX_CANDIDATES: usize = 4096;

impl<'a> EdgeGrid<'a> {
    pub fn new(edges: &'a [Edge], reach: f64) -> Self {
        let mut order: Vec<(i32, u32)> =
            edges.iter().enumerate().map(|(index, edge)| (class(edge, reach), index as u32)).collect();
        order.sort_unstable();
        let levels = order.chunk_by(|a, b| a.0 == b.0).map(|same| {
            let mut level = Level { cell: f64::from(same[0].0).exp2(), cells: HashMap::new() };
            for &(_, index) in same {
                for cell in cells(&edges[index as usize], level.cell, reach) {
                    level.cells.entry(cell).or_default().push(index);
                }
            }
            (same[0].0, level)
        });
        Self { edges, reach, levels: levels.collect() }
    }

    /// The edges that may touch an edge, in ascending order, so that each pair is found once: edges of longer classes,
    /// and those of its own class with a smaller index. Also returns whether there may be more than were found.
    pub fn near(&self, index: u32) -> (Vec<u32>, bool) {
        let edge = &self.edges[index as usize];
        let own_class = class(edge, self.reach);
        let mut near = Vec::new();
        for (class, level) in self.levels.iter().filter(|(class, _)| *class >= own_class) {
            for cell in cells(edge, level.cell, self.reach) {
                let there = level.cells.get(&cell).into_iter().flatten().copied();
                near.extend(there.filter(|&other| *class > own_class || other < index).take(MAX_CANDIDATES));
            }
        }
        near.sort_unstable();
        near.dedup();
        let is_crowded = near.len() >= MAX_CANDIDATES;
        near.truncate(MAX_CANDIDATES);
        (near, is_crowded)
    }
}

/// The length class of an edge: the exponent of the next power of two.
fn class(edge: &Edge, reach: f64) -> i32 {
    // Canonical lengths are about in [2^-149, 4], so the cast is exact.
    (edge.length() + 2.0 * reach).log2().ceil() as i32
}

/// The cells that an edge's bounding box touches: at most three along each axis if the edge is no longer than a cell.
fn cells(edge: &Edge, cell: f64, reach: f64) -> Vec<[i64; 3]> {
    let [a, b] = edge.ends;
    let place = |point: DVec3| (point / cell).floor().to_array().map(|x| x as i64);
    let (low, high) = (place(a.min(b) - reach), place(a.max(b) + reach));
    let mut cells = Vec::new();
    for x in low[0]..=high[0] {
        for y in low[1]..=high[1] {
            cells.extend((low[2]..=high[2]).map(|z| [x, y, z]));
        }
    }
    cells
}

#[cfg(test)]
mod tests {
    use glam::{Vec2, Vec3};

    use super::*;

    #[test]
    fn finds_every_pair_that_touches_once() {
        let edge = |a: [f64; 3], b: [f64; 3]| Edge {
            triangle: 0,
            ends: [DVec3::from(a), DVec3::from(b)],
            uv: [Vec2::ZERO, Vec2::X],
            normals: [Vec3::Y; 2],
            inward: Vec3::Z,
        };
        // A long edge, a hundred short ones along it, and as many far away.
        let mut edges = vec![edge([-1.0, 0.0, 0.0], [1.0, 0.0, 0.0])];
        for i in 0..100 {
            let x = -1.0 + f64::from(i) * 0.02;
            edges.push(edge([x, 0.0, 0.0], [x + 0.02, 0.0, 0.0]));
            edges.push(edge([x, 1.0, 0.5], [x + 0.02, 1.0, 0.5]));
        }
        let grid = EdgeGrid::new(&edges, 1e-6);
        let pairs: Vec<(u32, u32)> = (0..edges.len() as u32)
            .flat_map(|index| grid.near(index).0.into_iter().map(move |other| (index, other)))
            .collect();
        for short in (1..edges.len() as u32).step_by(2) {
            let with_the_long = pairs.iter().filter(|&&(a, b)| (a, b) == (short, 0) || (a, b) == (0, short));
            assert_eq!(with_the_long.count(), 1);
        }
        assert!((0..edges.len() as u32).all(|index| !grid.near(index).1));
        // Only neighbours: far fewer than all pairs.
        assert!(pairs.len() < 100 + 2 * 100 * 4, "{}", pairs.len());
        // Too many in one place are reported.
        let stacked = vec![edges[0]; MAX_CANDIDATES + 2];
        let grid = EdgeGrid::new(&stacked, 1e-6);
        let (near, is_crowded) = grid.near(MAX_CANDIDATES as u32 + 1);
        assert!(is_crowded && near.len() == MAX_CANDIDATES && !grid.near(5).1);
    }
}
