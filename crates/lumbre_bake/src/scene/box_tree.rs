//! Which triangles lie near a place: a binary tree of boxes. Not for rays, which have a hierarchy of their own.

use glam::Vec3;

use crate::cancel_token::CancelToken;

/// Triangles of a leaf.
const LEAF: usize = 4;

#[derive(Debug)]
struct Node {
    low: Vec3,
    high: Vec3,
    /// A leaf's items, or an inner node's second child; its first follows it.
    first: u32,
    /// 0 for an inner node.
    count: u32,
}

/// A tree of boxes around triangles.
#[derive(Debug)]
pub(crate) struct BoxTree {
    nodes: Vec<Node>,
    items: Vec<u32>,
}

impl BoxTree {
    /// Of triangles by their corners; those whose corners are NaN are left out, and the others keep their numbers.
    pub fn new(triangles: &[[Vec3; 3]], stop: &CancelToken) -> Self {
        let mut items: Vec<u32> =
            (0..triangles.len() as u32).filter(|&index| !triangles[index as usize][0].is_nan()).collect();
        let mut nodes = Vec::with_capacity(2 * items.len() / LEAF + 1);
        if !items.is_empty() {
            let end = items.len();
            build((triangles, stop), &mut items, 0, end, &mut nodes);
        }
        Self { nodes, items }
    }

    /// Calls `visit` for every triangle whose box may meet the one from `low` to `high`, in an order that depends on the scene alone.
    pub fn near(&self, low: Vec3, high: Vec3, mut visit: impl FnMut(u32)) {
        self.near_while(low, high, |index| {
            visit(index);
            true
        });
    }

    /// As [`near`](Self::near), as long as `visit` wants more; whether it always did.
    pub fn near_while(&self, low: Vec3, high: Vec3, mut visit: impl FnMut(u32) -> bool) -> bool {
        if self.nodes.is_empty() {
            return true;
        }
        let mut stack = vec![0u32];
        while let Some(index) = stack.pop() {
            let node = &self.nodes[index as usize];
            if node.low.cmpgt(high).any() || node.high.cmplt(low).any() {
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

/// Halves by the median along the longest axis.
fn build(
    (triangles, stop): (&[[Vec3; 3]], &CancelToken),
    items: &mut [u32],
    first: usize,
    end: usize,
    nodes: &mut Vec<Node>,
) {
    let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    for corner in items[first..end].iter().flat_map(|&index| triangles[index as usize]) {
        (low, high) = (low.min(corner), high.max(corner));
    }
    let (index, count) = (nodes.len(), end - first);
    let is_leaf = count <= LEAF || stop.is_cancelled();
    nodes.push(Node { low, high, first: first as u32, count: if is_leaf { count as u32 } else { 0 } });
    if is_leaf {
        return;
    }
    let axis = (high - low).max_position();
    let middle = |&index: &u32| triangles[index as usize].iter().map(|corner| corner[axis]).sum::<f32>();
    items[first..end].sort_by(|a, b| middle(a).total_cmp(&middle(b)).then(a.cmp(b)));
    let half = first + count / 2;
    build((triangles, stop), items, first, half, nodes);
    nodes[index].first = nodes.len() as u32;
    build((triangles, stop), items, half, end, nodes);
}
