//! Chooses one of many emissive triangles for a surface point, by a tree of bounds on where they are, how much
//! they emit and in which directions. After Conty Estevez and Kulla, "Importance Sampling of Many Lights with
//! Adaptive Tree Splitting", 2018, without their splitting, and pbrt-v4, section 12.6.3. Not the choice of a
//! point on the triangle: that is `light_sampling`'s.
//!
//! The estimate of a node affects the noise alone. It is 0 only where none of its triangles sends unoccluded
//! light, and the probability of every choice can be evaluated afterwards, for multiple importance sampling.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use glam::DVec3;

/// An emissive triangle as the tree sees it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EmitterBounds {
    pub low: DVec3,
    pub high: DVec3,
    /// Radiance times area, with both sides' radiance added up.
    pub power: f64,
    /// Unit vector to the side that emits.
    pub normal: DVec3,
    /// Whether both sides emit.
    pub two_sided: bool,
}

/// A binary tree over emissive triangles, each of which is a leaf.
#[derive(Debug, Default)]
pub(crate) struct EmitterTree {
    /// The root is the last element; children come before their parents.
    nodes: Vec<Node>,
    /// The leaf of each emitter, by the emitter's index.
    leaves: Vec<u32>,
}

#[derive(Debug)]
struct Node {
    center: DVec3,
    /// Radius of the sphere around the bounding box.
    radius: f64,
    power: f64,
    cone: NormalCone,
    /// Half the opening angle of the cone.
    cone_angle: Angle,
    two_sided: bool,
    parent: Option<u32>,
    contents: Contents,
}

#[derive(Clone, Copy, Debug)]
enum Contents {
    Emitter(u32),
    Children([u32; 2]),
}

/// A cone of directions that contains the normals of all triangles of a node.
#[derive(Clone, Copy, Debug)]
struct NormalCone {
    /// Unit vector.
    axis: DVec3,
    /// Half of its opening angle in [0, π].
    angle: f64,
}

/// The number of places at which a set of triangles may be split along each axis, plus one.
const BUCKETS: usize = 12;

impl EmitterTree {
    pub fn new(emitters: &[EmitterBounds]) -> Self {
        let mut tree = Self { nodes: Vec::new(), leaves: vec![0; emitters.len()] };
        let mut order: Vec<u32> = (0..emitters.len() as u32).collect();
        if !order.is_empty() {
            tree.add(emitters, &mut order);
        }
        tree
    }

    /// Chooses an emitter by `choice` in [0, 1) for a point and the normal of the surface there. Returns its
    /// index and the probability of choosing it; `None` if no emitter's unoccluded light arrives.
    pub fn choose(&self, point: DVec3, normal: DVec3, mut choice: f64) -> Option<(usize, f64)> {
        let mut node = self.nodes.last()?;
        let mut chance = 1.0;
        loop {
            let children = match node.contents {
                Contents::Emitter(emitter) => return (chance > 0.0).then_some((emitter as usize, chance)),
                Contents::Children(children) => children.map(|child| &self.nodes[child as usize]),
            };
            let [first, second] = children.map(|child| child.importance(point, normal));
            if first + second <= 0.0 {
                return None;
            }
            let share = first / (first + second);
            let (from, part, child) =
                if choice < share { (0.0, share, children[0]) } else { (share, 1.0 - share, children[1]) };
            choice = ((choice - from) / part).clamp(0.0, 1.0 - f64::EPSILON / 2.0);
            chance *= part;
            node = child;
        }
    }

    /// Returns the probability with which [`choose`](Self::choose) chooses an emitter for a point and a normal.
    pub fn chance(&self, emitter: usize, point: DVec3, normal: DVec3) -> f64 {
        let mut at = self.leaves[emitter];
        let mut chance = 1.0;
        while let Some(parent) = self.nodes[at as usize].parent {
            let Contents::Children(children) = self.nodes[parent as usize].contents else { return 0.0 };
            let [first, second] = children.map(|child| self.nodes[child as usize].importance(point, normal));
            let share = first / (first + second);
            // As `choose` computes it, to the bit.
            chance *= if children[0] == at { share } else { 1.0 - share };
            at = parent;
        }
        if chance.is_finite() { chance } else { 0.0 }
    }

    /// Adds the node over some emitters, after all nodes within it. Returns its index.
    fn add(&mut self, emitters: &[EmitterBounds], some: &mut [u32]) -> u32 {
        let bounds = Bounds::over(emitters, some);
        let contents = match *some {
            [emitter] => Contents::Emitter(emitter),
            _ => {
                let half = split(emitters, some, &bounds);
                let (left, right) = some.split_at_mut(half);
                Contents::Children([self.add(emitters, left), self.add(emitters, right)])
            }
        };
        let own = self.nodes.len() as u32;
        match contents {
            Contents::Emitter(emitter) => self.leaves[emitter as usize] = own,
            Contents::Children(children) => {
                children.iter().for_each(|&child| self.nodes[child as usize].parent = Some(own));
            }
        }
        self.nodes.push(Node {
            center: 0.5 * (bounds.low + bounds.high),
            radius: 0.5 * (bounds.high - bounds.low).length(),
            power: bounds.power,
            cone: bounds.cone,
            cone_angle: Angle { cosine: bounds.cone.angle.cos(), sine: bounds.cone.angle.sin() },
            two_sided: bounds.two_sided,
            parent: None,
            contents,
        });
        own
    }
}

impl Node {
    /// Estimates the unoccluded irradiance that the triangles bring to a surface point, up to a common factor.
    fn importance(&self, point: DVec3, normal: DVec3) -> f64 {
        let to = self.center - point;
        let distance_squared = to.length_squared();
        let distance = distance_squared.sqrt();
        if distance <= self.radius {
            return self.power / (self.radius * self.radius).max(f64::MIN_POSITIVE);
        }
        let direction = to / distance;
        // Directions to the triangles differ from that to the centre by at most this angle.
        let spread = Angle::from_sine(self.radius / distance);
        let emitted = -direction.dot(self.cone.axis);
        let emitted = Angle::from_cosine(if self.two_sided { emitted.abs() } else { emitted });
        let emitted = emitted.minus(self.cone_angle).minus(spread);
        let received = Angle::from_cosine(direction.dot(normal)).minus(spread);
        if emitted.cosine <= 0.0 || received.cosine <= 0.0 {
            return 0.0;
        }
        self.power * emitted.cosine * received.cosine / distance_squared
    }
}

/// An angle in [0, π] by its cosine and sine, as no trigonometric function is cheap enough for every node.
#[derive(Clone, Copy, Debug)]
struct Angle {
    cosine: f64,
    sine: f64,
}

impl Angle {
    fn from_cosine(cosine: f64) -> Self {
        let cosine = cosine.clamp(-1.0, 1.0);
        Self { cosine, sine: ((1.0 - cosine) * (1.0 + cosine)).sqrt() }
    }

    /// An acute angle.
    fn from_sine(sine: f64) -> Self {
        let sine = sine.clamp(0.0, 1.0);
        Self { cosine: ((1.0 - sine) * (1.0 + sine)).sqrt(), sine }
    }

    /// The difference, or 0 where the other angle is larger.
    fn minus(self, other: Self) -> Self {
        if self.cosine > other.cosine {
            return Self { cosine: 1.0, sine: 0.0 };
        }
        Self {
            cosine: self.cosine * other.cosine + self.sine * other.sine,
            sine: self.sine * other.cosine - self.cosine * other.sine,
        }
    }
}

/// What a node says of its triangles.
#[derive(Clone, Copy)]
struct Bounds {
    low: DVec3,
    high: DVec3,
    power: f64,
    cone: NormalCone,
    two_sided: bool,
}

impl Bounds {
    fn of(emitter: &EmitterBounds) -> Self {
        let cone = NormalCone { axis: emitter.normal, angle: 0.0 };
        let EmitterBounds { low, high, power, two_sided, .. } = *emitter;
        Self { low, high, power, cone, two_sided }
    }

    fn over(emitters: &[EmitterBounds], some: &[u32]) -> Self {
        let each = some.iter().map(|&emitter| Self::of(&emitters[emitter as usize]));
        each.reduce(Self::with).unwrap_or(Self {
            low: DVec3::ZERO,
            high: DVec3::ZERO,
            power: 0.0,
            cone: NormalCone { axis: DVec3::Z, angle: 0.0 },
            two_sided: false,
        })
    }

    fn with(self, other: Self) -> Self {
        Self {
            low: self.low.min(other.low),
            high: self.high.max(other.high),
            power: self.power + other.power,
            cone: self.cone.with(other.cone),
            two_sided: self.two_sided || other.two_sided,
        }
    }

    /// The cost of sampling these triangles together: their power, times the surface of their bounding box,
    /// times a measure of the directions that they emit into (pbrt-v4, section 12.6.3). `along` is the ratio by
    /// which a thin box is to be split along its length first.
    fn cost(&self, along: f64) -> f64 {
        let size = self.high - self.low;
        let surface = 2.0 * (size.x * size.y + size.y * size.z + size.z * size.x);
        let (angle, widest) = (self.cone.angle, (self.cone.angle + FRAC_PI_2).min(PI));
        let directions = TAU * (1.0 - angle.cos())
            + FRAC_PI_2
                * (2.0 * widest * angle.sin() - (angle - 2.0 * widest).cos() - 2.0 * angle * angle.sin()
                    + angle.cos());
        self.power * directions * along * surface
    }
}

impl NormalCone {
    /// The smallest cone that contains both.
    fn with(self, other: Self) -> Self {
        let (wide, narrow) = if self.angle >= other.angle { (self, other) } else { (other, self) };
        let between = wide.axis.dot(narrow.axis).clamp(-1.0, 1.0).acos();
        if (between + narrow.angle).min(PI) <= wide.angle {
            return wide;
        }
        let angle = 0.5 * (wide.angle + between + narrow.angle);
        let across = wide.axis.cross(narrow.axis).try_normalize();
        match across {
            Some(across) if angle < PI => {
                let turned = glam::DQuat::from_axis_angle(across, angle - wide.angle) * wide.axis;
                Self { axis: turned.normalize_or(wide.axis), angle }
            }
            _ => Self { axis: wide.axis, angle: PI },
        }
    }
}

/// Orders some emitters in two groups that are cheap to sample; returns how many are in the first.
fn split(emitters: &[EmitterBounds], some: &mut [u32], whole: &Bounds) -> usize {
    let center = |emitter: u32| {
        let bounds = &emitters[emitter as usize];
        0.5 * (bounds.low + bounds.high)
    };
    let low = some.iter().map(|&emitter| center(emitter)).fold(DVec3::INFINITY, DVec3::min);
    let high = some.iter().map(|&emitter| center(emitter)).fold(DVec3::NEG_INFINITY, DVec3::max);
    let size = whole.high - whole.low;
    let mut best: Option<(f64, usize, usize)> = None;
    let bucket = |emitter: u32, axis: usize| {
        let place = (center(emitter)[axis] - low[axis]) / (high[axis] - low[axis]);
        ((place * BUCKETS as f64) as usize).min(BUCKETS - 1)
    };
    for axis in (0..3).filter(|&axis| high[axis] > low[axis]) {
        let mut buckets: [Option<Bounds>; BUCKETS] = [None; BUCKETS];
        for &emitter in some.iter() {
            let own = Bounds::of(&emitters[emitter as usize]);
            let slot = &mut buckets[bucket(emitter, axis)];
            *slot = Some(slot.map_or(own, |sum| sum.with(own)));
        }
        let along = size.max_element() / size[axis].max(f64::MIN_POSITIVE);
        for first in 1..BUCKETS {
            let side = |buckets: &[Option<Bounds>]| buckets.iter().flatten().copied().reduce(Bounds::with);
            let (left, right) = buckets.split_at(first);
            let (Some(left), Some(right)) = (side(left), side(right)) else { continue };
            let cost = left.cost(along) + right.cost(along);
            if cost.is_finite() && best.is_none_or(|(least, ..)| cost < least) {
                best = Some((cost, axis, first));
            }
        }
    }
    let Some((_, axis, first)) = best else { return some.len() / 2 };
    some.sort_by_key(|&emitter| (bucket(emitter, axis) >= first, emitter));
    some.partition_point(|&emitter| bucket(emitter, axis) < first)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Numbers;

    /// Triangles' bounds of all sizes, powers and directions, some of them two-sided, some in one place.
    fn emitters(numbers: &mut Numbers, count: usize) -> Vec<EmitterBounds> {
        let vector = |numbers: &mut Numbers| DVec3::new(numbers.next(), numbers.next(), numbers.next()) - 0.5;
        (0..count)
            .map(|index| {
                let low = if index % 7 == 0 { DVec3::splat(2.0) } else { 10.0 * vector(numbers) };
                let high = low + vector(numbers).abs();
                let normal = vector(numbers).normalize_or(DVec3::Z);
                let power = 0.01 + numbers.next().powi(4);
                EmitterBounds { low, high, power, normal, two_sided: numbers.next() < 0.3 }
            })
            .collect()
    }

    #[test]
    fn probabilities_are_those_of_the_choice_and_sum_to_one() {
        let mut numbers = Numbers::new(3, 0, 0);
        for count in [1, 2, 3, 50, 400] {
            let emitters = emitters(&mut numbers, count);
            let tree = EmitterTree::new(&emitters);
            for _ in 0..50 {
                let point = 16.0 * (DVec3::new(numbers.next(), numbers.next(), numbers.next()) - 0.5);
                let normal = (DVec3::new(numbers.next(), numbers.next(), numbers.next()) - 0.5).normalize();
                let sum: f64 = (0..count).map(|emitter| tree.chance(emitter, point, normal)).sum();
                assert!((0.0..=1.0 + 1e-9).contains(&sum), "{sum}");
                for _ in 0..20 {
                    let Some((emitter, chance)) = tree.choose(point, normal, numbers.next()) else {
                        continue;
                    };
                    let evaluated = tree.chance(emitter, point, normal);
                    assert!((evaluated - chance).abs() <= 1e-12 * chance, "{evaluated} for {chance}");
                }
            }
        }
    }

    /// Where no node is left out, every choice ends at an emitter.
    #[test]
    fn frequencies_are_the_probabilities() {
        let mut numbers = Numbers::new(5, 0, 0);
        let emitters = emitters(&mut numbers, 20);
        let tree = EmitterTree::new(&emitters);
        let (point, normal) = (DVec3::new(1.0, -2.0, 3.0), DVec3::Y);
        let mut counts = [0u32; 20];
        let draws = 200_000;
        for _ in 0..draws {
            if let Some((emitter, _)) = tree.choose(point, normal, numbers.next()) {
                counts[emitter] += 1;
            }
        }
        for (emitter, count) in counts.into_iter().enumerate() {
            let chance = tree.chance(emitter, point, normal);
            let error = (chance * (1.0 - chance) / f64::from(draws)).sqrt();
            let found = f64::from(count) / f64::from(draws);
            assert!((found - chance).abs() <= 5.0 * error + 1e-12, "{emitter}: {found} for {chance}");
        }
    }

    /// A node's estimate is above 0 wherever one of its triangles faces a point above the horizon.
    #[test]
    fn no_emitter_that_shines_on_a_point_is_left_out() {
        let mut numbers = Numbers::new(7, 0, 0);
        let emitters = emitters(&mut numbers, 300);
        let tree = EmitterTree::new(&emitters);
        for _ in 0..200 {
            let point = 16.0 * (DVec3::new(numbers.next(), numbers.next(), numbers.next()) - 0.5);
            let normal = (DVec3::new(numbers.next(), numbers.next(), numbers.next()) - 0.5).normalize();
            for (index, emitter) in emitters.iter().enumerate() {
                let to = 0.5 * (emitter.low + emitter.high) - point;
                let faces = -to.dot(emitter.normal);
                let shines = to.dot(normal) > 0.0 && (faces > 0.0 || emitter.two_sided && faces != 0.0);
                let chance = tree.chance(index, point, normal);
                assert!(!shines || chance > 0.0, "{index} shines on {point} and is never chosen");
            }
        }
    }
}
