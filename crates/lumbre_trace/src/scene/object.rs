//! What a ray can meet, as the World has it: an object's shape, material and place. Not which ray meets it.

use std::sync::Arc;

use glam::{DAffine3, DMat3, DVec3, Vec3};
use lumbre_mesh::TriangleMesh;
use lumbre_optics::{AlphaMode, Material, ReflectionModel};
use lumbre_scene::{IrradianceVolume, LightmapImage, MaterialTextures, Medium, VolumePlace};

/// One object of the scene.
#[derive(Debug)]
pub(crate) struct Object {
    /// What people call it.
    pub name: String,
    pub shape: Arc<TriangleMesh>,
    pub material: Material,
    pub textures: MaterialTextures,
    pub medium: Medium,
    pub model: ReflectionModel,
    pub lightmap: Option<Arc<LightmapImage>>,
    /// What lights it, if it has no lightmap, and where that stands in the tracer's space.
    pub volume: Option<(Arc<IrradianceVolume>, VolumePlace)>,
    /// From the object's space to the tracer's.
    pub place: DAffine3,
    /// Of unit size, so that what counts as no normal does not depend on the scale.
    pub normals: DMat3,
    /// Its transform mirrors: the second and third corner of every triangle have changed places.
    pub mirrored: bool,
    /// The scene lights backs as backs.
    pub two_sided: bool,
}

/// How a ray gets past a surface without being reflected.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Passage {
    /// Not at all.
    Closed,
    /// Where its texture has a hole.
    Cut,
    /// In part, straight on: it covers what is behind in part.
    Covering,
    /// In part, through its matter.
    Clear,
}

impl Object {
    /// How rays get past it.
    pub fn passage(&self) -> Passage {
        match self.material.alpha_mode {
            AlphaMode::Mask { .. } => Passage::Cut,
            _ if self.transmission() != DVec3::ZERO => Passage::Clear,
            AlphaMode::Blend => Passage::Covering,
            AlphaMode::Opaque => Passage::Closed,
        }
    }

    /// k_t, 0 for what shows its colour whatever the light.
    pub fn transmission(&self) -> DVec3 {
        if self.material.unlit { DVec3::ZERO } else { self.material.transmission.as_dvec3() }
    }

    /// k_r.
    pub fn mirror(&self) -> DVec3 {
        if self.material.unlit { DVec3::ZERO } else { self.material.mirror.as_dvec3() }
    }

    /// It sends light by itself, on either side.
    pub fn glows(&self) -> bool {
        let back = self.material.back.as_ref().map_or(Vec3::ZERO, |back| back.emission);
        self.material.front.emission.max(back).max_element() > 0.0
    }

    /// Whether a point lies within the box around its mesh, in its own space.
    pub fn box_holds(&self, point: DVec3) -> bool {
        let own = self.place.inverse().transform_point3(point);
        let positions = || self.shape.positions.iter().map(|position| position.as_dvec3());
        let low = positions().fold(DVec3::INFINITY, DVec3::min);
        let high = positions().fold(DVec3::NEG_INFINITY, DVec3::max);
        // A sheet has no inside.
        low.cmplt(high).all() && own.cmpge(low).all() && own.cmple(high).all()
    }

    /// k_d E/π of the irradiance volume that lights it.
    pub fn volume_light(&self, point: DVec3, normal: DVec3, diffuse: DVec3) -> Option<DVec3> {
        self.volume.as_ref().map(|(volume, place)| diffuse * volume.light(place, point, normal))
    }

    /// It has an inside that light is refracted into.
    pub fn is_solid(&self) -> bool {
        self.passage() == Passage::Clear && !self.medium.thin
    }

    /// Its back is seen: of what is not, the rasterizer draws none.
    pub fn shows_back(&self) -> bool {
        self.material.double_sided || self.passage() == Passage::Clear
    }
}
