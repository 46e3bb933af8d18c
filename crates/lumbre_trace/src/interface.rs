//! The mirrored and transmitted rays at a surface and their factors. Snell's law and Fresnel's equations are
//! in `lumbre_optics`; the reflection of lights is in `direct_light`.

use glam::DVec3;
use lumbre_optics::{fresnel_dielectric, reflected_direction, transmitted_direction};

use crate::coplanar::coplanar_solids;
use crate::geometry::SpaceRay;
use crate::medium::MediumStack;
use crate::scene::{Object, Scene};
use crate::surface_point::SurfacePoint;

/// The rays that go on from a point of a surface that mirrors or transmits.
#[derive(Clone, Debug)]
pub(crate) struct RaySplit {
    /// Factor on the radiance from the mirrored direction: k_r, plus the part of k_t that Fresnel's equations
    /// or total reflection send back.
    pub mirrored: DVec3,
    /// Unit vector.
    pub mirror_direction: DVec3,
    /// Factor on the radiance from the transmitted direction.
    pub transmitted: DVec3,
    /// Unit vector; the ray's own direction where light goes straight on.
    pub transmitted_direction: DVec3,
    /// Index of refraction behind the surface over that in front.
    pub eta: f64,
    /// The media of the transmitted ray.
    pub behind: MediumStack,
    /// Largest coordinate of all surfaces that are crossed here.
    pub extent: f64,
}

impl RaySplit {
    /// Splits a ray in `media` that hits a point of a surface which mirrors or transmits.
    pub fn new(scene: &Scene, ray: &SpaceRay, point: &SurfacePoint, media: &MediumStack) -> Self {
        let object = &scene.objects[point.object];
        let viewer = -ray.direction;
        let normal = point.optical_normal(viewer);
        let cosine = normal.dot(viewer).clamp(0.0, 1.0);
        let mirror_direction = mirror(normal, viewer, point.geometric);
        let (mut mirrored, mut passing) = (object.mirror(), object.transmission());
        let mut split = Self {
            mirrored,
            mirror_direction,
            transmitted: DVec3::ZERO,
            transmitted_direction: ray.direction,
            eta: 1.0,
            behind: media.clone(),
            extent: point.extent,
        };
        if passing == DVec3::ZERO {
            return split;
        }
        if object.medium.thin {
            let reflected = reflected_by_sheet(object, cosine);
            split.mirrored = mirrored + passing * reflected;
            split.transmitted = passing * (1.0 - reflected);
            return split;
        }
        let here = media.before(point.object, object, point.front);
        let mut behind = here.across(point.object, object, point.front);
        for (other, front, extent) in coplanar_solids(scene, ray, point) {
            let solid = &scene.objects[other];
            behind = behind.before(other, solid, front).across(other, solid, front);
            passing *= solid.transmission();
            split.extent = split.extent.max(extent);
        }
        split.eta = behind.index() / here.index();
        let through = transmitted_direction(normal, viewer, split.eta);
        let leaves = through.dot(point.geometric) < 0.0;
        if through == DVec3::ZERO || !leaves {
            mirrored += passing;
            split.mirrored = mirrored;
            return split;
        }
        let fresnel = object.medium.fresnel;
        let reflected = if fresnel { fresnel_dielectric(cosine, split.eta) } else { 0.0 };
        split.mirrored = mirrored + passing * reflected;
        split.transmitted = passing * (1.0 - reflected);
        split.transmitted_direction = through;
        split.behind = behind;
        split
    }

    /// Returns the mirrored ray.
    pub fn mirrored_ray(&self, point: &SurfacePoint) -> SpaceRay {
        SpaceRay::leaving(point.position, self.mirror_direction, point.geometric, point.extent)
    }

    /// Returns the transmitted ray.
    pub fn transmitted_ray(&self, point: &SurfacePoint) -> SpaceRay {
        // Offset far enough to be past all surfaces that are crossed together.
        let room = if self.extent > point.extent { 4.0 } else { 1.0 };
        SpaceRay::leaving(point.position, self.transmitted_direction, point.geometric, room * self.extent)
    }
}

/// Returns the fraction of transmissible light that a thin sheet reflects: by both faces, with all
/// reflections between them, 2 F/(1 + F).
pub(crate) fn reflected_by_sheet(sheet: &Object, cosine: f64) -> f64 {
    if !sheet.medium.fresnel {
        return 0.0;
    }
    let once = fresnel_dielectric(cosine, f64::from(sheet.material.ior));
    2.0 * once / (1.0 + once)
}

/// Returns the mirrored direction r = 2 (n·v) n - v, about the geometric normal where r would point into the
/// surface.
fn mirror(normal: DVec3, viewer: DVec3, geometric: DVec3) -> DVec3 {
    let direction = reflected_direction(normal, viewer);
    let direction =
        if direction.dot(geometric) > 0.0 { direction } else { reflected_direction(geometric, viewer) };
    direction.normalize_or(geometric)
}
