//! Surfaces that lie in each other: which of them a ray meets. What is opaque wins, so that no light gets past a floor that glass stands on;
//! solids are crossed together. Not what becomes of the ray.

use glam::DVec3;

use crate::geometry::{Crossing, Meeting, SpaceRay};
use crate::scene::{Passage, Scene};
use crate::surface_point::SurfacePoint;

/// Surfaces nearer to each other than this part of their coordinates lie in each other: more than rays are set off by.
const TOGETHER: f64 = 64.0 / (1 << 24) as f64;
/// So many surfaces lie in one place at most.
const MOST_TOGETHER: usize = 8;
/// Cosine between normals of one plane.
const PARALLEL: f64 = 0.999_999;

/// The nearest surface for which `accept` holds, or an opaque one that lies in it, and its point where the ray meets it.
pub(crate) fn nearest_surface(
    scene: &Scene,
    ray: &SpaceRay,
    farthest: f64,
    accept: impl Fn(&Crossing) -> bool,
) -> Option<(Meeting, SurfacePoint)> {
    let found = scene.geometry.closest(ray, farthest, &accept)?;
    let point = SurfacePoint::new(scene, ray, &found);
    if !scene.is_open(found.crossing.object, true) {
        return Some((found, point));
    }
    let place = Place::of(ray, &point);
    let opaque = scene.geometry.closest(&place.around, 2.0 * place.reach, |crossing| {
        scene.passage(crossing.object) == Passage::Closed && accept(crossing)
    });
    let Some(opaque) = opaque.filter(|opaque| place.holds(scene, opaque)) else {
        return Some((found, point));
    };
    let distance = (point.distance - place.reach + opaque.distance).max(0.0);
    let meeting = Meeting { distance, ..opaque };
    Some((meeting, SurfacePoint::new(scene, ray, &meeting)))
}

/// The other solids whose surface lies where one is met, each with the side that is met and its largest coordinate: glass that touches glass
/// is one interface.
pub(crate) fn coplanar_solids(
    scene: &Scene,
    ray: &SpaceRay,
    point: &SurfacePoint,
) -> Vec<(usize, bool, f64)> {
    let mut found: Vec<(usize, bool, f64)> = Vec::new();
    let place = Place::of(ray, point);
    while found.len() < MOST_TOGETHER {
        let next = scene.geometry.closest(&place.around, 2.0 * place.reach, |crossing| {
            crossing.object != point.object
                && scene.is_solid(crossing.object)
                && found.iter().all(|(own, ..)| *own != crossing.object)
        });
        let Some(meeting) = next.filter(|meeting| place.holds(scene, meeting)) else { break };
        let extent = SurfacePoint::new(scene, &place.around, &meeting).extent;
        // Slightly different extents, so that the transmitted ray is set off by the larger.
        found.push((meeting.crossing.object, meeting.crossing.front, extent.max(point.extent) * 1.000_001));
    }
    found
}

/// Where surfaces count as one.
struct Place {
    /// A ray that begins as far before the surface as it ends behind it.
    around: SpaceRay,
    /// Metres from its start to the surface.
    reach: f64,
    /// Unit normal of the surface, towards the ray.
    normal: DVec3,
}

impl Place {
    fn of(ray: &SpaceRay, point: &SurfacePoint) -> Self {
        let size = point.extent.max(point.position.abs().max_element());
        let cosine = ray.direction.dot(point.geometric).abs().max(1e-3);
        let reach = TOGETHER * size / cosine;
        let around = SpaceRay::new(point.position - ray.direction * reach, ray.direction);
        Self { around, reach, normal: point.geometric }
    }

    /// Only faces that lie in each other: where an edge of one touches the other, rays meet them one after another.
    fn holds(&self, scene: &Scene, meeting: &Meeting) -> bool {
        SurfacePoint::new(scene, &self.around, meeting).geometric.dot(self.normal) >= PARALLEL
    }
}
