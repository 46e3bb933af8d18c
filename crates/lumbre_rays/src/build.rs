//! Builds the eight-wide hierarchy: a binary one by obvhs (PLOC and reinsertion), which `collapse` then makes wide.
//! Triangles without area have already been removed by the caller.

use glam::{Vec3, Vec3A};
use obvhs::aabb::Aabb;
use obvhs::bvh2::reinsertion::ReinsertionOptimizer;
use obvhs::bvh2::{Bvh2, node::Bvh2Node};
use obvhs::ploc::{PlocBuilder, SortPrecision};

use crate::collapse::collapse;
use crate::median_split::build_balanced;
use crate::wide_tree::WideTree;

/// Number of nodes that reinsertion tries to place better, within the shares below: about a second on a loaded
/// machine. Measured on 69,000 triangles in a room, trying half of the nodes instead of a seventh made closest hits
/// 1.15 and any hits 1.2 times as fast and the build 3 times as slow.
const REINSERTED_NODES: f32 = 80_000.0;

/// The smallest and the largest share of the nodes that it tries.
const REINSERTED_SHARE: [f32; 2] = [0.15, 0.6];

/// How far the box in which the Morton curve runs extends beyond the box around all primitives, as a fraction of
/// the latter: two of its 2^21 cells.
const BEYOND: f32 = 1.0 / (1 << 20) as f32;

/// How many clusters to each side PLOC searches for the one to merge with; and in how many of the first rounds it
/// only looks at the next ones.
const SEARCH_DISTANCE: usize = 14;
const NEIGHBOURS_ONLY: usize = 3;

/// PLOC and reinsertion choose by surface area, so both take quadratic time among n equal boxes. A mesh with more
/// equal boxes than this is split at the median instead.
const MAX_COINCIDENT: usize = 64;

/// Builds the hierarchy of (index, canonical triangle) pairs, all of them finite.
pub(crate) fn build(triangles: &[(u32, [Vec3; 3])]) -> WideTree {
    let mut tree = WideTree::default();
    if triangles.is_empty() {
        return tree;
    }
    let boxes: Vec<Aabb> = triangles.iter().map(|(_, t)| Aabb::from_points(&t.map(Vec3A::from))).collect();
    if most_coincident(&boxes) > MAX_COINCIDENT {
        build_balanced(&mut tree, triangles);
        return tree;
    }
    let mut binary = clustered(&boxes);
    let [least, largest] = REINSERTED_SHARE;
    let share = (REINSERTED_NODES / binary.nodes.len() as f32).clamp(least, largest);
    ReinsertionOptimizer::default().run(&mut binary, share, None);
    collapse(&mut tree, &binary, triangles);
    tree
}

/// Builds a binary tree over the boxes by PLOC (Meister and Bittner, "Parallel Locally-Ordered Clustering for
/// Bounding Volume Hierarchy Construction", 2018). The single steps of obvhs are called here because its complete
/// builder sorts the boxes along a Morton curve that wraps around: boxes in the highest planes of the bounds, such
/// as a room's ceiling and two of its walls, were sorted among those in the lowest and merged with them. The
/// benchmark scene "walls in small triangles" shows the cost of that.
fn clustered(boxes: &[Aabb]) -> Bvh2 {
    let mut binary = Bvh2::zeroed(boxes.len());
    binary.primitive_indices = (0..boxes.len() as u32).collect();
    let mut builder = PlocBuilder::with_capacity(boxes.len());
    builder.current_nodes.clear();
    builder.current_nodes.extend((0..).zip(boxes).map(|(index, own)| Bvh2Node::new(*own, 1, index)));
    let mut around = boxes.iter().fold(Aabb::empty(), |around, own| around.union(own));
    around.max += around.diagonal().max_element() * BEYOND;
    builder.build_ploc_from_leaves::<SEARCH_DISTANCE, false>(
        &mut binary,
        around,
        SortPrecision::U64,
        NEIGHBOURS_ONLY,
    );
    binary
}

/// Returns the size of the largest set of equal boxes.
fn most_coincident(boxes: &[Aabb]) -> usize {
    let mut keys: Vec<[u32; 6]> = boxes
        .iter()
        .map(|b| [b.min.x, b.min.y, b.min.z, b.max.x, b.max.y, b.max.z].map(f32::to_bits))
        .collect();
    keys.sort_unstable();
    keys.chunk_by(|a, b| a == b).map(<[_]>::len).max().unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The boxes of the triangles on the six walls of a room, with `2 n²` triangles on each wall.
    fn walls(n: u32) -> Vec<Aabb> {
        let mut boxes = Vec::new();
        let step = 2.0 / n as f32;
        for axis in 0..3 {
            for side in [-1.0f32, 1.0] {
                for cell in 0..n * n {
                    let along = [(cell % n) as f32, (cell / n) as f32].map(|at| at * step - 1.0);
                    let corner = |offset: f32| {
                        let mut corner = [side; 3];
                        corner[(axis + 1) % 3] = along[0] + offset;
                        corner[(axis + 2) % 3] = along[1] + offset;
                        Vec3A::from_array(corner)
                    };
                    let own = Aabb::new(corner(0.0), corner(step));
                    boxes.extend([own; 2]);
                }
            }
        }
        boxes
    }

    /// Area of all inner nodes over that of the root: roughly the number of nodes that a ray visits.
    fn nodes_met(binary: &Bvh2) -> f64 {
        let inner = binary.nodes.iter().filter(|node| !node.is_leaf());
        let area = inner.map(|node| f64::from(node.aabb().half_area())).sum::<f64>();
        area / f64::from(binary.nodes[0].aabb().half_area())
    }

    #[test]
    fn what_lies_in_the_highest_planes_is_not_clustered_with_what_lies_in_the_lowest() {
        for n in [4, 12, 40, 120] {
            let boxes = walls(n);
            let met = nodes_met(&clustered(&boxes));
            // Each level (walls, their quarters and so on) has about the area of the room, and there are somewhat
            // more levels than in a balanced tree. If boxes are joined across the room, most nodes are as long as
            // the room and there are n² of them, so that 4 to 47 times as many are visited.
            let levels = f64::from(boxes.len() as u32).log2();
            println!("{} boxes: {met:.1} nodes met, {levels:.1} levels", boxes.len());
            assert!(met < 3.0 * levels, "{met} of {levels} levels");
        }
    }
}
