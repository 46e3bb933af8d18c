//! The eight-wide hierarchy as the traversal reads it, and how nodes and blocks are added to it. What is put where
//! is decided by the builders.

use glam::Vec3;

use crate::triangle_block::TriangleBlock;
use crate::visit_order;
use crate::wide_node::{ChildRef, WideNode};

/// The tree as the traversal reads it; its root is node 0.
#[derive(Clone, Debug, Default)]
pub(crate) struct WideTree {
    pub nodes: Vec<WideNode>,
    pub blocks: Vec<TriangleBlock>,
    /// Number of nodes on the longest path from the root.
    pub depth: usize,
}

impl WideTree {
    /// Adds an empty node, to be filled later.
    pub fn reserve_node(&mut self) -> usize {
        self.nodes.push(WideNode::new(&[None; 8]));
        self.nodes.len() - 1
    }

    /// Fills a node with up to eight boxes and what they contain, each in the lane in which rays visit it front to
    /// back.
    pub fn fill_node(&mut self, index: usize, children: &[([Vec3; 2], ChildRef)]) {
        let centres: Vec<Vec3> = children.iter().map(|([min, max], _)| *min + *max).collect();
        let mut lanes = [None; 8];
        for (child, lane) in children.iter().zip(visit_order::lanes(&centres)) {
            lanes[lane] = Some(*child);
        }
        self.nodes[index] = WideNode::new(&lanes);
    }

    /// Adds a block of up to eight triangles.
    pub fn add_block(&mut self, triangles: &[(u32, [Vec3; 3])]) -> ChildRef {
        self.blocks.push(TriangleBlock::new(triangles));
        ChildRef::block(self.blocks.len() - 1)
    }
}
