//! Collapses a binary tree into eight-wide nodes and blocks of triangles at the lowest expected cost by surface
//! area. The binary tree is built in `build`.
//!
//! The method is dynamic programming over the number of wide children that a binary subtree becomes: Ylitie,
//! Karras, Laine, "Efficient Incoherent Ray Traversal on GPUs Through Compressed Wide BVHs", HPG 2017, section 3.1.

use glam::Vec3;
use obvhs::bvh2::{Bvh2, node::Bvh2Node};

use crate::triangle_block::TriangleBlock;
use crate::wide_node::ChildRef;
use crate::wide_tree::WideTree;

/// Cost of visiting a node, in units of testing a block; measured (`cargo bench -p lumbre_rays --bench ratios`).
const NODE_COST: f32 = 0.5;

/// The cheapest ways to turn a binary subtree into wide children.
#[derive(Clone, Copy, Default)]
struct Plan {
    /// Number of triangles in the subtree.
    count: u32,
    /// Whether it becomes a block when it becomes a single child.
    block: bool,
    /// How many of i + 1 children are for the left subtree (the last entry is for a node of its own with eight
    /// children); 0 where one child fewer is cheaper.
    left: [u8; 8],
    /// Expected cost with at most i + 1 children.
    cost: [f32; 7],
}

/// Fills an empty tree from a binary one over `triangles`.
pub(crate) fn collapse(tree: &mut WideTree, binary: &Bvh2, triangles: &[(u32, [Vec3; 3])]) {
    let plans = plans(binary);
    let root = tree.reserve_node();
    // (binary node, its wide node, depth)
    let mut pending = vec![(0usize, root, 1usize)];
    while let Some((index, wide, depth)) = pending.pop() {
        tree.depth = tree.depth.max(depth);
        let mut children = Vec::with_capacity(8);
        for child in wide_children(binary, &plans, index) {
            let bounds = binary.nodes[child].aabb();
            let reference = if plans[child].block {
                tree.add_block(&members(binary, triangles, child))
            } else {
                let wide = tree.reserve_node();
                pending.push((child, wide, depth + 1));
                ChildRef::node(wide)
            };
            children.push(([Vec3::from(bounds.min), Vec3::from(bounds.max)], reference));
        }
        tree.fill_node(wide, &children);
    }
}

fn plans(binary: &Bvh2) -> Vec<Plan> {
    let mut order = Vec::with_capacity(binary.nodes.len());
    let mut pending = vec![0usize];
    while let Some(index) = pending.pop() {
        order.push(index);
        let node = &binary.nodes[index];
        if !node.is_leaf() {
            pending.extend(below(node));
        }
    }
    let mut plans = vec![Plan::default(); binary.nodes.len()];
    for &index in order.iter().rev() {
        let node = &binary.nodes[index];
        let area = node.aabb().half_area();
        plans[index] = if node.is_leaf() {
            Plan { count: node.prim_count, block: true, left: [0; 8], cost: [area; 7] }
        } else {
            let [left, right] = below(node).map(|child| plans[child]);
            combine(area, &left, &right)
        };
    }
    plans
}

fn combine(area: f32, left: &Plan, right: &Plan) -> Plan {
    let count = left.count + right.count;
    let mut plan = Plan { count, block: false, left: [0; 8], cost: [f32::INFINITY; 7] };
    // Costs of distributing i + 1 children over both sides, each of which gets at least one.
    let mut shared = [f32::INFINITY; 8];
    for (i, best) in shared.iter_mut().enumerate().skip(1) {
        for of_left in 1..=i {
            let cost = left.cost[of_left - 1] + right.cost[i - of_left];
            if cost < *best {
                *best = cost;
                plan.left[i] = of_left as u8;
            }
        }
    }
    let node = shared[7] + area * NODE_COST;
    plan.block = count as usize <= TriangleBlock::SIZE && area <= node;
    plan.cost[0] = if plan.block { area } else { node };
    for (i, &cost) in shared.iter().enumerate().take(7).skip(1) {
        plan.cost[i] = plan.cost[i - 1];
        if cost < plan.cost[i] {
            plan.cost[i] = cost;
        } else {
            plan.left[i] = 0;
        }
    }
    plan
}

/// Returns the binary nodes that become the children of a wide node.
fn wide_children(binary: &Bvh2, plans: &[Plan], index: usize) -> Vec<usize> {
    let mut children = Vec::with_capacity(8);
    if plans[index].block {
        // Only the root can be a block here.
        return vec![index];
    }
    // (binary node, number of children it may become, whether it may become a single one)
    let mut pending = vec![(index, 8usize, false)];
    while let Some((index, mut share, whole)) = pending.pop() {
        let plan = &plans[index];
        if whole {
            while share > 1 && plan.left[share - 1] == 0 {
                share -= 1;
            }
        }
        if share == 1 || binary.nodes[index].is_leaf() {
            children.push(index);
            continue;
        }
        let of_left = usize::from(plan.left[share - 1]);
        let [left, right] = below(&binary.nodes[index]);
        pending.push((left, of_left, true));
        pending.push((right, share - of_left, true));
    }
    children
}

fn members(binary: &Bvh2, triangles: &[(u32, [Vec3; 3])], index: usize) -> Vec<(u32, [Vec3; 3])> {
    let mut found = Vec::with_capacity(TriangleBlock::SIZE);
    let mut pending = vec![index];
    while let Some(index) = pending.pop() {
        let node = &binary.nodes[index];
        if node.is_leaf() {
            let first = node.first_index as usize;
            let range = first..first + node.prim_count as usize;
            found.extend(binary.primitive_indices[range].iter().map(|&i| triangles[i as usize]));
        } else {
            pending.extend(below(node));
        }
    }
    found
}

fn below(node: &Bvh2Node) -> [usize; 2] {
    [node.first_index as usize, node.first_index as usize + 1]
}
