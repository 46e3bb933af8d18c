//! Sampling an emitter by descending the hierarchy: each step chooses among up to eight nodes in proportion to their
//! estimated light, so that ten thousand emitters are five steps away. The hierarchy itself is `emitter_tree`.

use fearless_simd::{Simd, dispatch};

use super::emitter_bounds::{BoundsEight, EmitterBounds, LANES, LEVEL, ReceiverLanes};
use super::source_tree::{NodeKind, pick};
use crate::scene::Receiver;

/// How a descent continues from a node.
#[derive(Clone, Copy, Debug)]
enum NextStep {
    /// It ends at an emitter.
    Emitter(u32),
    /// It chooses among the nodes of a wide node, given by its index.
    Wide(u32),
    /// It chooses between the node's two children. Such nodes are inside a wide node, so only a descent that starts
    /// there reaches them.
    Halves([u32; 2]),
}

/// A node of the tree with up to eight descendants that together hold its emitters, in the order of the tree.
#[derive(Clone, Debug)]
struct WideNode {
    bounds: BoundsEight,
    next: [NextStep; LANES],
    count: usize,
}

/// The hierarchy of emitters, widened for SIMD.
#[derive(Clone, Debug, Default)]
pub(crate) struct EmitterWalk {
    wide_nodes: Vec<WideNode>,
    /// How a descent continues from each node of the binary tree.
    next: Vec<NextStep>,
}

/// A sampled emitter.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EmitterChoice {
    pub emitter: u32,
    /// The random number, rescaled from the emitter's interval to [0, 1) for reuse.
    pub u: f32,
    pub probability: f32,
}

impl EmitterWalk {
    /// Bytes that it takes.
    pub fn bytes(&self) -> u64 {
        (size_of_val(self.wide_nodes.as_slice()) + size_of_val(self.next.as_slice())) as u64
    }

    /// Widens a binary tree in which children follow their parents and the first node is the root.
    pub fn new(kinds: &[NodeKind], bounds: &[EmitterBounds]) -> Self {
        let mut emitters = vec![1u32; kinds.len()];
        for (node, kind) in kinds.iter().enumerate().rev() {
            if let NodeKind::Inner([near, far]) = *kind {
                emitters[node] = emitters[near as usize] + emitters[far as usize];
            }
        }
        let next = |kind: &NodeKind| match *kind {
            NodeKind::Leaf(emitter) => NextStep::Emitter(emitter),
            NodeKind::Inner(halves) => NextStep::Halves(halves),
        };
        let mut walk = Self { wide_nodes: Vec::new(), next: kinds.iter().map(next).collect() };
        let mut pending = Vec::from_iter((!kinds.is_empty()).then_some(0u32));
        let mut wide_children = Vec::new();
        while let Some(node) = pending.pop() {
            let NodeKind::Inner(halves) = kinds[node as usize] else { continue };
            // The node with the most emitters is opened until there are eight nodes.
            let mut nodes = Vec::from(halves);
            while nodes.len() < LANES {
                let largest = (0..nodes.len()).max_by_key(|&place| emitters[nodes[place] as usize]);
                let Some((place, halves)) = largest.and_then(|place| match kinds[nodes[place] as usize] {
                    NodeKind::Leaf(_) => None,
                    NodeKind::Inner(halves) => Some((place, halves)),
                }) else {
                    break;
                };
                nodes.splice(place..=place, halves);
            }
            walk.next[node as usize] = NextStep::Wide(wide_children.len() as u32);
            pending.extend(&nodes);
            wide_children.push(nodes);
        }
        let wide_node = |nodes: &Vec<u32>| {
            let mut next = [NextStep::Emitter(0); LANES];
            next.iter_mut().zip(nodes).for_each(|(next, &node)| *next = walk.next[node as usize]);
            let bounds: Vec<EmitterBounds> = nodes.iter().map(|&node| bounds[node as usize]).collect();
            WideNode { bounds: BoundsEight::new(&bounds), next, count: nodes.len() }
        };
        walk.wide_nodes = wide_children.iter().map(wide_node).collect();
        walk
    }

    /// Samples an emitter of a node by `u` in [0, 1), about in proportion to the light that it brings to the receiver.
    /// `bounds` are those of the tree's nodes.
    pub fn choose(&self, bounds: &[EmitterBounds], node: u32, receiver: &Receiver, u: f32) -> EmitterChoice {
        #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
        if let Some(simd) = LEVEL.as_avx2() {
            return simd.vectorize(
                #[inline(always)]
                || self.choose_with(simd, bounds, node, receiver, u),
            );
        }
        dispatch!(*LEVEL, simd => self.choose_with(simd, bounds, node, receiver, u))
    }

    #[inline(always)]
    fn choose_with<S: Simd>(
        &self,
        simd: S,
        bounds: &[EmitterBounds],
        node: u32,
        receiver: &Receiver,
        mut u: f32,
    ) -> EmitterChoice {
        let lanes = ReceiverLanes::new(simd, receiver);
        let (mut next, mut probability) = (self.next[node as usize], 1.0);
        loop {
            next = match next {
                NextStep::Emitter(emitter) => return EmitterChoice { emitter, u, probability },
                NextStep::Wide(index) => {
                    let node = &self.wide_nodes[index as usize];
                    let weights = node.bounds.weights(&lanes);
                    let (lane, share, rescaled) = pick(&weights[..node.count], u);
                    (probability, u) = (probability * share, rescaled);
                    node.next[lane]
                }
                NextStep::Halves(halves) => {
                    let weights = halves.map(|half| bounds[half as usize].weight(receiver, 0.0));
                    let (half, share, rescaled) = pick(&weights, u);
                    (probability, u) = (probability * share, rescaled);
                    self.next[halves[half] as usize]
                }
            };
        }
    }
}
