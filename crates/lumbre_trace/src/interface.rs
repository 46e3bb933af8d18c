//! How a surface divides a ray: what is mirrored, what is let through, and where to. Snell's law and Fresnel's equations themselves are
//! `lumbre_optics`'. Not the diffuse and specular reflection of lights.

use glam::DVec3;
use lumbre_optics::{fresnel_dielectric, reflected_direction, transmitted_direction};

use crate::coplanar::coplanar_solids;
use crate::geometry::SpaceRay;
use crate::medium::MediumStack;
use crate::scene::{Object, Scene};
use crate::surface_point::SurfacePoint;

/// The rays that go on from a point.
#[derive(Clone, Debug)]
pub(crate) struct Division {
    /// Factor of what comes from the mirrored direction: k_r, and of k_t what is reflected by Fresnel's equations or totally.
    pub mirrored: DVec3,
    /// Unit.
    pub mirror_direction: DVec3,
    /// Factor of what comes through.
    pub transmitted: DVec3,
    /// Unit; the ray's own where light goes straight on.
    pub transmitted_direction: DVec3,
    /// Index behind over index in front.
    pub eta: f64,
    /// Where the transmitted ray runs.
    pub behind: MediumStack,
    /// Farthest coordinate of all surfaces that are crossed here.
    pub extent: f64,
}

impl Division {
    /// Of a ray in `media` that meets a point of a surface which mirrors or lets through.
    pub fn new(scene: &Scene, ray: &SpaceRay, point: &SurfacePoint, media: &MediumStack) -> Self {
        let object = &scene.objects[point.object];
        let viewer = -ray.direction;
        let normal = point.optical_normal(viewer);
        let cosine = normal.dot(viewer).clamp(0.0, 1.0);
        let mirror_direction = mirror(normal, viewer, point.geometric);
        let (mut mirrored, mut passing) = (object.mirror(), object.transmission());
        let mut division = Self {
            mirrored,
            mirror_direction,
            transmitted: DVec3::ZERO,
            transmitted_direction: ray.direction,
            eta: 1.0,
            behind: media.clone(),
            extent: point.extent,
        };
        if passing == DVec3::ZERO {
            return division;
        }
        if object.medium.thin {
            let reflected = reflected_by_sheet(object, cosine);
            division.mirrored = mirrored + passing * reflected;
            division.transmitted = passing * (1.0 - reflected);
            return division;
        }
        let here = media.before(point.object, object, point.front);
        let mut behind = here.across(point.object, object, point.front);
        for (other, front, extent) in coplanar_solids(scene, ray, point) {
            let solid = &scene.objects[other];
            behind = behind.before(other, solid, front).across(other, solid, front);
            passing *= solid.transmission();
            division.extent = division.extent.max(extent);
        }
        division.eta = behind.index() / here.index();
        let through = transmitted_direction(normal, viewer, division.eta);
        let leaves = through.dot(point.geometric) < 0.0;
        if through == DVec3::ZERO || !leaves {
            mirrored += passing;
            division.mirrored = mirrored;
            return division;
        }
        let fresnel = object.medium.fresnel;
        let reflected = if fresnel { fresnel_dielectric(cosine, division.eta) } else { 0.0 };
        division.mirrored = mirrored + passing * reflected;
        division.transmitted = passing * (1.0 - reflected);
        division.transmitted_direction = through;
        division.behind = behind;
        division
    }

    /// The mirrored ray.
    pub fn mirrored_ray(&self, point: &SurfacePoint) -> SpaceRay {
        SpaceRay::leaving(point.position, self.mirror_direction, point.geometric, point.extent)
    }

    /// The ray that goes through.
    pub fn transmitted_ray(&self, point: &SurfacePoint) -> SpaceRay {
        // Past everything that was crossed together.
        let room = if self.extent > point.extent { 4.0 } else { 1.0 };
        SpaceRay::leaving(point.position, self.transmitted_direction, point.geometric, room * self.extent)
    }
}

/// Of what a sheet deals with, the part that it reflects: by both faces, and the light that goes to and fro between them, 2 F/(1 + F).
pub(crate) fn reflected_by_sheet(sheet: &Object, cosine: f64) -> f64 {
    if !sheet.medium.fresnel {
        return 0.0;
    }
    let once = fresnel_dielectric(cosine, f64::from(sheet.material.ior));
    2.0 * once / (1.0 + once)
}

/// r = 2 (n·v) n - v, or about the face's own normal where that would go through the surface.
fn mirror(normal: DVec3, viewer: DVec3, geometric: DVec3) -> DVec3 {
    let direction = reflected_direction(normal, viewer);
    let direction =
        if direction.dot(geometric) > 0.0 { direction } else { reflected_direction(geometric, viewer) };
    direction.normalize_or(geometric)
}
