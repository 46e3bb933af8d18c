//! Traverses the eight-wide tree with a ray. The geometry tests are in `triangle_block` and `wide_node`, the order
//! of a node's children in `visit_order`.

use fearless_simd::Simd;

use crate::Hit;
use crate::ray_setup::RaySetup;
use crate::triangle_block::{BlockRay, TriangleBlock};
use crate::visit_order::visits;
use crate::wide_node::NodeRay;
use crate::wide_tree::WideTree;

/// Trees up to this depth are traversed without allocating the stack.
const SHORT: usize = 16;

/// Children of a node that are still to be visited.
#[derive(Clone, Copy, Default)]
struct Waiting {
    node: u32,
    /// In the order of `visits`.
    lanes: u32,
}

/// The state of a traversal's search.
struct Search<'a, S: Simd, F> {
    ray: BlockRay<S>,
    blocks: &'a [TriangleBlock],
    any: bool,
    filter: F,
    t_max: f32,
    best: Option<Hit>,
}

impl<S: Simd, F: Fn(u32, f32, f32) -> bool> Search<'_, S, F> {
    /// Tests a block and records its hits; returns true if the traversal is finished.
    #[inline(always)]
    fn test(&mut self, block: usize) -> bool {
        let Some(block) = self.blocks.get(block) else { return false };
        let Some(hits) = block.intersect(&self.ray, self.t_max) else { return false };
        let mut lanes = hits.lanes;
        while lanes != 0 {
            let lane = lanes.trailing_zeros() as usize & 7;
            lanes &= lanes - 1;
            let (triangle, distance) = (block.ids[lane], hits.distance[lane]);
            // Of two triangles at the same distance the lower index wins, regardless of the shape of the tree.
            let nearer = self.best.is_none_or(|best| (distance, triangle) < (best.distance, best.triangle));
            if !nearer {
                continue;
            }
            // The quotients may be rounded to one unit in the last place above 1.
            let u = hits.u[lane].clamp(0.0, 1.0);
            let v = hits.v[lane].clamp(0.0, 1.0 - u);
            if !(self.filter)(triangle, u, v) {
                continue;
            }
            let back_face = hits.back >> lane & 1 == 1;
            self.best = Some(Hit { triangle, distance, barycentric: (u, v), back_face });
            if self.any {
                return true;
            }
            self.t_max = distance;
        }
        false
    }
}

impl WideTree {
    /// Returns the closest hit, or with `ANY` any hit; distances are in canonical units.
    #[inline(always)]
    pub fn trace<const ANY: bool, S: Simd, F: Fn(u32, f32, f32) -> bool>(
        &self,
        simd: S,
        setup: &RaySetup,
        filter: F,
    ) -> Option<Hit> {
        // Few trees are deeper than the array; that of a pile of slivers may be.
        let (mut short, mut long);
        let stack = if self.depth <= SHORT {
            short = [Waiting::default(); SHORT];
            &mut short[..]
        } else {
            long = vec![Waiting::default(); self.depth];
            &mut long[..]
        };
        let ray = NodeRay::new(simd, setup);
        let octant = setup.octant;
        let mut search = Search {
            ray: BlockRay::new(simd, setup),
            blocks: &self.blocks,
            any: ANY,
            filter,
            t_max: setup.t_max,
            best: None,
        };
        let mut depth = 0;
        let mut index = 0;
        let mut node = self.nodes.first()?;
        let (entered, mut enter) = node.intersect(&ray, search.t_max);
        let mut lanes = visits(entered, octant);
        loop {
            if lanes == 0 {
                // Resume with the waiting children, except those that are beyond a hit found since.
                if depth == 0 {
                    return search.best;
                }
                depth -= 1;
                let waiting = stack.get(depth).copied().unwrap_or_default();
                index = waiting.node;
                node = self.nodes.get(index as usize)?;
                lanes = waiting.lanes;
                if !ANY {
                    let entered;
                    (entered, enter) = node.intersect(&ray, search.t_max);
                    lanes &= visits(entered, octant);
                }
                continue;
            }
            if ANY {
                // Blocks before nodes: the first hit ends the search.
                let mut blocks = lanes & visits(node.blocks, octant);
                lanes &= !blocks;
                while blocks != 0 {
                    let lane = blocks.trailing_zeros() ^ octant;
                    blocks &= blocks - 1;
                    if search.test(node.children[lane as usize & 7].as_block().unwrap_or(usize::MAX)) {
                        return search.best;
                    }
                }
                if lanes == 0 {
                    continue;
                }
            }
            let lane = lanes.trailing_zeros() ^ octant;
            lanes &= lanes - 1;
            let child = node.children[lane as usize & 7];
            if let Some(block) = child.as_block() {
                let before = search.t_max;
                if search.test(block) {
                    return search.best;
                }
                if !ANY && lanes != 0 && search.t_max != before {
                    lanes &= visits(ray.reached(enter, search.t_max), octant);
                }
            } else {
                if lanes != 0 {
                    // At most one entry per level waits, so there is always a slot.
                    if let Some(slot) = stack.get_mut(depth) {
                        *slot = Waiting { node: index, lanes };
                        depth += 1;
                    }
                }
                index = child.0;
                node = self.nodes.get(index as usize)?;
                let entered;
                (entered, enter) = node.intersect(&ray, search.t_max);
                lanes = visits(entered, octant);
            }
        }
    }
}
