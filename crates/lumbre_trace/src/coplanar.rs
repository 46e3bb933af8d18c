//! Coplanar surfaces, where rounding would decide which one a ray hits. An opaque one takes precedence, so
//! that no light leaks past a floor that glass stands on; solids of glass that touch are crossed together, as
//! one interface. The rays that go on are computed in `interface`.

use glam::DVec3;

use crate::geometry::{Candidate, Hit, SpaceRay};
use crate::scene::{Passage, Scene};
use crate::surface_point::SurfacePoint;

/// Surfaces closer to each other than this fraction of their coordinates count as coplanar. It is more than
/// the offset of ray origins.
const TOGETHER: f64 = 64.0 / (1 << 24) as f64;
/// Largest number of surfaces in one place.
const MAX_TOGETHER: usize = 8;
/// Least cosine between the normals of coplanar surfaces.
const PARALLEL: f64 = 0.999_999;

/// Returns the nearest surface that `accept` takes, or an opaque one that is coplanar with it, and the point
/// where the ray hits it.
pub(crate) fn nearest_surface(
    scene: &Scene,
    ray: &SpaceRay,
    farthest: f64,
    accept: impl Fn(&Candidate) -> bool,
) -> Option<(Hit, SurfacePoint)> {
    let found = scene.geometry.closest(ray, farthest, &accept)?;
    let point = SurfacePoint::new(scene, ray, &found);
    if !scene.is_open(found.candidate.object, true) {
        return Some((found, point));
    }
    let place = Place::of(ray, &point);
    let opaque = scene.geometry.closest(&place.around, 2.0 * place.reach, |candidate| {
        scene.passage(candidate.object) == Passage::Closed && accept(candidate)
    });
    let Some(opaque) = opaque.filter(|opaque| place.holds(scene, opaque)) else {
        return Some((found, point));
    };
    let distance = (point.distance - place.reach + opaque.distance).max(0.0);
    let hit = Hit { distance, ..opaque };
    Some((hit, SurfacePoint::new(scene, ray, &hit)))
}

/// Returns the other solids that have a coplanar surface at a point of a solid: glass that touches glass is
/// one interface. Each is given with whether its front is hit, and with its largest coordinate.
pub(crate) fn coplanar_solids(
    scene: &Scene,
    ray: &SpaceRay,
    point: &SurfacePoint,
) -> Vec<(usize, bool, f64)> {
    let mut found: Vec<(usize, bool, f64)> = Vec::new();
    let place = Place::of(ray, point);
    while found.len() < MAX_TOGETHER {
        let next = scene.geometry.closest(&place.around, 2.0 * place.reach, |candidate| {
            candidate.object != point.object
                && scene.is_solid(candidate.object)
                && found.iter().all(|(own, ..)| *own != candidate.object)
        });
        let Some(hit) = next.filter(|hit| place.holds(scene, hit)) else { break };
        let extent = SurfacePoint::new(scene, &place.around, &hit).extent;
        // Slightly larger, so that the caller sees that several surfaces were crossed and offsets the
        // transmitted ray by more.
        found.push((hit.candidate.object, hit.candidate.front, extent.max(point.extent) * 1.000_001));
    }
    found
}

/// The neighbourhood of a hit point in which surfaces may be coplanar.
struct Place {
    /// A ray through the point that starts as far before the surface as it ends behind it.
    around: SpaceRay,
    /// Metres from its start to the surface.
    reach: f64,
    /// Unit geometric normal of the surface, towards the ray's origin.
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

    /// Returns true if the surfaces are parallel. Where the edge of one only touches the other, rays hit them
    /// one after the other.
    fn holds(&self, scene: &Scene, hit: &Hit) -> bool {
        SurfacePoint::new(scene, &self.around, hit).geometric.dot(self.normal) >= PARALLEL
    }
}
