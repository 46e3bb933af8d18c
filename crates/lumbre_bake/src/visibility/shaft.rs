//! Shaft culling: finds the triangles that may stand between a flat receiver and a source, those that reach into the
//! convex hull of both (Haines and Wallace, "Shaft Culling for Efficient Ray-Traced Radiosity", 1991). The test is
//! conservative: a triangle that is found may hide nothing, but one that is not found certainly hides nothing, and
//! where none is found no shadow ray is needed. `visible_part` and `shadow_clipping` compute how much the triangles
//! hide.

use glam::{DVec3, Vec3};

use crate::bounds::Bounds;
use crate::sampling::frame;
use crate::scene::BakeScene;

/// A parallelogram that contains a flat receiver.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Area {
    pub corners: [DVec3; 4],
    /// Unit normal of the receiving side.
    pub normal: DVec3,
}

/// Triangle of a triangle.
pub(crate) type Triangle = [DVec3; 3];

/// Distance relative to the coordinates up to which things count as touching: the offset of ray origins from surfaces.
const CONTACT: f64 = 16.0 / (1 << 24) as f64;

/// Distance along a unit normal up to which things with coordinates of size `extent` count as touching, despite
/// rounding.
pub(crate) fn contact(normal: DVec3, extent: f64) -> f64 {
    CONTACT * extent * normal.abs().element_sum()
}

/// A half-space: what has `normal · point` above `height` is outside.
#[derive(Clone, Copy, Debug)]
struct Plane {
    normal: DVec3,
    height: f64,
}

/// The bounding box of some points, in single precision.
fn bounds(points: &[DVec3]) -> Bounds<Vec3> {
    let Bounds::<DVec3> { low, high } = points.iter().copied().collect();
    Bounds { low: low.as_vec3(), high: high.as_vec3() }
}

/// Whether no triangle reaches into the box above an area that is as high as the area is wide and extends beyond it by
/// as much on each side. If so, all points of the area are inside geometry or all are outside.
pub(crate) fn is_free_before(area: &Area, scene: &BakeScene) -> bool {
    let [a, b, c, d] = area.corners;
    let (row, across) = (b - a, d - a);
    let wide = row.length().max(across.length());
    let lift = area.normal * wide;
    let (row, across) = (row.normalize_or_zero() * wide, across.normalize_or_zero() * wide);
    let base = [a - row - across, b + row - across, c + row + across, d - row + across];
    let points = [base[0], base[1], base[2], base[3]].map(|corner| [corner, corner + lift]);
    let points: [DVec3; 8] = std::array::from_fn(|at| points[at / 2][at % 2]);
    let extent = points.iter().map(|point| point.abs().max_element()).fold(0.0, f64::max);
    let sides = [area.normal, row.normalize_or_zero(), across.normalize_or_zero()];
    let mut tested = 0;
    scene.boxes.near_while(&bounds(&points), |index| {
        tested += 1;
        let triangle = &scene.triangles[index as usize];
        let corners = triangle.corners.map(|corner| corner.as_dvec3());
        let triangle_normal = triangle.normal.as_dvec3();
        // Separating axis test, with the box's axes and the triangle's normal.
        let is_beside = sides.into_iter().chain([triangle_normal]).any(|side| {
            let slack = contact(side, extent.max(f64::from(triangle.extent)));
            let range = |places: &[DVec3]| {
                places
                    .iter()
                    .map(|place| place.dot(side))
                    .fold((f64::MAX, f64::MIN), |(low, high), along| (low.min(along), high.max(along)))
            };
            let (of_box, of_triangle) = (range(&points), range(&corners));
            of_triangle.0 >= of_box.1 - slack || of_triangle.1 <= of_box.0 + slack
        });
        is_beside && tested <= MAX_TESTED
    })
}

/// The convex hull of a receiver's area and a source.
pub(crate) struct Shaft {
    /// The corners of the area, then those of the source.
    points: Vec<DVec3>,
    planes: Vec<Plane>,
    /// Largest absolute coordinate, not counting the far ends of directions.
    extent: f64,
    /// Number of leading planes for which a triangle that only touches the plane is outside. Towards a punctual light,
    /// the other planes converge to a point, where this tolerance would leave a gap between triangles that meet along
    /// an edge.
    touched: usize,
}

/// Upper bound of the coordinates of a scene.
const LARGEST: f64 = 2.25;
/// Longer than any path through a scene.
const FAR: f64 = 16.0;
/// Largest half angle of a directional light that shafts support, radians.
pub(crate) const WIDEST: f64 = 0.5;
/// Factor by which the bounds of a sphere or cone are enlarged, against rounding.
const MARGIN: f64 = 1.001;

/// Edges of a cube whose corner i has the signs of its coordinates in the bits of i.
const CUBE_EDGES: [[usize; 2]; 12] =
    [[0, 1], [2, 3], [4, 5], [6, 7], [0, 2], [1, 3], [4, 6], [5, 7], [0, 4], [1, 5], [2, 6], [3, 7]];

impl Shaft {
    /// The shaft to a triangle that emits on the side of its `normal`. `None` if no light can pass, because the
    /// triangle is entirely behind the area or the area behind the triangle.
    pub fn new(area: &Area, [p, q, r]: Triangle, normal: Vec3) -> Option<Self> {
        let mut shaft = Self::before(area, &[p, q, r]);
        let normal = normal.as_dvec3();
        let slack = shaft.slack(normal, shaft.extent);
        let is_lit = area.corners.iter().any(|&point| (point - p).dot(normal) > slack);
        if !is_lit || !shaft.is_reached(area) {
            return None;
        }
        // Light travels only between the fronts of the two, so what is behind the triangle's plane is outside.
        let height = [p, q, r].iter().map(|corner| -corner.dot(normal)).fold(f64::MIN, f64::max);
        shaft.planes.push(Plane { normal: -normal, height });
        shaft.close(&[[0, 1], [1, 2], [2, 0]]);
        shaft.touched = shaft.planes.len();
        Some(shaft)
    }

    /// The shaft to a point; `None` if that is behind the area.
    pub fn to_point(area: &Area, point: DVec3) -> Option<Self> {
        Self::before(area, &[point]).closed_if_reached(area, &[])
    }

    /// The shaft to a cube that contains a sphere; `None` if that is entirely behind the area.
    pub fn to_ball(area: &Area, center: DVec3, radius: f64) -> Option<Self> {
        let sign =
            |corner: usize, axis: usize| MARGIN * if corner >> axis & 1 == 1 { radius } else { -radius };
        let corner = |corner: usize| center + DVec3::from([0, 1, 2].map(|axis| sign(corner, axis)));
        let corners: [DVec3; 8] = std::array::from_fn(corner);
        Self::before(area, &corners).closed_if_reached(area, &CUBE_EDGES)
    }

    /// The shaft in a direction, as far as any scene extends; `None` if the direction leads behind the area.
    pub fn towards(area: &Area, direction: DVec3) -> Option<Self> {
        let ends = area.corners.map(|corner| corner + direction * FAR);
        Self::before(area, &ends).closed_if_reached(area, &[])
    }

    /// The shaft in all directions of a square pyramid that contains a cone, given by its half angle of at most
    /// [`WIDEST`]; `None` if all of them lead behind the area.
    pub fn in_cone(area: &Area, direction: DVec3, half_angle: f64) -> Option<Self> {
        let [x, y] = frame(direction.as_vec3()).map(|side| side.as_dvec3() * half_angle.tan() * MARGIN);
        let offsets = [x + y, y - x, -x - y, x - y].map(|side| (direction + side) * FAR);
        let ends: Vec<DVec3> =
            area.corners.iter().flat_map(|&corner| offsets.map(|offset| corner + offset)).collect();
        let edges: Vec<[usize; 2]> =
            (0..16).map(|end| [end, if end % 4 == 3 { end - 3 } else { end + 1 }]).collect();
        Self::before(area, &ends).closed_if_reached(area, &edges)
    }

    /// A shaft to `ends` that still lacks all planes except that of the area.
    fn before(area: &Area, ends: &[DVec3]) -> Self {
        let points: Vec<DVec3> = area.corners.iter().chain(ends).copied().collect();
        let extent = |points: &[DVec3]| points.iter().map(|p| p.abs().max_element()).fold(0.0, f64::max);
        // The far ends of directions are not positions of the scene, so they add no rounding error.
        let extent = extent(&points).min(extent(&area.corners).max(LARGEST));
        let height = area.corners.iter().map(|corner| -corner.dot(area.normal)).fold(f64::MIN, f64::max);
        let mut planes = Vec::with_capacity(1 + 4 * ends.len());
        planes.push(Plane { normal: -area.normal, height });
        Self { points, planes, extent, touched: 1 }
    }

    /// Whether any of the ends is in front of the area.
    fn is_reached(&self, area: &Area) -> bool {
        let slack = self.slack(area.normal, self.extent);
        self.points[4..].iter().any(|&point| (point - area.corners[0]).dot(area.normal) > slack)
    }

    /// The shaft with all its planes; `None` if no end is in front of the area. `edges` are pairs of ends.
    fn closed_if_reached(mut self, area: &Area, edges: &[[usize; 2]]) -> Option<Self> {
        if !self.is_reached(area) {
            return None;
        }
        self.close(edges);
        Some(self)
    }

    /// Adds the planes through an edge of the area and an end, and through an edge between ends and a corner of the
    /// area, that bound the hull.
    fn close(&mut self, edges: &[[usize; 2]]) {
        let area_edges = [[0, 1], [1, 2], [2, 3], [3, 0]].map(|edge| (edge, 4..self.points.len()));
        let end_edges = edges.iter().map(|edge| (edge.map(|end| end + 4), 0..4));
        for ([from, to], others) in area_edges.into_iter().chain(end_edges) {
            let (from, along) = (self.points[from], self.points[to] - self.points[from]);
            for other in others {
                let Some(normal) = along.cross(self.points[other] - from).try_normalize() else { continue };
                self.push_facet(normal, normal.dot(from));
            }
        }
    }

    /// Adds a plane through three of the points if all others lie on one side of it.
    fn push_facet(&mut self, normal: DVec3, height: f64) {
        let slack = self.slack(normal, self.extent);
        let (mut above, mut below) = (height, height);
        for point in &self.points {
            let point_height = normal.dot(*point);
            (above, below) = (above.max(point_height), below.min(point_height));
        }
        if above <= height + slack {
            self.planes.push(Plane { normal, height: above });
        } else if below >= height - slack {
            self.planes.push(Plane { normal: -normal, height: -below });
        }
    }

    /// Tolerance for touching along a normal, for coordinates up to `extent` or those of the shaft.
    fn slack(&self, normal: DVec3, extent: f64) -> f64 {
        contact(normal, self.extent.max(extent))
    }

    /// Whether a triangle, whose largest absolute coordinate is `extent`, may reach into the shaft.
    pub fn may_meet(&self, corners: &Triangle, extent: f64) -> bool {
        for (place, plane) in self.planes.iter().enumerate() {
            let slack = if place < self.touched { self.slack(plane.normal, extent) } else { 0.0 };
            let inner = plane.height - slack;
            if corners.iter().all(|corner| plane.normal.dot(*corner) >= inner) {
                return false;
            }
        }
        let [a, b, c] = *corners;
        let Some(normal) = (b - a).cross(c - a).try_normalize() else { return true };
        let (slack, height) = (self.slack(normal, extent), normal.dot(a));
        let (mut above, mut below) = (false, false);
        for point in &self.points {
            let point_height = normal.dot(*point) - height;
            above |= point_height > slack;
            below |= point_height < -slack;
        }
        above && below
    }

    /// The triangles of a scene that may reach into the shaft; `None` if they are more than `most`, if too many must be
    /// tested, or if one of them lets light through.
    pub fn triangles(&self, scene: &BakeScene, most: usize) -> Option<Vec<u32>> {
        let (mut found, mut tested) = (Vec::new(), 0);
        let is_complete = scene.boxes.near_while(&bounds(&self.points), |index| {
            tested += 1;
            let triangle = &scene.triangles[index as usize];
            if self.may_meet(&triangle.corners.map(|corner| corner.as_dvec3()), f64::from(triangle.extent)) {
                found.push(index);
            }
            tested <= MAX_TESTED && found.len() <= most
        });
        let is_opaque = |index: &u32| !scene.is_masked(*index);
        (is_complete && found.iter().all(is_opaque)).then_some(found)
    }
}

/// Most triangles that are tested for one shaft; with more, shadow rays are faster.
const MAX_TESTED: usize = 512;

#[cfg(test)]
#[path = "shaft_tests.rs"]
mod tests;
