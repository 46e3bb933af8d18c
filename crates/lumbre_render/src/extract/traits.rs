//! What one object's components say that matters for shader variants and passes. Needs no device, so that a scene can be explained
//! without one. Which features of a shader follow from it is decided in `features`.

use glam::Vec3;
use lumbre_mesh::TriangleMesh;
use lumbre_optics::{AlphaMode, Distribution, Fresnel, Lobe, Material, ReflectionModel, Shading, Surface};
use lumbre_scene::MaterialTextures;

use crate::texture_sets;

/// The census of one object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Traits {
    /// Which material textures there are.
    pub texture_mask: u8,
    /// Which of them read the second set of coordinates.
    pub second_set: u8,
    pub vertex_color: bool,
    pub alpha_mode: AlphaMode,
    pub double_sided: bool,
    pub unlit: bool,
    /// Whether its front glows.
    pub glows: bool,
    /// Whether any light makes a highlight on it.
    pub specular: bool,
    /// Whether a highlight may be sharper than plain powers can tell.
    pub sharp: bool,
    pub lightmapped: bool,
    /// Whether its highlight is as glTF has it.
    pub energy_keeping: bool,
    pub distribution: Distribution,
    pub fresnel: Fresnel,
    pub shading: Option<Shading>,
    pub reflection: Option<ReflectionModel>,
}

/// The pass that draws an object; in this order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum LitPass {
    Lightmap,
    Forward,
    Transparent,
}

impl Traits {
    pub fn new(
        material: &Material,
        maps: Option<&MaterialTextures>,
        mesh: &TriangleMesh,
        lightmapped: bool,
        (shading, reflection): (Option<Shading>, Option<ReflectionModel>),
    ) -> Self {
        let back = material.back.as_ref().map_or(Vec3::ZERO, |back| back.specular);
        Self {
            texture_mask: maps.map_or(0, texture_sets::mask),
            second_set: maps.map_or(0, texture_sets::second_set),
            vertex_color: !mesh.colors.is_empty(),
            alpha_mode: material.alpha_mode,
            double_sided: material.double_sided,
            unlit: material.unlit,
            glows: material.front.emission != Vec3::ZERO,
            specular: material.front.specular != Vec3::ZERO
                || back != Vec3::ZERO
                || maps.is_some_and(|maps| maps.metallic_roughness.is_some()),
            sharp: material.front.has_sharp_highlight()
                || material.back.as_ref().is_some_and(Surface::has_sharp_highlight)
                || maps.is_some_and(|maps| maps.metallic_roughness.is_some()),
            lightmapped: lightmapped && !mesh.uv1.is_empty(),
            energy_keeping: material.lobe == Lobe::EnergyKeeping,
            distribution: material.distribution,
            fresnel: material.fresnel,
            shading,
            reflection,
        }
    }

    /// Whether its light comes from a lightmap in such a frame.
    pub fn uses_lightmap(&self, lightmaps: bool) -> bool {
        lightmaps && self.lightmapped && !self.unlit
    }

    /// The pass that draws it.
    pub fn pass(&self, lightmaps: bool) -> LitPass {
        match (self.alpha_mode, self.uses_lightmap(lightmaps)) {
            (AlphaMode::Blend, _) => LitPass::Transparent,
            (_, true) => LitPass::Lightmap,
            (_, false) => LitPass::Forward,
        }
    }
}
