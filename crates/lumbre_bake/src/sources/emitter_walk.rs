//! The walk of a sample down the hierarchy of emitters: at each step it chooses among eight parts by about what each brings, so that ten thousand
//! emitters are five steps away. Not the hierarchy: that is `emitter_tree`; not what an emitter then brings: that is `shared_samples`.

use fearless_simd::{Simd, dispatch};

use super::emitter_bounds::{BoundsEight, EmitterBounds, LANES, LEVEL, ReceiverLanes};
use crate::scene::Receiver;

/// What a part of the hierarchy is.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Kind {
    /// One emitter, by number.
    Leaf(u32),
    Inner([u32; 2]),
}

/// Where a sample may go from a part.
#[derive(Clone, Copy, Debug)]
enum WalkStep {
    Emitter(u32),
    /// To one of the parts of a step, by its number.
    Step(u32),
    /// To one of two parts: such lie within a step, and only a walk that begins there meets them.
    Halves([u32; 2]),
}

/// Up to eight parts that together are one, in the order of the tree.
#[derive(Clone, Debug)]
struct Step {
    bounds: BoundsEight,
    next: [WalkStep; LANES],
    count: usize,
}

/// All steps down.
#[derive(Clone, Debug, Default)]
pub(crate) struct EmitterWalk {
    steps: Vec<Step>,
    /// Of each part of the tree.
    next: Vec<WalkStep>,
}

/// An emitter that was chosen.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EmitterChoice {
    pub emitter: u32,
    /// The place within its interval of [0, 1), stretched to [0, 1).
    pub u: f32,
    pub probability: f32,
}

impl EmitterWalk {
    /// Down a tree whose children come after their parents; the first part is the root.
    pub fn new(kinds: &[Kind], bounds: &[EmitterBounds]) -> Self {
        let mut emitters = vec![1u32; kinds.len()];
        for (node, kind) in kinds.iter().enumerate().rev() {
            if let Kind::Inner([near, far]) = *kind {
                emitters[node] = emitters[near as usize] + emitters[far as usize];
            }
        }
        let next = |kind: &Kind| match *kind {
            Kind::Leaf(emitter) => WalkStep::Emitter(emitter),
            Kind::Inner(halves) => WalkStep::Halves(halves),
        };
        let mut walk = Self { steps: Vec::new(), next: kinds.iter().map(next).collect() };
        let mut pending = Vec::from_iter((!kinds.is_empty()).then_some(0u32));
        let mut parts_of_steps = Vec::new();
        while let Some(node) = pending.pop() {
            let Kind::Inner(halves) = kinds[node as usize] else { continue };
            // The largest is opened, until they are eight.
            let mut nodes = Vec::from(halves);
            while nodes.len() < LANES {
                let largest = (0..nodes.len()).max_by_key(|&place| emitters[nodes[place] as usize]);
                let Some((place, halves)) = largest.and_then(|place| match kinds[nodes[place] as usize] {
                    Kind::Leaf(_) => None,
                    Kind::Inner(halves) => Some((place, halves)),
                }) else {
                    break;
                };
                nodes.splice(place..=place, halves);
            }
            walk.next[node as usize] = WalkStep::Step(parts_of_steps.len() as u32);
            pending.extend(&nodes);
            parts_of_steps.push(nodes);
        }
        let step = |nodes: &Vec<u32>| {
            let mut next = [WalkStep::Emitter(0); LANES];
            next.iter_mut().zip(nodes).for_each(|(next, &node)| *next = walk.next[node as usize]);
            let bounds: Vec<EmitterBounds> = nodes.iter().map(|&node| bounds[node as usize]).collect();
            Step { bounds: BoundsEight::new(&bounds), next, count: nodes.len() }
        };
        walk.steps = parts_of_steps.iter().map(step).collect();
        walk
    }

    /// The emitter of a part at `u` in [0, 1): about in proportion to what it brings a receiver. `bounds` are those of the tree's parts.
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
                WalkStep::Emitter(emitter) => return EmitterChoice { emitter, u, probability },
                WalkStep::Step(step) => {
                    let step = &self.steps[step as usize];
                    let weights = step.bounds.weights(&lanes);
                    let (lane, share, within) = pick(&weights[..step.count], u);
                    (probability, u) = (probability * share, within);
                    step.next[lane]
                }
                WalkStep::Halves(halves) => {
                    let weights = halves.map(|half| bounds[half as usize].weight(receiver, 0.0));
                    let (half, share, within) = pick(&weights, u);
                    (probability, u) = (probability * share, within);
                    self.next[halves[half] as usize]
                }
            };
        }
    }
}

/// Of some weights the one at `u` in [0, 1), its share of all, and the place within its interval, stretched to [0, 1). Where they tell nothing all
/// are alike.
#[inline(always)]
fn pick(weights: &[f32], u: f32) -> (usize, f32, f32) {
    let sum: f32 = weights.iter().sum();
    if !(sum > 0.0 && sum.is_finite()) {
        let along = u * weights.len() as f32;
        let place = (along as usize).min(weights.len() - 1);
        return (place, 1.0 / weights.len() as f32, stretched(along - place as f32));
    }
    let wanted = u * sum;
    let (mut running, mut last) = (0.0, 0);
    for (place, &weight) in weights.iter().enumerate() {
        if wanted < running + weight {
            return (place, weight / sum, stretched((wanted - running) / weight));
        }
        if weight > 0.0 {
            last = place;
        }
        running += weight;
    }
    // Rounding at the very end.
    (last, weights[last] / sum, stretched(1.0))
}

fn stretched(u: f32) -> f32 {
    u.clamp(0.0, 1.0 - f32::EPSILON)
}
