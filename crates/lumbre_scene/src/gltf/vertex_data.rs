//! Copies accessors of any type for a new selection of vertices, element by element and bit for bit. The
//! selection is made in `lightmapped`.

use std::collections::HashMap;

use glam::Vec3;
use gltf::json::buffer::{ARRAY_BUFFER, ELEMENT_ARRAY_BUFFER};
use serde_json::{Value, json};

use super::accessor::Buffers;
use super::accessor_format::{self, FLOAT, Format, SHORT};
use super::error::LoadProblem;
use super::patch::{Patch, place};

const UNSIGNED_BYTE: u64 = accessor_format::UNSIGNED_BYTE as u64;
const UNSIGNED_SHORT: u64 = accessor_format::UNSIGNED_SHORT as u64;
const UNSIGNED_INT: u64 = accessor_format::UNSIGNED_INT as u64;

/// Bytes appended to a buffer of the file, with buffer views that refer to them.
pub(crate) struct NewData {
    /// Index of the buffer.
    pub buffer: usize,
    /// Size of the buffer before, a multiple of four.
    pub start: usize,
    pub bytes: Vec<u8>,
}

/// The new vertices of a primitive, selected from its old ones.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub(crate) struct Vertices {
    /// The old vertex for every new one.
    pub sources: Vec<u32>,
    /// Whether every old vertex is among them.
    pub complete: bool,
}

impl NewData {
    fn view(&mut self, patch: &mut Patch, bytes: &[u8], target: Option<u32>, stride: Option<usize>) -> usize {
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        let offset = self.start + self.bytes.len();
        self.bytes.extend_from_slice(bytes);
        let mut view = json!({"buffer": self.buffer, "byteOffset": offset, "byteLength": bytes.len()});
        if let Some(stride) = stride {
            view["byteStride"] = stride.into();
        }
        if let Some(target) = target {
            view["target"] = target.into();
        }
        patch.push("bufferViews", view)
    }

    /// Writes texture coordinates and returns their accessor.
    pub(crate) fn coordinates(
        &mut self,
        patch: &mut Patch,
        values: &[[f32; 2]],
        name: Option<&str>,
    ) -> usize {
        let bytes: Vec<u8> = values.iter().flatten().flat_map(|value| value.to_le_bytes()).collect();
        let view = self.view(patch, &bytes, Some(ARRAY_BUFFER), None);
        let mut accessor =
            json!({"bufferView": view, "componentType": FLOAT, "count": values.len(), "type": "VEC2"});
        if let Some(name) = name {
            accessor["name"] = name.into();
        }
        patch.push("accessors", accessor)
    }

    /// Writes indices of at most `vertices` vertices and returns their accessor. They keep the component type
    /// of the accessor they replace if it is wide enough.
    pub(crate) fn indices(
        &mut self,
        patch: &mut Patch,
        values: &[u32],
        vertices: usize,
        replaced: Option<usize>,
    ) -> usize {
        let former = replaced.and_then(|accessor| patch.get(&place!["accessors", accessor])).cloned();
        let least = former.as_ref().and_then(|former| former["componentType"].as_u64());
        // The largest index of a type is the primitive restart value and must not be a vertex.
        let component = index_component(least.unwrap_or(UNSIGNED_SHORT), vertices);
        let bytes = index_bytes(values, component);
        let view = self.view(patch, &bytes, Some(ELEMENT_ARRAY_BUFFER), None);
        let mut accessor = former.unwrap_or_else(|| json!({}));
        if let Value::Object(object) = &mut accessor {
            for stale in ["byteOffset", "sparse", "min", "max"] {
                object.shift_remove(stale);
            }
        }
        accessor["bufferView"] = view.into();
        accessor["componentType"] = component.into();
        accessor["count"] = values.len().into();
        accessor["type"] = "SCALAR".into();
        patch.push("accessors", accessor)
    }

    /// Writes the values of an attribute for the chosen vertices, in the same format (normalized, quantized
    /// or sparse), and returns their accessor.
    ///
    /// # Errors
    /// [`LoadProblem`] if the accessor is invalid or does not have `vertices` elements.
    pub(crate) fn attribute(
        &mut self,
        patch: &mut Patch,
        buffers: &Buffers<'_>,
        accessor: usize,
        used_by: &str,
        vertices: usize,
        chosen: &Vertices,
    ) -> Result<usize, LoadProblem> {
        let raw = buffers.raw(accessor, used_by)?;
        if raw.count != vertices {
            return Err(LoadProblem::Accessor {
                accessor,
                used_by: used_by.to_owned(),
                problem: format!("has {} elements, but POSITION has {vertices}", raw.count),
            });
        }
        let mut written = patch.get(&place!["accessors", accessor]).cloned().unwrap_or_default();
        let size = raw.format.size();
        let zero = vec![0; size];
        let replacements: HashMap<u32, &[u8]> = raw.sparse.iter().copied().collect();
        // Decompressed values may lie outside of the range stated in the file, so it is recomputed for them
        // as well.
        if !chosen.complete || buffers.is_decoded(accessor) {
            let elements = chosen.sources.iter().map(|source| {
                let replaced = replacements.get(source).copied();
                replaced.or_else(|| raw.base(*source as usize)).unwrap_or(&zero)
            });
            state_range(&mut written, raw.format, elements);
        }
        let Value::Object(object) = &mut written else { return Ok(accessor) };
        object.shift_remove("byteOffset");
        object.insert("count".to_owned(), chosen.sources.len().into());
        if raw.base(0).is_some() {
            let stride = size.next_multiple_of(4);
            let mut bytes = Vec::with_capacity(stride * chosen.sources.len());
            for source in &chosen.sources {
                bytes.extend_from_slice(raw.base(*source as usize).unwrap_or(&zero));
                bytes.resize(bytes.len().next_multiple_of(stride), 0);
            }
            let view = self.view(patch, &bytes, Some(ARRAY_BUFFER), (stride != size).then_some(stride));
            object.insert("bufferView".to_owned(), view.into());
        }
        let sparse: Vec<(u32, &[u8])> = (0u32..)
            .zip(&chosen.sources)
            .filter_map(|(new, source)| Some((new, *replacements.get(source)?)))
            .collect();
        let former = object.shift_remove("sparse");
        if let Some(mut former) = former.filter(|_| !sparse.is_empty()) {
            let least = former["indices"]["componentType"].as_u64().unwrap_or(UNSIGNED_SHORT);
            let component = index_component(least, chosen.sources.len());
            let indices: Vec<u32> = sparse.iter().map(|(index, _)| *index).collect();
            let values: Vec<u8> = sparse.iter().flat_map(|(_, value)| value.iter().copied()).collect();
            let at = self.view(patch, &index_bytes(&indices, component), None, None);
            let of = self.view(patch, &values, None, None);
            former["count"] = sparse.len().into();
            former["indices"] = json!({"bufferView": at, "componentType": component});
            former["values"] = json!({"bufferView": of});
            object.insert("sparse".to_owned(), former);
        }
        Ok(patch.push("accessors", written))
    }
}

/// Normals for the chosen vertices, written as by [`NewData::attribute`], except that zero and non-finite
/// ones are replaced.
pub(crate) struct Normals<'a> {
    pub buffers: &'a Buffers<'a>,
    pub accessor: usize,
    pub used_by: &'a str,
    /// Number of old vertices.
    pub vertices: usize,
    pub chosen: &'a Vertices,
    /// The replacement for each new vertex.
    pub directions: &'a [Vec3],
}

impl Normals<'_> {
    /// Writes the normals with replacements. Returns their accessor and the number of replaced ones, or
    /// `None` if nothing needs to be replaced or the accessor is not one of `vertices` 3D vectors.
    ///
    /// # Errors
    /// As [`NewData::attribute`].
    pub(crate) fn mended(
        &self,
        data: &mut NewData,
        patch: &mut Patch,
    ) -> Result<Option<(usize, usize)>, LoadProblem> {
        let raw = self.buffers.raw(self.accessor, self.used_by)?;
        if raw.count != self.vertices || raw.format.components != 3 || raw.format.columns != 1 {
            return Ok(None);
        }
        let zero = vec![0; raw.format.size()];
        let replacements: HashMap<u32, &[u8]> = raw.sparse.iter().copied().collect();
        let stride = raw.format.size().next_multiple_of(4);
        let mut bytes = Vec::with_capacity(stride * self.chosen.sources.len());
        let mut mended = 0;
        for (new, source) in self.chosen.sources.iter().enumerate() {
            let replaced = replacements.get(source).copied();
            let own = replaced.or_else(|| raw.base(*source as usize)).unwrap_or(&zero);
            let length: f64 = raw.format.raw(own).map(|value| value * value).sum();
            if length > 0.0 && length.is_finite() {
                bytes.extend_from_slice(own);
            } else {
                mended += 1;
                let direction = self.directions.get(new).and_then(|direction| direction.try_normalize());
                for value in direction.unwrap_or(Vec3::Y).to_array() {
                    match raw.format.component {
                        FLOAT => bytes.extend(value.to_le_bytes()),
                        SHORT => bytes.extend(((value * 32767.0).round() as i16).to_le_bytes()),
                        _ => bytes.extend(((value * 127.0).round() as i8).to_le_bytes()),
                    }
                }
            }
            bytes.resize(bytes.len().next_multiple_of(stride), 0);
        }
        if mended == 0 {
            return Ok(None);
        }
        let view =
            data.view(patch, &bytes, Some(ARRAY_BUFFER), (stride != raw.format.size()).then_some(stride));
        let mut written = patch.get(&place!["accessors", self.accessor]).cloned().unwrap_or_default();
        if let Value::Object(object) = &mut written {
            for stale in ["byteOffset", "sparse", "min", "max"] {
                object.shift_remove(stale);
            }
            object.insert("bufferView".to_owned(), view.into());
            object.insert("count".to_owned(), self.chosen.sources.len().into());
        }
        Ok(Some((patch.push("accessors", written), mended)))
    }
}

/// The narrowest index type that is at least as wide as `least` and can hold the indices of this many
/// vertices.
fn index_component(least: u64, vertices: usize) -> u64 {
    let fits = |component: u64| match component {
        UNSIGNED_BYTE => vertices <= usize::from(u8::MAX),
        UNSIGNED_SHORT => vertices <= usize::from(u16::MAX),
        _ => true,
    };
    [UNSIGNED_BYTE, UNSIGNED_SHORT, UNSIGNED_INT]
        .into_iter()
        .find(|&component| component >= least && fits(component))
        .unwrap_or(UNSIGNED_INT)
}

fn index_bytes(values: &[u32], component: u64) -> Vec<u8> {
    let size = match component {
        UNSIGNED_BYTE => 1,
        UNSIGNED_SHORT => 2,
        _ => 4,
    };
    values.iter().flat_map(|value| value.to_le_bytes().into_iter().take(size)).collect()
}

/// Updates `min` and `max` of an accessor from its elements, where it states them.
fn state_range<'a>(accessor: &mut Value, format: Format, elements: impl Iterator<Item = &'a [u8]>) {
    let stated: Vec<&str> = ["min", "max"].into_iter().filter(|key| accessor.get(key).is_some()).collect();
    if stated.is_empty() {
        return;
    }
    let mut range: Vec<[f64; 2]> = Vec::new();
    for element in elements {
        for (at, value) in format.raw(element).enumerate() {
            match range.get_mut(at) {
                Some([least, most]) => (*least, *most) = (least.min(value), most.max(value)),
                None => range.push([value; 2]),
            }
        }
    }
    for key in stated {
        let end = usize::from(key == "max");
        accessor[key] = range.iter().map(|ends| Value::from(ends[end])).collect();
    }
}
