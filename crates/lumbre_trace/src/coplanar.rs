//! Coplanar surfaces, where rounding would decide which one a ray hits, and which others it misses.
//!
//! - An opaque surface takes precedence over glass, so that no light leaks past a floor that glass stands on.
//! - Surfaces that cover their background in part (alpha blending), such as decals and labels, lie over what is
//!   opaque or glass in their plane, as in frames, and over each other in the order of the objects, the
//!   youngest on top.
//! - Solids of glass that touch are crossed together, as one interface. The rays that go on are computed in
//!   `interface`.

use glam::DVec3;

use crate::geometry::{Candidate, Hit, SpaceRay};
use crate::scene::{Passage, Scene};
use crate::surface_point::SurfacePoint;

/// Surfaces closer to each other than this fraction of their coordinates count as coplanar. It is more than
/// the offset of ray origins.
const TOGETHER: f64 = 64.0 / (1 << 24) as f64;
/// Largest number of surfaces in one place.
const MAX_TOGETHER: usize = 32;
/// Least cosine between the normals of coplanar surfaces.
const PARALLEL: f64 = 0.999_999;

/// A surface that a ray hits.
#[derive(Clone, Debug)]
pub(crate) struct Layer {
    pub hit: Hit,
    pub point: SurfacePoint,
}

/// The surfaces that a ray hits in one place.
#[derive(Clone, Debug)]
pub(crate) struct Layers {
    pub top: Layer,
    /// The surfaces in the same plane that `top` covers in part, in the order in which a ray meets them, each at
    /// a distance of 0 from the first.
    pub below: Vec<Layer>,
}

/// Returns the nearest surface that `accept` takes, with all that are coplanar with it and partly visible
/// there.
pub(crate) fn nearest_layers(
    scene: &Scene,
    ray: &SpaceRay,
    farthest: f64,
    accept: impl Fn(&Candidate) -> bool,
) -> Option<Layers> {
    let hit = scene.geometry.closest(ray, farthest, &accept)?;
    let point = SurfacePoint::new(scene, ray, &hit);
    let found = Layer { hit, point };
    let open = scene.is_open(found.point.object, true);
    if !open && !scene.may_be_covered(found.point.position) {
        return Some(Layers { top: found, below: Vec::new() });
    }
    let place = Place::of(ray, &found.point);
    let nearest = |wanted: &dyn Fn(Passage) -> bool| {
        let hit = scene.geometry.closest(&place.around, 2.0 * place.reach, |candidate| {
            wanted(scene.passage(candidate.object)) && accept(candidate)
        });
        hit.filter(|hit| place.holds(scene, hit)).map(|hit| place.layer(scene, ray, hit))
    };
    let opaque = |passage| matches!(passage, Passage::Closed | Passage::Cut);
    let base = match scene.passage(found.point.object) {
        Passage::Closed | Passage::Cut => Some(found.clone()),
        Passage::Clear => Some(nearest(&opaque).unwrap_or_else(|| found.clone())),
        Passage::Covering => nearest(&opaque).or_else(|| nearest(&|passage| passage == Passage::Clear)),
    };
    // What is on the other side of a base is not over it.
    let covers = |candidate: &Candidate| accept(candidate) && (base.is_none() || scene.is_seen(candidate));
    let mut layers: Vec<Layer> =
        place.coverings(scene, covers).into_iter().map(|hit| place.layer(scene, ray, hit)).collect();
    layers.extend(base);
    let extent = layers.iter().fold(0.0_f64, |extent, layer| extent.max(layer.point.extent));
    for layer in &mut layers {
        // Rays that leave one of them are past all of them.
        layer.point.extent = extent;
    }
    for layer in layers.iter_mut().skip(1) {
        layer.point.distance = 0.0;
    }
    let mut layers = layers.into_iter();
    // Where rounding hides the surface itself from the ray around it, it is alone.
    let top = layers.next().unwrap_or(found);
    Some(Layers { top, below: layers.collect() })
}

/// Returns the part of the light of a surface that reaches a viewer past the surfaces that cover it in its own
/// plane: the product of 1 - alpha. `ray` goes to the surface, whose point lies at a distance; `normal` is a unit
/// vector to either side of it, and `extent` is its largest coordinate.
pub(crate) fn uncovered_share(
    scene: &Scene,
    ray: &SpaceRay,
    distance: f64,
    (normal, extent): (DVec3, f64),
) -> f64 {
    let position = ray.at(distance);
    if !scene.may_be_covered(position) {
        return 1.0;
    }
    let towards = if normal.dot(ray.direction) > 0.0 { -normal } else { normal };
    let place = Place::new(position, ray.direction, towards, extent);
    let coverings = place.coverings(scene, |candidate| scene.is_seen(candidate));
    coverings.iter().map(|hit| 1.0 - SurfacePoint::new(scene, &place.around, hit).coverage).product()
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
    /// Metres from the origin of the original ray to the surface.
    distance: f64,
    /// Unit geometric normal of the surface, towards the ray's origin.
    normal: DVec3,
}

impl Place {
    fn of(ray: &SpaceRay, point: &SurfacePoint) -> Self {
        let place = Self::new(point.position, ray.direction, point.geometric, point.extent);
        Self { distance: point.distance, ..place }
    }

    fn new(position: DVec3, direction: DVec3, normal: DVec3, extent: f64) -> Self {
        let size = extent.max(position.abs().max_element());
        let cosine = direction.dot(normal).abs().max(1e-3);
        let reach = TOGETHER * size / cosine;
        let around = SpaceRay::new(position - direction * reach, direction);
        Self { around, reach, distance: reach, normal }
    }

    /// Returns the hits of the surfaces that `accept` takes and that cover the place in part, the youngest object
    /// first.
    fn coverings(&self, scene: &Scene, accept: impl Fn(&Candidate) -> bool) -> Vec<Hit> {
        let mut met: Vec<usize> = Vec::new();
        let mut covering = Vec::new();
        while met.len() < MAX_TOGETHER {
            let next = scene.geometry.closest(&self.around, 2.0 * self.reach, |candidate| {
                scene.passage(candidate.object) == Passage::Covering
                    && !met.contains(&candidate.object)
                    && accept(candidate)
            });
            let Some(hit) = next else { break };
            met.push(hit.candidate.object);
            if self.holds(scene, &hit) {
                covering.push(hit);
            }
        }
        covering.sort_by_key(|hit| std::cmp::Reverse(hit.candidate.object));
        covering
    }

    /// Returns the surface that the ray around the place hits, as the original ray sees it.
    fn layer(&self, scene: &Scene, ray: &SpaceRay, hit: Hit) -> Layer {
        let distance = (self.distance - self.reach + hit.distance).max(0.0);
        let hit = Hit { distance, ..hit };
        Layer { hit, point: SurfacePoint::new(scene, ray, &hit) }
    }

    /// Returns true if the surfaces are parallel. Where the edge of one only touches the other, rays hit them
    /// one after the other.
    fn holds(&self, scene: &Scene, hit: &Hit) -> bool {
        SurfacePoint::new(scene, &self.around, hit).geometric.dot(self.normal) >= PARALLEL
    }
}
