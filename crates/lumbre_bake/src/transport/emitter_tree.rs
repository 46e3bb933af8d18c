//! Emissive triangles as a hierarchy: lamps (pieces that hang together), lamps of lamps, and the parts of a lamp, each with the
//! ball it lies in, where it shines to and how much (after Conty Estevez and Kulla, "Importance Sampling of Many Lights with
//! Adaptive Tree Splitting", 2018). It tells about how much of the light each part brings, and takes samples. Not visibility: that is
//! `direct`; not which parts have samples of their own: that is `light_cut`.

use glam::{DVec3, Vec3};

use super::direct::Receiver;
use super::emitters::Emitter;

/// Emissive triangles as a hierarchy.
#[derive(Clone, Debug, Default)]
pub(crate) struct EmitterTree {
    /// Children after their parents; the first is the root.
    nodes: Vec<Node>,
    /// The emitters, those of each part side by side.
    order: Vec<u32>,
}

/// Some emitters.
#[derive(Clone, Debug)]
struct Node {
    /// By power.
    center: Vec3,
    /// Around the centre, of all corners.
    radius: f32,
    /// Unit, or zero: by power, where it shines to; no normal differs from it by more than `spread`, a chord.
    axis: Vec3,
    spread: f32,
    /// Σ radiance · area, sum of the channels.
    power: f32,
    /// Lamps in it, wholly or in part.
    lamps: u32,
    /// Emitters in it: the first, in the order of all, and how many.
    first: u32,
    emitters: u32,
    kind: Kind,
}

#[derive(Clone, Copy, Debug)]
enum Kind {
    /// One emitter, by number.
    Leaf(u32),
    Inner([u32; 2]),
}

/// Least share of a cosine in a weight, so that none is 0 where light may arrive.
pub(super) const LEAST_COSINE: f32 = 0.02;

impl EmitterTree {
    /// Over all emitters; `lamps[i]` numbers the lamp of emitter i.
    pub fn new(emitters: &[Emitter], lamps: &[u32]) -> Self {
        let mut tree = Self { nodes: Vec::with_capacity(2 * emitters.len()), order: Vec::new() };
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
        let index = self.nodes.len() as u32;
        self.nodes.push(Node::over(emitters, &all, lamps.len() as u32, self.order.len() as u32));
        let place = |lamp: &u32| middle(emitters, &members[*lamp as usize]);
        let half = split(lamps, place);
        let (near, far) = lamps.split_at_mut(half);
        let children = [self.add_lamps(emitters, members, near), self.add_lamps(emitters, members, far)];
        self.nodes[index as usize].kind = Kind::Inner(children);
        index
    }

    /// A node over some emitters of one lamp.
    fn add(&mut self, emitters: &[Emitter], some: &mut [u32]) -> u32 {
        let index = self.nodes.len() as u32;
        self.nodes.push(Node::over(emitters, some, 1, self.order.len() as u32));
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

    /// The part that holds all emitters; none where there are none.
    pub fn root(&self) -> Option<u32> {
        (!self.nodes.is_empty()).then_some(0)
    }

    /// The two parts of a part, unless it is one emitter.
    pub fn children(&self, part: u32) -> Option<[u32; 2]> {
        match self.nodes[part as usize].kind {
            Kind::Leaf(_) => None,
            Kind::Inner(children) => Some(children),
        }
    }

    /// How many lamps a part holds, wholly or in part.
    pub fn lamps(&self, part: u32) -> u32 {
        self.nodes[part as usize].lamps
    }

    /// How many emitters a part holds.
    pub fn emitters(&self, part: u32) -> u32 {
        self.nodes[part as usize].emitters
    }

    /// The sine under which a part's ball, larger by `reach`, appears from a receiver, at most 1.
    pub fn sine(&self, part: u32, receiver: &Receiver, reach: f32) -> f32 {
        let node = &self.nodes[part as usize];
        let distance = node.center.distance(receiver.position);
        let size = node.radius + reach;
        if size < distance { size / distance } else { 1.0 }
    }

    /// The emitters of a part, by number.
    pub fn emitters_of(&self, part: u32) -> &[u32] {
        let node = &self.nodes[part as usize];
        &self.order[node.first as usize..(node.first + node.emitters) as usize]
    }

    /// An emitter of a part at `u` in [0, 1), the place within its interval stretched to [0, 1), and its probability: about in
    /// proportion to what it brings a receiver.
    pub fn pick(&self, part: u32, receiver: &Receiver, mut u: f32) -> (usize, f32, f32) {
        let (mut index, mut probability) = (part, 1.0f32);
        loop {
            let [near, far] = match self.nodes[index as usize].kind {
                Kind::Leaf(emitter) => return (emitter as usize, u, probability),
                Kind::Inner(children) => children,
            };
            let [a, b] = [near, far].map(|child| self.weight(child, receiver, 0.0));
            let first = if a + b > 0.0 && (a + b).is_finite() { a / (a + b) } else { 0.5 };
            (index, u) = if u < first { (near, u / first) } else { (far, (u - first) / (1.0 - first)) };
            probability *= if index == near { first } else { 1.0 - first };
            u = u.clamp(0.0, 1.0 - f32::EPSILON);
        }
    }

    /// About what a part brings receivers within `reach` of one (irradiance, sum of the channels); positive.
    pub fn weight(&self, index: u32, receiver: &Receiver, reach: f32) -> f32 {
        let node = &self.nodes[index as usize];
        let towards = node.center - receiver.position;
        let size = node.radius + reach;
        let squared = towards.length_squared() + size * size;
        // Directions are a little short where the part is near: all of it counts there anyway.
        let inverse = 1.0 / squared.sqrt();
        let subtends = size * inverse;
        let receives = (towards.dot(receiver.normal) * inverse + subtends).clamp(LEAST_COSINE, 1.0);
        let emits = (node.spread + subtends - towards.dot(node.axis) * inverse).clamp(LEAST_COSINE, 1.0);
        node.power * receives * emits * inverse * inverse
    }
}

impl Node {
    fn over(emitters: &[Emitter], some: &[u32], lamps: u32, first: u32) -> Self {
        let of = |&index: &u32| &emitters[index as usize];
        let mut power = 0.0f64;
        let (mut center, mut axis) = (DVec3::ZERO, DVec3::ZERO);
        for emitter in some.iter().map(of) {
            let own = emitter.radiance.as_dvec3().element_sum() * f64::from(emitter.area);
            power += own;
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
        Self { center, radius, axis, spread, power: power as f32, lamps, first, emitters, kind }
    }
}

/// Mean of the emitters' middles.
fn middle(emitters: &[Emitter], some: &[u32]) -> Vec3 {
    let sum: DVec3 = some.iter().map(|&index| emitters[index as usize].middle().as_dvec3()).sum();
    (sum / some.len().max(1) as f64).as_vec3()
}

/// Orders things along the widest axis of their places; the number that goes to the first half.
pub(super) fn split(some: &mut [u32], place: impl Fn(&u32) -> Vec3) -> usize {
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
