//! Builds the eight-wide hierarchy by splitting at the median, which is balanced for any triangles and takes n
//! log^2 n. It is only used for meshes with piles of equal boxes, on which PLOC takes quadratic time (see `build`).

use std::ops::Range;

use glam::Vec3;

use crate::triangle_block::TriangleBlock;
use crate::wide_node::ChildRef;
use crate::wide_tree::WideTree;

/// Fills an empty tree from (index, canonical triangle) pairs.
pub(crate) fn build_balanced(tree: &mut WideTree, triangles: &[(u32, [Vec3; 3])]) {
    let mut sorted = triangles.to_vec();
    let root = tree.reserve_node();
    // (triangles, their wide node, depth)
    let mut pending = vec![(0..sorted.len(), root, 1usize)];
    while let Some((range, wide, depth)) = pending.pop() {
        tree.depth = tree.depth.max(depth);
        let mut parts = vec![range];
        for _ in 0..3 {
            parts = parts.into_iter().flat_map(|part| halves(&mut sorted, part)).collect();
        }
        let mut children = Vec::with_capacity(8);
        for part in parts.into_iter().filter(|part| !part.is_empty()) {
            let members = &sorted[part.clone()];
            let bounds = bounds(members.iter().flat_map(|(_, triangle)| triangle.iter().copied()));
            let reference = if members.len() <= TriangleBlock::SIZE {
                tree.add_block(members)
            } else {
                let wide = tree.reserve_node();
                pending.push((part, wide, depth + 1));
                ChildRef::node(wide)
            };
            children.push((bounds, reference));
        }
        tree.fill_node(wide, &children);
    }
}

/// Sorts a range along the axis with the largest extent of its centres, and cuts it in the middle.
fn halves(triangles: &mut [(u32, [Vec3; 3])], range: Range<usize>) -> [Range<usize>; 2] {
    let middle = range.start + range.len() / 2;
    let members = &mut triangles[range.clone()];
    if !members.is_empty() {
        let [min, max] = bounds(members.iter().map(|(_, triangle)| centre(triangle)));
        let axis = (max - min).max_position();
        members.sort_by(|(i, a), (j, b)| centre(a)[axis].total_cmp(&centre(b)[axis]).then(i.cmp(j)));
    }
    [range.start..middle, middle..range.end]
}

fn centre(triangle: &[Vec3; 3]) -> Vec3 {
    triangle[0] + triangle[1] + triangle[2]
}

fn bounds(points: impl Iterator<Item = Vec3>) -> [Vec3; 2] {
    points.fold([Vec3::INFINITY, Vec3::NEG_INFINITY], |[min, max], point| [min.min(point), max.max(point)])
}
