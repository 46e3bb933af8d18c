//! What may stand between a flat piece of surface and what shines on it: the triangles that reach into the convex hull of both (Haines and
//! Wallace, "Shaft Culling for Efficient Ray-Traced Radiosity", 1991). Where none does, no shadow ray is needed. What is named may still
//! stand beside; what is not named does not matter. Not how much they hide: that is `visible_part` and `shadow_clipping`.

use glam::{DVec3, Vec3};

use crate::sampling::frame;
use crate::scene::BakeScene;

/// A parallelogram that holds a flat piece of surface.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Area {
    pub corners: [DVec3; 4],
    /// Unit, of the side that receives.
    pub normal: DVec3,
}

/// Corners of a triangle.
pub(crate) type Corners = [DVec3; 3];

/// Distance that counts as none, relative to coordinates: what rays are moved off surfaces by.
const CONTACT: f64 = 16.0 / (1 << 24) as f64;

/// How far apart what touches may be, along a unit normal, by the rounding of coordinates of that size.
pub(crate) fn contact(normal: DVec3, extent: f64) -> f64 {
    CONTACT * extent * normal.abs().element_sum()
}

/// A half-space: what has `normal · point` above `height` is outside.
#[derive(Clone, Copy, Debug)]
struct Plane {
    normal: DVec3,
    height: f64,
}

/// Whether no triangle of a scene reaches into the space before an area, as high as the area is wide, or into as much beside it: what is
/// inside something there, or outside, is so all over.
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
    let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for point in &points {
        (low, high) = (low.min(*point), high.max(*point));
    }
    let sides = [area.normal, row.normalize_or_zero(), across.normalize_or_zero()];
    let mut looked_at = 0;
    scene.boxes.near_while(low.as_vec3(), high.as_vec3(), |index| {
        looked_at += 1;
        let triangle = &scene.triangles[index as usize];
        let corners = triangle.corners.map(|corner| corner.as_dvec3());
        let own = triangle.normal.as_dvec3();
        let beside = sides.into_iter().chain([own]).any(|side| {
            let slack = contact(side, extent.max(f64::from(triangle.extent)));
            let range = |places: &[DVec3]| {
                places
                    .iter()
                    .map(|place| place.dot(side))
                    .fold((f64::MAX, f64::MIN), |(low, high), own| (low.min(own), high.max(own)))
            };
            let (one, other) = (range(&points), range(&corners));
            other.0 >= one.1 - slack || other.1 <= one.0 + slack
        });
        beside && looked_at <= MAX_LOOKED_AT
    })
}

/// The convex hull of an area and what shines on it.
pub(crate) struct Shaft {
    points: Vec<DVec3>,
    planes: Vec<Plane>,
    /// Largest absolute coordinate of what has a place.
    extent: f64,
    /// Planes of which what touches them is outside, too: the first so many. Towards a light the others run together to a point, and what
    /// meets along an edge there would leave a gap.
    touched: usize,
}

/// Coordinates of a scene are below this; and longer than any way through it.
const LARGEST: f64 = 2.25;
const FAR: f64 = 16.0;
/// The widest half angle of a light in the sky that shafts lead to, radians.
pub(crate) const WIDEST: f64 = 0.5;
/// What is around a round thing is so much larger, for what rounds.
const ROOM: f64 = 1.001;

/// Edges of the cube whose corner i has its signs in the bits of i.
const CUBE_EDGES: [[usize; 2]; 12] =
    [[0, 1], [2, 3], [4, 5], [6, 7], [0, 2], [1, 3], [4, 6], [5, 7], [0, 4], [1, 5], [2, 6], [3, 7]];

impl Shaft {
    /// To a triangle that shines on the side of its `normal`; `None` where it is wholly behind the area, or the area behind it: no light passes.
    pub fn new(area: &Area, [p, q, r]: Corners, normal: Vec3) -> Option<Self> {
        let mut shaft = Self::before(area, &[p, q, r]);
        let shines = normal.as_dvec3();
        let slack = shaft.slack(shines, shaft.extent);
        let lit = area.corners.iter().any(|&point| (point - p).dot(shines) > slack);
        if !lit || !shaft.is_reached(area) {
            return None;
        }
        // Light leaves the one and arrives at the other by their fronts alone.
        let lowest = [p, q, r].iter().map(|corner| -corner.dot(shines)).fold(f64::MIN, f64::max);
        shaft.planes.push(Plane { normal: -shines, height: lowest });
        shaft.close(&[[0, 1], [1, 2], [2, 0]]);
        shaft.touched = shaft.planes.len();
        Some(shaft)
    }

    /// To a point; `None` if that is behind the area.
    pub fn to_point(area: &Area, point: DVec3) -> Option<Self> {
        Self::before(area, &[point]).closed_if_reached(area, &[])
    }

    /// To all of a ball, and to a little beside it; `None` if it is wholly behind the area.
    pub fn to_ball(area: &Area, center: DVec3, radius: f64) -> Option<Self> {
        let sign = |corner: usize, axis: usize| ROOM * if corner >> axis & 1 == 1 { radius } else { -radius };
        let corner = |corner: usize| center + DVec3::from([0, 1, 2].map(|axis| sign(corner, axis)));
        let corners: [DVec3; 8] = std::array::from_fn(corner);
        Self::before(area, &corners).closed_if_reached(area, &CUBE_EDGES)
    }

    /// As far as a scene goes in a direction; `None` if that leads behind the area.
    pub fn towards(area: &Area, direction: DVec3) -> Option<Self> {
        let ends = area.corners.map(|corner| corner + direction * FAR);
        Self::before(area, &ends).closed_if_reached(area, &[])
    }

    /// In all directions of a cone, by half its angle, at most [`WIDEST`], and a little beside it; `None` if all of them lead behind the area.
    pub fn in_cone(area: &Area, direction: DVec3, half_angle: f64) -> Option<Self> {
        let [x, y] = frame(direction.as_vec3()).map(|side| side.as_dvec3() * half_angle.tan() * ROOM);
        let ways = [x + y, y - x, -x - y, x - y].map(|side| (direction + side) * FAR);
        let ends: Vec<DVec3> = area.corners.iter().flat_map(|&corner| ways.map(|way| corner + way)).collect();
        let edges: Vec<[usize; 2]> =
            (0..16).map(|end| [end, if end % 4 == 3 { end - 3 } else { end + 1 }]).collect();
        Self::before(area, &ends).closed_if_reached(area, &edges)
    }

    /// Open but for the area's own side.
    fn before(area: &Area, ends: &[DVec3]) -> Self {
        let points: Vec<DVec3> = area.corners.iter().chain(ends).copied().collect();
        let extent = |points: &[DVec3]| points.iter().map(|p| p.abs().max_element()).fold(0.0, f64::max);
        // What ends far away has no place there that could be rounded.
        let extent = extent(&points).min(extent(&area.corners).max(LARGEST));
        let lowest = area.corners.iter().map(|corner| -corner.dot(area.normal)).fold(f64::MIN, f64::max);
        let mut planes = Vec::with_capacity(1 + 4 * ends.len());
        planes.push(Plane { normal: -area.normal, height: lowest });
        Self { points, planes, extent, touched: 1 }
    }

    /// Whether something of the ends is before the area.
    fn is_reached(&self, area: &Area) -> bool {
        let slack = self.slack(area.normal, self.extent);
        self.points[4..].iter().any(|&point| (point - area.corners[0]).dot(area.normal) > slack)
    }

    fn closed_if_reached(mut self, area: &Area, edges: &[[usize; 2]]) -> Option<Self> {
        if !self.is_reached(area) {
            return None;
        }
        self.close(edges);
        Some(self)
    }

    /// Planes through every edge of the area and every end, and through every edge between ends and every corner of the area.
    fn close(&mut self, edges: &[[usize; 2]]) {
        let own = [[0, 1], [1, 2], [2, 3], [3, 0]].map(|edge| (edge, 4..self.points.len()));
        let far = edges.iter().map(|edge| (edge.map(|end| end + 4), 0..4));
        for ([from, to], others) in own.into_iter().chain(far) {
            let (from, along) = (self.points[from], self.points[to] - self.points[from]);
            for other in others {
                let Some(normal) = along.cross(self.points[other] - from).try_normalize() else { continue };
                self.push_facet(normal, normal.dot(from));
            }
        }
    }

    /// A plane through three of the points, if the others lie on one side of it.
    fn push_facet(&mut self, normal: DVec3, height: f64) {
        let slack = self.slack(normal, self.extent);
        let (mut above, mut below) = (height, height);
        for point in &self.points {
            let own = normal.dot(*point);
            (above, below) = (above.max(own), below.min(own));
        }
        if above <= height + slack {
            self.planes.push(Plane { normal, height: above });
        } else if below >= height - slack {
            self.planes.push(Plane { normal: -normal, height: -below });
        }
    }

    fn slack(&self, normal: DVec3, extent: f64) -> f64 {
        contact(normal, self.extent.max(extent))
    }

    /// Whether a triangle, whose largest absolute coordinate is `extent`, may reach into it.
    pub fn may_meet(&self, corners: &Corners, extent: f64) -> bool {
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
            let own = normal.dot(*point) - height;
            above |= own > slack;
            below |= own < -slack;
        }
        above && below
    }

    /// The triangles of a scene that may reach into it, if they are few and stop all light.
    pub fn triangles(&self, scene: &BakeScene, most: usize) -> Option<Vec<u32>> {
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for point in &self.points {
            (low, high) = (low.min(*point), high.max(*point));
        }
        let (mut found, mut looked_at) = (Vec::new(), 0);
        let all = scene.boxes.near_while(low.as_vec3(), high.as_vec3(), |index| {
            looked_at += 1;
            let triangle = &scene.triangles[index as usize];
            if self.may_meet(&triangle.corners.map(|corner| corner.as_dvec3()), f64::from(triangle.extent)) {
                found.push(index);
            }
            looked_at <= MAX_LOOKED_AT && found.len() <= most
        });
        let solid =
            |&index: &u32| !scene.surfaces[scene.triangles[index as usize].surface as usize].is_masked();
        (all && found.iter().all(solid)).then_some(found)
    }
}

/// Most triangles that are looked at for one shaft, and that may stand in it: beyond, rays are quicker.
const MAX_LOOKED_AT: usize = 512;

#[cfg(test)]
#[path = "shaft_tests.rs"]
mod tests;
