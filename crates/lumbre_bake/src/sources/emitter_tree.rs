//! Emissive triangles as a hierarchy: lamps (pieces that hang together), lamps of lamps, and the parts of a lamp, each with the
//! ball it lies in, where it shines to and how much (after Conty Estevez and Kulla, "Importance Sampling of Many Lights with
//! Adaptive Tree Splitting", 2018). It tells about how much of the light each part brings, and how much exactly where nothing is between, and
//! lets samples walk down. Not visibility: that is `direct`; not which parts have samples of their own: that is `light_cut`.

use std::f32::consts::PI;

use glam::{DVec3, Mat3, Vec3};

use super::emitter_bounds::EmitterBounds;
use super::emitter_walk::{EmitterChoice, EmitterWalk, Kind};
use super::emitters::Emitter;
use crate::scene::Receiver;
use crate::visibility::polygon::point_to_triangle;

/// Emissive triangles as a hierarchy.
#[derive(Clone, Debug, Default)]
pub(crate) struct EmitterTree {
    /// Children after their parents; the first is the root.
    nodes: Vec<Node>,
    bounds: Vec<EmitterBounds>,
    walk: EmitterWalk,
    /// The emitters, those of each part side by side.
    order: Vec<u32>,
}

/// Some emitters.
#[derive(Clone, Debug)]
struct Node {
    /// Σ radiance · area, and Σ area.
    light: Vec3,
    area: f32,
    /// Σ radiance · area · normal: a column for each channel.
    moments: Mat3,
    /// Lamps in it, wholly or in part.
    lamps: u32,
    /// Emitters in it: the first, in the order of all, and how many.
    first: u32,
    emitters: u32,
    kind: Kind,
}

/// Up to this many emitters every one is summed exactly wherever it is.
pub(crate) const EXACT_EMITTERS: u32 = 48;
/// Beyond, parts of at most this sine of their radius against their distance count as one term: it differs from a part of radius r at distance
/// d by about (r/d)², here a quarter of a per cent, and by (r/d) times what its normals differ by.
const OPENING: f32 = 0.05;
/// A part of which some may look away is opened no further where it can bring no more than this share of what was found before.
const NEGLIGIBLE: f32 = 0.003;
/// What one term for a part leaves of the light of a lamp: root of the mean square, as a test measures it.
pub(crate) const TERM_ERROR: f32 = 0.005;

/// Lamps whose common ball has at most this sine cast one shadow.
const NARROW: f32 = 0.02;
/// Parts that are opened at most to tell how much of what a receiver sees shines.
const MAX_OPENED: usize = 64;

impl EmitterTree {
    /// Over all emitters; `lamps[i]` numbers the lamp of emitter i.
    pub fn new(emitters: &[Emitter], lamps: &[u32]) -> Self {
        let room = 2 * emitters.len();
        let (nodes, bounds) = (Vec::with_capacity(room), Vec::with_capacity(room));
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
        let kinds: Vec<Kind> = tree.nodes.iter().map(|node| node.kind).collect();
        tree.walk = EmitterWalk::new(&kinds, &tree.bounds);
        tree
    }

    /// A node over some lamps, by number in `members`.
    fn add_lamps(&mut self, emitters: &[Emitter], members: &[Vec<u32>], lamps: &mut [u32]) -> u32 {
        if let [lamp] = *lamps {
            return self.add(emitters, &mut members[lamp as usize].clone());
        }
        let mut all: Vec<u32> =
            lamps.iter().flat_map(|&lamp| members[lamp as usize].iter().copied()).collect();
        all.sort_unstable();
        let index = self.push(emitters, &all, lamps.len() as u32);
        let place = |lamp: &u32| middle(emitters, &members[*lamp as usize]);
        let half = split(lamps, place);
        let (near, far) = lamps.split_at_mut(half);
        let children = [self.add_lamps(emitters, members, near), self.add_lamps(emitters, members, far)];
        self.nodes[index as usize].kind = Kind::Inner(children);
        index
    }

    /// A node over some emitters of one lamp.
    fn add(&mut self, emitters: &[Emitter], some: &mut [u32]) -> u32 {
        let index = self.push(emitters, some, 1);
        if let [emitter] = *some {
            self.order.push(emitter);
        } else {
            let half = split(some, |emitter| middle(emitters, &[*emitter]));
            let (near, far) = some.split_at_mut(half);
            let children = [self.add(emitters, near), self.add(emitters, far)];
            self.nodes[index as usize].kind = Kind::Inner(children);
        }
        index
    }

    /// Adds a node without children.
    fn push(&mut self, emitters: &[Emitter], some: &[u32], lamps: u32) -> u32 {
        let index = self.nodes.len() as u32;
        let (node, bounds) = over(emitters, some, lamps, self.order.len() as u32);
        self.nodes.push(node);
        self.bounds.push(bounds);
        index
    }

    /// Where the emitters of a part are, where they shine to and how much.
    pub fn bounds(&self, index: u32) -> EmitterBounds {
        self.bounds[index as usize]
    }

    /// The part that holds all emitters; none where there are none.
    pub fn root(&self) -> Option<u32> {
        (!self.nodes.is_empty()).then_some(0)
    }

    /// The two parts of a part, unless it is one emitter.
    pub fn children(&self, index: u32) -> Option<[u32; 2]> {
        match self.nodes[index as usize].kind {
            Kind::Leaf(_) => None,
            Kind::Inner(children) => Some(children),
        }
    }

    /// How many lamps a part holds, wholly or in part.
    pub fn lamps(&self, index: u32) -> u32 {
        self.nodes[index as usize].lamps
    }

    /// How many emitters a part holds.
    pub fn emitters(&self, index: u32) -> u32 {
        self.nodes[index as usize].emitters
    }

    /// The sine under which a part's ball, larger by `reach`, appears from a receiver, at most 1.
    pub fn sine(&self, index: u32, receiver: &Receiver, reach: f32) -> f32 {
        let bounds = &self.bounds[index as usize];
        let distance = bounds.center.distance(receiver.position);
        let size = bounds.radius + reach;
        if size < distance { size / distance } else { 1.0 }
    }

    /// About how much of what a receiver sees are emitters, weighted by the cosine, if nothing stood before them: from 0 to about 1. What is far
    /// counts as one area in its middle; what is near is opened, and no part of it takes more than its ball does.
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

    /// The lamps, or groups of lamps, whose shadows are told apart at a receiver, at most so many: the brightest that subtend an angle are
    /// parted first.
    pub fn groups(&self, receiver: &Receiver, most: usize) -> Vec<u32> {
        let mut groups: Vec<u32> = self.root().into_iter().collect();
        while groups.len() < most {
            let weight = |&(_, group): &(usize, &u32)| self.weight(*group, receiver, 0.0);
            let parted = groups
                .iter()
                .enumerate()
                .filter(|(_, group)| self.lamps(**group) > 1 && self.sine(**group, receiver, 0.0) > NARROW)
                .max_by(|a, b| weight(a).total_cmp(&weight(b)).then(b.1.cmp(a.1)));
            let Some((place, &group)) = parted else { break };
            let Some([near, far]) = self.children(group) else { break };
            groups[place] = near;
            groups.push(far);
        }
        groups
    }

    /// The emitters of a part, by number.
    pub fn emitters_of(&self, index: u32) -> &[u32] {
        let node = &self.nodes[index as usize];
        &self.order[node.first as usize..(node.first + node.emitters) as usize]
    }

    /// Irradiance of a part as if nothing were between.
    pub fn unoccluded(&self, emitters: &[Emitter], index: u32, receiver: &Receiver) -> Vec3 {
        let opening = if self.emitters(index) <= EXACT_EMITTERS { 0.0 } else { OPENING };
        let (position, normal) = (receiver.position.as_dvec3(), receiver.normal.as_dvec3());
        let mut sum = DVec3::ZERO;
        let mut open = Vec::with_capacity(64);
        open.push(index);
        while let Some(index) = open.pop() {
            let (node, bounds) = (&self.nodes[index as usize], &self.bounds[index as usize]);
            let children = match node.kind {
                Kind::Leaf(emitter) => {
                    let emitter = &emitters[emitter as usize];
                    let factor = point_to_triangle(position, normal, &emitter.corners_f64);
                    sum += emitter.radiance.as_dvec3() * (std::f64::consts::PI * factor);
                    continue;
                }
                Kind::Inner(children) => children,
            };
            let towards = bounds.center - receiver.position;
            let height = towards.dot(receiver.normal);
            if height <= -bounds.radius {
                continue;
            }
            let distance = towards.length();
            if bounds.radius < opening * distance && height > bounds.radius {
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
                    // The mean of max(0, cosine) over cosines spread evenly.
                    let mean = match bounds.spread > faces.abs() {
                        true => (faces + bounds.spread).powi(2) / (4.0 * bounds.spread),
                        false => faces.max(0.0),
                    };
                    sum += (node.light * (per_power * mean)).as_dvec3();
                    continue;
                }
            }
            // The brighter first: it tells what is negligible.
            let [a, b] = children.map(|child| {
                let child = &self.bounds[child as usize];
                child.power * (child.spread * distance + (receiver.position - child.center).dot(child.axis))
            });
            let [near, far] = children;
            open.extend(if a > b { [far, near] } else { [near, far] });
        }
        sum.as_vec3()
    }

    /// An emitter of a part at `u` in [0, 1): about in proportion to what it brings a receiver.
    pub fn pick(&self, index: u32, receiver: &Receiver, u: f32) -> EmitterChoice {
        self.walk.choose(&self.bounds, index, receiver, u)
    }

    /// About what a part brings receivers within `reach` of one (irradiance, sum of the channels); positive.
    pub fn weight(&self, index: u32, receiver: &Receiver, reach: f32) -> f32 {
        self.bounds[index as usize].weight(receiver, reach)
    }
}

/// What a node holds, without children.
fn over(emitters: &[Emitter], some: &[u32], lamps: u32, first: u32) -> (Node, EmitterBounds) {
    let of = |&index: &u32| &emitters[index as usize];
    let (mut power, mut area, mut sum) = (0.0f64, 0.0f64, DVec3::ZERO);
    let (mut center, mut axis) = (DVec3::ZERO, DVec3::ZERO);
    let mut moments = [DVec3::ZERO; 3];
    for emitter in some.iter().map(of) {
        let light = emitter.radiance.as_dvec3() * f64::from(emitter.area);
        let own = light.element_sum();
        power += own;
        area += f64::from(emitter.area);
        sum += light;
        for (channel, moment) in moments.iter_mut().enumerate() {
            *moment += light[channel] * emitter.normal.as_dvec3();
        }
        center += own * emitter.middle().as_dvec3();
        axis += own * emitter.normal.as_dvec3();
    }
    let middle = middle(emitters, some).as_dvec3();
    let center = if power > 0.0 { center / power } else { middle }.as_vec3();
    let axis = axis.normalize_or_zero().as_vec3();
    let corners = some.iter().map(of).flat_map(|emitter| emitter.corners);
    let radius = corners.map(|corner| corner.distance(center)).fold(0.0, f32::max);
    let spread = some.iter().map(of).map(|e| e.normal.distance(axis)).fold(0.0, f32::max);
    let kind = Kind::Leaf(some.first().copied().unwrap_or(0));
    let emitters = some.len() as u32;
    let [red, green, blue] = moments.map(|moment| moment.as_vec3());
    let moments = Mat3::from_cols(red, green, blue);
    let (light, power, area) = (sum.as_vec3(), power as f32, area as f32);
    let bounds = EmitterBounds { center, radius, axis, spread, power };
    (Node { light, area, moments, lamps, first, emitters, kind }, bounds)
}

/// Mean of the emitters' middles.
fn middle(emitters: &[Emitter], some: &[u32]) -> Vec3 {
    let sum: DVec3 = some.iter().map(|&index| emitters[index as usize].middle().as_dvec3()).sum();
    (sum / some.len().max(1) as f64).as_vec3()
}

/// Orders things along the widest axis of their places; the number that goes to the first half.
pub(crate) fn split(some: &mut [u32], place: impl Fn(&u32) -> Vec3) -> usize {
    let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    let mut placed: Vec<(Vec3, u32)> = some.iter().map(|thing| (place(thing), *thing)).collect();
    for (place, _) in &placed {
        (low, high) = (low.min(*place), high.max(*place));
    }
    let axis = (high - low).max_position();
    placed.sort_unstable_by(|a, b| a.0[axis].total_cmp(&b.0[axis]).then(a.1.cmp(&b.1)));
    for (thing, (_, sorted)) in some.iter_mut().zip(placed) {
        *thing = sorted;
    }
    some.len() / 2
}

#[cfg(test)]
#[path = "emitter_tree_tests.rs"]
mod tests;
