//! What one object's components say that matters for shader variants and passes. Needs no device, so that a scene can be explained
//! without one.

use glam::Vec3;
use lumbre_mesh::TriangleMesh;
use lumbre_optics::{
    AlphaMode, Distribution, FogMode, Fresnel, Lobe, Material, ReflectionModel, Shading, Surface,
};
use lumbre_scene::{MaterialTextures, SceneSettings};

use super::lights::{LightCounts, LightSet, UNIFORM_LIGHTS};
use crate::shader::{Feature, Variant};
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

/// What all variants of a frame have in common.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FrameFeatures {
    pub shading: Option<Shading>,
    pub reflection: Option<ReflectionModel>,
    pub lightmaps: bool,
    pub specular_antialiasing: bool,
    pub clamp: bool,
    /// The frame is kept in half floats.
    pub half: bool,
    pub lights: LightSet,
    /// Fragments find lights with a range by clusters.
    pub clustered: bool,
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
    fn uses_lightmap(&self, lightmaps: bool) -> bool {
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

    /// The features that it calls for in such a frame.
    pub fn variant(&self, settings: &SceneSettings, frame: &FrameFeatures) -> Variant {
        let shading = frame.shading.or(self.shading).unwrap_or(settings.shading);
        let reflection = frame.reflection.or(self.reflection).unwrap_or(settings.reflection);
        let mut variant = Variant::new(shading, reflection);
        let lit = !self.unlit;
        let lightmapped = self.uses_lightmap(frame.lightmaps);
        for (feature, bound) in texture_sets::features(self.texture_mask) {
            variant.set(feature, bound);
        }
        variant.set(Feature::VertexColor, self.vertex_color);
        variant.set(Feature::Alpha, self.alpha_mode != AlphaMode::Opaque);
        variant.set(Feature::AlphaMask, matches!(self.alpha_mode, AlphaMode::Mask { .. }));
        variant.set(Feature::Lightmap, lightmapped);
        variant.set(Feature::TwoSided, self.double_sided && settings.two_sided);
        variant.set(Feature::Lit, lit);
        let clustered = frame.clustered && lit && shading == Shading::Phong;
        let LightSet { every, unbounded, inverse_square, ranged, .. } = &frame.lights;
        let listed = if clustered { unbounded } else { every };
        // Of a baked light the highlight is left, if the material has one, and what the light adds to the ambient term.
        let left =
            |of: &LightCounts| of.all > of.dynamic && (!lightmapped || self.specular || of.static_ambient);
        variant.set(Feature::DynamicLights, listed.dynamic > 0);
        variant.set(Feature::StaticLights, left(listed));
        let reads = |of: &LightCounts| clustered && (of.dynamic > 0 || left(of));
        variant.set(Feature::InverseSquareClusters, reads(inverse_square));
        variant.set(Feature::UniformLights, reads(inverse_square) && inverse_square.all <= UNIFORM_LIGHTS);
        variant.set(Feature::RangedClusters, reads(ranged));
        for kinds in [Some(listed), clustered.then_some(ranged)].into_iter().flatten() {
            variant.set(Feature::DirectionalLights, kinds.directional);
            variant.set(Feature::PointLights, kinds.point);
            variant.set(Feature::SpotLights, kinds.spot);
            variant.set(Feature::PolygonLights, kinds.polygon);
        }
        variant.set(Feature::Matt, lit && !self.specular);
        variant.set(Feature::SharpHighlights, self.sharp);
        if self.specular {
            let (distribution, fresnel) = (self.distribution, self.fresnel);
            let chosen = (distribution, fresnel) != (Distribution::default(), Fresnel::default());
            variant.set(Feature::EnergyKeeping, self.energy_keeping);
            variant.set(Feature::Microfacets, chosen);
            variant.set(Feature::DistributionCosinePower, distribution == Distribution::CosinePower);
            variant.set(Feature::DistributionGaussian, distribution == Distribution::Gaussian);
            variant.set(Feature::FresnelConductor, matches!(fresnel, Fresnel::Conductor { .. }));
            variant.set(Feature::FresnelNormalReflectance, fresnel == Fresnel::NormalReflectance);
        }
        variant.set(Feature::LocalViewer, settings.local_viewer);
        if let Some(fog) = &settings.fog {
            variant.set(Feature::Fog, true);
            let feature = match fog.mode {
                FogMode::Linear { .. } => Feature::FogLinear,
                FogMode::Exponential { .. } => Feature::FogExponential,
                FogMode::ExponentialSquared { .. } => Feature::FogExponentialSquared,
                FogMode::DepthCue { .. } => Feature::FogDepthCue,
            };
            variant.set(feature, true);
        }
        let per_vertex = lit && shading != Shading::Phong;
        // Only a highlight that is evaluated per fragment can fall between pixels.
        let filtered = frame.specular_antialiasing && lit && !per_vertex && self.specular;
        variant.set(Feature::SpecularAntialiasing, filtered);
        variant.set(Feature::Clamp, frame.clamp);
        // What is clamped to 1 overflows nothing.
        variant.set(Feature::HalfRange, frame.half && !frame.clamp);
        variant.set(Feature::ClampVertices, frame.clamp && per_vertex);
        variant.set(Feature::Modulated, per_vertex && variant.has(Feature::BaseColorTexture));
        let mut variant = variant.reduced();
        // The coordinates of the textures that are left.
        let read = |second: bool| {
            let slots = (0..).zip(texture_sets::features(self.texture_mask));
            slots
                .filter(|(slot, _)| (self.second_set & (1 << slot) != 0) == second)
                .any(|(_, (feature, _))| variant.has(feature))
        };
        let (first, second) = (read(false), read(true));
        variant.set(Feature::Uv0, first);
        variant.set(Feature::Uv1, second || variant.has(Feature::Lightmap));
        variant
    }
}
