//! The JSON of a glTF 2.0 file as plain data. Types are checked, but indices and ranges are not, and buffers
//! are not loaded.
//!
//! Buffers, buffer views, images and samplers use the types of the `gltf` crate. The other types are defined
//! here, because that crate stores numbers as f32, requires a texture's `source` and an animation target's
//! `node`, and drops values and names that it does not know (docs/decisions.md). Every list is parsed element
//! by element, so that an error can name the element.

use gltf::json;
use serde::Deserialize;
use serde::de::DeserializeOwned;
use serde_json::{Map, Value};

use super::error::{LoadProblem, Notes};

/// Extension objects by name.
pub(crate) type Extensions = Map<String, Value>;

#[derive(Deserialize, Debug, Default)]
pub(crate) struct Scene {
    #[serde(default)]
    pub nodes: Vec<usize>,
    #[serde(default)]
    pub extensions: Extensions,
}

#[derive(Deserialize, Debug, Default)]
pub(crate) struct Node {
    pub name: Option<String>,
    #[serde(default)]
    pub children: Vec<usize>,
    pub mesh: Option<usize>,
    pub camera: Option<usize>,
    pub skin: Option<usize>,
    pub matrix: Option<[f64; 16]>,
    pub translation: Option<[f64; 3]>,
    pub rotation: Option<[f64; 4]>,
    pub scale: Option<[f64; 3]>,
    #[serde(default)]
    pub extensions: Extensions,
    pub extras: Option<Value>,
}

#[derive(Deserialize, Debug)]
pub(crate) struct Mesh {
    pub name: Option<String>,
    #[serde(default)]
    pub primitives: Vec<Primitive>,
}

#[derive(Deserialize, Debug)]
pub(crate) struct Primitive {
    pub attributes: Map<String, Value>,
    pub indices: Option<usize>,
    pub material: Option<usize>,
    pub mode: Option<u32>,
    pub targets: Option<Value>,
    #[serde(default)]
    pub extensions: Extensions,
}

#[derive(Deserialize, Debug)]
#[serde(rename_all = "camelCase")]
pub(crate) struct Accessor {
    pub name: Option<String>,
    pub buffer_view: Option<usize>,
    #[serde(default)]
    pub byte_offset: u64,
    pub component_type: u32,
    #[serde(default)]
    pub normalized: bool,
    pub count: u64,
    #[serde(rename = "type")]
    pub shape: String,
    pub sparse: Option<Sparse>,
}

#[derive(Deserialize, Debug)]
pub(crate) struct Sparse {
    pub count: u64,
    pub indices: SparseIndices,
    pub values: SparseValues,
}

#[derive(Deserialize, Debug)]
#[serde(rename_all = "camelCase")]
pub(crate) struct SparseIndices {
    pub buffer_view: usize,
    #[serde(default)]
    pub byte_offset: u64,
    pub component_type: u32,
}

#[derive(Deserialize, Debug)]
#[serde(rename_all = "camelCase")]
pub(crate) struct SparseValues {
    pub buffer_view: usize,
    #[serde(default)]
    pub byte_offset: u64,
}

#[derive(Deserialize, Debug, Default)]
#[serde(rename_all = "camelCase")]
pub(crate) struct Material {
    pub name: Option<String>,
    #[serde(default)]
    pub pbr_metallic_roughness: MetallicRoughness,
    pub normal_texture: Option<NormalTextureInfo>,
    pub occlusion_texture: Option<OcclusionTextureInfo>,
    pub emissive_texture: Option<TextureInfo>,
    pub emissive_factor: Option<[f64; 3]>,
    pub alpha_mode: Option<String>,
    pub alpha_cutoff: Option<f64>,
    #[serde(default)]
    pub double_sided: bool,
    #[serde(default)]
    pub extensions: Extensions,
}

#[derive(Deserialize, Debug, Default)]
#[serde(rename_all = "camelCase")]
pub(crate) struct MetallicRoughness {
    pub base_color_factor: Option<[f64; 4]>,
    pub base_color_texture: Option<TextureInfo>,
    pub metallic_factor: Option<f64>,
    pub roughness_factor: Option<f64>,
    pub metallic_roughness_texture: Option<TextureInfo>,
}

#[derive(Deserialize, Debug)]
#[serde(rename_all = "camelCase")]
pub(crate) struct TextureInfo {
    pub index: usize,
    #[serde(default)]
    pub tex_coord: u32,
    #[serde(default)]
    pub extensions: Extensions,
}

#[derive(Deserialize, Debug)]
pub(crate) struct NormalTextureInfo {
    #[serde(flatten)]
    pub texture: TextureInfo,
    pub scale: Option<f64>,
}

#[derive(Deserialize, Debug)]
pub(crate) struct OcclusionTextureInfo {
    #[serde(flatten)]
    pub texture: TextureInfo,
    pub strength: Option<f64>,
}

#[derive(Deserialize, Debug)]
pub(crate) struct Texture {
    pub sampler: Option<usize>,
    pub source: Option<usize>,
    #[serde(default)]
    pub extensions: Extensions,
}

#[derive(Deserialize, Debug)]
pub(crate) struct Camera {
    pub name: Option<String>,
    #[serde(rename = "type")]
    pub kind: String,
    pub perspective: Option<Perspective>,
    pub orthographic: Option<Orthographic>,
}

#[derive(Deserialize, Debug)]
#[serde(rename_all = "camelCase")]
pub(crate) struct Perspective {
    pub aspect_ratio: Option<f64>,
    pub yfov: f64,
    pub znear: f64,
    pub zfar: Option<f64>,
}

#[derive(Deserialize, Debug)]
pub(crate) struct Orthographic {
    pub xmag: f64,
    pub ymag: f64,
    pub znear: f64,
    pub zfar: f64,
}

#[derive(Deserialize, Debug)]
pub(crate) struct Animation {
    #[serde(default)]
    pub channels: Vec<Channel>,
}

#[derive(Deserialize, Debug)]
pub(crate) struct Channel {
    pub target: Target,
}

#[derive(Deserialize, Debug)]
pub(crate) struct Target {
    pub node: Option<usize>,
    #[serde(default)]
    pub extensions: Extensions,
}

/// `KHR_lights_punctual.lights[i]`.
#[derive(Deserialize, Debug)]
pub(crate) struct PunctualLight {
    pub name: Option<String>,
    #[serde(rename = "type")]
    pub kind: String,
    pub color: Option<[f64; 3]>,
    pub intensity: Option<f64>,
    pub range: Option<f64>,
    pub spot: Option<PunctualSpot>,
    #[serde(default)]
    pub extensions: Extensions,
}

#[derive(Deserialize, Debug, Default)]
#[serde(rename_all = "camelCase")]
pub(crate) struct PunctualSpot {
    pub inner_cone_angle: Option<f64>,
    pub outer_cone_angle: Option<f64>,
}

/// The parsed JSON of a file.
#[derive(Debug)]
pub(crate) struct Document {
    pub scene: Option<usize>,
    pub scenes: Vec<Scene>,
    pub nodes: Vec<Node>,
    pub meshes: Vec<Mesh>,
    pub accessors: Vec<Accessor>,
    pub buffer_views: Vec<json::buffer::View>,
    pub buffers: Vec<json::Buffer>,
    pub materials: Vec<Material>,
    pub textures: Vec<Texture>,
    pub images: Vec<json::Image>,
    pub samplers: Vec<json::texture::Sampler>,
    pub cameras: Vec<Camera>,
    pub animations: Vec<Animation>,
    pub skins: usize,
    pub lights: Vec<PunctualLight>,
    /// For each light, whether its intensity is in candela or lux.
    pub photometric: Vec<bool>,
    pub extensions_used: Vec<String>,
    pub extensions_required: Vec<String>,
}

impl Document {
    /// Parses the JSON of a file. Checks types and the glTF version, but not indices or ranges.
    pub(crate) fn from_root(mut root: Map<String, Value>, notes: &mut Notes) -> Result<Self, LoadProblem> {
        let at = |place: &str| {
            let place = place.to_owned();
            move |source| LoadProblem::Json { place, source }
        };
        let version = root.get("asset").and_then(|asset| asset.get("version")).and_then(Value::as_str);
        if version.is_none_or(|version| version.split('.').next() != Some("2")) {
            let unstated = version.is_none();
            let version = version.map_or_else(|| "unstated".to_owned(), |v| shortened(v).to_owned());
            let problem = LoadProblem::Version { version };
            // glTF 1 has objects where glTF 2 has lists, so lists identify version 2 if the version is not
            // stated.
            let lists = ["nodes", "meshes", "scenes"].iter().filter_map(|list| root.get(*list));
            if !unstated || !lists.clone().any(Value::is_array) || !lists.clone().all(Value::is_array) {
                return Err(problem);
            }
            notes.repair("asset.version", problem, "taken for 2.0, which its lists are of")?;
        }
        let photometric = super::patch::photometric_lights(&root);
        let mut lights = Vec::new();
        if let Some(Value::Object(extensions)) = root.get_mut("extensions")
            && let Some(Value::Object(punctual)) = extensions.get_mut("KHR_lights_punctual")
        {
            lights = list(punctual, "lights", "KHR_lights_punctual.lights")?;
        }
        let scene = root.remove("scene").map(serde_json::from_value).transpose().map_err(at("scene"))?;
        Ok(Self {
            scene,
            scenes: list(&mut root, "scenes", "scenes")?,
            nodes: list(&mut root, "nodes", "nodes")?,
            meshes: list(&mut root, "meshes", "meshes")?,
            accessors: list(&mut root, "accessors", "accessors")?,
            buffer_views: list(&mut root, "bufferViews", "bufferViews")?,
            buffers: list(&mut root, "buffers", "buffers")?,
            materials: list(&mut root, "materials", "materials")?,
            textures: list(&mut root, "textures", "textures")?,
            images: list(&mut root, "images", "images")?,
            samplers: list(&mut root, "samplers", "samplers")?,
            cameras: list(&mut root, "cameras", "cameras")?,
            animations: list(&mut root, "animations", "animations")?,
            skins: list::<Value>(&mut root, "skins", "skins")?.len(),
            lights,
            photometric,
            extensions_used: list(&mut root, "extensionsUsed", "extensionsUsed")?,
            extensions_required: list(&mut root, "extensionsRequired", "extensionsRequired")?,
        })
    }

    /// `nodes[3] (lamp)`, for messages.
    pub(crate) fn node_place(&self, node: usize) -> String {
        place("nodes", node, self.nodes.get(node).and_then(|node| node.name.as_deref()))
    }

    /// `meshes[3] (crate)`, for messages.
    pub(crate) fn mesh_place(&self, mesh: usize) -> String {
        place("meshes", mesh, self.meshes.get(mesh).and_then(|mesh| mesh.name.as_deref()))
    }

    /// `materials[3] (rust)`, for messages.
    pub(crate) fn material_place(&self, material: usize) -> String {
        place(
            "materials",
            material,
            self.materials.get(material).and_then(|material| material.name.as_deref()),
        )
    }
}

/// Parses the JSON text of a file into an object.
pub(crate) fn parse(json: &[u8]) -> Result<Map<String, Value>, LoadProblem> {
    serde_json::from_slice(json).map_err(|source| LoadProblem::Json { place: "JSON".to_owned(), source })
}

/// The first 80 characters of a text from a file, for messages.
pub(crate) fn shortened(text: &str) -> &str {
    match text.char_indices().nth(80) {
        Some((end, _)) => &text[..end],
        None => text,
    }
}

fn place(list: &str, index: usize, name: Option<&str>) -> String {
    match name {
        Some(name) => format!("{list}[{index}] ({})", shortened(name)),
        None => format!("{list}[{index}]"),
    }
}

fn list<T: DeserializeOwned>(
    object: &mut Map<String, Value>,
    key: &str,
    place: &str,
) -> Result<Vec<T>, LoadProblem> {
    let Some(value) = object.remove(key) else { return Ok(Vec::new()) };
    let elements: Vec<Value> = serde_json::from_value(value)
        .map_err(|source| LoadProblem::Json { place: place.to_owned(), source })?;
    let parsed = elements.into_iter().enumerate().map(|(index, element)| {
        serde_json::from_value(element)
            .map_err(|source| LoadProblem::Json { place: format!("{place}[{index}]"), source })
    });
    parsed.collect()
}

/// The extension `name` of an object, or `None` if it has none.
pub(crate) fn extension<T: DeserializeOwned>(
    extensions: &Extensions,
    name: &str,
    place: &str,
) -> Result<Option<T>, LoadProblem> {
    let Some(value) = extensions.get(name) else { return Ok(None) };
    // Deserializing from a reference avoids copying a possibly large tree.
    T::deserialize(value)
        .map(Some)
        .map_err(|source| LoadProblem::Json { place: format!("{place}.extensions.{name}"), source })
}

/// The list element with this index, or an error that names the field holding the index.
pub(crate) fn element<'a, T>(
    list: &'a [T],
    name: &'static str,
    index: usize,
    place: impl FnOnce() -> String,
) -> Result<&'a T, LoadProblem> {
    list.get(index).ok_or_else(|| LoadProblem::Reference {
        place: place(),
        list: name,
        index,
        count: list.len(),
    })
}
