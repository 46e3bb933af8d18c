//! The JSON types of the LUMBRE_* extensions, for reading and writing, and of other extensions, for reading.
//! Their keys are interpreted in `import_*` and `export_*`.
//!
//! Every key is optional, except the `image` of lightmaps and irradiance volumes. Besides the keys that the
//! format describes, three represent what a World holds but glTF has no place for: `LUMBRE_lights_phong.kind`
//! ("ambient"), `LUMBRE_object` and `LUMBRE_camera`.

use serde::{Deserialize, Serialize};

use super::frame_settings::FrameExtension;

type Color = [f64; 3];

/// `materials[i].extensions.LUMBRE_materials_phong`.
#[derive(Deserialize, Serialize, Clone, Debug, Default)]
pub(crate) struct PhongMaterial {
    #[serde(flatten)]
    pub front: PhongSurface,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub back: Option<PhongSurface>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mirror: Option<Color>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub transmission: Option<Color>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ior: Option<f64>,
    /// `bare` or `energy-keeping`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lobe: Option<String>,
    /// `cosine-power`, `gaussian` or `trowbridge-reitz`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub distribution: Option<String>,
    /// `dielectric`, `conductor` or `normal-reflectance`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fresnel: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub eta: Option<Color>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub absorption: Option<Color>,
    /// A transmissive surface is a thin sheet.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub thin: Option<bool>,
    /// The Fresnel equations split the light that passes.
    #[serde(rename = "fresnelSplit", skip_serializing_if = "Option::is_none")]
    pub fresnel_split: Option<bool>,
    #[serde(rename = "attenuationColor", skip_serializing_if = "Option::is_none")]
    pub attenuation_color: Option<Color>,
    /// In metres.
    #[serde(rename = "attenuationDistance", skip_serializing_if = "Option::is_none")]
    pub attenuation_distance: Option<f64>,
}

/// The coefficients of one side of a surface.
#[derive(Deserialize, Serialize, Clone, Debug, Default)]
pub(crate) struct PhongSurface {
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ambient: Option<Color>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub diffuse: Option<Color>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub specular: Option<Color>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub emission: Option<Color>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shininess: Option<f64>,
}

/// `KHR_lights_punctual.lights[i].extensions.LUMBRE_lights_phong`.
#[derive(Deserialize, Serialize, Clone, Debug, Default)]
#[serde(rename_all = "camelCase")]
pub(crate) struct PhongLight {
    #[serde(skip_serializing_if = "Option::is_none")]
    pub kind: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ambient: Option<Color>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub diffuse: Option<Color>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub specular: Option<Color>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub attenuation: Option<[f64; 3]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub attenuation_clamp: Option<bool>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub spot: Option<PhongSpot>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub enabled: Option<bool>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shadow: Option<bool>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bake: Option<String>,
    /// In metres.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub radius: Option<f64>,
    /// In radians.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub angle: Option<f64>,
}

/// OpenGL's cone, or with `inner` and `outer` that of KHR_lights_punctual (for directional lights, which have
/// no cone there).
#[derive(Deserialize, Serialize, Clone, Debug, Default)]
pub(crate) struct PhongSpot {
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cutoff: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub exponent: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub inner: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub outer: Option<f64>,
}

/// `scenes[i].extensions.LUMBRE_scene`.
#[derive(Deserialize, Serialize, Clone, Debug, Default)]
#[serde(rename_all = "camelCase")]
pub(crate) struct SceneExtension {
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ambient: Option<Color>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub background: Option<Color>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sky: Option<Color>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub local_viewer: Option<bool>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub two_sided: Option<bool>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reflection: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shading: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub flat_rule: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub specular_antialiasing: Option<bool>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fog: Option<FogExtension>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub frame: Option<FrameExtension>,
}

/// `LUMBRE_scene.fog`.
#[derive(Deserialize, Serialize, Clone, Debug, Default)]
pub(crate) struct FogExtension {
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mode: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub color: Option<Color>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub start: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub end: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub density: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub near_weight: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub far_weight: Option<f64>,
}

/// `nodes[i].extensions.LUMBRE_shading`.
#[derive(Deserialize, Serialize, Clone, Debug, Default)]
pub(crate) struct ShadingExtension {
    pub technique: Option<String>,
    pub reflection: Option<String>,
}

/// `nodes[i].extensions.LUMBRE_lightmap`.
#[derive(Deserialize, Serialize, Clone, Debug)]
#[serde(rename_all = "camelCase")]
pub(crate) struct LightmapExtension {
    pub image: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tex_coord: Option<u32>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub encoding: Option<String>,
}

/// `nodes[i].extensions.LUMBRE_irradiance_volume`. Import takes the texel format from the image; the key
/// `encoding` is for other programs.
#[derive(Deserialize, Serialize, Clone, Debug)]
pub(crate) struct IrradianceVolumeExtension {
    pub image: String,
    /// Runs of probes inside geometry as pairs of first index and count; x varies fastest, then y, then z.
    #[serde(default)]
    pub inside: Vec<u32>,
}

/// `nodes[i].extensions.LUMBRE_object`.
#[derive(Deserialize, Serialize, Clone, Debug, Default, PartialEq)]
#[serde(rename_all = "camelCase")]
pub(crate) struct ObjectExtension {
    /// `false` marks a mesh with a skin as static.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub dynamic: Option<bool>,
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub hidden: bool,
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub emissive_light: bool,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lightmap_scale: Option<f64>,
}

/// `nodes[i].extensions.LUMBRE_camera`, beside the node's `camera`.
#[derive(Deserialize, Serialize, Clone, Debug, Default)]
pub(crate) struct CameraExtension {
    #[serde(skip_serializing_if = "Option::is_none")]
    pub exposure: Option<f64>,
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub active: bool,
}

/// EXT_meshopt_compression of a buffer view: where the compressed data is, and what it decodes to.
#[derive(Deserialize, Debug)]
#[serde(rename_all = "camelCase")]
pub(crate) struct MeshoptView {
    pub buffer: usize,
    #[serde(default)]
    pub byte_offset: u64,
    pub byte_length: u64,
    pub byte_stride: u64,
    pub count: u64,
    pub mode: String,
    pub filter: Option<String>,
}

/// EXT_meshopt_compression of a buffer.
#[derive(Deserialize, Debug, Default)]
pub(crate) struct MeshoptBuffer {
    /// The buffer has no data: all views into it are compressed.
    #[serde(default)]
    pub fallback: bool,
}

/// KHR_draco_mesh_compression of a primitive: the view with the compressed data, and the id of each attribute
/// in it.
#[derive(Deserialize, Debug)]
#[serde(rename_all = "camelCase")]
pub(crate) struct DracoPrimitive {
    pub buffer_view: usize,
    #[serde(default)]
    pub attributes: std::collections::BTreeMap<String, u32>,
}

/// KHR_texture_basisu and EXT_texture_webp of a texture: the image that replaces its `source`.
#[derive(Deserialize, Debug)]
pub(crate) struct TextureSource {
    pub source: usize,
}

/// EXT_mesh_gpu_instancing of a node: the accessor of each per-instance attribute, by the attribute's name.
#[derive(Deserialize, Debug)]
pub(crate) struct Instancing {
    #[serde(default)]
    pub attributes: std::collections::BTreeMap<String, usize>,
}

/// KHR_animation_pointer of an animation channel's target: the JSON pointer to the animated value.
#[derive(Deserialize, Debug)]
pub(crate) struct AnimationPointer {
    pub pointer: String,
}

/// KHR_materials_emissive_strength.
#[derive(Deserialize, Debug, Default)]
#[serde(rename_all = "camelCase")]
pub(crate) struct EmissiveStrength {
    pub emissive_strength: Option<f64>,
}

/// KHR_materials_ior.
#[derive(Deserialize, Debug, Default)]
pub(crate) struct IndexOfRefraction {
    pub ior: Option<f64>,
}

/// KHR_materials_specular.
#[derive(Deserialize, Debug, Default)]
#[serde(rename_all = "camelCase")]
pub(crate) struct Specular {
    pub specular_factor: Option<f64>,
    pub specular_color_factor: Option<Color>,
    pub specular_texture: Option<serde_json::Value>,
    pub specular_color_texture: Option<serde_json::Value>,
}

/// KHR_materials_transmission.
#[derive(Deserialize, Debug, Default)]
#[serde(rename_all = "camelCase")]
pub(crate) struct Transmission {
    pub transmission_factor: Option<f64>,
    pub transmission_texture: Option<serde_json::Value>,
}

/// KHR_materials_volume.
#[derive(Deserialize, Debug, Default)]
#[serde(rename_all = "camelCase")]
pub(crate) struct Volume {
    pub thickness_factor: Option<f64>,
    pub thickness_texture: Option<serde_json::Value>,
    pub attenuation_distance: Option<f64>,
    pub attenuation_color: Option<Color>,
}

/// KHR_texture_transform.
#[derive(Deserialize, Debug, Default)]
#[serde(rename_all = "camelCase")]
pub(crate) struct TextureTransform {
    pub offset: Option<[f64; 2]>,
    pub rotation: Option<f64>,
    pub scale: Option<[f64; 2]>,
    pub tex_coord: Option<u32>,
}

/// `nodes[i].extensions.KHR_lights_punctual`.
#[derive(Deserialize, Debug)]
pub(crate) struct LightReference {
    pub light: usize,
}
