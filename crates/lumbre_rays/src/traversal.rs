//! Walks the four-wide tree with a ray, nearest children first. Not the geometry tests it calls.

use crate::Hit;
use crate::build::WideTree;
use crate::ray_setup::RaySetup;
use crate::triangle_block::{BlockHits, BlockRay, TriangleBlock};
use crate::wide_node::{ChildRef, NodeRay, WideNode};

/// Where the traversal stands with its search.
struct Search<F> {
    any: bool,
    filter: F,
    t_max: f32,
    best: Option<Hit>,
}

impl<F: Fn(u32, f32, f32) -> bool> Search<F> {
    /// Takes the hits of a block; true ends the traversal.
    #[inline(always)]
    fn take(&mut self, block: &TriangleBlock, hits: &BlockHits) -> bool {
        let mut lanes = hits.lanes;
        while lanes != 0 {
            let lane = lanes.trailing_zeros() as usize & 3;
            lanes &= lanes - 1;
            let (triangle, distance) = (block.ids[lane], hits.distance[lane]);
            // Of two triangles at the same distance the first in the list wins, whatever the shape of the tree.
            let nearer = self.best.is_none_or(|best| (distance, triangle) < (best.distance, best.triangle));
            if !nearer {
                continue;
            }
            // The quotients may round past 1 by one unit in the last place.
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
    /// The closest hit, or with `ANY` one of them; distances in canonical units.
    #[inline]
    pub fn trace<const ANY: bool, F: Fn(u32, f32, f32) -> bool>(
        &self,
        setup: &RaySetup,
        filter: F,
    ) -> Option<Hit> {
        match self.stack_size {
            0..=40 => self.trace_with_stack::<ANY, F>(setup, filter, &mut [0; 40]),
            41..=112 => self.trace_with_stack::<ANY, F>(setup, filter, &mut [0; 112]),
            size => self.trace_with_stack::<ANY, F>(setup, filter, &mut vec![0; size]),
        }
    }

    #[inline(always)]
    fn trace_with_stack<const ANY: bool, F: Fn(u32, f32, f32) -> bool>(
        &self,
        setup: &RaySetup,
        filter: F,
        stack: &mut [u64],
    ) -> Option<Hit> {
        let node_ray = NodeRay::new(setup);
        let block_ray = BlockRay::new(setup);
        let mut search = Search { any: ANY, filter, t_max: setup.t_max, best: None };
        let mut waiting = 0;
        let mut current = self.root;
        loop {
            if let Some(index) = current.as_block() {
                // `ChildRef::NONE`, the root of an empty tree, is a block that does not exist.
                let Some(block) = self.blocks.get(index) else { break };
                let hits = block.intersect(&block_ray, search.t_max);
                if hits.lanes != 0 && search.take(block, &hits) {
                    break;
                }
            } else {
                let Some(node) = self.nodes.get(current.0 as usize) else { break };
                if let Some(next) = descend::<ANY>(node, &node_ray, search.t_max, stack, &mut waiting) {
                    current = next;
                    continue;
                }
            }
            // The next child that starts before the closest hit so far.
            loop {
                if waiting == 0 {
                    return search.best;
                }
                waiting -= 1;
                let entry = stack.get(waiting).copied().unwrap_or_default();
                if f32::from_bits((entry >> 32) as u32) <= search.t_max {
                    current = ChildRef(entry as u32);
                    break;
                }
            }
        }
        search.best
    }
}

/// Tests the children; returns the nearest and pushes the others, the farthest first.
#[inline(always)]
fn descend<const ANY: bool>(
    node: &WideNode,
    ray: &NodeRay,
    t_max: f32,
    stack: &mut [u64],
    waiting: &mut usize,
) -> Option<ChildRef> {
    let (mut lanes, enter) = node.intersect(ray, t_max);
    if lanes == 0 {
        return None;
    }
    // Distances are not negative, so their bits sort like the numbers.
    let mut next_entry = || {
        let lane = lanes.trailing_zeros() as usize & 3;
        lanes &= lanes - 1;
        (u64::from(enter[lane].to_bits()) << 32 | u64::from(node.children[lane].0), lanes != 0)
    };
    let (mut nearest, more) = next_entry();
    if !more {
        return Some(ChildRef(nearest as u32));
    }
    let mut push = |entry: u64| {
        // `stack_size` bounds what can wait, so there always is a slot.
        if let Some(slot) = stack.get_mut(*waiting) {
            *slot = entry;
            *waiting += 1;
        }
    };
    let (mut second, more) = next_entry();
    if !ANY && second < nearest {
        (nearest, second) = (second, nearest);
    }
    if !more {
        push(second);
        return Some(ChildRef(nearest as u32));
    }
    let (mut third, more) = next_entry();
    let mut fourth = if more { next_entry().0 } else { u64::MAX };
    if !ANY {
        // nearest <= second holds; a sorting network for the rest.
        sort_pair(&mut third, &mut fourth);
        sort_pair(&mut nearest, &mut third);
        sort_pair(&mut second, &mut fourth);
        sort_pair(&mut second, &mut third);
    }
    if more {
        push(fourth);
    }
    push(third);
    push(second);
    Some(ChildRef(nearest as u32))
}

#[inline(always)]
fn sort_pair(a: &mut u64, b: &mut u64) {
    (*a, *b) = ((*a).min(*b), (*a).max(*b));
}
