//! What may stand between a flat piece of surface and an emitter: the triangles that reach into the convex hull of both (Haines and
//! Wallace, "Shaft Culling for Efficient Ray-Traced Radiosity", 1991). Where none does, no shadow ray is needed. What is named may still
//! stand beside; what is not named does not matter. Not how much of the emitter they hide: that is `visible_part`.

use glam::DVec3;

use super::box_tree::BoxTree;
use super::emitters::Emitter;
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

/// The triangles that may stand between a receiver and the emitters of one part of the sources: no others do.
pub(crate) struct Between {
    pub part: u32,
    /// Those that shine on it; none where nothing stands before any of them.
    pub emitters: Vec<(u32, Vec<Corners>)>,
}

/// A half-space: what has `normal · point` above `height` is outside.
#[derive(Clone, Copy, Debug)]
struct Plane {
    normal: DVec3,
    height: f64,
}

/// Most facets of the hull of four points and three: every edge of one with every corner of the other, and both planes.
const MOST_PLANES: usize = 26;

/// Whether no triangle of a scene reaches into the space before an area, as high as the area is wide, or into as much beside it: what is
/// inside something there, or outside, is so all over.
pub(crate) fn is_free_before(area: &Area, scene: &BakeScene, tree: &BoxTree) -> bool {
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
    tree.near_while(low.as_vec3(), high.as_vec3(), |index| {
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
        beside && looked_at <= MOST_LOOKED_AT
    })
}

/// The convex hull of an area and an emitter.
pub(crate) struct Shaft {
    points: [DVec3; 7],
    planes: [Plane; MOST_PLANES],
    count: usize,
    /// Largest absolute coordinate.
    extent: f64,
}

impl Shaft {
    /// `None` where the emitter is wholly behind the area, or the area behind it: no light passes.
    pub fn new(area: &Area, emitter: &Emitter) -> Option<Self> {
        let [a, b, c, d] = area.corners;
        let [p, q, r] = emitter.corners_f64;
        let points = [a, b, c, d, p, q, r];
        let extent = points.iter().map(|point| point.abs().max_element()).fold(0.0, f64::max);
        let mut shaft = Self {
            points,
            planes: [Plane { normal: DVec3::ZERO, height: 0.0 }; MOST_PLANES],
            count: 0,
            extent,
        };
        let shines = emitter.normal.as_dvec3();
        let receives =
            [p, q, r].iter().any(|&point| (point - a).dot(area.normal) > shaft.slack(area.normal, extent));
        let lit = area.corners.iter().any(|&point| (point - p).dot(shines) > shaft.slack(shines, extent));
        if !receives || !lit {
            return None;
        }
        // Light leaves the one and arrives at the other by their fronts alone.
        let lowest = area.corners.iter().map(|corner| -corner.dot(area.normal)).fold(f64::MIN, f64::max);
        shaft.push(-area.normal, lowest);
        let lowest = [p, q, r].iter().map(|corner| -corner.dot(shines)).fold(f64::MIN, f64::max);
        shaft.push(-shines, lowest);
        for (edges, others) in [(&points[..4], &points[4..]), (&points[4..], &points[..4])] {
            for (place, &from) in edges.iter().enumerate() {
                let along = edges[(place + 1) % edges.len()] - from;
                for &other in others {
                    let Some(normal) = along.cross(other - from).try_normalize() else { continue };
                    shaft.push_facet(normal, normal.dot(from));
                }
            }
        }
        Some(shaft)
    }

    fn push(&mut self, normal: DVec3, height: f64) {
        if let Some(plane) = self.planes.get_mut(self.count) {
            *plane = Plane { normal, height };
            self.count += 1;
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
            self.push(normal, above);
        } else if below >= height - slack {
            self.push(-normal, -below);
        }
    }

    fn slack(&self, normal: DVec3, extent: f64) -> f64 {
        contact(normal, self.extent.max(extent))
    }

    /// Whether a triangle, whose largest absolute coordinate is `extent`, may reach into it.
    pub fn may_meet(&self, corners: &Corners, extent: f64) -> bool {
        for plane in &self.planes[..self.count] {
            let inner = plane.height - self.slack(plane.normal, extent);
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
    pub fn triangles(&self, scene: &BakeScene, tree: &BoxTree) -> Option<Vec<u32>> {
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for point in &self.points {
            (low, high) = (low.min(*point), high.max(*point));
        }
        let (mut found, mut looked_at) = (Vec::new(), 0);
        let all = tree.near_while(low.as_vec3(), high.as_vec3(), |index| {
            looked_at += 1;
            let triangle = &scene.triangles[index as usize];
            if self.may_meet(&triangle.corners.map(|corner| corner.as_dvec3()), f64::from(triangle.extent)) {
                found.push(index);
            }
            looked_at <= MOST_LOOKED_AT && found.len() <= MOST_BLOCKERS
        });
        let solid =
            |&index: &u32| !scene.surfaces[scene.triangles[index as usize].surface as usize].is_masked();
        (all && found.iter().all(solid)).then_some(found)
    }
}

/// Most triangles that are looked at for one shaft, and that may stand in it: beyond, rays are quicker.
const MOST_LOOKED_AT: usize = 512;
const MOST_BLOCKERS: usize = 32;

#[cfg(test)]
#[path = "shaft_tests.rs"]
mod tests;
