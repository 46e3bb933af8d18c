//! Shadow rays: how much of a light comes through to a point, S_i between 0 and 1 per channel. Glass lets through k_t at every surface, what
//! covers in part the rest of that; neither bends the ray, so that no light is focused. Not the light itself.

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
/// The part of the light that arrives along a ray, from a distance that may be infinite. `media` is where the ray starts; `bulbs` are objects that do not count. The second value counts the rays that were
/// traced for it.
pub(crate) fn transmittance(
    scene: &Scene,
    ray: &SpaceRay,
    distance: f64,
    media: &MediumStack,
    (glass, bulbs): (Glass, &[usize]),
) -> (DVec3, u32) {
    let open = |object: usize| {
        let object = &scene.objects[object];
        match object.passage() {
            Passage::Covering => true,
            Passage::Clear => glass == Glass::LetsThrough || object.medium.thin,
            Passage::Closed | Passage::Cut => false,
        }
    };
    let hidden = scene.geometry.any_between(ray, distance, |crossing| {
        (!scene.see_through || !open(crossing.object))
            && !bulbs.contains(&crossing.object)
            && scene.blocks(crossing)
    });
    if hidden {
        return (DVec3::ZERO, 1);
    }
    if !scene.see_through {
        return (DVec3::ONE, 1);
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
        let solid = object.is_solid();
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
