//! A binary tree of bounding boxes that finds the triangles near a place. Rays use a hierarchy of their own
//! (`lumbre_rays::Bvh`).

use glam::Vec3;

use crate::bounds::Bounds;
use crate::cancel_token::CancelToken;

/// Most triangles in a leaf.
const MAX_LEAF_TRIANGLES: usize = 4;

#[derive(Debug)]
struct Node {
    bounds: Bounds<Vec3>,
    /// Of a leaf, the index of its first item; of an inner node, the index of its second child (the first child
    /// directly follows the node).
    first: u32,
    /// The number of items in a leaf; 0 for an inner node.
    count: u32,
}

/// A tree of boxes around triangles.
#[derive(Debug)]
pub(crate) struct BoxTree {
    nodes: Vec<Node>,
    items: Vec<u32>,
}

impl BoxTree {
    /// Builds the tree over triangles given by their corners. Triangles whose first corner is NaN are left out; the
    /// others keep their indices.
    pub fn new(triangles: &[[Vec3; 3]], stop: &CancelToken) -> Self {
        let mut items: Vec<u32> =
            (0..triangles.len() as u32).filter(|&index| !triangles[index as usize][0].is_nan()).collect();
        let mut nodes = Vec::with_capacity(2 * items.len() / MAX_LEAF_TRIANGLES + 1);
        if !items.is_empty() {
            let end = items.len();
            build((triangles, stop), &mut items, 0, end, &mut nodes);
        }
        Self { nodes, items }
    }

    /// Calls `visit` for every triangle that may overlap a box (all triangles of each leaf that
    /// overlaps it). The order depends on the scene alone.
    pub fn near(&self, place: &Bounds<Vec3>, mut visit: impl FnMut(u32)) {
        self.near_while(place, |index| {
            visit(index);
            true
        });
    }

    /// Like [`near`](Self::near), but stops as soon as `visit` returns `false`. Returns whether it visited all of them.
    pub fn near_while(&self, place: &Bounds<Vec3>, mut visit: impl FnMut(u32) -> bool) -> bool {
        if self.nodes.is_empty() {
            return true;
        }
        let mut stack = vec![0u32];
        while let Some(index) = stack.pop() {
            let node = &self.nodes[index as usize];
            if node.bounds.low.cmpgt(place.high).any() || node.bounds.high.cmplt(place.low).any() {
                continue;
            }
            if node.count == 0 {
                stack.extend([node.first, index + 1]);
            } else {
                let range = node.first as usize..(node.first + node.count) as usize;
                if !self.items[range].iter().all(|&index| visit(index)) {
                    return false;
                }
            }
        }
        true
    }
}

/// Builds the subtree over `items[first..end]`, split at the median along the longest axis of its box.
fn build(
    (triangles, stop): (&[[Vec3; 3]], &CancelToken),
    items: &mut [u32],
    first: usize,
    end: usize,
    nodes: &mut Vec<Node>,
) {
    let bounds: Bounds<Vec3> =
        items[first..end].iter().flat_map(|&index| triangles[index as usize]).collect();
    let (index, count) = (nodes.len(), end - first);
    let is_leaf = count <= MAX_LEAF_TRIANGLES || stop.is_cancelled();
    nodes.push(Node { bounds, first: first as u32, count: if is_leaf { count as u32 } else { 0 } });
    if is_leaf {
        return;
    }
    let axis = (bounds.high - bounds.low).max_position();
    // Three times the centroid's coordinate, which sorts as the centroid does.
    let position = |&index: &u32| triangles[index as usize].iter().map(|corner| corner[axis]).sum::<f32>();
    items[first..end].sort_by(|a, b| position(a).total_cmp(&position(b)).then(a.cmp(b)));
    let half = first + count / 2;
    build((triangles, stop), items, first, half, nodes);
    nodes[index].first = nodes.len() as u32;
    build((triangles, stop), items, half, end, nodes);
}
