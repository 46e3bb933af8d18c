//! Point and spot lights as a hierarchy: halves of halves, each with the ball it lies in, how far and where to it shines, and how much
//! (after Conty Estevez and Kulla, "Importance Sampling of Many Lights with Adaptive Tree Splitting", 2018). It tells about how much of the
//! light each part brings, and takes samples. Not lights in the sky, which have no place; not visibility: that is `punctual`.

use std::f32::consts::PI;

use glam::{DVec3, Vec3};
use lumbre_optics::LightKind;

use super::emitter_bounds::MIN_COSINE;
use super::emitter_tree::split;
use crate::scene::Receiver;
use crate::scene::{Canonical, PlacedLight};

/// Lights as a hierarchy.
#[derive(Clone, Debug, Default)]
pub(crate) struct LightTree {
    /// Children after their parents; the first is the root.
    nodes: Vec<Node>,
}

/// Some lights. Lengths are canonical.
#[derive(Clone, Debug)]
struct Node {
    /// By power.
    center: Vec3,
    /// Around the centre, of all lights with their sizes.
    radius: f32,
    /// π times the colours, sum of the channels.
    power: f32,
    /// By power: the constant, linear and quadratic part of what the light is divided by.
    law: [f32; 3],
    /// The largest.
    range: f32,
    /// Unit, or zero: about where they shine to; all of it within this angle's cosine.
    axis: Vec3,
    cosine: f32,
    kind: Kind,
}

#[derive(Clone, Copy, Debug)]
enum Kind {
    /// One light, by number.
    Leaf(u32),
    Inner([u32; 2]),
}

/// Outside of the lights' cones, and near the end of their range, a part still counts by this share: a bound of many is no exact one.
const OUTSIDE: f32 = 0.01;

impl LightTree {
    /// Over some lights, by number.
    pub fn new(lights: &[PlacedLight], mut some: Vec<u32>, space: Canonical) -> Self {
        let mut tree = Self { nodes: Vec::with_capacity(2 * some.len()) };
        if !some.is_empty() {
            tree.add(lights, &mut some, space);
        }
        tree
    }

    fn add(&mut self, lights: &[PlacedLight], some: &mut [u32], space: Canonical) -> u32 {
        let index = self.nodes.len() as u32;
        self.nodes.push(Node::over(lights, some, space));
        if some.len() > 1 {
            let half = split(some, |light| space.position(lights[*light as usize].position));
            let (near, far) = some.split_at_mut(half);
            let children = [self.add(lights, near, space), self.add(lights, far, space)];
            self.nodes[index as usize].kind = Kind::Inner(children);
        }
        index
    }

    /// The part that holds all lights; none where there are none.
    pub fn root(&self) -> Option<u32> {
        (!self.nodes.is_empty()).then_some(0)
    }

    /// The two parts of a part, or the number of its only light.
    pub fn children(&self, index: u32) -> Result<[u32; 2], u32> {
        match self.nodes[index as usize].kind {
            Kind::Leaf(light) => Err(light),
            Kind::Inner(children) => Ok(children),
        }
    }

    /// The sine under which a part's ball, larger by `reach`, appears from a receiver, at most 1.
    pub fn sine(&self, index: u32, receiver: &Receiver, reach: f32) -> f32 {
        let node = &self.nodes[index as usize];
        let distance = node.center.distance(receiver.position);
        let size = node.radius + reach;
        if size < distance { size / distance } else { 1.0 }
    }

    /// A light of a part at `u` in [0, 1), and its probability: about in proportion to what it brings a receiver. None where no light of the
    /// part reaches as far.
    pub fn pick(&self, index: u32, receiver: &Receiver, mut u: f32) -> Option<(u32, f32)> {
        let (mut index, mut probability) = (index, 1.0f32);
        loop {
            let [near, far] = match self.nodes[index as usize].kind {
                Kind::Leaf(light) => return Some((light, probability)),
                Kind::Inner(children) => children,
            };
            let [a, b] = [near, far].map(|child| self.weight(child, receiver, 0.0));
            if a + b <= 0.0 {
                return None;
            }
            let first = if (a + b).is_finite() { a / (a + b) } else { 0.5 };
            (index, u) = if u < first { (near, u / first) } else { (far, (u - first) / (1.0 - first)) };
            probability *= if index == near { first } else { 1.0 - first };
            u = u.clamp(0.0, 1.0 - f32::EPSILON);
        }
    }

    /// About what a part brings receivers within `reach` of one (irradiance, sum of the channels); 0 only where none of it arrives at any of them.
    pub fn weight(&self, index: u32, receiver: &Receiver, reach: f32) -> f32 {
        let node = &self.nodes[index as usize];
        let towards = node.center - receiver.position;
        let (away, size) = (towards.length_squared(), node.radius + reach);
        if away > (node.range + size).powi(2) {
            return 0.0;
        }
        let squared = away + size * size;
        let distance = squared.sqrt();
        let direction = towards.normalize_or_zero();
        let subtends = size / distance.max(f32::MIN_POSITIVE);
        let receives = (direction.dot(receiver.normal) + subtends).clamp(MIN_COSINE, 1.0);
        let [constant, linear, quadratic] = node.law;
        let law = constant + linear * distance + quadratic * squared;
        // An angle's sine is less than the angle, so that this is a little narrow: those outside count, too.
        let inside = node.cosine <= -1.0 || node.cosine - 1.5 * subtends <= -direction.dot(node.axis);
        // The window that closes at the range, of what is nearest.
        let window = 1.0 - ((distance - size).max(0.0) / node.range).powi(4);
        let weight = node.power * receives * window.max(OUTSIDE) * if inside { 1.0 } else { OUTSIDE } / law;
        // At a light itself there is no end to it.
        if weight.is_nan() { f32::MAX } else { weight.clamp(f32::MIN_POSITIVE, f32::MAX) }
    }
}

impl Node {
    fn over(lights: &[PlacedLight], some: &[u32], space: Canonical) -> Self {
        let of = |&index: &u32| &lights[index as usize];
        let own_power = |placed: &PlacedLight| f64::from(placed.light.diffuse.element_sum());
        let power: f64 = some.iter().map(of).map(own_power).sum();
        let share = |placed: &PlacedLight| if power > 0.0 { own_power(placed) / power } else { 0.0 };
        let (mut center, mut axis, mut law) = (DVec3::ZERO, DVec3::ZERO, [0.0f64; 3]);
        let mut range = 0.0f32;
        for placed in some.iter().map(of) {
            let share = share(placed);
            center += share * space.place(placed.position);
            axis += share * placed.axis;
            // From metres to canonical units.
            let coefficients = placed.light.attenuation.coefficients().as_dvec3().to_array();
            for (power, (sum, own)) in law.iter_mut().zip(coefficients).enumerate() {
                *sum += share * own * space.scale.powi(-(power as i32));
            }
            let own_range = f64::from(placed.light.attenuation.range) * space.scale;
            // What is no range is none.
            range = range.max(if own_range > 0.0 { own_range as f32 } else { f32::INFINITY });
        }
        let axis = axis.normalize_or_zero();
        let mut angle = 0.0f64;
        let mut radius = 0.0f64;
        for placed in some.iter().map(of) {
            let size = f64::from(placed.light.radius.max(0.0)) * space.scale;
            radius = radius.max(space.place(placed.position).distance(center) + size);
            angle = angle.max(cutoff(placed) + axis.angle_between(placed.axis));
        }
        let everywhere = axis == DVec3::ZERO || angle.is_nan() || angle >= std::f64::consts::PI;
        Self {
            center: center.as_vec3(),
            radius: radius as f32,
            power: PI * power as f32,
            law: law.map(|own| own as f32),
            range,
            axis: axis.as_vec3(),
            cosine: if everywhere { -1.0 } else { angle.cos() as f32 },
            kind: Kind::Leaf(some.first().copied().unwrap_or(0)),
        }
    }
}

/// The angle from a light's axis beyond which it does not shine, radians.
fn cutoff(placed: &PlacedLight) -> f64 {
    match placed.light.spot.filter(|cone| !cone.is_everywhere()) {
        Some(cone) => f64::from(cone.outer_angle()),
        None => std::f64::consts::PI,
    }
}

/// Whether a light has a place in such a hierarchy.
pub(crate) fn has_place(placed: &PlacedLight) -> bool {
    placed.light.kind != LightKind::Directional
}
