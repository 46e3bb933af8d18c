//! A hierarchy of the point and spot lights (after Conty Estevez and Kulla, "Importance Sampling of Many Lights with
//! Adaptive Tree Splitting", 2018). Each node stores bounds of position, range, emission directions and power; the tree
//! estimates the light of a node and samples its lights. Directional lights have no position and stay out; visibility
//! is in `punctual`.

use std::f32::consts::PI;

use glam::{DVec3, Vec3};
use lumbre_optics::LightKind;

use super::emitter_bounds::MIN_COSINE;
use super::source_tree::{NodeKind, apparent_sine, clamp_below_one, distance_to_sphere, split_at_median};
use crate::scene::{Canonical, PlacedLight, Receiver};

/// The hierarchy of the point and spot lights.
#[derive(Clone, Debug, Default)]
pub(crate) struct LightTree {
    /// Children follow their parents; the first node is the root.
    nodes: Vec<Node>,
}

/// A node of the hierarchy: a group of lights. Lengths are in canonical units.
#[derive(Clone, Debug)]
struct Node {
    /// Mean position, weighted by power.
    center: Vec3,
    /// Radius of the sphere about `center` that contains all lights with their sizes.
    radius: f32,
    /// π times the sum of the colours, summed over the channels.
    power: f32,
    /// Constant, linear and quadratic attenuation coefficients: means weighted by power.
    attenuation: [f32; 3],
    /// The largest range.
    range: f32,
    /// Mean axis, weighted by power: a unit vector, or zero.
    axis: Vec3,
    /// Cosine of the half angle of a cone about `axis` that contains all emission; -1 if it has every direction.
    cosine: f32,
    kind: NodeKind,
}

/// Factor on the weight of a node outside of its lights' cones, and lower bound of the factor near the end of their
/// range: the bounds of a group are not exact, so that some light may arrive nevertheless.
const OUTSIDE: f32 = 0.01;

impl LightTree {
    /// Builds the hierarchy over `members`, indices of `lights`.
    pub fn new(lights: &[PlacedLight], mut members: Vec<u32>, space: Canonical) -> Self {
        let mut tree = Self { nodes: Vec::with_capacity(2 * members.len()) };
        if !members.is_empty() {
            tree.add(lights, &mut members, space);
        }
        tree
    }

    /// Adds the subtree over `members`.
    fn add(&mut self, lights: &[PlacedLight], members: &mut [u32], space: Canonical) -> u32 {
        let index = self.nodes.len() as u32;
        self.nodes.push(Node::new(lights, members, space));
        if members.len() > 1 {
            let half = split_at_median(members, |light| space.position(lights[*light as usize].position));
            let (near, far) = members.split_at_mut(half);
            let children = [self.add(lights, near, space), self.add(lights, far, space)];
            self.nodes[index as usize].kind = NodeKind::Inner(children);
        }
        index
    }

    /// The node of all lights; `None` if there are no lights.
    pub fn root(&self) -> Option<u32> {
        (!self.nodes.is_empty()).then_some(0)
    }

    /// The two children of a node, or, for a leaf, the index of its light.
    pub fn children(&self, index: u32) -> Result<[u32; 2], u32> {
        match self.nodes[index as usize].kind {
            NodeKind::Leaf(light) => Err(light),
            NodeKind::Inner(children) => Ok(children),
        }
    }

    /// The [`apparent_sine`] of a node's bounding sphere.
    pub fn sine(&self, index: u32, receiver: &Receiver, reach: f32) -> f32 {
        let node = &self.nodes[index as usize];
        apparent_sine(node.center, node.radius, receiver, reach)
    }

    /// The distance from a receiver to a node's bounding sphere; 0 inside.
    pub fn distance(&self, index: u32, receiver: &Receiver) -> f32 {
        let node = &self.nodes[index as usize];
        distance_to_sphere(node.center, node.radius, receiver)
    }

    /// Samples a light of a node by `u` in [0, 1), about in proportion to the light that it brings to the receiver;
    /// also returns its probability. `None` if the descent reaches a node none of whose lights reaches as far as the
    /// receiver.
    pub fn pick(&self, index: u32, receiver: &Receiver, mut u: f32) -> Option<(u32, f32)> {
        let (mut index, mut probability) = (index, 1.0f32);
        loop {
            let [near, far] = match self.nodes[index as usize].kind {
                NodeKind::Leaf(light) => return Some((light, probability)),
                NodeKind::Inner(children) => children,
            };
            let [a, b] = [near, far].map(|child| self.weight(child, receiver, 0.0));
            if a + b <= 0.0 {
                return None;
            }
            let first = if (a + b).is_finite() { a / (a + b) } else { 0.5 };
            (index, u) = if u < first { (near, u / first) } else { (far, (u - first) / (1.0 - first)) };
            probability *= if index == near { first } else { 1.0 - first };
            u = clamp_below_one(u);
        }
    }

    /// Estimates the irradiance, summed over the channels, that a node brings to receivers within `reach` of the given
    /// one. It is 0 only if no light of the node arrives at any of them.
    pub fn weight(&self, index: u32, receiver: &Receiver, reach: f32) -> f32 {
        let node = &self.nodes[index as usize];
        let towards = node.center - receiver.position;
        let (to_center, size) = (towards.length_squared(), node.radius + reach);
        if to_center > (node.range + size).powi(2) {
            return 0.0;
        }
        let squared = to_center + size * size;
        let distance = squared.sqrt();
        let direction = towards.normalize_or_zero();
        let subtends = size / distance.max(f32::MIN_POSITIVE);
        let receives = (direction.dot(receiver.normal) + subtends).clamp(MIN_COSINE, 1.0);
        let [constant, linear, quadratic] = node.attenuation;
        let divisor = constant + linear * distance + quadratic * squared;
        // A sine is less than its angle, so this test is slightly too narrow; lights that it misses still count by
        // `OUTSIDE`.
        let is_inside = node.cosine <= -1.0 || node.cosine - 1.5 * subtends <= -direction.dot(node.axis);
        // The attenuation window that closes at the range, for the nearest point of the bounding sphere.
        let window = 1.0 - ((distance - size).max(0.0) / node.range).powi(4);
        let cone = if is_inside { 1.0 } else { OUTSIDE };
        let weight = node.power * receives * window.max(OUTSIDE) * cone / divisor;
        // At the position of a light, the weight is infinite or undefined.
        if weight.is_nan() { f32::MAX } else { weight.clamp(f32::MIN_POSITIVE, f32::MAX) }
    }
}

impl Node {
    /// A node over `members`, without children.
    fn new(lights: &[PlacedLight], members: &[u32], space: Canonical) -> Self {
        let light_at = |&index: &u32| &lights[index as usize];
        let light_power = |placed: &PlacedLight| f64::from(placed.light.diffuse.element_sum());
        let power: f64 = members.iter().map(light_at).map(light_power).sum();
        let share = |placed: &PlacedLight| if power > 0.0 { light_power(placed) / power } else { 0.0 };
        let (mut center, mut axis, mut attenuation) = (DVec3::ZERO, DVec3::ZERO, [0.0f64; 3]);
        let mut range = 0.0f32;
        for placed in members.iter().map(light_at) {
            let share = share(placed);
            center += share * space.place(placed.position);
            axis += share * placed.axis;
            // From metres to canonical units.
            let coefficients = placed.light.attenuation.coefficients().as_dvec3().to_array();
            for (power, (sum, coefficient)) in attenuation.iter_mut().zip(coefficients).enumerate() {
                *sum += share * coefficient * space.scale.powi(-(power as i32));
            }
            let light_range = f64::from(placed.light.attenuation.range) * space.scale;
            // An invalid range, one that is not above 0, counts as no limit.
            range = range.max(if light_range > 0.0 { light_range as f32 } else { f32::INFINITY });
        }
        let axis = axis.normalize_or_zero();
        let mut angle = 0.0f64;
        let mut radius = 0.0f64;
        for placed in members.iter().map(light_at) {
            let size = f64::from(placed.light.radius.max(0.0)) * space.scale;
            radius = radius.max(space.place(placed.position).distance(center) + size);
            angle = angle.max(cutoff(placed) + axis.angle_between(placed.axis));
        }
        let is_everywhere = axis == DVec3::ZERO || angle.is_nan() || angle >= std::f64::consts::PI;
        Self {
            center: center.as_vec3(),
            radius: radius as f32,
            power: PI * power as f32,
            attenuation: attenuation.map(|coefficient| coefficient as f32),
            range,
            axis: axis.as_vec3(),
            cosine: if is_everywhere { -1.0 } else { angle.cos() as f32 },
            kind: NodeKind::Leaf(members.first().copied().unwrap_or(0)),
        }
    }
}

/// The angle from a light's axis beyond which it emits no light, radians.
fn cutoff(placed: &PlacedLight) -> f64 {
    match placed.light.spot.filter(|cone| !cone.is_everywhere()) {
        Some(cone) => f64::from(cone.outer_angle()),
        None => std::f64::consts::PI,
    }
}

/// Whether a light has a position, so that it can be in the hierarchy.
pub(crate) fn has_position(placed: &PlacedLight) -> bool {
    placed.light.kind != LightKind::Directional
}
