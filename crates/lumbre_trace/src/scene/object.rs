//! An object that rays can hit: its shape, material and transform, as the World has them. Intersections are
//! in `geometry`.

use std::sync::Arc;

use glam::{DAffine3, DMat3, DVec3, Vec3};
use lumbre_mesh::TriangleMesh;
use lumbre_optics::{AlphaMode, Material, ReflectionModel};
use lumbre_scene::{IrradianceVolume, LightmapImage, MaterialTextures, Medium, VolumePlace};

/// One object of the scene.
#[derive(Debug)]
pub(crate) struct Object {
    /// The name shown to the user.
    pub name: String,
    pub shape: Arc<TriangleMesh>,
    pub material: Material,
    pub textures: MaterialTextures,
    pub medium: Medium,
    pub model: ReflectionModel,
    pub lightmap: Option<Arc<LightmapImage>>,
    /// The irradiance volume that lights it if it has no lightmap, and the volume's place in the tracer's
    /// space.
    pub volume: Option<(Arc<IrradianceVolume>, VolumePlace)>,
    /// From the object's space to the tracer's.
    pub place: DAffine3,
    /// Transform of normals, scaled to a largest element of 1, so that the test for a zero normal does not
    /// depend on the object's scale.
    pub normals: DMat3,
    /// Whether the transform mirrors; the second and third corner of every triangle are swapped then.
    pub mirrored: bool,
    /// Whether the scene lights the backs of double-sided materials with their own normal.
    pub two_sided: bool,
}

/// How a ray passes a surface without being reflected.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Passage {
    /// Not at all: the surface is opaque.
    Closed,
    /// Through the holes of its alpha mask.
    Cut,
    /// In part and in a straight line, by its opacity.
    Covering,
    /// In part, through transmissive material.
    Clear,
}

impl Object {
    /// Returns how rays pass the object.
    pub fn passage(&self) -> Passage {
        match self.material.alpha_mode {
            AlphaMode::Mask { .. } => Passage::Cut,
            _ if self.transmission() != DVec3::ZERO => Passage::Clear,
            AlphaMode::Blend => Passage::Covering,
            AlphaMode::Opaque => Passage::Closed,
        }
    }

    /// Returns k_t; 0 for unlit materials.
    pub fn transmission(&self) -> DVec3 {
        if self.material.unlit { DVec3::ZERO } else { self.material.transmission.as_dvec3() }
    }

    /// Returns k_r; 0 for unlit materials.
    pub fn mirror(&self) -> DVec3 {
        if self.material.unlit { DVec3::ZERO } else { self.material.mirror.as_dvec3() }
    }

    /// Returns true if its front or its back is emissive.
    pub fn glows(&self) -> bool {
        let back = self.material.back.as_ref().map_or(Vec3::ZERO, |back| back.emission);
        self.material.front.emission.max(back).max_element() > 0.0
    }

    /// Returns true if a point is inside the bounding box of the mesh, in the object's own space.
    pub fn box_holds(&self, point: DVec3) -> bool {
        let own = self.place.inverse().transform_point3(point);
        let positions = || self.shape.positions.iter().map(|position| position.as_dvec3());
        let low = positions().fold(DVec3::INFINITY, DVec3::min);
        let high = positions().fold(DVec3::NEG_INFINITY, DVec3::max);
        // A flat mesh has no inside.
        low.cmplt(high).all() && own.cmpge(low).all() && own.cmple(high).all()
    }

    /// Returns true if a lightmap or an irradiance volume lights it.
    pub fn takes_baked_light(&self) -> bool {
        self.lightmap.is_some() || self.volume.is_some()
    }

    /// Returns the light of the irradiance volume that lights it, if there is one, with this reflectance.
    pub fn volume_light(&self, point: DVec3, normal: DVec3, reflectance: DVec3) -> Option<DVec3> {
        self.volume.as_ref().map(|(volume, place)| reflectance * volume.light(place, point, normal))
    }

    /// Returns true if it is a refracting solid: transmissive and not thin.
    pub fn is_solid(&self) -> bool {
        self.passage() == Passage::Clear && !self.medium.thin
    }

    /// Returns true if its back is visible. Other backs are culled, as in the rasterizer.
    pub fn shows_back(&self) -> bool {
        self.material.double_sided || self.passage() == Passage::Clear
    }
}
