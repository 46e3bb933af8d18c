//! Triangles in double precision, and a bounding volume hierarchy for ray casts against them.

use std::sync::Arc;

use glam::{DVec2, DVec3};
use lumbre_scene::Image;

pub struct Triangle {
    pub a: DVec3,
    pub ab: DVec3,
    pub ac: DVec3,
    pub normal: DVec3,
    pub area: f64,
    pub reflectance: DVec3,
    /// The reflectance of its back side; 0 for a surface with one side.
    pub back_reflectance: DVec3,
    /// The share of the light that passes it in a straight line, from either side; 0 if it is opaque.
    pub transmission: DVec3,
    pub emission: DVec3,
    /// A texture that multiplies the emission, and the texture coordinates of the corners.
    pub picture: Option<(Arc<Image>, [DVec2; 3])>,
    /// The index of the mesh in the query, and the index of the triangle in that mesh.
    pub source: [usize; 2],
}

struct Node {
    low: DVec3,
    high: DVec3,
    /// In a leaf, the first of its `count` triangles. In an inner node, whose `count` is 0, the index of its second
    /// child; the first child directly follows the node.
    first: usize,
    count: usize,
}

#[derive(Clone, Copy)]
pub struct Hit {
    pub distance: f64,
    pub triangle: usize,
}

pub struct Hierarchy {
    pub triangles: Vec<Triangle>,
    nodes: Vec<Node>,
    /// Whether light passes any of the triangles.
    has_sheets: bool,
}

impl Triangle {
    /// The point of two uniform numbers; it is uniformly distributed over the triangle.
    pub fn point(&self, u: f64, v: f64) -> DVec3 {
        let root = u.sqrt();
        self.a + self.ab * (root * (1.0 - v)) + self.ac * (root * v)
    }

    /// Intersects a ray with the triangle from both sides (Möller and Trumbore) and returns the distance.
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

    /// The point with these barycentric coordinates with respect to the second and third corner.
    pub fn at(&self, barycentric: DVec2) -> DVec3 {
        self.a + self.ab * barycentric.x + self.ac * barycentric.y
    }

    pub fn longest_edge(&self) -> f64 {
        self.ab.length().max(self.ac.length()).max((self.ac - self.ab).length())
    }

    /// The barycentric coordinates of a point of the plane with respect to the second and third corner.
    pub fn barycentric(&self, point: DVec3) -> DVec2 {
        let d = point - self.a;
        let size = 2.0 * self.area;
        DVec2::new(d.cross(self.ac).dot(self.normal), self.ab.cross(d).dot(self.normal)) / size
    }

    fn corners(&self) -> [DVec3; 3] {
        [self.a, self.a + self.ab, self.a + self.ac]
    }

    fn middle(&self) -> DVec3 {
        self.a + (self.ab + self.ac) / 3.0
    }
}

impl Hierarchy {
    pub fn new(mut triangles: Vec<Triangle>) -> Self {
        let mut nodes = Vec::new();
        let count = triangles.len();
        build(&mut triangles, 0, count, &mut nodes);
        let has_sheets = triangles.iter().any(|triangle| triangle.transmission != DVec3::ZERO);
        Self { triangles, nodes, has_sheets }
    }

    /// The lowest and the highest corner of the bounding box of all triangles.
    pub fn bounds(&self) -> [DVec3; 2] {
        [self.nodes[0].low, self.nodes[0].high]
    }

    /// Whether a triangle blocks the segment between two points.
    pub fn hidden(&self, from: DVec3, to: DVec3) -> bool {
        self.intersect(from, to - from, 1.0, true).is_some()
    }

    /// The share of the light that reaches a point from another one.
    pub fn transmission(&self, from: DVec3, to: DVec3) -> DVec3 {
        self.transmission_up_to(from, to - from, 1.0)
    }

    /// The share of the light that reaches a point from a direction.
    pub fn transmission_along(&self, from: DVec3, direction: DVec3) -> DVec3 {
        self.transmission_up_to(from, direction, f64::INFINITY)
    }

    fn transmission_up_to(&self, from: DVec3, direction: DVec3, max_distance: f64) -> DVec3 {
        if !self.has_sheets {
            let hidden = self.intersect(from, direction, max_distance, true).is_some();
            return if hidden { DVec3::ZERO } else { DVec3::ONE };
        }
        // Every triangle is tested: such scenes are small.
        let crossed = |triangle: &&Triangle| {
            triangle.hit(from, direction).is_some_and(|distance| distance > 0.0 && distance < max_distance)
        };
        self.triangles.iter().filter(crossed).map(|triangle| triangle.transmission).product()
    }

    pub fn closest(&self, origin: DVec3, direction: DVec3) -> Option<Hit> {
        self.intersect(origin, direction, f64::INFINITY, false)
    }

    /// Returns the closest hit nearer than `max_distance`, or the first one found if `any` is set.
    fn intersect(&self, origin: DVec3, direction: DVec3, mut max_distance: f64, any: bool) -> Option<Hit> {
        let inverse = direction.recip();
        let mut stack = [0usize; 64];
        let mut depth = 1;
        let mut closest = None;
        while depth > 0 {
            depth -= 1;
            let index = stack[depth];
            let node = &self.nodes[index];
            let (s, t) = ((node.low - origin) * inverse, (node.high - origin) * inverse);
            let enters = s.min(t).max_element();
            let leaves = s.max(t).min_element();
            if enters > leaves * (1.0 + 1e-9) || leaves < 0.0 || enters > max_distance {
                continue;
            }
            if node.count == 0 {
                stack[depth] = index + 1;
                stack[depth + 1] = node.first;
                depth += 2;
                continue;
            }
            for triangle in node.first..node.first + node.count {
                let hit =
                    self.triangles[triangle].hit(origin, direction).filter(|&t| t > 0.0 && t < max_distance);
                if let Some(distance) = hit {
                    max_distance = distance;
                    closest = Some(Hit { distance, triangle });
                    if any {
                        return closest;
                    }
                }
            }
        }
        closest
    }
}

/// Splits the triangles at the median along the longest axis, recursively, in depth-first order.
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
