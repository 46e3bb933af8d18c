//! A hierarchy of the emissive triangles (after Conty Estevez and Kulla, "Importance Sampling of Many Lights with
//! Adaptive Tree Splitting", 2018). The upper nodes group lamps (connected pieces), the lower nodes divide a lamp; each
//! node stores bounds of its position, emission directions and power. The tree estimates the light of a node, computes
//! its unoccluded light, and samples its emitters. Visibility is in `area_light`, and the choice of the nodes that are
//! sampled individually in `light_cut`.

use std::f32::consts::PI;

use glam::{DVec3, Mat3, Vec3};

use super::emitter_bounds::EmitterBounds;
use super::emitter_walk::{EmitterChoice, EmitterWalk};
use super::emitters::Emitter;
use super::source_tree::{NodeKind, apparent_sine, distance_to_sphere, split_at_median};
use crate::scene::Receiver;
use crate::visibility::polygon::point_to_triangle;

/// The hierarchy of the emissive triangles.
#[derive(Clone, Debug, Default)]
pub(crate) struct EmitterTree {
    /// Children follow their parents; the first node is the root.
    nodes: Vec<Node>,
    bounds: Vec<EmitterBounds>,
    walk: EmitterWalk,
    /// Emitter indices in tree order, so that those of each node are contiguous.
    order: Vec<u32>,
}

/// A node of the hierarchy: a group of emitters.
#[derive(Clone, Debug)]
struct Node {
    /// Σ radiance · area.
    light: Vec3,
    /// Σ area.
    area: f32,
    /// Σ radiance · area · normal: a column for each channel.
    moments: Mat3,
    /// Where all emitters face the same way, the moments of their position about its centre.
    flat: Option<FlatMoments>,
    /// Number of lamps that it contains, wholly or in part.
    lamps: u32,
    /// Index of its first emitter in [`EmitterTree::order`].
    first: u32,
    /// Number of its emitters.
    emitters: u32,
    kind: NodeKind,
}

/// The moments of the light of emitters that face the same way, about the centre of their power: weighted by radiance ·
/// area, so that each channel has its own.
#[derive(Clone, Copy, Debug)]
struct FlatMoments {
    /// How far their corners are in front of the plane through the centre, at least and at most; negative behind it.
    offsets: [f32; 2],
    /// Σ light · position: x, y and z.
    first: [Vec3; 3],
    /// Σ light · position · positionᵀ: xx, yy, zz, xy, xz and yz.
    second: [Vec3; 6],
}

/// How much of emitters that face the same way a receiver may see: it and they are above each other's horizons.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum FlatView {
    None,
    Part,
    Whole,
}

/// Nodes of up to this many emitters are summed exactly, emitter by emitter, at any distance.
pub(crate) const EXACT_EMITTERS: u32 = 48;
/// In larger nodes, descendants whose radius is less than this fraction of their distance are approximated by one term.
/// For a node of radius r at distance d, the relative error is about (r/d)², here a quarter of a per cent, plus (r/d)
/// times the difference of its normals.
const OPENING: f32 = 0.05;
/// The same for nodes whose emitters all face the same way: their light is expanded to the second order about their
/// centre, channel by channel, so that the relative error is of the order of (r/d)³; near the receiver's horizon, of
/// (r/d)² times radius over height.
const FLAT_OPENING: f32 = 0.15;
/// Emitters face the same way if their normals differ from the mean by no more than this.
const FLAT: f32 = 1e-4;
/// Emitters in one plane bring nothing to a receiver that faces the same way, to this difference from 1 of the cosine
/// between their normals. In one plane are those whose offsets from it are at most this share of their radius.
const PARALLEL: f32 = 1e-7;
const IN_A_PLANE: f32 = 1e-4;
/// A node that may partly face away is not opened further if it can bring no more than this fraction of the light
/// summed so far.
const NEGLIGIBLE: f32 = 0.003;
/// Relative RMS error of a lamp's light when its distant nodes are approximated by one term each, as a test measures
/// it.
pub(crate) const TERM_ERROR: f32 = 0.005;

/// The number of nodes that take as long to visit as an emitter's exact light.
const COST_OF_EMITTER: u32 = 8;

/// Lamps whose common bounding sphere appears under at most this sine are treated as casting one shadow.
const NARROW: f32 = 0.02;
/// Nodes whose radius is more than this share of their distance are divided to find that of their emitters.
const DIVIDED: f32 = 0.25;
/// Most nodes that [`EmitterTree::form_factor`] opens.
const MAX_OPENED: usize = 64;

impl EmitterTree {
    /// Bytes that it takes.
    pub fn bytes(&self) -> u64 {
        let nodes = size_of_val(self.nodes.as_slice()) + size_of_val(self.bounds.as_slice());
        (nodes + size_of_val(self.order.as_slice())) as u64 + self.walk.bytes()
    }

    /// Builds the hierarchy; `lamps[i]` is the number of the lamp that emitter i belongs to.
    pub fn new(emitters: &[Emitter], lamps: &[u32]) -> Self {
        let capacity = 2 * emitters.len();
        let (nodes, bounds) = (Vec::with_capacity(capacity), Vec::with_capacity(capacity));
        let mut tree = Self { nodes, bounds, order: Vec::new(), walk: EmitterWalk::default() };
        if emitters.is_empty() {
            return tree;
        }
        let count = lamps.iter().map(|&lamp| lamp as usize + 1).max().unwrap_or(0);
        let mut members: Vec<Vec<u32>> = vec![Vec::new(); count];
        for (emitter, &lamp) in lamps.iter().enumerate() {
            members[lamp as usize].push(emitter as u32);
        }
        members.retain(|members| !members.is_empty());
        let mut order: Vec<u32> = (0..members.len() as u32).collect();
        tree.add_lamps(emitters, &members, &mut order);
        let kinds: Vec<NodeKind> = tree.nodes.iter().map(|node| node.kind).collect();
        tree.walk = EmitterWalk::new(&kinds, &tree.bounds);
        tree
    }

    /// Adds the subtree over `lamps`, which index `members`, the emitters of each lamp.
    fn add_lamps(&mut self, emitters: &[Emitter], members: &[Vec<u32>], lamps: &mut [u32]) -> u32 {
        if let [lamp] = *lamps {
            return self.add(emitters, &mut members[lamp as usize].clone());
        }
        let mut all: Vec<u32> =
            lamps.iter().flat_map(|&lamp| members[lamp as usize].iter().copied()).collect();
        all.sort_unstable();
        let index = self.push(emitters, &all, lamps.len() as u32);
        let place = |lamp: &u32| middle(emitters, &members[*lamp as usize]);
        let half = split_at_median(lamps, place);
        let (near, far) = lamps.split_at_mut(half);
        let children = [self.add_lamps(emitters, members, near), self.add_lamps(emitters, members, far)];
        self.nodes[index as usize].kind = NodeKind::Inner(children);
        index
    }

    /// Adds the subtree over `members`, emitters of one lamp.
    fn add(&mut self, emitters: &[Emitter], members: &mut [u32]) -> u32 {
        let index = self.push(emitters, members, 1);
        if let [emitter] = *members {
            self.order.push(emitter);
        } else {
            let half = split_at_median(members, |emitter| middle(emitters, &[*emitter]));
            let (near, far) = members.split_at_mut(half);
            let children = [self.add(emitters, near), self.add(emitters, far)];
            self.nodes[index as usize].kind = NodeKind::Inner(children);
        }
        index
    }

    /// Appends a node over `members` without children.
    fn push(&mut self, emitters: &[Emitter], members: &[u32], lamps: u32) -> u32 {
        let index = self.nodes.len() as u32;
        let (node, bounds) = summarize(emitters, members, lamps, self.order.len() as u32);
        self.nodes.push(node);
        self.bounds.push(bounds);
        index
    }

    /// The bounds of a node's emitters.
    pub fn bounds(&self, index: u32) -> EmitterBounds {
        self.bounds[index as usize]
    }

    /// The node of all emitters; `None` if there are no emitters.
    pub fn root(&self) -> Option<u32> {
        (!self.nodes.is_empty()).then_some(0)
    }

    /// The two children of a node; `None` for a leaf.
    pub fn children(&self, index: u32) -> Option<[u32; 2]> {
        match self.nodes[index as usize].kind {
            NodeKind::Leaf(_) => None,
            NodeKind::Inner(children) => Some(children),
        }
    }

    /// Number of lamps that a node contains, wholly or in part.
    pub fn lamps(&self, index: u32) -> u32 {
        self.nodes[index as usize].lamps
    }

    /// Number of emitters of a node.
    pub fn emitters(&self, index: u32) -> u32 {
        self.nodes[index as usize].emitters
    }

    /// The [`apparent_sine`] of a node's bounding sphere.
    pub fn sine(&self, index: u32, receiver: &Receiver, reach: f32) -> f32 {
        let bounds = &self.bounds[index as usize];
        apparent_sine(bounds.center, bounds.radius, receiver, reach)
    }

    /// A lower bound of the distance from a receiver to a node's emitters: that to the nearest of the spheres around parts
    /// of the node which are small beside their distance.
    pub fn distance(&self, index: u32, receiver: &Receiver) -> f32 {
        let to_sphere = |index: u32| {
            let bounds = &self.bounds[index as usize];
            distance_to_sphere(bounds.center, bounds.radius, receiver)
        };
        let is_large = |distance: f32, index: u32| self.bounds[index as usize].radius > DIVIDED * distance;
        let distance = to_sphere(index);
        if !is_large(distance, index) {
            return distance;
        }
        let (mut nearest, mut open) = (f32::INFINITY, vec![(distance, index)]);
        while let Some((distance, index)) = open.pop() {
            if distance >= nearest {
                continue;
            }
            match self.children(index).filter(|_| is_large(distance, index)) {
                None => nearest = distance,
                Some(children) => {
                    let [near, far] = children.map(|child| (to_sphere(child), child));
                    let (near, far) = if near.0 <= far.0 { (near, far) } else { (far, near) };
                    open.extend([far, near]);
                }
            }
        }
        nearest
    }

    /// Estimates the unoccluded form factor from a receiver to all emitters together, from 0 to about 1. A distant node
    /// counts as one area at its centre; near nodes are opened, and none counts for more than its bounding sphere.
    pub fn form_factor(&self, receiver: &Receiver) -> f32 {
        let (mut sum, mut open, mut opened) = (0.0, Vec::new(), 0);
        open.extend(self.root());
        while let Some(index) = open.pop() {
            let sine = self.sine(index, receiver, 0.0);
            match self.children(index).filter(|_| sine > 0.5 && opened < MAX_OPENED) {
                Some(halves) => {
                    opened += 1;
                    open.extend(halves);
                }
                None => {
                    let bounds = &self.bounds[index as usize];
                    let direction = (bounds.center - receiver.position).normalize_or_zero();
                    let receives = (direction.dot(receiver.normal) + sine).clamp(0.0, 1.0);
                    let emits = (bounds.spread - direction.dot(bounds.axis)).clamp(0.0, 1.0);
                    let squared = (bounds.center - receiver.position).length_squared();
                    let of_area = self.nodes[index as usize].area / (PI * squared.max(f32::MIN_POSITIVE));
                    sum += receives * emits * of_area.min(sine * sine);
                }
            }
        }
        sum
    }

    /// The lamps or groups of lamps, at most `most`, whose shadows are computed separately at a receiver. The brightest
    /// group that is not [`NARROW`] is divided first.
    pub fn groups(&self, receiver: &Receiver, most: usize) -> Vec<u32> {
        let mut groups: Vec<u32> = self.root().into_iter().collect();
        while groups.len() < most {
            let weight = |&(_, group): &(usize, &u32)| self.weight(*group, receiver, 0.0);
            let divided = groups
                .iter()
                .enumerate()
                .filter(|(_, group)| self.lamps(**group) > 1 && self.sine(**group, receiver, 0.0) > NARROW)
                .max_by(|a, b| weight(a).total_cmp(&weight(b)).then(b.1.cmp(a.1)));
            let Some((place, &group)) = divided else { break };
            let Some([near, far]) = self.children(group) else { break };
            groups[place] = near;
            groups.push(far);
        }
        groups
    }

    /// The indices of a node's emitters.
    pub fn emitters_of(&self, index: u32) -> &[u32] {
        let node = &self.nodes[index as usize];
        &self.order[node.first as usize..(node.first + node.emitters) as usize]
    }

    /// Irradiance that a node brings to a receiver, ignoring occlusion.
    pub fn unoccluded(&self, emitters: &[Emitter], index: u32, receiver: &Receiver) -> Vec3 {
        self.unoccluded_and_cost(emitters, index, receiver).0
    }

    /// The same, and what it costs: the number of nodes that are visited, where an emitter counts as
    /// [`COST_OF_EMITTER`] nodes.
    pub fn unoccluded_and_cost(&self, emitters: &[Emitter], index: u32, receiver: &Receiver) -> (Vec3, u32) {
        let (position, normal) = (receiver.position.as_dvec3(), receiver.normal.as_dvec3());
        let light_of = |emitter: u32| {
            let emitter = &emitters[emitter as usize];
            let factor = point_to_triangle(position, normal, &emitter.corners_f64);
            emitter.radiance.as_dvec3() * (std::f64::consts::PI * factor)
        };
        if self.emitters(index) <= EXACT_EMITTERS {
            let sum: DVec3 = self.emitters_of(index).iter().map(|emitter| light_of(*emitter)).sum();
            return (sum.as_vec3(), COST_OF_EMITTER * self.emitters(index));
        }
        let (mut sum, mut cost) = (DVec3::ZERO, 0);
        let mut open = Vec::with_capacity(64);
        open.push(index);
        while let Some(index) = open.pop() {
            cost += 1;
            let (node, bounds) = (&self.nodes[index as usize], &self.bounds[index as usize]);
            let towards = bounds.center - receiver.position;
            let height = towards.dot(receiver.normal);
            if height <= -bounds.radius {
                continue;
            }
            let distance = towards.length();
            if let Some(flat) = &node.flat {
                match flat.view(bounds, towards, receiver.normal) {
                    FlatView::None => continue,
                    FlatView::Whole if bounds.radius < FLAT_OPENING * distance => {
                        let light = flat.light_at(node.light, bounds.axis, towards, receiver.normal);
                        sum += light.as_dvec3();
                        continue;
                    }
                    _ => {}
                }
            }
            let children = match node.kind {
                NodeKind::Leaf(emitter) => {
                    cost += COST_OF_EMITTER;
                    sum += light_of(emitter);
                    continue;
                }
                NodeKind::Inner(children) => children,
            };
            if bounds.radius < OPENING * distance && height > bounds.radius {
                let direction = towards / distance;
                let (faces, may_differ) =
                    (-direction.dot(bounds.axis), bounds.spread + bounds.radius / distance);
                if faces + may_differ <= 0.0 {
                    continue;
                }
                let per_power = height / (distance * distance * distance);
                if faces >= may_differ {
                    let moment = (node.moments.transpose() * -direction).max(Vec3::ZERO);
                    sum += moment.as_dvec3() * f64::from(per_power);
                    continue;
                }
                let most = bounds.power * per_power * (faces + may_differ).min(1.0);
                if f64::from(most) < f64::from(NEGLIGIBLE) * sum.element_sum() {
                    // The mean of max(0, cosine) for cosines distributed uniformly within `spread` of the axis's.
                    let mean = match bounds.spread > faces.abs() {
                        true => (faces + bounds.spread).powi(2) / (4.0 * bounds.spread),
                        false => faces.max(0.0),
                    };
                    sum += (node.light * (per_power * mean)).as_dvec3();
                    continue;
                }
            }
            // Visit the brighter child first, so that the sum soon shows what is negligible.
            let [a, b] = children.map(|child| {
                let child = &self.bounds[child as usize];
                child.power * (child.spread * distance + (receiver.position - child.center).dot(child.axis))
            });
            let [near, far] = children;
            open.extend(if a > b { [far, near] } else { [near, far] });
        }
        (sum.as_vec3(), cost)
    }

    /// Samples an emitter of a node by `u` in [0, 1), about in proportion to the light that it brings to the receiver.
    pub fn pick(&self, index: u32, receiver: &Receiver, u: f32) -> EmitterChoice {
        self.walk.choose(&self.bounds, index, receiver, u)
    }

    /// The [`EmitterBounds::weight`] of a node: about the irradiance that it brings.
    pub fn weight(&self, index: u32, receiver: &Receiver, reach: f32) -> f32 {
        self.bounds[index as usize].weight(receiver, reach)
    }
}

impl FlatMoments {
    /// `None` if the emitters face different ways.
    fn new<'a>(emitters: impl Iterator<Item = &'a Emitter>, bounds: &EmitterBounds) -> Option<Self> {
        if bounds.spread > FLAT {
            return None;
        }
        let (mut first, mut second) = ([DVec3::ZERO; 3], [DVec3::ZERO; 6]);
        let mut offsets = [f32::INFINITY, f32::NEG_INFINITY];
        for emitter in emitters {
            let light = emitter.radiance.as_dvec3() * f64::from(emitter.area);
            let corners = emitter.corners_f64.map(|corner| corner - bounds.center.as_dvec3());
            for corner in corners {
                let offset = corner.dot(bounds.axis.as_dvec3()) as f32;
                offsets = [offsets[0].min(offset), offsets[1].max(offset)];
            }
            let middle = (corners[0] + corners[1] + corners[2]) / 3.0;
            for (moment, place) in first.iter_mut().zip(middle.to_array()) {
                *moment += light * place;
            }
            // Over a triangle the mean of a product is that of its middle and, about that, a twelfth of the corners' sum.
            for (offset, weight) in
                corners.map(|corner| (corner - middle, 1.0 / 12.0)).into_iter().chain([(middle, 1.0)])
            {
                for (moment, square) in second.iter_mut().zip(squares(offset)) {
                    *moment += light * (weight * square);
                }
            }
        }
        let moments =
            Self { offsets, first: first.map(|m| m.as_vec3()), second: second.map(|m| m.as_vec3()) };
        moments.first.iter().chain(&moments.second).all(|moment| moment.is_finite()).then_some(moments)
    }

    /// What a receiver of which the centre is `towards` away may see.
    fn view(&self, bounds: &EmitterBounds, towards: Vec3, normal: Vec3) -> FlatView {
        let [behind, front] = self.offsets;
        let cosine = normal.dot(bounds.axis);
        let is_parallel = cosine >= 1.0 - PARALLEL && front - behind <= IN_A_PLANE * bounds.radius;
        // How far the emitters are above the receiver's horizon, and it above theirs.
        let (height, above) = (towards.dot(normal), -towards.dot(bounds.axis));
        let in_plane = (normal - cosine * bounds.axis).length() * bounds.radius;
        let (lower, higher) = ((cosine * behind).min(cosine * front), (cosine * behind).max(cosine * front));
        if is_parallel || height + higher + in_plane <= 0.0 || above - behind <= 0.0 {
            FlatView::None
        } else if height + lower - in_plane > 0.0 && above - front > 0.0 {
            FlatView::Whole
        } else {
            FlatView::Part
        }
    }

    /// The irradiance that emitters of normal `axis` and of so much light (Σ radiance · area) bring to a receiver of
    /// which the centre is `towards` away, with all of them above its horizon and it above theirs: the kernel
    /// f(t) = (n·t)(-a·t) / |t|⁴ to the second order, light f + first moments · ∇f + second moments : ∇∇f / 2.
    fn light_at(&self, light: Vec3, axis: Vec3, towards: Vec3, normal: Vec3) -> Vec3 {
        let inverse = towards.length_squared().recip();
        let (height, above) = (towards.dot(normal), -towards.dot(axis));
        let value = height * above * inverse * inverse;
        // ∇((n·t)(-a·t))
        let slope = above * normal - height * axis;
        let gradient = slope * (inverse * inverse) - towards * (4.0 * value * inverse);
        let of_normals = symmetric_products(normal, axis).map(|product| -product * inverse * inverse);
        let of_slopes = symmetric_products(slope, towards).map(|product| -4.0 * product * inverse.powi(3));
        // The symmetric products of a vector with itself are twice its squares: hence 12 and not 24.
        let of_offsets =
            symmetric_products(towards, towards).map(|product| 12.0 * value * inverse * inverse * product);
        let diagonal = -4.0 * value * inverse;
        let mut sum = light * value;
        for (moment, slope) in self.first.into_iter().zip(gradient.to_array()) {
            sum += moment * slope;
        }
        for (place, moment) in self.second.into_iter().enumerate() {
            let curvature = of_normals[place] + of_slopes[place] + of_offsets[place];
            // What is off the diagonal counts twice.
            let weight = if place < 3 { 0.5 * (curvature + diagonal) } else { curvature };
            sum += moment * weight;
        }
        sum.max(Vec3::ZERO)
    }
}

/// The entries of a aᵀ: xx, yy, zz, xy, xz and yz.
fn squares(a: DVec3) -> [f64; 6] {
    [a.x * a.x, a.y * a.y, a.z * a.z, a.x * a.y, a.x * a.z, a.y * a.z]
}

/// The entries of a bᵀ + b aᵀ, in the same order.
fn symmetric_products(a: Vec3, b: Vec3) -> [f32; 6] {
    let both = |i: usize, j: usize| a[i] * b[j] + b[i] * a[j];
    [both(0, 0), both(1, 1), both(2, 2), both(0, 1), both(0, 2), both(1, 2)]
}

/// A node over `members`, without children, and its bounds.
fn summarize(emitters: &[Emitter], members: &[u32], lamps: u32, first: u32) -> (Node, EmitterBounds) {
    let emitter_at = |&index: &u32| &emitters[index as usize];
    let (mut power, mut area, mut sum) = (0.0f64, 0.0f64, DVec3::ZERO);
    let (mut center, mut axis) = (DVec3::ZERO, DVec3::ZERO);
    let mut moments = [DVec3::ZERO; 3];
    for emitter in members.iter().map(emitter_at) {
        let light = emitter.radiance.as_dvec3() * f64::from(emitter.area);
        let emitter_power = light.element_sum();
        power += emitter_power;
        area += f64::from(emitter.area);
        sum += light;
        for (channel, moment) in moments.iter_mut().enumerate() {
            *moment += light[channel] * emitter.normal.as_dvec3();
        }
        center += emitter_power * emitter.middle().as_dvec3();
        axis += emitter_power * emitter.normal.as_dvec3();
    }
    let middle = middle(emitters, members).as_dvec3();
    let center = if power > 0.0 { center / power } else { middle }.as_vec3();
    let axis = axis.normalize_or_zero().as_vec3();
    let corners = members.iter().map(emitter_at).flat_map(|emitter| emitter.corners);
    let radius = corners.map(|corner| corner.distance(center)).fold(0.0, f32::max);
    let spread = members.iter().map(emitter_at).map(|e| e.normal.distance(axis)).fold(0.0, f32::max);
    let kind = NodeKind::Leaf(members.first().copied().unwrap_or(0));
    let emitters = members.len() as u32;
    let [red, green, blue] = moments.map(|moment| moment.as_vec3());
    let moments = Mat3::from_cols(red, green, blue);
    let (light, power, area) = (sum.as_vec3(), power as f32, area as f32);
    let bounds = EmitterBounds { center, radius, axis, spread, power };
    let flat = FlatMoments::new(members.iter().map(emitter_at), &bounds);
    (Node { light, area, moments, flat, lamps, first, emitters, kind }, bounds)
}

/// Mean of the emitters' centroids.
fn middle(emitters: &[Emitter], members: &[u32]) -> Vec3 {
    let sum: DVec3 = members.iter().map(|&index| emitters[index as usize].middle().as_dvec3()).sum();
    (sum / members.len().max(1) as f64).as_vec3()
}

#[cfg(test)]
#[path = "emitter_tree_tests.rs"]
mod tests;
