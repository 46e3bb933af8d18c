//! Gives nodes with an exact surface and no mesh the surface's tessellation, as data of the file, so that it is
//! drawn, baked and written like any other mesh. The tessellation itself is in `quadric_mesh`.

use std::borrow::Cow;
use std::collections::HashMap;

use lumbre_mesh::TriangleMesh;
use serde_json::{Map, Value, json};

use super::document::{Document, element, extension};
use super::error::{LoadProblem, Notes};
use super::limits::Budget;
use super::patch::{Patch, place};
use super::quadric_extension::QuadricExtension;
use super::uri;
use crate::Quadric;

const EXTENSION: &str = "LUMBRE_quadric";

/// Bytes that are kept of a mesh per index, of which there are about six per vertex of up to 32 bytes: ten of its data
/// and 14 of their text.
const BYTES_PER_INDEX: usize = 24;

/// Returns true if a node of the file has an exact surface and no mesh.
pub(crate) fn is_used(root: &Map<String, Value>) -> bool {
    let nodes = root.get("nodes").and_then(Value::as_array).into_iter().flatten();
    let mut extended =
        nodes.filter(|node| node.get("mesh").is_none()).filter_map(|node| node.get("extensions"));
    extended.any(|extensions| extensions.get(EXTENSION).is_some())
}

/// Adds the meshes to the file. Returns true if there were any. Nodes with equal surfaces and materials share
/// one.
pub(crate) fn add(
    patch: &mut Patch,
    document: &Document,
    contents: &mut Vec<Cow<'_, [u8]>>,
    budget: &mut Budget,
    notes: &mut Notes,
) -> Result<bool, LoadProblem> {
    let mut known: HashMap<String, Option<usize>> = HashMap::new();
    for (index, node) in document.nodes.iter().enumerate() {
        let name = document.node_place(index);
        let found = match node.mesh {
            None => extension::<QuadricExtension>(&node.extensions, EXTENSION, &name)?,
            Some(_) => None,
        };
        let Some(found) = found else { continue };
        let surface = found.surface(&name)?;
        if let Some(material) = found.material {
            let field = || format!("{name}.extensions.{EXTENSION}.material");
            element(&document.materials, "materials", material, field)?;
        }
        if surface.is_endless() {
            let reach = Quadric::MESH_REACH;
            notes.add(&name, format!("its exact surface has no end; frames and bakes have it up to {reach} m from its origin: give min and max"));
        }
        let key = node.extensions.get(EXTENSION).map(ToString::to_string).unwrap_or_default();
        let mesh = match known.get(&key) {
            Some(known) => *known,
            None => {
                let mesh = surface.mesh(Quadric::SEGMENTS);
                budget.charge(mesh.indices.len() as u64, BYTES_PER_INDEX, || name.clone())?;
                let added = (!mesh.indices.is_empty()).then(|| push(patch, contents, &mesh, found.material));
                *known.entry(key).or_insert(added)
            }
        };
        match mesh {
            Some(mesh) => patch.set(&place!["nodes", index, "mesh"], mesh.into()),
            None => notes.add(&name, "nothing of its exact surface is inside min and max, or it is larger than f32 can hold; it is left out"),
        }
    }
    Ok(known.values().any(Option::is_some))
}

/// Adds a mesh with its data in a buffer of its own, and returns its index.
fn push(
    patch: &mut Patch,
    contents: &mut Vec<Cow<'_, [u8]>>,
    mesh: &TriangleMesh,
    material: Option<usize>,
) -> usize {
    let floats = |list: &[glam::Vec3]| -> Vec<u8> {
        list.iter().flat_map(|own| own.to_array()).flat_map(f32::to_le_bytes).collect()
    };
    let coordinates: Vec<u8> =
        mesh.uv0.iter().flat_map(|own| own.to_array()).flat_map(f32::to_le_bytes).collect();
    let indices: Vec<u8> = mesh.indices.iter().flat_map(|index| index.to_le_bytes()).collect();
    let parts = [floats(&mesh.positions), floats(&mesh.normals), indices, coordinates];
    let bytes = parts.concat();
    let uri = format!("data:application/octet-stream;base64,{}", uri::base64(&bytes));
    let buffer = patch.push("buffers", json!({"byteLength": bytes.len(), "uri": uri}));
    contents.push(Cow::Owned(bytes));
    let mut offset = 0;
    let [positions, normals, indices, coordinates] = parts.map(|part| {
        if part.is_empty() {
            return 0;
        }
        let view = json!({"buffer": buffer, "byteOffset": offset, "byteLength": part.len()});
        offset += part.len();
        patch.push("bufferViews", view)
    });
    let low = mesh.positions.iter().fold(glam::Vec3::INFINITY, |low, own| low.min(*own));
    let high = mesh.positions.iter().fold(glam::Vec3::NEG_INFINITY, |high, own| high.max(*own));
    let count = mesh.positions.len();
    let vectors =
        |view: usize| json!({"bufferView": view, "componentType": 5126, "count": count, "type": "VEC3"});
    let mut bounded = vectors(positions);
    (bounded["min"], bounded["max"]) = (json!(low.to_array()), json!(high.to_array()));
    let positions = patch.push("accessors", bounded);
    let normals = patch.push("accessors", vectors(normals));
    let numbers =
        json!({"bufferView": indices, "componentType": 5125, "count": mesh.indices.len(), "type": "SCALAR"});
    let indices = patch.push("accessors", numbers);
    let mut primitive = json!({"attributes": {"POSITION": positions, "NORMAL": normals}, "indices": indices});
    if !mesh.uv0.is_empty() {
        let numbers =
            json!({"bufferView": coordinates, "componentType": 5126, "count": count, "type": "VEC2"});
        primitive["attributes"]["TEXCOORD_0"] = patch.push("accessors", numbers).into();
    }
    if let Some(material) = material {
        primitive["material"] = material.into();
    }
    patch.push("meshes", json!({"primitives": [primitive]}))
}
