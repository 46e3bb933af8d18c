//! Coplanar surfaces, where rounding would decide which one a ray hits, and which others it misses.
//!
//! - An opaque surface takes precedence over glass, so that no light leaks past a floor that glass stands on.
//! - Surfaces that cover their background in part (alpha blending), such as decals and labels, lie over what is
//!   opaque or glass in their plane, as in frames, and over each other in the order of the objects, the
//!   youngest on top.
//! - Solids of glass that touch are crossed together, as one interface. The rays that go on are computed in
//!   `interface`.
//!
//! Only parallel surfaces are coplanar. At a joint, such as that of a wall and a box, a ray crosses other faces
//! within the same neighbourhood, and in any order, so that each query leaves them out itself.

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
        let hit =
            place.nearest(scene, |candidate| wanted(scene.passage(candidate.object)) && accept(candidate))?;
        Some(place.layer(scene, ray, hit))
    };
    let base = match scene.passage(found.point.object) {
        Passage::Closed | Passage::Cut => Some(found.clone()),
        Passage::Clear => Some(nearest(&is_opaque).unwrap_or_else(|| found.clone())),
        Passage::Covering => nearest(&is_opaque).or_else(|| nearest(&|passage| passage == Passage::Clear)),
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

/// The surface that a ray ends on.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EndSurface {
    pub object: usize,
    /// Unit geometric normal, to either side.
    pub normal: DVec3,
    /// Largest coordinate, to which rounding errors are relative.
    pub extent: f64,
}

impl EndSurface {
    /// Returns the part of its light that reaches the start of a ray past the other surfaces in its plane: the
    /// product of 1 - alpha over those that cover it, and 0 if it is glass with an opaque surface there. `ray`
    /// goes to the surface, whose point lies at a distance.
    pub fn uncovered_share(&self, scene: &Scene, ray: &SpaceRay, distance: f64) -> f64 {
        let may_be_covered = scene.may_be_covered(ray.at(distance));
        let is_glass = scene.passage(self.object) == Passage::Clear;
        if !may_be_covered && !is_glass {
            return 1.0;
        }
        let place = self.place(ray, distance);
        let dims = |candidate: &Candidate| scene.is_seen(candidate) && scene.blocks(candidate);
        let covers = |candidate: &Candidate| is_opaque(scene.passage(candidate.object)) && dims(candidate);
        if is_glass && place.nearest(scene, covers).is_some() {
            return 0.0;
        }
        if !may_be_covered {
            return 1.0;
        }
        let coverings = place.coverings(scene, dims);
        coverings.iter().map(|hit| 1.0 - SurfacePoint::new(scene, &place.around, hit).coverage).product()
    }

    /// Returns true if a ray crosses another surface in the plane of this one, of which `position` is a point.
    pub fn is_coplanar(&self, scene: &Scene, position: DVec3, candidate: &Candidate) -> bool {
        let (other, normal) = scene.position_and_normal(candidate);
        let size = self.extent.max(position.abs().max_element());
        normal.dot(self.normal).abs() >= PARALLEL
            && (other - position).dot(self.normal).abs() <= TOGETHER * size
    }

    fn place(&self, ray: &SpaceRay, distance: f64) -> Place {
        let towards = if self.normal.dot(ray.direction) > 0.0 { -self.normal } else { self.normal };
        Place::new(ray.at(distance), ray.direction, towards, self.extent)
    }
}

fn is_opaque(passage: Passage) -> bool {
    matches!(passage, Passage::Closed | Passage::Cut)
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
        let next = place.nearest(scene, |candidate| {
            candidate.object != point.object
                && scene.is_solid(candidate.object)
                && found.iter().all(|(own, ..)| *own != candidate.object)
        });
        let Some(hit) = next else { break };
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
        let mut covering: Vec<Hit> = Vec::new();
        while covering.len() < MAX_TOGETHER {
            let next = self.nearest(scene, |candidate| {
                scene.passage(candidate.object) == Passage::Covering
                    && covering.iter().all(|hit| hit.candidate.object != candidate.object)
                    && accept(candidate)
            });
            let Some(hit) = next else { break };
            covering.push(hit);
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

    /// Returns the nearest of the surfaces that `accept` takes and that are coplanar with the place's.
    fn nearest(&self, scene: &Scene, accept: impl Fn(&Candidate) -> bool) -> Option<Hit> {
        scene.geometry.closest(&self.around, 2.0 * self.reach, |candidate| {
            accept(candidate) && self.is_parallel(scene, candidate)
        })
    }

    fn is_parallel(&self, scene: &Scene, candidate: &Candidate) -> bool {
        let (_, normal) = scene.position_and_normal(candidate);
        let towards = if normal.dot(self.around.direction) > 0.0 { -normal } else { normal };
        towards.dot(self.normal) >= PARALLEL
    }
}
