//! A ray tree as data: each branch with its point, its medium, its weight and the terms of its sum. Not how it grows, nor how it is shown.

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
    /// A surface mirrors it.
    Mirrored,
    /// It goes through a surface.
    Transmitted,
    /// It sees what a surface covers in part only.
    Behind,
}

impl Kind {
    /// The word for it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Camera => "camera",
            Self::Mirrored => "mirrored",
            Self::Transmitted => "transmitted",
            Self::Behind => "behind",
        }
    }
}

/// One ray of a tree, with what it met.
#[derive(Clone, Debug, Serialize)]
pub struct Branch {
    /// Why it was traced.
    pub kind: Kind,
    /// Where it starts, in the world, metres.
    pub origin: DVec3,
    /// Unit.
    pub direction: DVec3,
    /// What its radiance counts for in the pixel, linear RGB.
    pub weight: DVec3,
    /// What its radiance counts for at the point where it starts: k_r, k_t, or what coverage leaves.
    pub factor: DVec3,
    /// The limits of depth, weight or number of rays ended it before it was traced.
    pub cut: bool,
    /// What it met; nothing for the background.
    pub point: Option<BranchPoint>,
    /// The light of the lamps there, term by term.
    pub light: Option<BranchLight>,
    /// What it brought, linear RGB, W/(m² sr).
    pub radiance: DVec3,
    /// The rays that start where it ends.
    pub branches: Vec<Branch>,
}

/// Where a ray ends.
#[derive(Clone, Debug, Serialize)]
pub struct BranchPoint {
    /// What people call the object.
    pub object: String,
    /// In the world, metres.
    pub position: DVec3,
    /// Unit normal that is lit.
    pub normal: DVec3,
    /// Metres along the ray.
    pub distance: f64,
    /// The ray meets the front.
    pub front: bool,
    /// What the ray runs through: the innermost solid, or air.
    pub medium: String,
    /// Its index of refraction.
    pub index: f64,
    /// What it leaves of the light.
    pub transmittance: DVec3,
}

/// The terms of the sum at a point, linear RGB.
#[derive(Clone, Debug, Serialize)]
pub struct BranchLight {
    /// k_a (I_a + Σ L_a).
    pub ambient: DVec3,
    /// Σ S_i f_att k_d L_d (n·l).
    pub diffuse: DVec3,
    /// Σ S_i f_att k_s L_s and the model's factor.
    pub specular: DVec3,
    /// Σ S_i f_att k_t L_s (t·v)ⁿ.
    pub transmitted: DVec3,
    /// k_d E/π of the lightmap.
    pub baked: DVec3,
    /// What the surface sends by itself.
    pub emission: DVec3,
    /// Of every light that adds something.
    pub lights: Vec<BranchLamp>,
}

/// What one light adds.
#[derive(Clone, Debug, Serialize)]
pub struct BranchLamp {
    /// What people call it.
    pub light: String,
    /// S_i: what the shadow ray found, per channel.
    pub visibility: DVec3,
    /// Its part of the ambient term.
    pub ambient: DVec3,
    /// Its part of the diffuse term.
    pub diffuse: DVec3,
    /// Its part of the specular term.
    pub specular: DVec3,
    /// Its part of the transmitted highlight.
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

    pub(crate) fn meets_nothing(&mut self, radiance: DVec3) {
        self.radiance = radiance;
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
        // The world's origin does not matter to a ray that was not traced, but to whoever draws it.
        let origin = self.point.as_ref().map_or(ray.origin, |point| point.position);
        let cut = Self { cut: true, ..Self::new(kind, ray, DVec3::ZERO, weight, factor) };
        self.branches.push(Self { origin, ..cut });
    }
}
