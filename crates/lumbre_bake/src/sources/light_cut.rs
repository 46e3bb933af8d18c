//! Chooses which sources are sampled individually at a piece of surface, and the nodes from which the others are
//! sampled: a cut through the trees of emitters and lights that opens the brightest nodes first (adaptive splitting:
//! Conty Estevez and Kulla, "Importance Sampling of Many Lights with Adaptive Tree Splitting", 2018; Walter et al.,
//! "Lightcuts", 2005). The cost of a receiver thus depends on which sources matter there and not on how many there are.
//! The light itself is computed in `area_light`, `punctual` and `shared_samples`.

use std::collections::BinaryHeap;

use lumbre_optics::BakeMode;

use super::emitter_bounds::BoundsLanes;
use super::emitter_tree::EXACT_EMITTERS;
use super::light_sources::Sources;
use super::source_tree::{clamp_below_one, pick};
use crate::sampling::interval_at;
use crate::scene::{PlacedLight, Receiver};

/// How the sources are sampled at a piece of surface. Sources in none of the lists bring no light there.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct LightCut {
    /// Nodes of the emitter tree that are sampled individually: lamps, or groups of them.
    pub lamps: Vec<u32>,
    /// Whether `lamps` covers all lamps of the scene, so that none shares samples.
    pub has_all_lamps: bool,
    /// Indices of the punctual lights that are sampled individually, ascending.
    pub lights: Vec<u32>,
    /// The other sources.
    pub shared: SharedSources,
}

/// The sources that share samples.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct SharedSources {
    /// In the order of the trees.
    branches: Vec<SharedBranch>,
    /// Number of sources of the controlled branches.
    controlled: u32,
    /// Whether some node is so near that the probabilities must be computed for each receiver.
    near: bool,
    /// If `near`, the bounds of the first branches: the nodes of the emitter tree.
    bounds: BoundsLanes,
}

/// A node of sources that share samples.
#[derive(Clone, Copy, Debug, PartialEq)]
struct SharedBranch {
    branch: Branch,
    /// The cumulative sum of the probabilities up to this node; the last one is 1.
    end: f32,
    is_controlled: bool,
}

/// A sampled branch.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BranchChoice {
    pub branch: Branch,
    /// The random number, rescaled from the branch's interval to [0, 1) for reuse.
    pub u: f32,
    pub probability: f32,
    /// Whether the branch is one of [`SharedSources::controlled`].
    pub is_controlled: bool,
}

/// A node of one of the two trees.
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

    /// The branches whose unoccluded light is cheap to compute exactly at a point, so that it can serve as a control variate
    /// of the samples: the brightest ones of few emitters, and lights without a size or a cone.
    pub fn controlled(&self) -> impl Iterator<Item = Branch> {
        self.branches.iter().filter(|shared| shared.is_controlled).map(|shared| shared.branch)
    }

    /// Whether receivers estimate the light of the branches anew.
    #[cfg(test)]
    pub fn is_near(&self) -> bool {
        self.near
    }

    /// The number of samples that take about as long as the unoccluded light of the controlled branches at a point.
    pub fn control_cost(&self) -> u32 {
        self.controlled.div_ceil(CONTROLLED_PER_SAMPLE)
    }
}

impl Sources<'_> {
    /// Samples a branch of the shared sources by `u` in [0, 1).
    pub(crate) fn pick_branch(
        &self,
        shared: &SharedSources,
        receiver: &Receiver,
        u: f32,
    ) -> Option<BranchChoice> {
        let choice = |place: usize, u: f32, probability: f32| {
            let SharedBranch { branch, is_controlled, .. } = shared.branches[place];
            BranchChoice { branch, u, probability, is_controlled }
        };
        if shared.near {
            let mut weights = [0.0f32; MAX_NEAR_BRANCHES];
            shared.bounds.weights(receiver, &mut weights);
            let unbounded = weights.iter_mut().zip(&shared.branches).skip(shared.bounds.len());
            for (weight, SharedBranch { branch, .. }) in unbounded {
                *weight = self.weight(*branch, receiver, 0.0);
            }
            let weights = &weights[..shared.branches.len()];
            if weights.iter().all(|weight| *weight == 0.0) {
                return None;
            }
            let (place, probability, u) = pick(weights, u);
            return Some(choice(place, u, probability));
        }
        let (place, start, end) = interval_at(&shared.branches, |shared| shared.end, u)?;
        let probability = (end - start).max(f32::MIN_POSITIVE);
        Some(choice(place, clamp_below_one((u - start) / probability), probability))
    }
}

impl LightCut {
    /// A hash of the individually sampled sources. Where it differs between receivers, so does the light of the shared
    /// sources.
    pub fn key(&self) -> u64 {
        let mut hasher = blake3::Hasher::new();
        for number in self.lamps.iter().chain(&[u32::MAX]).chain(&self.lights) {
            hasher.update(&number.to_le_bytes());
        }
        let [a, b, c, d, e, f, g, h, ..] = *hasher.finalize().as_bytes();
        u64::from_le_bytes([a, b, c, d, e, f, g, h])
    }
}

/// Up to this many lamps, all are sampled individually, except in their penumbrae and beyond [`MAX_COST`]: their exact
/// light, or their exact unoccluded light times the visible fraction, is less noisy than shared samples.
const FEW_LAMPS: u32 = 8;
/// With more emitters than this in the scene, the lamps are never all sampled individually.
const MAX_EMITTERS: u32 = 20_000;
/// Where lamps are many, most emitters of a lamp that is sampled individually.
pub(crate) const FEW_EMITTERS: u32 = 24;
/// If the lamps' form factor from a receiver exceeds this, all lamps are sampled individually too, in groups (up to
/// [`MAX_COST_ENCLOSED`]): the sum over them is exact and little of it is hidden, while shared samples of near and large
/// sources are noisy.
const ENCLOSED: f32 = 0.5;
/// Most that the unoccluded light of lamps of many emitters may cost at a point of a texel, as a number of nodes of the
/// emitter tree. Beyond it, shared samples reach the same error sooner, however few the lamps are.
const MAX_COST: u32 = 512;
/// The same where lamps fill most of what the receiver sees: there, shared samples are noisier.
const MAX_COST_ENCLOSED: u32 = 2048;
/// Most nodes into which all lamps are grouped when they are all sampled individually.
const MAX_GROUPS: usize = 16;
/// Where sources are many, the fraction of all estimated light that a source must bring to be sampled individually.
const INDIVIDUAL_SHARE: f32 = 0.12;
/// Where sources are many, most sources that are sampled individually.
const MAX_INDIVIDUAL: usize = 3;
/// Nodes are opened while they bring more than this fraction of all estimated light.
const OPENED: f32 = 0.02;
/// Most nodes in a cut.
const MAX_BRANCHES: usize = 32;
/// Nodes whose bounding sphere appears under a larger sine than this are near. They have lower limits for opening,
/// since it differs from receiver to receiver which of their sources matter.
const NEAR: f32 = 0.5;
/// [`OPENED`] for near nodes.
const OPENED_NEAR: f32 = 0.005;
/// [`MAX_BRANCHES`] for near nodes.
const MAX_NEAR_BRANCHES: usize = 48;

/// Most sources whose unoccluded light serves as a control variate.
const MAX_CONTROLLED: u32 = 96;
/// The number of sources whose unoccluded light takes as long as one sample.
const CONTROLLED_PER_SAMPLE: u32 = 8;

/// A node with its estimated light.
#[derive(Clone, Copy, PartialEq)]
struct Weighted {
    weight: f32,
    branch: Branch,
}

impl Eq for Weighted {}

impl Ord for Weighted {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        // A total order, so that the cut does not depend on the order of insertion.
        self.weight.total_cmp(&other.weight).then(other.branch.cmp(&self.branch))
    }
}

impl PartialOrd for Weighted {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl Sources<'_> {
    /// The cut for all receivers within `reach` (canonical units) of the given one. The lamps in `shared` share
    /// samples, however bright they are.
    pub fn cut(&self, receiver: &Receiver, reach: f32, shared: &[u32]) -> LightCut {
        let mut cut = LightCut { lights: self.individually_sampled_lights.clone(), ..LightCut::default() };
        let mut roots = Vec::new();
        let few_lamps = self.few_lamps(receiver);
        let has_few_lamps = few_lamps.is_some();
        match few_lamps {
            Some(lamps) => {
                let costly = if reach > 0.0 { self.costly_lamps(&lamps, receiver) } else { Vec::new() };
                let (sharing, individual): (Vec<u32>, _) =
                    lamps.into_iter().partition(|lamp| shared.contains(lamp) || costly.contains(lamp));
                (cut.lamps, cut.has_all_lamps) = (individual, sharing.is_empty());
                roots.extend(sharing.into_iter().map(Branch::Emitters));
            }
            None => roots.extend(self.emitter_tree.root().map(Branch::Emitters)),
        }
        roots.extend(self.light_tree.root().map(Branch::Lights));
        let (mut nodes, total) = self.opened(roots, receiver, reach);
        // Nodes whose light does not arrive at all are left out.
        nodes.retain(|node| node.weight > 0.0);
        nodes.sort_unstable_by(|a, b| b.cmp(a));
        let mut individual = 0;
        nodes.retain(|node| {
            let may_be_individual = match node.branch {
                Branch::Emitters(lamp) => !has_few_lamps && !shared.contains(&lamp),
                Branch::Lights(_) => true,
            };
            let is_individual = may_be_individual
                && individual < MAX_INDIVIDUAL
                && node.weight >= INDIVIDUAL_SHARE * total
                && self.is_single(node.branch);
            if is_individual {
                individual += 1;
                match node.branch {
                    Branch::Emitters(lamp) => cut.lamps.push(lamp),
                    Branch::Lights(node) => cut.lights.extend(self.light_tree.children(node).err()),
                }
            }
            !is_individual
        });
        cut.lamps.sort_unstable();
        cut.lights.sort_unstable();
        let near = nodes.iter().any(|node| self.sine(node.branch, receiver, reach) > NEAR);
        cut.shared = self.shared_sources(nodes, near);
        cut
    }

    /// Opens the nodes of most estimated light below the roots while that is worth it. Returns what is left closed, in
    /// no order, and the estimated light of all of them.
    fn opened(&self, roots: Vec<Branch>, receiver: &Receiver, reach: f32) -> (Vec<Weighted>, f32) {
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
        (closed, total)
    }

    /// Nodes that share samples, from the brightest to the dimmest, each with a probability in proportion to its estimated
    /// light. Where some are `near`, receivers estimate that anew.
    fn shared_sources(&self, nodes: Vec<Weighted>, near: bool) -> SharedSources {
        let sum: f64 = nodes.iter().map(|node| f64::from(node.weight)).sum();
        let mut left = MAX_CONTROLLED;
        let with_control = |node: Weighted| {
            let sources = self.controllable_sources(node.branch).filter(|sources| *sources <= left);
            left -= sources.unwrap_or(0);
            (node, sources.is_some())
        };
        let mut nodes: Vec<(Weighted, bool)> = nodes.into_iter().map(with_control).collect();
        // Tree order, so that neighbours in the list are neighbours in space.
        nodes.sort_unstable_by_key(|(node, _)| node.branch);
        let controlled = MAX_CONTROLLED - left;
        let mut shared = SharedSources { near, controlled, ..SharedSources::default() };
        let (mut running, last) = (0.0, nodes.len().saturating_sub(1));
        for (place, &(Weighted { weight, branch }, is_controlled)) in nodes.iter().enumerate() {
            running += f64::from(weight);
            let end = if place == last { 1.0 } else { (running / sum) as f32 };
            shared.branches.push(SharedBranch { branch, end, is_controlled });
        }
        if near {
            let bounds = |shared: &SharedBranch| match shared.branch {
                Branch::Emitters(node) => Some(self.emitter_tree.bounds(node)),
                Branch::Lights(_) => None,
            };
            shared.bounds = BoundsLanes::new(&shared.branches.iter().map_while(bounds).collect::<Vec<_>>());
        }
        shared
    }

    /// The number of a branch's sources, if their unoccluded light is cheap to compute exactly at a point.
    fn controllable_sources(&self, branch: Branch) -> Option<u32> {
        match branch {
            Branch::Emitters(node) => {
                Some(self.emitter_tree.emitters(node)).filter(|emitters| *emitters <= EXACT_EMITTERS)
            }
            Branch::Lights(node) => {
                let light = self.light_tree.children(node).err()?;
                has_simple_light(&self.lights[light as usize]).then_some(1)
            }
        }
    }

    /// The nodes of all lamps, if those are to be sampled individually: if they are few, or fill most of what the
    /// receiver sees.
    fn few_lamps(&self, receiver: &Receiver) -> Option<Vec<u32>> {
        let tree = &self.emitter_tree;
        let Some(root) = tree.root() else { return Some(Vec::new()) };
        let few = tree.lamps(root) <= FEW_LAMPS || tree.form_factor(receiver) > ENCLOSED;
        if !few || tree.emitters(root) > MAX_EMITTERS {
            return None;
        }
        let mut groups = tree.groups(receiver, MAX_GROUPS);
        groups.sort_unstable();
        Some(groups)
    }

    /// Those of a few lamps that share samples all the same, because their unoccluded light takes too long where the
    /// points of a texel are many: the costliest of them, until the others cost no more than [`MAX_COST`] together, or
    /// [`MAX_COST_ENCLOSED`] where lamps enclose the receiver.
    fn costly_lamps(&self, lamps: &[u32], receiver: &Receiver) -> Vec<u32> {
        let tree = &self.emitter_tree;
        let mut costs: Vec<(u32, u32)> = lamps
            .iter()
            .filter(|&&lamp| tree.emitters(lamp) > EXACT_EMITTERS)
            .map(|&lamp| (tree.unoccluded_and_cost(&self.emitters, lamp, receiver).1, lamp))
            .collect();
        let mut left: u32 = costs.iter().map(|(cost, _)| cost).sum();
        let is_enclosed = tree.form_factor(receiver) > ENCLOSED;
        let most = if is_enclosed { MAX_COST_ENCLOSED } else { MAX_COST };
        costs.sort_unstable_by(|a, b| b.cmp(a));
        let is_costly = |(cost, lamp): (u32, u32)| {
            let is_costly = left > most;
            left -= cost;
            is_costly.then_some(lamp)
        };
        costs.into_iter().map_while(is_costly).collect()
    }

    /// Whether a node is one source that can be sampled individually.
    fn is_single(&self, branch: Branch) -> bool {
        match branch {
            Branch::Emitters(node) => {
                self.emitter_tree.lamps(node) == 1 && self.emitter_tree.emitters(node) <= FEW_EMITTERS
            }
            Branch::Lights(node) => self.light_tree.children(node).is_err(),
        }
    }

    /// The two children of a node, if it may be opened: lamps that can be sampled individually stay whole.
    fn halves(&self, branch: Branch) -> Option<[Branch; 2]> {
        match branch {
            Branch::Emitters(_) if self.is_single(branch) => None,
            Branch::Emitters(node) => Some(self.emitter_tree.children(node)?.map(Branch::Emitters)),
            Branch::Lights(node) => Some(self.light_tree.children(node).ok()?.map(Branch::Lights)),
        }
    }

    /// The estimated light of a node; see [`EmitterTree::weight`] and [`LightTree::weight`].
    ///
    /// [`EmitterTree::weight`]: super::emitter_tree::EmitterTree::weight
    /// [`LightTree::weight`]: super::light_tree::LightTree::weight
    fn weight(&self, branch: Branch, receiver: &Receiver, reach: f32) -> f32 {
        match branch {
            Branch::Emitters(node) => self.emitter_tree.weight(node, receiver, reach),
            Branch::Lights(node) => self.light_tree.weight(node, receiver, reach),
        }
    }

    /// The largest sine under which a node's bounding sphere appears from receivers within `reach` of the given one.
    fn sine(&self, branch: Branch, receiver: &Receiver, reach: f32) -> f32 {
        match branch {
            Branch::Emitters(node) => self.emitter_tree.sine(node, receiver, reach),
            Branch::Lights(node) => self.light_tree.sine(node, receiver, reach),
        }
    }
}

/// Whether a light's baked light is known exactly at a point, and changes little over a texel: not where it has a size, or
/// the narrow edge of a cone.
fn has_simple_light(placed: &PlacedLight) -> bool {
    let has_cone = placed.light.spot.is_some_and(|cone| !cone.is_everywhere());
    placed.light.bake == BakeMode::Static && !placed.is_sized() && !has_cone
}

#[cfg(test)]
mod tests {
    use glam::Vec3;
    use lumbre_mesh::shapes;

    use super::*;
    use crate::scene::Side;
    use crate::scene::laid_out::mesh_laid_out;
    use crate::sources::Emitter;
    use crate::{BakeOptions, Density};

    /// A lamp of columns x rows squares that faces down at a height of 1, two metres wide.
    fn screen(columns: u16, rows: u16) -> Vec<Emitter> {
        let side = 2.0 / f32::from(columns);
        let square = |i: u16| {
            let corner =
                Vec3::new(f32::from(i % columns) * side - 1.0, 1.0, f32::from(i / columns) * side - 0.5);
            let [a, b, c, d] =
                [Vec3::ZERO, Vec3::X, Vec3::new(1.0, 0.0, 1.0), Vec3::Z].map(|p| corner + p * side);
            [[a, b, c], [a, c, d]]
        };
        let emitter = |corners: [Vec3; 3]| Emitter {
            corners,
            corners_f64: corners.map(|corner| corner.as_dvec3()),
            normal: Vec3::NEG_Y,
            area: 0.5 * side * side,
            radiance: Vec3::ONE,
            triangle: 0,
            side: Side::Front,
        };
        (0..columns * rows).flat_map(square).map(emitter).collect()
    }

    #[test]
    fn a_lamp_of_many_emitters_shares_samples_near_it_and_not_from_afar() {
        let options = BakeOptions { density: Density::MapSize(16), ..BakeOptions::default() };
        let (_, scene) = mesh_laid_out(shapes::plane(2.0, 2.0, 1, 1), &options);
        let has_all_lamps = |emitters: Vec<Emitter>, [x, height]: [f32; 2], reach: f32| {
            let sources = Sources::new(&scene, emitters, Vec::new(), Vec3::ZERO);
            let position = Vec3::new(x, height, 0.1);
            let receiver =
                Receiver { position, origin: position, geometric_normal: Vec3::Y, normal: Vec3::Y };
            let cut = sources.cut(&receiver, reach, &[]);
            assert_eq!(cut.has_all_lamps, cut.shared.is_empty());
            cut.has_all_lamps
        };
        // Beyond the edge of the lamp, where it does not enclose a receiver.
        let (many, few, near) = (|| screen(136, 68), || screen(6, 4), [1.06, 0.95]);
        assert!(!has_all_lamps(many(), near, 0.01), "near");
        assert!(has_all_lamps(many(), [0.1, -30.0], 0.01), "from afar");
        assert!(has_all_lamps(many(), near, 0.0), "at a single point");
        assert!(has_all_lamps(few(), near, 0.01), "a lamp of few emitters");
        // Right below it the limit is higher.
        assert!(has_all_lamps(many(), [0.1, 0.85], 0.01) && !has_all_lamps(many(), [0.1, 0.95], 0.01));
    }
}
