//! Shadow rays: how much of a light comes through to a point, S_i between 0 and 1 per channel. Glass lets through k_t at every surface, what
//! covers in part the rest of that; neither bends the ray, so that no light is focused. Not the light itself.

use std::cell::Cell;

use glam::DVec3;

use crate::geometry::SpaceRay;
use crate::interface::reflected_by_sheet;
use crate::medium::MediumStack;
use crate::scene::{Passage, Scene};
use crate::surface_point::SurfacePoint;

/// What the rays towards lights are let through by.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Glass {
    /// Sheets and solids, as the documents have it.
    LetsThrough,
    /// Sheets alone: what refracts is met by paths, not by straight lines.
    OnlySheets,
}

/// After so many surfaces nothing is left, or the scene is a mistake.
const MOST_SURFACES: usize = 1024;

/// The part of the light that arrives along a ray, from a distance that may be infinite. `media` is where the ray starts; `bulbs` are objects
/// that do not count. The second value counts the rays that were traced for it.
pub(crate) fn transmittance(
    scene: &Scene,
    ray: &SpaceRay,
    distance: f64,
    media: &MediumStack,
    (glass, bulbs): (Glass, &[usize]),
) -> (DVec3, u32) {
    if bulbs.is_empty() && !scene.see_through && !scene.holes {
        let hidden = scene.geometry.anything_between(ray, distance);
        return (if hidden { DVec3::ZERO } else { media.transmittance(distance) }, 1);
    }
    let open = |object: usize| scene.see_through && scene.is_open(object, glass == Glass::LetsThrough);
    // A ray that nothing hides has seen all that lies on its way.
    let through = Cell::new(false);
    let hidden = scene.geometry.any_between(ray, distance, |crossing| {
        if bulbs.contains(&crossing.object) {
            return false;
        }
        if open(crossing.object) {
            through.set(true);
            return false;
        }
        scene.blocks(crossing)
    });
    if hidden {
        return (DVec3::ZERO, 1);
    }
    if !through.get() {
        return (media.transmittance(distance), 1);
    }
    let (mut left, mut rays) = (DVec3::ONE, 1);
    let (mut ray, mut travelled, mut media) = (*ray, 0.0, media.clone());
    for _ in 0..MOST_SURFACES {
        rays += 1;
        let next = scene.geometry.closest(&ray, distance - travelled, |crossing| {
            open(crossing.object) && !bulbs.contains(&crossing.object)
        });
        let Some(meeting) = next else {
            return (left * media.transmittance(distance - travelled), rays);
        };
        let point = SurfacePoint::new(scene, &ray, &meeting);
        let object = &scene.objects[point.object];
        let front = meeting.crossing.front;
        let solid = scene.is_solid(point.object);
        let here = if solid { media.before(point.object, object, front) } else { media.clone() };
        left *= here.transmittance(point.distance);
        media = if solid { here.across(point.object, object, front) } else { here };
        left *= match object.passage() {
            Passage::Clear if glass == Glass::OnlySheets => {
                let cosine = point.optical_normal(-ray.direction).dot(-ray.direction);
                object.transmission() * (1.0 - reflected_by_sheet(object, cosine))
            }
            Passage::Clear => object.transmission().min(DVec3::ONE),
            _ => DVec3::splat(1.0 - point.coverage),
        };
        if left.max_element() <= 0.0 {
            return (DVec3::ZERO, rays);
        }
        travelled += point.distance;
        ray = SpaceRay::leaving(point.position, ray.direction, point.geometric, point.extent);
    }
    (DVec3::ZERO, rays)
}
