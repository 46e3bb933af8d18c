//! Converged irradiance at points of a world's surfaces: f64, next-event estimation, Russian roulette, a bounding volume
//! hierarchy of its own. Front sides are diffuse, emitters one-sided, back sides black. Shares no code with the baker.

use std::f64::consts::{PI, TAU};

use bevy_ecs::world::World;
use glam::DVec3;
use lumbre_optics::{Light, Material};
use lumbre_scene::{GlobalTransform, Mesh, StaticObject};
use rayon::prelude::*;

use super::random::Random;

pub struct Triangle {
    a: DVec3,
    ab: DVec3,
    ac: DVec3,
    normal: DVec3,
    area: f64,
    reflectance: DVec3,
    emission: DVec3,
}

struct Node {
    low: DVec3,
    high: DVec3,
    /// Triangles from here, `count` of them; inner nodes have none, their first child follows and the second is here.
    first: usize,
    count: usize,
}

pub struct PathTracer {
    triangles: Vec<Triangle>,
    nodes: Vec<Node>,
    /// Place and intensity (W/sr).
    lights: Vec<(DVec3, DVec3)>,
    /// Emissive triangles and the sum of their powers' weights up to each.
    emitters: Vec<(usize, f64)>,
    offset: f64,
}

/// A point and its irradiance with standard errors, W/m².
pub struct Irradiance {
    pub position: DVec3,
    pub normal: DVec3,
    pub value: DVec3,
    pub error: DVec3,
}

struct Hit {
    distance: f64,
    triangle: usize,
}

impl PathTracer {
    pub fn new(world: &mut World) -> Self {
        lumbre_scene::update_transforms(world);
        let mut triangles = Vec::new();
        let mut meshes = world
            .query_filtered::<(&Mesh, &Material, &GlobalTransform), bevy_ecs::prelude::With<StaticObject>>();
        for (mesh, material, transform) in meshes.iter(world) {
            let mirrored = transform.0.matrix3.determinant() < 0.0;
            for corners in mesh.0.triangles() {
                let [a, mut b, mut c] =
                    corners.map(|v| transform.0.transform_point3(mesh.0.positions[v as usize].as_dvec3()));
                if mirrored {
                    (b, c) = (c, b);
                }
                let cross = (b - a).cross(c - a);
                let Some(normal) = cross.try_normalize() else { continue };
                triangles.push(Triangle {
                    a,
                    ab: b - a,
                    ac: c - a,
                    normal,
                    area: cross.length() / 2.0,
                    reflectance: material.front.diffuse.as_dvec3(),
                    emission: material.front.emission.as_dvec3(),
                });
            }
        }
        let lights = world
            .query::<(&Light, &GlobalTransform)>()
            .iter(world)
            .map(|(light, place)| (place.translation(), light.diffuse.as_dvec3() * PI))
            .collect();
        let mut nodes = Vec::new();
        let count = triangles.len();
        build(&mut triangles, 0, count, &mut nodes);
        let mut weight = 0.0;
        let mut emitters = Vec::new();
        for (index, triangle) in triangles.iter().enumerate() {
            if triangle.emission != DVec3::ZERO {
                weight += triangle.emission.element_sum() * triangle.area;
                emitters.push((index, weight));
            }
        }
        let offset = 1e-9 * (nodes[0].high - nodes[0].low).length();
        Self { triangles, nodes, lights, emitters, offset }
    }

    /// Points uniform by area on what can be seen, and the irradiance there by `batches` of `side`² paths each.
    pub fn points(&self, count: usize, batches: usize, side: usize, seed: u64) -> Vec<Irradiance> {
        let mut sums = Vec::with_capacity(self.triangles.len());
        let mut sum = 0.0;
        for triangle in &self.triangles {
            sum += triangle.area;
            sums.push(sum);
        }
        let mut random = Random::new(seed);
        let mut places = Vec::new();
        while places.len() < count {
            let chosen = random.uniform() * sum;
            let triangle = &self.triangles[sums.partition_point(|&sum| sum <= chosen).min(sums.len() - 1)];
            let position = triangle.point(random.uniform(), random.uniform());
            // In the open: most of what it sees are fronts (not the outside of the walls, nor what stands on something).
            let seen = (0..64).filter(|_| {
                let direction = cosine(triangle.normal, random.uniform(), random.uniform());
                self.closest(position + triangle.normal * self.offset, direction)
                    .is_some_and(|hit| self.triangles[hit.triangle].normal.dot(direction) < 0.0)
            });
            if seen.count() > 32 {
                places.push((position, triangle.normal));
            }
        }
        self.at(&places, batches, side, seed)
    }

    /// Irradiance at places with their normals.
    pub fn at(&self, places: &[(DVec3, DVec3)], batches: usize, side: usize, seed: u64) -> Vec<Irradiance> {
        let irradiance = |(index, &(position, normal)): (usize, &(DVec3, DVec3))| {
            let mut random = Random::new(seed ^ ((index as u64 + 1) << 20));
            let (mut sum, mut squares) = (DVec3::ZERO, DVec3::ZERO);
            for _ in 0..batches {
                let value = self.batch(position, normal, side, &mut random);
                sum += value;
                squares += value * value;
            }
            let n = batches as f64;
            let value = sum / n;
            let variance = (squares / n - value * value).max(DVec3::ZERO) / (n - 1.0);
            let error = DVec3::from_array(variance.to_array().map(f64::sqrt));
            Irradiance { position, normal, value, error }
        };
        places.par_iter().enumerate().map(irradiance).collect()
    }

    /// An unbiased estimate by a jittered grid of first directions, and one of places on the lamps.
    fn batch(&self, position: DVec3, normal: DVec3, side: usize, random: &mut Random) -> DVec3 {
        let origin = position + normal * self.offset;
        let mut bounced = DVec3::ZERO;
        let mut direct = DVec3::ZERO;
        for cell in 0..side * side {
            let mut jitter = |cell: usize| (cell as f64 + random.uniform()) / side as f64;
            let (s, t) = (jitter(cell % side), jitter(cell / side));
            let (u, v) = (jitter(cell % side), jitter(cell / side));
            direct += self.lamp(origin, normal, s, t);
            bounced += PI * self.radiance(origin, cosine(normal, u, v), random);
        }
        direct /= (side * side) as f64;
        for light in &self.lights {
            direct += self.light(origin, normal, *light);
        }
        direct + bounced / (side * side) as f64
    }

    /// Reflected (not emitted) radiance that comes from a direction.
    fn radiance(&self, mut origin: DVec3, mut direction: DVec3, random: &mut Random) -> DVec3 {
        let (mut sum, mut weight) = (DVec3::ZERO, DVec3::ONE);
        for bounce in 1.. {
            let Some(hit) = self.closest(origin, direction) else { break };
            let triangle = &self.triangles[hit.triangle];
            let normal = triangle.normal;
            if normal.dot(direction) >= 0.0 {
                break;
            }
            weight *= triangle.reflectance;
            origin = origin + direction * hit.distance + normal * self.offset;
            let direct = self.lamp(origin, normal, random.uniform(), random.uniform())
                + self.one_light(origin, normal, random.uniform());
            sum += weight * direct / PI;
            if bounce > 2 {
                let survives = weight.max_element().min(0.95);
                if random.uniform() >= survives {
                    break;
                }
                weight /= survives;
            }
            direction = cosine(normal, random.uniform(), random.uniform());
        }
        sum
    }

    /// Irradiance by one place of one emitter, chosen by power.
    fn lamp(&self, origin: DVec3, normal: DVec3, choice: f64, v: f64) -> DVec3 {
        let Some(&(_, total)) = self.emitters.last() else { return DVec3::ZERO };
        let chosen = choice * total;
        let index = self.emitters.partition_point(|&(_, sum)| sum <= chosen).min(self.emitters.len() - 1);
        let before = if index == 0 { 0.0 } else { self.emitters[index - 1].1 };
        let (triangle, after) = self.emitters[index];
        // What is left of the choice is as good as a number of its own, and keeps its stratum.
        let triangle = &self.triangles[triangle];
        let target = triangle.point((chosen - before) / (after - before), v);
        let towards = target - origin;
        let squared = towards.length_squared();
        let direction = towards / squared.sqrt();
        let cosines = normal.dot(direction).max(0.0) * (-triangle.normal.dot(direction)).max(0.0);
        if cosines <= 0.0 || self.hidden(origin, target + triangle.normal * self.offset) {
            return DVec3::ZERO;
        }
        triangle.emission * (cosines / squared * triangle.area * total / (after - before))
    }

    fn light(&self, origin: DVec3, normal: DVec3, (place, intensity): (DVec3, DVec3)) -> DVec3 {
        let light = unshadowed(origin, normal, place, intensity);
        if light == DVec3::ZERO || self.hidden(origin, place) { DVec3::ZERO } else { light }
    }

    /// Irradiance by one of the point lights, chosen by what it gives where nothing stands in the way.
    fn one_light(&self, origin: DVec3, normal: DVec3, choice: f64) -> DVec3 {
        let weight =
            |&(place, intensity): &(DVec3, DVec3)| unshadowed(origin, normal, place, intensity).element_sum();
        let total: f64 = self.lights.iter().map(weight).sum();
        let mut left = choice * total;
        for light in &self.lights {
            let own = weight(light);
            left -= own;
            if left < 0.0 {
                return self.light(origin, normal, *light) * (total / own);
            }
        }
        DVec3::ZERO
    }

    fn hidden(&self, from: DVec3, to: DVec3) -> bool {
        self.walk(from, to - from, 1.0, true).is_some()
    }

    fn closest(&self, origin: DVec3, direction: DVec3) -> Option<Hit> {
        self.walk(origin, direction, f64::INFINITY, false)
    }

    fn walk(&self, origin: DVec3, direction: DVec3, mut most: f64, any: bool) -> Option<Hit> {
        let inverse = direction.recip();
        let mut stack = [0usize; 64];
        let mut depth = 1;
        let mut found = None;
        while depth > 0 {
            depth -= 1;
            let index = stack[depth];
            let node = &self.nodes[index];
            let (s, t) = ((node.low - origin) * inverse, (node.high - origin) * inverse);
            let enters = s.min(t).max_element();
            let leaves = s.max(t).min_element();
            if enters > leaves * (1.0 + 1e-9) || leaves < 0.0 || enters > most {
                continue;
            }
            if node.count == 0 {
                stack[depth] = index + 1;
                stack[depth + 1] = node.first;
                depth += 2;
                continue;
            }
            for triangle in node.first..node.first + node.count {
                let hit = self.triangles[triangle].hit(origin, direction).filter(|&t| t > 0.0 && t < most);
                if let Some(distance) = hit {
                    most = distance;
                    found = Some(Hit { distance, triangle });
                    if any {
                        return found;
                    }
                }
            }
        }
        found
    }
}

fn unshadowed(origin: DVec3, normal: DVec3, place: DVec3, intensity: DVec3) -> DVec3 {
    let towards = place - origin;
    let squared = towards.length_squared();
    intensity * (normal.dot(towards).max(0.0) / (squared * squared.sqrt()))
}

/// A direction by the cosine about a normal.
fn cosine(normal: DVec3, u: f64, v: f64) -> DVec3 {
    let (right, up) = normal.any_orthonormal_pair();
    let (radius, angle) = (u.sqrt(), TAU * v);
    (right * (radius * angle.cos()) + up * (radius * angle.sin()) + normal * (1.0 - u).max(0.0).sqrt())
        .normalize()
}

impl Triangle {
    fn point(&self, u: f64, v: f64) -> DVec3 {
        let root = u.sqrt();
        self.a + self.ab * (root * (1.0 - v)) + self.ac * (root * v)
    }

    /// Möller and Trumbore, both sides.
    fn hit(&self, origin: DVec3, direction: DVec3) -> Option<f64> {
        let p = direction.cross(self.ac);
        let determinant = self.ab.dot(p);
        if determinant == 0.0 {
            return None;
        }
        let d = origin - self.a;
        let u = d.dot(p) / determinant;
        if !(-1e-12..=1.0 + 1e-12).contains(&u) {
            return None;
        }
        let q = d.cross(self.ab);
        let v = direction.dot(q) / determinant;
        (v >= -1e-12 && u + v <= 1.0 + 1e-12).then(|| self.ac.dot(q) / determinant)
    }

    fn corners(&self) -> [DVec3; 3] {
        [self.a, self.a + self.ab, self.a + self.ac]
    }

    fn middle(&self) -> DVec3 {
        self.a + (self.ab + self.ac) / 3.0
    }
}

/// Halves by the median along the longest axis; children follow their parent.
fn build(triangles: &mut [Triangle], first: usize, end: usize, nodes: &mut Vec<Node>) {
    let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for corner in triangles[first..end].iter().flat_map(Triangle::corners) {
        low = low.min(corner);
        high = high.max(corner);
    }
    let index = nodes.len();
    let count = end - first;
    nodes.push(Node { low, high, first, count: if count <= 2 { count } else { 0 } });
    if count <= 2 {
        return;
    }
    let size = high - low;
    let axis = (0..3).max_by(|&a, &b| size[a].total_cmp(&size[b])).unwrap_or(0);
    triangles[first..end].sort_by(|a, b| a.middle()[axis].total_cmp(&b.middle()[axis]));
    let middle = first + count / 2;
    build(triangles, first, middle, nodes);
    nodes[index].first = nodes.len();
    build(triangles, middle, end, nodes);
}
