//! Shadow rays: the transmittance S_i from a point to a light, between 0 and 1 per channel. Every surface of
//! glass transmits k_t, and a partly covering surface what its coverage leaves. Neither bends the ray, so
//! that light is not focused.

use std::cell::Cell;

use glam::DVec3;

use crate::coplanar::{EndSurface, Layer, Layers, nearest_layers};
use crate::geometry::{Candidate, SpaceRay};
use crate::interface::reflected_by_sheet;
use crate::medium::MediumStack;
use crate::scene::{Passage, Scene};
use crate::surface_point::SurfacePoint;

/// Which transmissive surfaces let shadow rays pass.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Glass {
    /// Thin sheets and solids, which the ray tree passes in straight lines.
    LetsThrough,
    /// Thin sheets alone: light through refracting solids is left to paths.
    OnlySheets,
}

/// Largest number of surfaces that a ray passes. By then no light is left, or the scene is broken.
const MAX_SURFACES: usize = 1024;

/// Where a shadow ray ends, and what it passes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Target<'a> {
    /// Metres along the ray; infinite for distant lights.
    pub distance: f64,
    /// The surface that it ends on, if it ends on one. What is coplanar with that does not lie in between.
    pub surface: Option<EndSurface>,
    pub glass: Glass,
    /// Objects that do not block it.
    pub bulbs: &'a [usize],
}

/// Returns the transmittance along a ray to its target, and the number of rays that were traced for it. `media`
/// holds the media at the ray's start. (Inlined, so that the ray is not written to memory.)
#[inline]
pub(crate) fn transmittance(
    scene: &Scene,
    ray: &SpaceRay,
    target: &Target,
    media: &MediumStack,
) -> (DVec3, u32) {
    let &Target { distance, glass, bulbs, .. } = target;
    if bulbs.is_empty() && !scene.see_through && !scene.holes {
        let hidden = scene.geometry.anything_between(ray, distance);
        return (if hidden { DVec3::ZERO } else { media.transmittance(distance) }, 1);
    }
    let open = |object: usize| scene.see_through && scene.is_open(object, glass == Glass::LetsThrough);
    // Set if a surface was passed that transmits part of the light. A ray that is not blocked tests all
    // surfaces on its way.
    let through = Cell::new(false);
    let hidden = scene.geometry.blocked_between(ray, distance, |candidate| {
        if bulbs.contains(&candidate.object) {
            return false;
        }
        if open(candidate.object) {
            through.set(true);
            return false;
        }
        scene.blocks(candidate)
    });
    if hidden {
        return (DVec3::ZERO, 1);
    }
    if !through.get() {
        return (media.transmittance(distance), 1);
    }
    transmittance_of_surfaces(scene, ray, target, media)
}

/// Returns the same as [`transmittance`] for a ray that nothing blocks and that passes surfaces which transmit part of
/// the light. (Not inlined: its large stack frame would slow down all other rays.)
#[inline(never)]
fn transmittance_of_surfaces(
    scene: &Scene,
    ray: &SpaceRay,
    target: &Target,
    media: &MediumStack,
) -> (DVec3, u32) {
    let &Target { distance, surface, glass, bulbs } = target;
    let (mut left, mut rays) = (DVec3::ONE, 1);
    let end = surface.map(|surface| (surface, ray.at(distance)));
    let before_end = |candidate: &Candidate| {
        end.is_none_or(|(surface, position)| !surface.is_coplanar(scene, position, candidate))
    };
    let (mut ray, mut travelled, mut media) = (*ray, 0.0, media.clone());
    for _ in 0..MAX_SURFACES {
        rays += 1;
        let next = nearest_layers(scene, &ray, distance - travelled, |candidate| {
            scene.is_open(candidate.object, glass == Glass::LetsThrough)
                && !bulbs.contains(&candidate.object)
                && before_end(candidate)
        });
        let Some(Layers { top, below }) = next else {
            return (left * media.transmittance(distance - travelled), rays);
        };
        travelled += top.point.distance;
        let leaving =
            |at: &SurfacePoint| SpaceRay::leaving(at.position, ray.direction, at.geometric, at.extent);
        let after = leaving(&top.point);
        for Layer { hit, point } in [top].into_iter().chain(below) {
            let object = &scene.objects[point.object];
            let front = hit.candidate.front;
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
        }
        if left.max_element() <= 0.0 {
            return (DVec3::ZERO, rays);
        }
        ray = after;
    }
    (DVec3::ZERO, rays)
}
