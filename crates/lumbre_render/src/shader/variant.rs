//! Shader variants: the set of features that a draw needs. What is not in the set is not in the shader.

use lumbre_optics::{ReflectionModel, Shading};

use crate::Display;

macro_rules! features {
    ($($(#[$doc:meta])* $name:ident = $bit:literal => $word:literal),+ $(,)?) => {
        /// A feature that a shader may or may not have.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        #[repr(u64)]
        pub enum Feature {
            $($(#[$doc])* $name = 1 << $bit),+
        }

        impl Feature {
            /// Every feature.
            pub const ALL: &'static [Self] = &[$(Self::$name),+];

            /// Returns its name in the shaders.
            pub fn name(self) -> &'static str {
                match self { $(Self::$name => $word),+ }
            }
        }
    };
}

features! {
    /// Reads TEXCOORD_0.
    Uv0 = 0 => "UV0",
    /// Reads TEXCOORD_1.
    Uv1 = 1 => "UV1",
    /// Multiplies by vertex colours.
    VertexColor = 2 => "VERTEX_COLOR",
    /// Samples a base colour texture.
    BaseColorTexture = 3 => "BASE_COLOR_TEXTURE",
    /// Samples an emissive texture.
    EmissiveTexture = 4 => "EMISSIVE_TEXTURE",
    /// Samples a metallic-roughness texture.
    MetallicRoughnessTexture = 5 => "METALLIC_ROUGHNESS_TEXTURE",
    /// Writes alpha.
    Alpha = 6 => "ALPHA",
    /// Discards fragments below the alpha cutoff.
    AlphaMask = 7 => "ALPHA_MASK",
    /// Samples a lightmap.
    Lightmap = 8 => "LIGHTMAP",
    /// Lights back faces with their own side of the material.
    TwoSided = 9 => "TWO_SIDED",
    /// Is lit at all.
    Lit = 10 => "LIT",
    /// Loops over dynamic lights.
    DynamicLights = 11 => "DYNAMIC_LIGHTS",
    /// Loops over baked lights.
    StaticLights = 12 => "STATIC_LIGHTS",
    /// Supports directional lights.
    DirectionalLights = 13 => "DIRECTIONAL_LIGHTS",
    /// Supports point lights.
    PointLights = 14 => "POINT_LIGHTS",
    /// Supports spot cones.
    SpotLights = 15 => "SPOT_LIGHTS",
    /// The viewer is at a finite distance.
    LocalViewer = 16 => "LOCAL_VIEWER",
    /// Linear fog.
    FogLinear = 17 => "FOG_LINEAR",
    /// Exponential fog.
    FogExponential = 18 => "FOG_EXPONENTIAL",
    /// Squared exponential fog.
    FogExponentialSquared = 19 => "FOG_EXPONENTIAL_SQUARED",
    /// Depth cueing.
    FogDepthCue = 20 => "FOG_DEPTH_CUE",
    /// Any fog.
    Fog = 21 => "FOG",
    /// Clamps to [0, 1] as OpenGL does.
    Clamp = 22 => "CLAMP",
    /// Clamps vertex colours before interpolation.
    ClampVertices = 23 => "CLAMP_VERTICES",
    /// Light from the vertex stage is modulated per fragment, so specular light is passed on separately.
    Modulated = 24 => "MODULATED",
    /// Uses the precise form of highlights, for exponents above 256.
    SharpHighlights = 25 => "SHARP_HIGHLIGHTS",
    /// Widens highlights by how much the normals change within a pixel.
    SpecularAntialiasing = 26 => "SPECULAR_ANTIALIASING",
    /// Supports the faces of emissive objects as lights.
    PolygonLights = 27 => "POLYGON_LIGHTS",
    /// Torrance-Sparrow with a distribution or a Fresnel reflectance other than the defaults.
    Microfacets = 28 => "MICROFACETS",
    /// The microfacet distribution is a power of the cosine.
    DistributionCosinePower = 29 => "DISTRIBUTION_COSINE_POWER",
    /// The microfacet distribution is a Gaussian.
    DistributionGaussian = 30 => "DISTRIBUTION_GAUSSIAN",
    /// The microfacets are those of a conductor.
    FresnelConductor = 31 => "FRESNEL_CONDUCTOR",
    /// The microfacets reflect k_s at normal incidence.
    FresnelNormalReflectance = 32 => "FRESNEL_NORMAL_REFLECTANCE",
    /// Writes half floats, and clamps to the largest one.
    HalfRange = 33 => "HALF_RANGE",
    /// Has no highlight: every specular coefficient is 0.
    Matt = 34 => "MATT",
    /// Reads lists of the lights that reach a cluster of pixels.
    Clusters = 35 => "CLUSTERS",
    /// Loops over a cluster's inverse-square lights.
    InverseSquareClusters = 36 => "INVERSE_SQUARE_CLUSTERS",
    /// Reads these lights from a uniform buffer, which has room for all of them.
    UniformLights = 37 => "UNIFORM_LIGHTS",
    /// Loops over a cluster's other lights with a range.
    RangedClusters = 38 => "RANGED_CLUSTERS",
    /// Loops over a cluster's inverse-square lights that cast a shadow.
    ShadowedClusters = 60 => "SHADOWED_CLUSTERS",
    /// Samples a normal map.
    NormalTexture = 39 => "NORMAL_TEXTURE",
    /// Samples an occlusion texture.
    OcclusionTexture = 40 => "OCCLUSION_TEXTURE",
    /// Its highlight is normalized, like glTF's.
    EnergyConserving = 41 => "ENERGY_CONSERVING",
    /// Writes the target's final values; the frame has no display pass.
    Display = 42 => "DISPLAY",
    /// Applies a tone curve, for viewing.
    DisplaySrgb = 43 => "DISPLAY_SRGB",
    /// Applies OpenGL's clamp.
    DisplayClamp = 44 => "DISPLAY_CLAMP",
    /// Encodes sRGB, because the target's format does not.
    EncodeSrgb = 45 => "ENCODE_SRGB",
    /// Decodes sRGB, because the target's format would encode values that are to be stored unchanged.
    DecodeSrgb = 46 => "DECODE_SRGB",
    /// Reads shadow maps.
    Shadows = 47 => "SHADOWS",
    /// Supports the six views of a point light.
    ShadowCubes = 48 => "SHADOW_CUBES",
    /// Supports the cascades of a directional light.
    ShadowCascades = 49 => "SHADOW_CASCADES",
    /// Filters shadows by the size of the light.
    SoftShadows = 50 => "SOFT_SHADOWS",
    /// Loops over lights of any kind, so it needs points and normals.
    Lights = 51 => "LIGHTS",
    /// Has the same colour everywhere, which the vertex stage computes.
    Constant = 52 => "CONSTANT",
    /// Some of a cluster's inverse-square lights, with a shadow or without, have a cone.
    InverseSquareSpots = 53 => "INVERSE_SQUARE_SPOTS",
    /// Samples an irradiance volume.
    IrradianceVolume = 54 => "IRRADIANCE_VOLUME",
    /// Counts the lights that it tests and those that contribute.
    CountLights = 55 => "COUNT_LIGHTS",
    /// Reads a single texel of a shadow map.
    HardShadows = 56 => "HARD_SHADOWS",
    /// Draws a surface into the G-buffer.
    GBuffer = 57 => "G_BUFFER",
    /// The G-buffer has details.
    GBufferDetails = 58 => "G_BUFFER_DETAILS",
    /// Lights the surfaces in the G-buffer.
    Deferred = 59 => "DEFERRED",
    /// Reflects baked light like a metal.
    BakedMetal = 61 => "BAKED_METAL",
    /// Lights the surfaces in the G-buffer in a compute shader.
    InCompute = 62 => "IN_COMPUTE",
}

/// The feature flag of shaders that read the tables of a frame: whether the tables are textures.
pub(crate) const TABLES_IN_TEXTURES: &str = "TABLES_IN_TEXTURES";

/// The feature flag of lit shaders whose fragments load records for each other.
const SUBGROUPS_OF_8: &str = "SUBGROUPS_OF_8";

/// How the lit shaders of a device read tables.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct TableAccess {
    /// Tables are textures instead of storage buffers.
    pub in_textures: bool,
    /// Fragments can load records for each other.
    pub shared: bool,
}

/// Features that are decided by the frame, its lights and their lists, not by a material alone.
const OF_THE_FRAME: u64 = Feature::Lightmap as u64
    | Feature::IrradianceVolume as u64
    | Feature::Lit as u64
    | Feature::DynamicLights as u64
    | Feature::StaticLights as u64
    | Feature::DirectionalLights as u64
    | Feature::PointLights as u64
    | Feature::SpotLights as u64
    | Feature::PolygonLights as u64
    | Feature::FogLinear as u64
    | Feature::FogExponential as u64
    | Feature::FogExponentialSquared as u64
    | Feature::FogDepthCue as u64
    | Feature::Fog as u64
    | Feature::Clamp as u64
    | Feature::ClampVertices as u64
    | Feature::HalfRange as u64
    | Feature::Clusters as u64
    | Feature::InverseSquareClusters as u64
    | Feature::UniformLights as u64
    | Feature::RangedClusters as u64
    | Feature::ShadowedClusters as u64
    | Feature::InverseSquareSpots as u64
    | Feature::Display as u64
    | Feature::DisplaySrgb as u64
    | Feature::DisplayClamp as u64
    | Feature::EncodeSrgb as u64
    | Feature::DecodeSrgb as u64
    | Feature::Shadows as u64
    | Feature::ShadowCubes as u64
    | Feature::ShadowCascades as u64
    | Feature::SoftShadows as u64
    | Feature::HardShadows as u64
    | Feature::CountLights as u64
    | Feature::GBuffer as u64
    | Feature::GBufferDetails as u64
    | Feature::Deferred as u64
    | Feature::InCompute as u64;

/// Features that make the colour of a surface vary over it, or between its front and its back.
const VARYING: u64 = Feature::Lights as u64
    | Feature::Lightmap as u64
    | Feature::IrradianceVolume as u64
    | Feature::VertexColor as u64
    | Feature::BaseColorTexture as u64
    | Feature::EmissiveTexture as u64
    | Feature::MetallicRoughnessTexture as u64
    | Feature::OcclusionTexture as u64
    | Feature::Alpha as u64
    | Feature::TwoSided as u64
    | Feature::Fog as u64;

/// A variant of the shaders of lit surfaces: of the forward shader, or of those for deferred shading.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Variant {
    /// Rate of evaluation.
    pub shading: Shading,
    /// Specular model.
    pub reflection: ReflectionModel,
    bits: u64,
}

impl Variant {
    /// Creates a variant without features.
    pub fn new(shading: Shading, reflection: ReflectionModel) -> Self {
        Self { shading, reflection, bits: 0 }
    }

    /// Adds a feature if it is called for.
    pub fn set(&mut self, feature: Feature, called_for: bool) {
        if called_for {
            self.bits |= feature as u64;
        }
    }

    /// Returns the variant without these features.
    pub(crate) fn without(mut self, features: &[Feature]) -> Self {
        features.iter().for_each(|feature| self.bits &= !(*feature as u64));
        self
    }

    /// Returns true if a lightmap is bound. The geometry pass stores only its coordinates in the G-buffer.
    pub(crate) fn samples_lightmap(&self) -> bool {
        self.has(Feature::Lightmap) && !self.has(Feature::GBuffer)
    }

    /// Returns the number of textures that it draws into.
    pub(crate) fn targets(&self) -> usize {
        if self.has(Feature::GBuffer) && self.has(Feature::GBufferDetails) { 2 } else { 1 }
    }

    /// Returns the shader module that it is a variant of.
    pub(crate) fn module(&self) -> &'static str {
        match (self.has(Feature::GBuffer), self.has(Feature::Deferred)) {
            (true, _) => "g_buffer",
            (_, true) => "deferred_lighting",
            (false, false) => "forward",
        }
    }

    /// Returns true if it has the feature.
    pub fn has(&self, feature: Feature) -> bool {
        self.bits & feature as u64 != 0
    }

    /// Returns true if both use the same light from the same lists and write the same kind of values. They
    /// can only differ in what the material alone decides.
    pub(crate) fn is_lit_as(&self, other: &Self) -> bool {
        (self.bits ^ other.bits) & OF_THE_FRAME == 0 && self.shading == other.shading
    }

    /// Returns a measure of how much two variants differ, for comparing candidates.
    pub(crate) fn differences(&self, other: &Self) -> (u32, bool, u64) {
        let differ = self.bits ^ other.bits;
        (differ.count_ones(), self.reflection != other.reflection, differ)
    }

    /// Returns the variant without features that have no effect, so that fewer pipelines are created.
    pub fn reduced(mut self) -> Self {
        if !self.has(Feature::Lit) {
            // An unlit surface needs neither lights nor normals, whatever its shading.
            let keep = !(Feature::DynamicLights as u64
                | Feature::StaticLights as u64
                | Feature::InverseSquareClusters as u64
                | Feature::ShadowedClusters as u64
                | Feature::RangedClusters as u64
                | Feature::LocalViewer as u64
                | Feature::TwoSided as u64
                | Feature::Lightmap as u64
                | Feature::IrradianceVolume as u64
                | Feature::BakedMetal as u64
                | Feature::NormalTexture as u64
                | Feature::OcclusionTexture as u64
                | Feature::MetallicRoughnessTexture as u64);
            self.bits &= keep;
            (self.shading, self.reflection) = (Shading::Flat, ReflectionModel::Phong);
        }
        if self.shading != Shading::Phong {
            // Light is not evaluated per fragment, and vertices do not use clusters.
            self.bits &= !(Feature::SpecularAntialiasing as u64
                | Feature::NormalTexture as u64
                | Feature::InverseSquareClusters as u64
                | Feature::ShadowedClusters as u64
                | Feature::RangedClusters as u64);
        }
        let shadowed = self.has(Feature::ShadowedClusters);
        self.set(Feature::Shadows, shadowed);
        let clusters =
            self.has(Feature::InverseSquareClusters) || shadowed || self.has(Feature::RangedClusters);
        self.bits &= !(Feature::Clusters as u64);
        self.set(Feature::Clusters, clusters);
        if !self.has(Feature::InverseSquareClusters) {
            self.bits &= !(Feature::UniformLights as u64);
        }
        if !self.has(Feature::InverseSquareClusters) && !shadowed {
            self.bits &= !(Feature::InverseSquareSpots as u64);
        }
        let listed = self.has(Feature::DynamicLights) || self.has(Feature::StaticLights);
        if !listed && !self.has(Feature::RangedClusters) {
            // The remaining inverse-square lights need no kinds.
            self.bits &= !(Feature::DirectionalLights as u64
                | Feature::PointLights as u64
                | Feature::SpotLights as u64
                | Feature::PolygonLights as u64);
        }
        if !self.has(Feature::Shadows) || !listed && !shadowed && !self.has(Feature::RangedClusters) {
            self.bits &= !(Feature::Shadows as u64
                | Feature::ShadowCubes as u64
                | Feature::ShadowCascades as u64
                | Feature::SoftShadows as u64
                | Feature::HardShadows as u64);
        }
        self.bits &= !(Feature::Lights as u64 | Feature::Constant as u64);
        self.set(Feature::Lights, listed || clusters);
        if !listed && !clusters {
            let by_volume = self.has(Feature::IrradianceVolume);
            if self.has(Feature::Lit) && !self.has(Feature::ClampVertices) && !by_volume {
                // Without lights the rate of evaluation makes no difference.
                self.shading = Shading::Phong;
                self.bits &= !(Feature::Modulated as u64);
            }
            self.bits &= !(Feature::SharpHighlights as u64
                | Feature::SpecularAntialiasing as u64
                | Feature::LocalViewer as u64
                | Feature::EnergyConserving as u64
                | Feature::CountLights as u64
                | Feature::Matt as u64);
            if by_volume {
                // A volume lights the normals of a normal map, but gives no highlight.
                self.set(Feature::Matt, true);
            } else {
                self.bits &= !(Feature::NormalTexture as u64);
            }
            self.reflection = ReflectionModel::Phong;
        }
        if self.has(Feature::Matt) {
            // Without a highlight nothing depends on the viewer.
            self.bits &= !(Feature::SharpHighlights as u64
                | Feature::SpecularAntialiasing as u64
                | Feature::EnergyConserving as u64
                | Feature::LocalViewer as u64);
            self.reflection = ReflectionModel::Phong;
        }
        if self.reflection != ReflectionModel::TorranceSparrow || self.has(Feature::EnergyConserving) {
            self.bits &= !(Feature::Microfacets as u64
                | Feature::DistributionCosinePower as u64
                | Feature::DistributionGaussian as u64
                | Feature::FresnelConductor as u64
                | Feature::FresnelNormalReflectance as u64);
        }
        let evaluated_once = !self.has(Feature::Lit) || self.shading == Shading::Phong;
        self.set(Feature::Constant, evaluated_once && self.bits & VARYING == 0);
        self
    }

    /// Returns true if its fragments load records for each other on a device that can do that. Fragments that
    /// count lights do not: each counts those of its own lists. Nor do compute shaders, which are for GPUs.
    pub(super) fn shares_records(&self) -> bool {
        self.shading == Shading::Phong
            && self.has(Feature::Lights)
            && !self.has(Feature::CountLights)
            && !self.has(Feature::GBuffer)
            && !self.has(Feature::InCompute)
    }

    /// Returns the shader's feature flags on a device that reads tables this way: each name, and whether it
    /// is on.
    pub(crate) fn flags(&self, tables: TableAccess) -> Vec<(&'static str, bool)> {
        let features = Feature::ALL.iter().map(|feature| (feature.name(), self.has(*feature)));
        let shading = [
            ("SHADING_FLAT", Shading::Flat),
            ("SHADING_GOURAUD", Shading::Gouraud),
            ("SHADING_PHONG", Shading::Phong),
        ];
        let reflection = [
            ("REFLECTION_PHONG", ReflectionModel::Phong),
            ("REFLECTION_BLINN", ReflectionModel::Blinn),
            ("REFLECTION_BLINN_4N", ReflectionModel::Blinn4n),
            ("REFLECTION_BLINN_MATCHED", ReflectionModel::BlinnMatched),
            ("REFLECTION_TORRANCE_SPARROW", ReflectionModel::TorranceSparrow),
        ];
        features
            // Ambient lights are summed before the frame, so no shader handles them.
            .chain([("AMBIENT_LIGHTS", false), (TABLES_IN_TEXTURES, tables.in_textures)])
            .chain([(SUBGROUPS_OF_8, tables.shared && self.shares_records())])
            .chain(shading.map(|(name, value)| (name, value == self.shading)))
            .chain(reflection.map(|(name, value)| (name, value == self.reflection)))
            .collect()
    }
}

impl std::fmt::Display for Variant {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let mut separator = "";
        for (name, on) in self.flags(TableAccess::default()) {
            if on {
                write!(formatter, "{separator}{name}")?;
                separator = " ";
            }
        }
        Ok(())
    }
}

/// How colours are converted to the values of a target.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct DisplayVariant {
    /// The kind of conversion.
    pub display: Display,
    /// The shader encodes sRGB, because the target's format does not.
    pub encode: bool,
    /// The shader decodes sRGB, because the target's format encodes and is to store the values unchanged.
    pub decode: bool,
}

impl DisplayVariant {
    /// Creates the variant for a target of this format.
    pub fn new(display: Display, target: wgpu::TextureFormat) -> Self {
        let shown = display == Display::Srgb;
        Self { display, encode: shown && !target.is_srgb(), decode: !shown && target.is_srgb() }
    }

    /// Returns the features that it needs.
    pub(crate) fn features(self) -> [(Feature, bool); 4] {
        [
            (Feature::DisplaySrgb, self.display == Display::Srgb),
            (Feature::DisplayClamp, self.display == Display::Clamp),
            (Feature::EncodeSrgb, self.encode),
            (Feature::DecodeSrgb, self.decode),
        ]
    }

    pub(crate) fn flags(self) -> Vec<(&'static str, bool)> {
        self.features().map(|(feature, on)| (feature.name(), on)).to_vec()
    }
}
