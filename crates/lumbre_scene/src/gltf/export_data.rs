//! The binary data of a file being written: buffer views, accessors, meshes and images.

use std::collections::HashMap;
use std::sync::Arc;

use glam::Vec3;
use gltf::json::buffer::{ARRAY_BUFFER, ELEMENT_ARRAY_BUFFER};
use gltf::json::texture;
use lumbre_mesh::TriangleMesh;
use serde_json::{Value, json};

use super::accessor_format::{FLOAT, UNSIGNED_INT, UNSIGNED_SHORT};
use super::error::Notes;
use super::export::SaveError;
use super::texture_sets::LIGHTMAP_COORDINATES;
use crate::{Image, Mipmap, Sampler, TextureReference, Wrap};

/// The data collected so far; equal items are written once.
#[derive(Default)]
pub(crate) struct Data {
    pub binary: Vec<u8>,
    pub buffer_views: Vec<Value>,
    pub accessors: Vec<Value>,
    pub images: Vec<Value>,
    pub samplers: Vec<Value>,
    pub textures: Vec<Value>,
    pub uses_texture_transform: bool,
    pub notes: Notes,
    geometries: HashMap<*const TriangleMesh, Value>,
    known_images: HashMap<*const Image, usize>,
    known_samplers: Vec<Sampler>,
    known_textures: Vec<(usize, usize)>,
}

impl Data {
    fn view(&mut self, bytes: &[u8], target: Option<u32>) -> usize {
        self.binary.resize(self.binary.len().next_multiple_of(4), 0);
        let mut view = json!({"buffer": 0, "byteOffset": self.binary.len(), "byteLength": bytes.len()});
        if let Some(target) = target {
            view["target"] = target.into();
        }
        self.binary.extend_from_slice(bytes);
        self.buffer_views.push(view);
        self.buffer_views.len() - 1
    }

    fn floats(&mut self, values: impl Iterator<Item = f32>, shape: &str, count: usize) -> usize {
        let bytes: Vec<u8> = values.flat_map(f32::to_le_bytes).collect();
        let view = self.view(&bytes, Some(ARRAY_BUFFER));
        self.accessors
            .push(json!({"bufferView": view, "componentType": FLOAT, "count": count, "type": shape}));
        self.accessors.len() - 1
    }

    /// The `attributes` and `indices` of a primitive. Meshes that share their `Arc` share accessors. The
    /// caller must keep the mesh alive, since it is identified by its address.
    pub(crate) fn geometry(&mut self, mesh: &Arc<TriangleMesh>, place: &str) -> Result<Value, SaveError> {
        if let Some(known) = self.geometries.get(&Arc::as_ptr(mesh)) {
            return Ok(known.clone());
        }
        mesh.validate().map_err(|source| SaveError::Mesh { place: place.to_owned(), source })?;
        let attributes = [&mesh.positions, &mesh.normals];
        let uvs = [&mesh.uv0, &mesh.uv1];
        let finite = attributes.iter().all(|list| list.iter().all(|value| value.is_finite()))
            && uvs.iter().all(|list| list.iter().all(|value| value.is_finite()))
            && mesh.colors.iter().chain(&mesh.tangents).all(|value| value.is_finite());
        if !finite {
            return Err(SaveError::NotFinite { place: place.to_owned(), field: "its mesh".to_owned() });
        }
        let count = mesh.positions.len();
        let mut attributes = serde_json::Map::new();
        let positions = self.floats(mesh.positions.iter().flat_map(|v| v.to_array()), "VEC3", count);
        let min = mesh.positions.iter().copied().fold(Vec3::INFINITY, Vec3::min);
        let max = mesh.positions.iter().copied().fold(Vec3::NEG_INFINITY, Vec3::max);
        if count > 0 {
            self.accessors[positions]["min"] = json!(min.to_array());
            self.accessors[positions]["max"] = json!(max.to_array());
        }
        attributes.insert("POSITION".to_owned(), positions.into());
        if !mesh.normals.is_empty() {
            // A vertex of degenerate triangles has a zero normal, which glTF does not allow.
            let missing = mesh.normals.iter().filter(|normal| **normal == Vec3::ZERO).count();
            if missing > 0 {
                self.notes.add(place, format!("{missing} normals are zero; they are written as (0, 1, 0)"));
            }
            let written = |normal: &Vec3| if *normal == Vec3::ZERO { Vec3::Y } else { *normal };
            let normals = mesh.normals.iter().flat_map(|normal| written(normal).to_array());
            let accessor = self.floats(normals, "VEC3", count);
            attributes.insert("NORMAL".to_owned(), accessor.into());
        }
        // glTF does not allow zero tangents. Without the attribute, a reader computes its own.
        if !mesh.tangents.is_empty() && mesh.tangents.iter().all(|tangent| tangent.truncate() != Vec3::ZERO) {
            let accessor = self.floats(mesh.tangents.iter().flat_map(|v| v.to_array()), "VEC4", count);
            attributes.insert("TANGENT".to_owned(), accessor.into());
        }
        for (name, uv) in [("TEXCOORD_0", &mesh.uv0), ("TEXCOORD_1", &mesh.uv1)] {
            if !uv.is_empty() {
                let accessor = self.floats(uv.iter().flat_map(|v| v.to_array()), "VEC2", count);
                attributes.insert(name.to_owned(), accessor.into());
            }
        }
        if let (None, Some(second)) = (attributes.get("TEXCOORD_0"), attributes.get("TEXCOORD_1").cloned()) {
            if let Some(accessor) = second.as_u64() {
                self.accessors[accessor as usize]["name"] = LIGHTMAP_COORDINATES.into();
            }
            attributes.insert("TEXCOORD_0".to_owned(), second);
        }
        if !mesh.colors.is_empty() {
            let accessor = self.floats(mesh.colors.iter().flat_map(|v| v.to_array()), "VEC4", count);
            attributes.insert("COLOR_0".to_owned(), accessor.into());
        }
        // The largest index of a type is the primitive restart value and must not be a vertex.
        let short = count < usize::from(u16::MAX);
        let bytes: Vec<u8> = if short {
            mesh.indices.iter().flat_map(|&index| (index as u16).to_le_bytes()).collect()
        } else {
            mesh.indices.iter().flat_map(|index| index.to_le_bytes()).collect()
        };
        let view = self.view(&bytes, Some(ELEMENT_ARRAY_BUFFER));
        let component = if short { UNSIGNED_SHORT } else { UNSIGNED_INT };
        let length = mesh.indices.len();
        self.accessors
            .push(json!({"bufferView": view, "componentType": component, "count": length, "type": "SCALAR"}));
        let geometry = json!({"attributes": attributes, "indices": self.accessors.len() - 1});
        self.geometries.insert(Arc::as_ptr(mesh), geometry.clone());
        Ok(geometry)
    }

    /// A texture info object. Images that share their `Arc` are written once, as PNG.
    pub(crate) fn texture(&mut self, texture: &TextureReference, place: &str) -> Result<Value, SaveError> {
        let image = self.image(&texture.image, place)?;
        let sampler = match self.known_samplers.iter().position(|known| *known == texture.sampler) {
            Some(known) => known,
            None => {
                self.known_samplers.push(texture.sampler);
                self.samplers.push(sampler(&texture.sampler));
                self.samplers.len() - 1
            }
        };
        let index = match self.known_textures.iter().position(|known| *known == (image, sampler)) {
            Some(known) => known,
            None => {
                self.known_textures.push((image, sampler));
                self.textures.push(json!({"source": image, "sampler": sampler}));
                self.textures.len() - 1
            }
        };
        let mut info = json!({"index": index, "texCoord": texture.tex_coord});
        let (offset, rotation, scale) = (texture.offset, texture.rotation, texture.scale);
        if offset != glam::Vec2::ZERO || rotation != 0.0 || scale != glam::Vec2::ONE {
            let transform =
                json!({"offset": offset.to_array(), "rotation": rotation, "scale": scale.to_array()});
            info["extensions"] = json!({"KHR_texture_transform": transform});
            self.uses_texture_transform = true;
        }
        Ok(info)
    }

    fn image(&mut self, image: &Arc<Image>, place: &str) -> Result<usize, SaveError> {
        if let Some(&known) = self.known_images.get(&Arc::as_ptr(image)) {
            return Ok(known);
        }
        let failed = |problem: String| SaveError::Image {
            place: place.to_owned(),
            image: image.name.clone(),
            problem,
        };
        let texels = u64::from(image.width) * u64::from(image.height);
        if texels == 0 || image.rgba.len() as u64 != 4 * texels {
            return Err(failed(format!(
                "{} bytes are not {} x {} RGBA texels",
                image.rgba.len(),
                image.width,
                image.height
            )));
        }
        let mut png = Vec::new();
        let encoder = image::codecs::png::PngEncoder::new(&mut png);
        image::ImageEncoder::write_image(
            encoder,
            &image.rgba,
            image.width,
            image.height,
            image::ExtendedColorType::Rgba8,
        )
        .map_err(|error| failed(error.to_string()))?;
        let view = self.view(&png, None);
        let mut written = json!({"bufferView": view, "mimeType": "image/png"});
        if !image.name.is_empty() {
            written["name"] = image.name.clone().into();
        }
        self.images.push(written);
        self.known_images.insert(Arc::as_ptr(image), self.images.len() - 1);
        Ok(self.images.len() - 1)
    }
}

fn sampler(sampler: &Sampler) -> Value {
    let wrap = |wrap: Wrap| match wrap {
        Wrap::Repeat => texture::REPEAT,
        Wrap::MirroredRepeat => texture::MIRRORED_REPEAT,
        Wrap::ClampToEdge => texture::CLAMP_TO_EDGE,
    };
    let minify = match (sampler.minify_linear, sampler.mipmap) {
        (false, Mipmap::None) => texture::NEAREST,
        (true, Mipmap::None) => texture::LINEAR,
        (false, Mipmap::Nearest) => texture::NEAREST_MIPMAP_NEAREST,
        (true, Mipmap::Nearest) => texture::LINEAR_MIPMAP_NEAREST,
        (false, Mipmap::Linear) => texture::NEAREST_MIPMAP_LINEAR,
        (true, Mipmap::Linear) => texture::LINEAR_MIPMAP_LINEAR,
    };
    let magnify = if sampler.magnify_linear { texture::LINEAR } else { texture::NEAREST };
    json!({"wrapS": wrap(sampler.wrap_u), "wrapT": wrap(sampler.wrap_v), "magFilter": magnify, "minFilter": minify})
}
