//! Which sources have samples of their own at a piece of surface, and the parts of the trees that the others are drawn from: a cut through the
//! trees of emitters and lights, the brightest parts opened first (adaptive splitting: Conty Estevez and Kulla, "Importance Sampling of
//! Many Lights with Adaptive Tree Splitting", 2018; Walter et al., "Lightcuts", 2005). What a receiver spends so follows from what matters
//! there, and not from how many sources there are. Not their light: that is `direct` and `punctual`.

use std::collections::BinaryHeap;

use super::emitter_bounds::BoundsLanes;
use crate::scene::Receiver;
use crate::sources::light_sources::Sources;

/// How the sources are divided at a piece of surface: what is in none of the lists brings nothing there.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct LightCut {
    /// Parts of the emissive surfaces that have samples of their own: lamps.
    pub lamps: Vec<u32>,
    /// Whether those are all lamps that there are.
    pub all_apart: bool,
    /// Lights that have, by number, ascending.
    pub lights: Vec<u32>,
    /// The others.
    pub shared: SharedSources,
}

/// Sources that share samples.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct SharedSources {
    /// Parts of the trees, each with the running sum of their probabilities: the last is 1.
    branches: Vec<(Branch, f32)>,
    /// Whether some are so near that each receiver has probabilities of its own.
    near: bool,
    /// Of those that are near, the first branches: the parts of the emissive surfaces.
    bounds: BoundsLanes,
}

/// A part of one of the trees.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Branch {
    Emitters(u32),
    Lights(u32),
}

impl SharedSources {
    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.branches.is_empty()
    }
}

impl Sources<'_> {
    /// Of sources that share samples, the part at `u` in [0, 1), the place within its interval stretched to [0, 1), and its probability.
    pub(crate) fn pick_branch(
        &self,
        shared: &SharedSources,
        receiver: &Receiver,
        u: f32,
    ) -> Option<(Branch, f32, f32)> {
        let last = shared.branches.len().checked_sub(1)?;
        if shared.near {
            let mut weights = [0.0f32; MAX_NEAR_BRANCHES];
            shared.bounds.weights(receiver, &mut weights);
            for (weight, (branch, _)) in weights.iter_mut().zip(&shared.branches).skip(shared.bounds.len()) {
                *weight = self.weight(*branch, receiver, 0.0);
            }
            let sum = weights[..shared.branches.len()].iter().sum::<f32>();
            let wanted = u * sum;
            let mut running = 0.0;
            for (weight, (branch, _)) in weights.iter().zip(&shared.branches) {
                if wanted < running + weight {
                    let u = ((wanted - running) / weight).clamp(0.0, 1.0 - f32::EPSILON);
                    return Some((*branch, u, weight / sum));
                }
                running += weight;
            }
            // Rounding at the very end, or no weight at all.
            let (branch, weight) = (shared.branches[last].0, weights[last.min(MAX_NEAR_BRANCHES - 1)]);
            return (weight > 0.0).then(|| (branch, 1.0 - f32::EPSILON, weight / sum));
        }
        let at = shared.branches.partition_point(|(_, end)| *end <= u).min(last);
        let start = if at == 0 { 0.0 } else { shared.branches[at - 1].1 };
        let (branch, end) = shared.branches[at];
        let probability = (end - start).max(f32::MIN_POSITIVE);
        Some((branch, ((u - start) / probability).clamp(0.0, 1.0 - f32::EPSILON), probability))
    }
}

impl LightCut {
    /// One number for the sources that have samples of their own: where it differs, so does what the others bring.
    pub fn key(&self) -> u64 {
        let mut hasher = blake3::Hasher::new();
        for number in self.lamps.iter().chain(&[u32::MAX]).chain(&self.lights) {
            hasher.update(&number.to_le_bytes());
        }
        let [a, b, c, d, e, f, g, h, ..] = *hasher.finalize().as_bytes();
        u64::from_le_bytes([a, b, c, d, e, f, g, h])
    }
}

/// Up to so many lamps, of so many emitters together, all have samples of their own: what is exact for them, or the
/// exact sum over them times the share that is seen, is less noisy than samples.
const FEW_LAMPS: u32 = 8;
const MAX_EMITTERS: u32 = 20_000;
/// Most emitters of one of many lamps that has samples of its own.
pub(crate) const FEW_EMITTERS: u32 = 24;
/// Where more than this share of what a receiver sees shines, all lamps have samples of their own, too, in so many groups: the sum over them is
/// exact, and little of it is hidden, while samples of what is near and large are noisy.
const ENCLOSED: f32 = 0.5;
const MAX_GROUPS: usize = 16;
/// Of all that may arrive, what a source must bring to have samples of its own, and the most that have where sources are many.
const OWN_SHARE: f32 = 0.12;
const MAX_OWN: usize = 3;
/// Parts are opened while they bring more than this share of all, up to so many.
const OPENED: f32 = 0.02;
const MAX_BRANCHES: usize = 32;
/// Parts whose ball appears under a larger sine than this are near: opened while they bring more than this share, as which of their sources
/// matters differs from receiver to receiver.
const NEAR: f32 = 0.5;
const OPENED_NEAR: f32 = 0.005;
const MAX_NEAR_BRANCHES: usize = 48;

/// A part with about what it brings.
#[derive(Clone, Copy, PartialEq)]
struct Weighted {
    weight: f32,
    branch: Branch,
}

impl Eq for Weighted {}

impl Ord for Weighted {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        // The same everywhere, whatever the order in which they came.
        self.weight.total_cmp(&other.weight).then(other.branch.cmp(&self.branch))
    }
}

impl PartialOrd for Weighted {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl Sources<'_> {
    /// The cut at receivers within `reach` of one, canonical units. The lamps named in `shared` share samples, however bright they are.
    pub fn cut(&self, receiver: &Receiver, reach: f32, shared: &[u32]) -> LightCut {
        let mut cut = LightCut { lights: self.individually_sampled_lights.clone(), ..LightCut::default() };
        let mut roots = Vec::new();
        match self.few_lamps(receiver) {
            Some(lamps) => (cut.lamps, cut.all_apart) = (lamps, true),
            None => roots.extend(self.emitter_tree.root().map(Branch::Emitters)),
        }
        roots.extend(self.light_tree.root().map(Branch::Lights));
        let weighted = |branch: Branch| Weighted { weight: self.weight(branch, receiver, reach), branch };
        let mut open: BinaryHeap<Weighted> = roots.into_iter().map(weighted).collect();
        let mut total: f32 = open.iter().map(|node| node.weight).sum();
        let mut closed: Vec<Weighted> = Vec::new();
        while let Some(node) = open.pop() {
            let near = self.sine(node.branch, receiver, reach) > NEAR;
            let (least, most) = if near { (OPENED_NEAR, MAX_NEAR_BRANCHES) } else { (OPENED, MAX_BRANCHES) };
            let worth_it = node.weight > least * total && open.len() + closed.len() + 2 <= most;
            match self.halves(node.branch).filter(|_| worth_it) {
                Some(halves) => {
                    let halves = halves.map(weighted);
                    total += halves.iter().map(|half| half.weight).sum::<f32>() - node.weight;
                    open.extend(halves);
                }
                None => closed.push(node),
            }
        }
        // What does not arrive at all is left out.
        closed.retain(|node| node.weight > 0.0);
        closed.sort_unstable_by(|a, b| b.cmp(a));
        let mut own = 0;
        closed.retain(|node| {
            let is_own = own < MAX_OWN
                && node.weight >= OWN_SHARE * total
                && self.is_single(node.branch)
                && !matches!(node.branch, Branch::Emitters(lamp) if shared.contains(&lamp));
            if is_own {
                own += 1;
                match node.branch {
                    Branch::Emitters(lamp) => cut.lamps.push(lamp),
                    Branch::Lights(node) => cut.lights.extend(self.light_tree.children(node).err()),
                }
            }
            !is_own
        });
        cut.lamps.sort_unstable();
        cut.lights.sort_unstable();
        // In the order of the tree, so that neighbours in the list are neighbours in space.
        closed.sort_unstable_by_key(|node| node.branch);
        let sum: f64 = closed.iter().map(|node| f64::from(node.weight)).sum();
        cut.shared.near = closed.iter().any(|node| self.sine(node.branch, receiver, reach) > NEAR);
        let (mut running, last) = (0.0, closed.len().saturating_sub(1));
        for (place, node) in closed.iter().enumerate() {
            running += f64::from(node.weight);
            let end = if place == last { 1.0 } else { (running / sum) as f32 };
            cut.shared.branches.push((node.branch, end));
        }
        if cut.shared.near {
            let bounds = |node: &Weighted| match node.branch {
                Branch::Emitters(node) => Some(self.emitter_tree.bounds(node)),
                Branch::Lights(_) => None,
            };
            cut.shared.bounds = BoundsLanes::new(&closed.iter().map_while(bounds).collect::<Vec<_>>());
        }
        cut
    }

    /// All lamps, where they are few, or most of what a receiver sees.
    fn few_lamps(&self, receiver: &Receiver) -> Option<Vec<u32>> {
        let tree = &self.emitter_tree;
        let Some(root) = tree.root() else { return Some(Vec::new()) };
        let few = tree.lamps(root) <= FEW_LAMPS || tree.form_factor(receiver) > ENCLOSED;
        if !few || tree.emitters(root) > MAX_EMITTERS {
            return None;
        }
        let mut found = tree.groups(receiver, MAX_GROUPS);
        found.sort_unstable();
        Some(found)
    }

    /// Whether a part can have samples of its own.
    fn is_single(&self, branch: Branch) -> bool {
        match branch {
            Branch::Emitters(node) => {
                self.emitter_tree.lamps(node) == 1 && self.emitter_tree.emitters(node) <= FEW_EMITTERS
            }
            Branch::Lights(node) => self.light_tree.children(node).is_err(),
        }
    }

    /// The halves of a part that is opened: lamps that can have samples of their own stay whole.
    fn halves(&self, branch: Branch) -> Option<[Branch; 2]> {
        match branch {
            Branch::Emitters(_) if self.is_single(branch) => None,
            Branch::Emitters(node) => Some(self.emitter_tree.children(node)?.map(Branch::Emitters)),
            Branch::Lights(node) => Some(self.light_tree.children(node).ok()?.map(Branch::Lights)),
        }
    }

    fn weight(&self, branch: Branch, receiver: &Receiver, reach: f32) -> f32 {
        match branch {
            Branch::Emitters(node) => self.emitter_tree.weight(node, receiver, reach),
            Branch::Lights(node) => self.light_tree.weight(node, receiver, reach),
        }
    }

    /// The sine under which a part's ball appears from receivers within `reach` of one, at most 1.
    fn sine(&self, branch: Branch, receiver: &Receiver, reach: f32) -> f32 {
        match branch {
            Branch::Emitters(node) => self.emitter_tree.sine(node, receiver, reach),
            Branch::Lights(node) => self.light_tree.sine(node, receiver, reach),
        }
    }
}
