//! The nodes of a ray tree, one for each ray that was traced, and the sum of their light from the leaves to the
//! root. Which rays are traced is decided in `ray_tree`.

use std::ops::Range;

use glam::DVec3;
use lumbre_optics::apply_fog;

use crate::branch::{Branch, Kind};

/// A traced ray: the light of the point where it ends, and how the branches that start there add to it.
#[derive(Debug)]
pub(crate) struct Node {
    /// Radiance of the point itself, without its branches.
    pub local: DVec3,
    /// The weight of the point's light in the fog before it, and the fog's colour.
    pub fog: Option<(f64, DVec3)>,
    /// Opacity of the point, 0 to 1.
    pub coverage: f64,
    /// Transmittance of the medium between the ray's start and the point.
    pub clear: DVec3,
    /// The branches that were traced, by their place in [`PLACES`].
    pub branches: [Option<Grown>; 3],
    /// The terms of `local` and of the fog, by their indices in the tree's list.
    pub terms: Range<usize>,
    /// The ray with what it hit, if the tree is recorded.
    pub record: Option<Box<Branch>>,
}

/// A branch that starts at a node.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Grown {
    /// Factor on its radiance.
    factor: DVec3,
    /// Its node's index.
    node: usize,
}

/// The kinds of branches of a node.
const PLACES: [Kind; 3] = [Kind::Mirrored, Kind::Transmitted, Kind::Behind];

impl Node {
    /// Creates a node without branches that has only radiance.
    pub fn of_radiance(local: DVec3, terms: Range<usize>) -> Self {
        Self { local, fog: None, coverage: 1.0, clear: DVec3::ONE, branches: [None; 3], terms, record: None }
    }

    /// Adds a branch that has a node of its own.
    pub fn add(&mut self, kind: Kind, factor: DVec3, node: usize) {
        if let Some(place) = PLACES.iter().position(|place| *place == kind) {
            self.branches[place] = Some(Grown { factor, node });
        }
    }

    /// Returns the factor with which the radiance of a kind of branch counts in that of this node.
    fn share(&self, kind: Kind) -> DVec3 {
        let fog = self.fog.map_or(1.0, |(weight, _)| weight);
        self.clear * if kind == Kind::Behind { 1.0 } else { fog * self.coverage }
    }
}

/// Returns the radiance of every node, where every branch's node comes after the one that it starts at.
pub(crate) fn radiances(nodes: &[Node]) -> Vec<DVec3> {
    let mut radiances = vec![DVec3::ZERO; nodes.len()];
    for (index, node) in nodes.iter().enumerate().rev() {
        let [mirrored, transmitted, behind] = node
            .branches
            .map(|branch| branch.map_or(DVec3::ZERO, |Grown { factor, node }| factor * radiances[node]));
        let mut radiance = node.local + mirrored + transmitted;
        if let Some((weight, color)) = node.fog {
            radiance = apply_fog(weight, radiance, color);
        }
        if node.coverage < 1.0 {
            radiance = radiance * node.coverage + behind;
        }
        radiances[index] = radiance * node.clear;
    }
    radiances
}

/// Returns the weight of every node's own terms in the radiance of the root, as [`radiances`] adds them up.
pub(crate) fn weights(nodes: &[Node]) -> Vec<DVec3> {
    let mut weights = vec![DVec3::ONE; nodes.len()];
    for (index, node) in nodes.iter().enumerate() {
        for (kind, branch) in PLACES.into_iter().zip(node.branches) {
            if let Some(Grown { factor, node: next }) = branch {
                weights[next] = weights[index] * node.share(kind) * factor;
            }
        }
    }
    weights
}

/// Returns the recorded tree, with the radiance of every branch; `None` if it was not recorded.
pub(crate) fn recorded(mut nodes: Vec<Node>, radiances: &[DVec3]) -> Option<Branch> {
    for index in (0..nodes.len()).rev() {
        let mut own = nodes[index].record.take()?;
        own.radiance = radiances[index];
        for branch in nodes[index].branches.into_iter().flatten() {
            own.branches.extend(nodes[branch.node].record.take().map(|branch| *branch));
        }
        // The branches that were cut off are there already.
        own.branches.sort_by_key(|branch| PLACES.iter().position(|place| *place == branch.kind));
        nodes[index].record = Some(own);
    }
    nodes.into_iter().next()?.record.map(|root| *root)
}
