//! Emissive triangles as a hierarchy: lamps (pieces that hang together), lamps of lamps, and the parts of a lamp, each with the
//! ball it lies in, where it shines to and how much (after Conty Estevez and Kulla, "Importance Sampling of Many Lights with
//! Adaptive Tree Splitting", 2018). It tells the unoccluded light of a part, exactly near by and in one term far away, which
//! parts have a shadow of their own, and takes samples. Not visibility: that is `direct`.

use std::f32::consts::PI;

use glam::{DVec3, Mat3, Vec3};

use super::direct::Receiver;
use super::emitters::Emitter;
use super::polygon::point_to_triangle;

/// Emissive triangles as a hierarchy.
#[derive(Clone, Debug, Default)]
pub(crate) struct EmitterTree {
    /// Children after their parents; the first is the root.
    nodes: Vec<Node>,
    /// Parts of at most this sine of their radius against their distance count as one term.
    opening: f32,
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
    /// Σ radiance · area.
    light: Vec3,
    /// Sum of its channels.
    power: f32,
    /// Σ radiance · area · normal: a column for each channel.
    moments: Mat3,
    /// Lamps in it, wholly or in part.
    lamps: u32,
    kind: Kind,
}

#[derive(Clone, Copy, Debug)]
enum Kind {
    /// One emitter, by number.
    Leaf(u32),
    Inner([u32; 2]),
}

/// Up to this many emitters every one is summed exactly wherever it is.
const EXACT_EMITTERS: usize = 48;
/// Beyond: one term differs from a part of radius r at distance d by about (r/d)², here a quarter of a per cent, and by (r/d) times what
/// its normals differ by.
const OPENING: f32 = 0.05;
/// A part of which some may look away is opened no further where it can bring no more than this share of what was found before.
const NEGLIGIBLE: f32 = 0.003;
/// What one term for a part leaves of the light of a lamp: root of the mean square, as a test measures it.
const TERM_ERROR: f32 = 0.005;
/// Most groups of lamps whose shadows are told apart at a receiver.
const MOST_GROUPS: usize = 16;
/// Lamps whose common ball has at most this sine cast one shadow.
const NARROW: f32 = 0.02;
/// Least share of a cosine in a weight, so that none is 0 where light may arrive.
const LEAST_COSINE: f32 = 0.02;

impl EmitterTree {
    /// Over all emitters; `lamps[i]` numbers the lamp of emitter i.
    pub fn new(emitters: &[Emitter], lamps: &[u32]) -> Self {
        let opening = if emitters.len() <= EXACT_EMITTERS { 0.0 } else { OPENING };
        let mut tree = Self { nodes: Vec::with_capacity(2 * emitters.len()), opening };
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
        self.nodes.push(Node::over(emitters, &all, lamps.len() as u32));
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
        self.nodes.push(Node::over(emitters, some, 1));
        if some.len() > 1 {
            let half = split(some, |emitter| middle(emitters, &[*emitter]));
            let (near, far) = some.split_at_mut(half);
            let children = [self.add(emitters, near), self.add(emitters, far)];
            self.nodes[index as usize].kind = Kind::Inner(children);
        }
        index
    }

    /// The groups of lamps whose shadows are told apart at a receiver: the brightest that subtend an angle are parted first.
    pub fn groups(&self, receiver: &Receiver) -> Vec<u32> {
        let mut groups: Vec<u32> = if self.nodes.is_empty() { Vec::new() } else { vec![0] };
        while groups.len() < MOST_GROUPS {
            let weight = |&(_, group): &(usize, &u32)| self.weight(*group, receiver);
            let parted = groups
                .iter()
                .enumerate()
                .filter(|(_, group)| {
                    let node = &self.nodes[**group as usize];
                    node.lamps > 1 && node.radius > NARROW * node.center.distance(receiver.position)
                })
                .max_by(|a, b| weight(a).total_cmp(&weight(b)).then(b.1.cmp(a.1)));
            let Some((place, &group)) = parted else { break };
            let Kind::Inner(children) = self.nodes[group as usize].kind else { break };
            groups[place] = children[0];
            groups.push(children[1]);
        }
        groups
    }

    /// The emitters of a part, if they are at most `most`.
    pub fn emitters_of(&self, part: u32, most: usize) -> Option<Vec<u32>> {
        let (mut found, mut open) = (Vec::new(), vec![part]);
        while let Some(index) = open.pop() {
            match self.nodes[index as usize].kind {
                Kind::Leaf(emitter) => found.push(emitter),
                Kind::Inner([near, far]) => open.extend([far, near]),
            }
            if found.len() + open.len() > most {
                return None;
            }
        }
        Some(found)
    }

    /// Irradiance of a part as if nothing were between.
    pub fn unoccluded(&self, emitters: &[Emitter], part: u32, receiver: &Receiver) -> Vec3 {
        let (position, normal) = (receiver.position.as_dvec3(), receiver.normal.as_dvec3());
        let mut sum = DVec3::ZERO;
        let mut open = Vec::with_capacity(64);
        open.push(part);
        while let Some(index) = open.pop() {
            let node = &self.nodes[index as usize];
            let children = match node.kind {
                Kind::Leaf(emitter) => {
                    let emitter = &emitters[emitter as usize];
                    let factor = point_to_triangle(position, normal, &emitter.corners_f64);
                    sum += emitter.radiance.as_dvec3() * (std::f64::consts::PI * factor);
                    continue;
                }
                Kind::Inner(children) => children,
            };
            let towards = node.center - receiver.position;
            let height = towards.dot(receiver.normal);
            if height <= -node.radius {
                continue;
            }
            let distance = towards.length();
            if node.radius < self.opening * distance && height > node.radius {
                let direction = towards / distance;
                let (faces, may_differ) = (-direction.dot(node.axis), node.spread + node.radius / distance);
                if faces + may_differ <= 0.0 {
                    continue;
                }
                let per_power = height / (distance * distance * distance);
                if faces >= may_differ {
                    let moment = (node.moments.transpose() * -direction).max(Vec3::ZERO);
                    sum += moment.as_dvec3() * f64::from(per_power);
                    continue;
                }
                let most = node.power * per_power * (faces + may_differ).min(1.0);
                if f64::from(most) < f64::from(NEGLIGIBLE) * sum.element_sum() {
                    // The mean of max(0, cosine) over cosines spread evenly.
                    let mean = match node.spread > faces.abs() {
                        true => (faces + node.spread).powi(2) / (4.0 * node.spread),
                        false => faces.max(0.0),
                    };
                    sum += (node.light * (per_power * mean)).as_dvec3();
                    continue;
                }
            }
            // The brighter first: it tells what is negligible.
            let [a, b] = children.map(|child| {
                let child = &self.nodes[child as usize];
                child.power * (child.spread * distance + (receiver.position - child.center).dot(child.axis))
            });
            let [near, far] = children;
            open.extend(if a > b { [far, near] } else { [near, far] });
        }
        sum.as_vec3()
    }

    /// Relative error of [`unoccluded`](Self::unoccluded).
    pub fn error(&self) -> f32 {
        if self.opening > 0.0 { TERM_ERROR } else { 0.0 }
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
            let [a, b] = [near, far].map(|child| self.weight(child, receiver));
            let first = if a + b > 0.0 && (a + b).is_finite() { a / (a + b) } else { 0.5 };
            (index, u) = if u < first { (near, u / first) } else { (far, (u - first) / (1.0 - first)) };
            probability *= if index == near { first } else { 1.0 - first };
            u = u.clamp(0.0, 1.0 - f32::EPSILON);
        }
    }

    /// About what a part brings a receiver; positive.
    pub fn weight(&self, index: u32, receiver: &Receiver) -> f32 {
        let node = &self.nodes[index as usize];
        let towards = node.center - receiver.position;
        let squared = towards.length_squared() + node.radius * node.radius;
        let direction = towards.normalize_or_zero();
        let subtends = node.radius / squared.sqrt();
        let receives = (direction.dot(receiver.normal) + subtends).clamp(LEAST_COSINE, 1.0);
        let emits = (node.spread + subtends - direction.dot(node.axis)).clamp(LEAST_COSINE, 1.0);
        PI * node.power * receives * emits / squared
    }
}

impl Node {
    fn over(emitters: &[Emitter], some: &[u32], lamps: u32) -> Self {
        let of = |&index: &u32| &emitters[index as usize];
        let (mut power, mut sum) = (0.0f64, DVec3::ZERO);
        let (mut center, mut axis) = (DVec3::ZERO, DVec3::ZERO);
        let mut moments = [DVec3::ZERO; 3];
        for emitter in some.iter().map(of) {
            let light = emitter.radiance.as_dvec3() * f64::from(emitter.area);
            let own = light.element_sum();
            power += own;
            sum += light;
            center += own * emitter.middle().as_dvec3();
            axis += own * emitter.normal.as_dvec3();
            for (channel, moment) in moments.iter_mut().enumerate() {
                *moment += light[channel] * emitter.normal.as_dvec3();
            }
        }
        let middle = middle(emitters, some).as_dvec3();
        let center = if power > 0.0 { center / power } else { middle }.as_vec3();
        let axis = axis.normalize_or_zero().as_vec3();
        let corners = some.iter().map(of).flat_map(|emitter| emitter.corners);
        let radius = corners.map(|corner| corner.distance(center)).fold(0.0, f32::max);
        let spread = some.iter().map(of).map(|e| e.normal.distance(axis)).fold(0.0, f32::max);
        let [red, green, blue] = moments.map(|moment| moment.as_vec3());
        let kind = Kind::Leaf(some.first().copied().unwrap_or(0));
        let moments = Mat3::from_cols(red, green, blue);
        Self { center, radius, axis, spread, light: sum.as_vec3(), power: power as f32, moments, lamps, kind }
    }
}

/// Mean of the emitters' middles.
fn middle(emitters: &[Emitter], some: &[u32]) -> Vec3 {
    let sum: DVec3 = some.iter().map(|&index| emitters[index as usize].middle().as_dvec3()).sum();
    (sum / some.len().max(1) as f64).as_vec3()
}

/// Orders things along the widest axis of their places; the number that goes to the first half.
fn split(some: &mut [u32], place: impl Fn(&u32) -> Vec3) -> usize {
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
