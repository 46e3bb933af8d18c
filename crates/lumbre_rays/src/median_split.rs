//! Builds the four-wide hierarchy by splitting at the median: balanced whatever the triangles are, in n log^2 n.
//! Not the usual builder: piles of equal boxes, on which PLOC takes quadratic time, come here (see `build`).

use std::ops::Range;

use glam::Vec3;

use crate::build::WideTree;
use crate::triangle_block::TriangleBlock;
use crate::wide_node::{ChildRef, WideNode};

/// Fills an empty tree from more than four (index, canonical triangle) pairs, or fewer.
pub(crate) fn build_balanced(tree: &mut WideTree, triangles: &[(u32, [Vec3; 3])]) {
    let mut sorted = triangles.to_vec();
    if sorted.len() <= 4 {
        tree.root = block(tree, &sorted);
        return;
    }
    tree.root = ChildRef::node(0);
    tree.nodes.push(WideNode::new(&[]));
    let mut deepest = 0;
    // (triangles, their wide node, depth)
    let mut pending = vec![(0..sorted.len(), 0usize, 1usize)];
    while let Some((range, wide_index, depth)) = pending.pop() {
        deepest = deepest.max(depth);
        let mut lanes = Vec::with_capacity(4);
        for half in halves(&mut sorted, range) {
            for quarter in halves(&mut sorted, half) {
                let members = &sorted[quarter.clone()];
                if members.is_empty() {
                    continue;
                }
                let bounds = bounds(members.iter().flat_map(|(_, triangle)| triangle.iter().copied()));
                let reference = if members.len() <= 4 {
                    block(tree, members)
                } else {
                    tree.nodes.push(WideNode::new(&[]));
                    let index = tree.nodes.len() - 1;
                    pending.push((quarter, index, depth + 1));
                    ChildRef::node(index)
                };
                lanes.push((bounds, reference));
            }
        }
        tree.nodes[wide_index] = WideNode::new(&lanes);
    }
    tree.stack_size = 3 * deepest + 1;
}

fn block(tree: &mut WideTree, members: &[(u32, [Vec3; 3])]) -> ChildRef {
    tree.blocks.push(TriangleBlock::new(members));
    ChildRef::block(tree.blocks.len() - 1)
}

/// Sorts a range along the axis on which its centres lie farthest apart, and cuts it in the middle.
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
