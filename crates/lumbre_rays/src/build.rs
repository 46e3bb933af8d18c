//! Builds the four-wide hierarchy: a binary one by obvhs (PLOC and reinsertion), then its collapse.
//! Not traversal, and not a judge of triangles: those without area never come here.

use glam::{Vec3, Vec3A};
use obvhs::{
    aabb::Aabb,
    bvh2::{Bvh2, node::Bvh2Node, reinsertion::ReinsertionOptimizer},
    ploc::{PlocBuilder, PlocSearchDistance, SortPrecision},
};

use crate::median_split::build_balanced;
use crate::triangle_block::TriangleBlock;
use crate::wide_node::{ChildRef, WideNode};

/// Share of the nodes that reinsertion tries to place better; more costs build time and gains little.
const REINSERTION_RATIO: f32 = 0.15;

/// PLOC and reinsertion choose by surface area, so among n equal boxes both take quadratic time. A mesh with a pile
/// of more than this many is split at the median instead.
const MOST_COINCIDENT: usize = 64;

/// The tree as traversal reads it.
#[derive(Clone, Debug)]
pub(crate) struct WideTree {
    pub nodes: Vec<WideNode>,
    pub blocks: Vec<TriangleBlock>,
    pub root: ChildRef,
    /// Entries that the traversal stack may hold at once.
    pub stack_size: usize,
}

impl WideTree {
    /// From (index, canonical triangle) pairs; every triangle finite.
    pub fn build(triangles: &[(u32, [Vec3; 3])]) -> Self {
        let mut tree = Self { nodes: Vec::new(), blocks: Vec::new(), root: ChildRef::NONE, stack_size: 1 };
        if triangles.is_empty() {
            return tree;
        }
        let boxes: Vec<Aabb> =
            triangles.iter().map(|(_, t)| Aabb::from_points(&t.map(Vec3A::from))).collect();
        if most_coincident(&boxes) > MOST_COINCIDENT {
            build_balanced(&mut tree, triangles);
            return tree;
        }
        let mut binary = PlocBuilder::with_capacity(boxes.len()).build(
            PlocSearchDistance::Medium,
            &boxes,
            (0..boxes.len() as u32).collect(),
            SortPrecision::U64,
            3,
        );
        ReinsertionOptimizer::default().run(&mut binary, REINSERTION_RATIO, None);
        Collapse::new(&binary, triangles).run(&mut tree);
        tree
    }
}

/// Size of the largest set of equal boxes.
fn most_coincident(boxes: &[Aabb]) -> usize {
    let mut keys: Vec<[u32; 6]> = boxes
        .iter()
        .map(|b| [b.min.x, b.min.y, b.min.z, b.max.x, b.max.y, b.max.z].map(f32::to_bits))
        .collect();
    keys.sort_unstable();
    keys.chunk_by(|a, b| a == b).map(<[_]>::len).max().unwrap_or(0)
}

struct Collapse<'a> {
    binary: &'a Bvh2,
    triangles: &'a [(u32, [Vec3; 3])],
    /// Triangles below each binary node.
    counts: Vec<u32>,
}

impl<'a> Collapse<'a> {
    fn new(binary: &'a Bvh2, triangles: &'a [(u32, [Vec3; 3])]) -> Self {
        let mut order = Vec::with_capacity(binary.nodes.len());
        let mut pending = vec![0usize];
        while let Some(index) = pending.pop() {
            order.push(index);
            let node = &binary.nodes[index];
            if !node.is_leaf() {
                pending.extend(children(node));
            }
        }
        let mut counts = vec![0u32; binary.nodes.len()];
        for &index in order.iter().rev() {
            let node = &binary.nodes[index];
            counts[index] =
                if node.is_leaf() { node.prim_count } else { children(node).map(|c| counts[c]).iter().sum() };
        }
        Self { binary, triangles, counts }
    }

    fn run(&self, tree: &mut WideTree) {
        if self.fits_a_block(0) {
            tree.root = self.block(0, tree);
            return;
        }
        tree.root = ChildRef::node(0);
        tree.nodes.push(WideNode::new(&[]));
        let mut deepest = 0;
        // (binary node, its wide node, depth)
        let mut pending = vec![(0usize, 0usize, 1usize)];
        while let Some((binary_index, wide_index, depth)) = pending.pop() {
            deepest = deepest.max(depth);
            let mut lanes = Vec::with_capacity(4);
            for child in self.four_children(binary_index) {
                let bounds = &self.binary.nodes[child].aabb();
                let reference = if self.fits_a_block(child) {
                    self.block(child, tree)
                } else {
                    let index = tree.nodes.len();
                    tree.nodes.push(WideNode::new(&[]));
                    pending.push((child, index, depth + 1));
                    ChildRef::node(index)
                };
                lanes.push(([Vec3::from(bounds.min), Vec3::from(bounds.max)], reference));
            }
            tree.nodes[wide_index] = WideNode::new(&lanes);
        }
        // Each level leaves at most three siblings waiting.
        tree.stack_size = 3 * deepest + 1;
    }

    /// Opens the child of the largest surface until there are four, or none that is worth opening.
    fn four_children(&self, index: usize) -> Vec<usize> {
        let mut open: Vec<usize> = children(&self.binary.nodes[index]).to_vec();
        while open.len() < 4 {
            let largest = (0..open.len())
                .filter(|&i| !self.fits_a_block(open[i]))
                .max_by(|&a, &b| self.area(open[a]).total_cmp(&self.area(open[b])));
            let Some(largest) = largest else { break };
            let [left, right] = children(&self.binary.nodes[open[largest]]);
            open[largest] = left;
            open.push(right);
        }
        // Any-hit rays go through the lanes in order: the largest child stops most of them.
        open.sort_by(|&a, &b| self.area(b).total_cmp(&self.area(a)));
        open
    }

    fn area(&self, index: usize) -> f32 {
        self.binary.nodes[index].aabb().half_area()
    }

    fn fits_a_block(&self, index: usize) -> bool {
        self.counts[index] <= 4 || self.binary.nodes[index].is_leaf()
    }

    fn block(&self, index: usize, tree: &mut WideTree) -> ChildRef {
        let mut triangles = Vec::with_capacity(4);
        let mut pending = vec![index];
        while let Some(index) = pending.pop() {
            let node = &self.binary.nodes[index];
            if node.is_leaf() {
                let first = node.first_index as usize;
                let range = first..first + node.prim_count as usize;
                triangles
                    .extend(self.binary.primitive_indices[range].iter().map(|&i| self.triangles[i as usize]));
            } else {
                pending.extend(children(node));
            }
        }
        tree.blocks.push(TriangleBlock::new(&triangles));
        ChildRef::block(tree.blocks.len() - 1)
    }
}

fn children(node: &Bvh2Node) -> [usize; 2] {
    [node.first_index as usize, node.first_index as usize + 1]
}
