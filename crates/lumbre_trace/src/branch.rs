//! A recorded ray tree: every ray with the point where it ends, its medium, its weight and the terms of its
//! light. Built by `ray_tree`, drawn by `branch_drawing`.

use glam::DVec3;
use serde::Serialize;

use crate::direct_light::DirectLight;
use crate::geometry::SpaceRay;
use crate::medium::MediumStack;
use crate::scene::Scene;
use crate::surface_point::SurfacePoint;

/// Why a ray was traced.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    /// It comes from the eye.
    Camera,
    /// It was reflected by a mirror.
    Mirrored,
    /// It was transmitted through a surface.
    Transmitted,
    /// It goes on behind a surface that covers its background only in part.
    Behind,
}

impl Kind {
    /// The name used in drawings.
    pub fn name(self) -> &'static str {
        match self {
            Self::Camera => "camera",
            Self::Mirrored => "mirrored",
            Self::Transmitted => "transmitted",
            Self::Behind => "behind",
        }
    }
}

/// One ray of a tree, and what it hit.
#[derive(Clone, Debug, Serialize)]
pub struct Branch {
    /// Why it was traced.
    pub kind: Kind,
    /// Starting point in the world, metres.
    pub origin: DVec3,
    /// Unit vector.
    pub direction: DVec3,
    /// Weight of its radiance in the pixel, linear RGB.
    pub weight: DVec3,
    /// Factor on its radiance at the point where it starts: k_r, k_t, or 1 - coverage.
    pub factor: DVec3,
    /// Whether the limits of depth, weight or number of rays ended it before it was traced.
    pub cut: bool,
    /// Where it ends; `None` for the background and for rays that were cut off.
    pub point: Option<BranchPoint>,
    /// The light at that point, term by term; `None` for the background and for unlit surfaces.
    pub light: Option<BranchLight>,
    /// The radiance that it returned, linear RGB, W/(m² sr).
    pub radiance: DVec3,
    /// The rays that start where it ends.
    pub branches: Vec<Branch>,
}

/// The point where a ray ends.
#[derive(Clone, Debug, Serialize)]
pub struct BranchPoint {
    /// The name of the object.
    pub object: String,
    /// Position in the world, metres.
    pub position: DVec3,
    /// Unit shading normal.
    pub normal: DVec3,
    /// Metres along the ray.
    pub distance: f64,
    /// Whether the ray hits the front of the surface.
    pub front: bool,
    /// The medium that the ray runs through: the name of the innermost solid, or `air`.
    pub medium: String,
    /// Index of refraction of the medium.
    pub index: f64,
    /// Transmittance of the medium along the ray.
    pub transmittance: DVec3,
}

/// The terms of the lighting equation at a point, linear RGB.
#[derive(Clone, Debug, Serialize)]
pub struct BranchLight {
    /// k_a (I_a + Σ L_a).
    pub ambient: DVec3,
    /// Σ S_i f_att k_d L_d (n·l).
    pub diffuse: DVec3,
    /// Σ S_i f_att k_s L_s times the reflection model's factor.
    pub specular: DVec3,
    /// Σ S_i f_att k_t L_s (t·v)ⁿ.
    pub transmitted: DVec3,
    /// Light of the lightmap: k_d E/π, and what stands for a metal's highlight.
    pub baked: DVec3,
    /// Emission of the surface.
    pub emission: DVec3,
    /// The contribution of every light that adds something.
    pub lights: Vec<BranchLamp>,
}

/// The contribution of one light.
#[derive(Clone, Debug, Serialize)]
pub struct BranchLamp {
    /// The name of the light.
    pub light: String,
    /// S_i: the visibility that the shadow rays found, per channel.
    pub visibility: DVec3,
    /// Its ambient term.
    pub ambient: DVec3,
    /// Its diffuse term.
    pub diffuse: DVec3,
    /// Its specular term.
    pub specular: DVec3,
    /// Its transmitted highlight.
    pub transmitted: DVec3,
}

impl Branch {
    pub(crate) fn new(kind: Kind, ray: &SpaceRay, origin: DVec3, weight: DVec3, factor: DVec3) -> Self {
        Self {
            kind,
            origin: ray.origin + origin,
            direction: ray.direction,
            weight,
            factor,
            cut: false,
            point: None,
            light: None,
            radiance: DVec3::ZERO,
            branches: Vec::new(),
        }
    }

    pub(crate) fn meets(
        &mut self,
        scene: &Scene,
        point: &SurfacePoint,
        media: &MediumStack,
        transmittance: DVec3,
    ) {
        let name = |object: usize| scene.objects[object].name.clone();
        self.point = Some(BranchPoint {
            object: name(point.object),
            position: point.position + scene.origin,
            normal: point.normal,
            distance: point.distance,
            front: point.front,
            medium: media.innermost().map_or_else(|| "air".to_owned(), name),
            index: media.index(),
            transmittance,
        });
    }

    pub(crate) fn lit(&mut self, scene: &Scene, light: &DirectLight) {
        let name = |number: usize| match scene.lights.get(number) {
            Some(placed) => placed.name.clone(),
            None => {
                let polygon = &scene.polygons[number - scene.lights.len()];
                scene.objects[polygon.emitter].name.clone()
            }
        };
        let lamps = light.lights.iter().map(|term| BranchLamp {
            light: name(term.light),
            visibility: term.visibility,
            ambient: term.ambient,
            diffuse: term.diffuse,
            specular: term.specular,
            transmitted: term.transmitted,
        });
        self.light = Some(BranchLight {
            ambient: light.ambient,
            diffuse: light.diffuse,
            specular: light.specular,
            transmitted: light.transmitted,
            baked: light.baked,
            emission: light.emission,
            lights: lamps.collect(),
        });
    }

    pub(crate) fn cuts(&mut self, kind: Kind, ray: &SpaceRay, weight: DVec3, factor: DVec3) {
        // The ray was never traced, and was not moved to the world's origin; for drawings it starts at the
        // point.
        let origin = self.point.as_ref().map_or(ray.origin, |point| point.position);
        let cut = Self { cut: true, ..Self::new(kind, ray, DVec3::ZERO, weight, factor) };
        self.branches.push(Self { origin, ..cut });
    }
}
