//! Expands EXT_mesh_gpu_instancing: every instance becomes a child node of the instanced node, so that it is
//! drawn, baked and written like any other node. Instanced drawing is not decided here: the renderer finds
//! objects that share a mesh.

use serde_json::{Map, Value, json};

use super::accessor::Buffers;
use super::document::{Document, Node, extension};
use super::error::{LoadProblem, Notes};
use super::extensions::Instancing;
use super::limits::Budget;
use super::patch::{Patch, place, without_unused};

const EXTENSION: &str = "EXT_mesh_gpu_instancing";

/// Approximate size in bytes of an instance as a node, including its JSON.
const NODE: usize = 1024;

/// Returns true if a node of the file has instances.
pub(crate) fn is_used(root: &Map<String, Value>) -> bool {
    let nodes = root.get("nodes").and_then(Value::as_array).into_iter().flatten();
    nodes.filter_map(|node| node.get("extensions")).any(|extensions| extensions.get(EXTENSION).is_some())
}

/// Replaces the instances of every node by nodes. Returns true if there were any.
pub(crate) fn expand(
    patch: &mut Patch,
    document: &Document,
    buffers: &Buffers<'_>,
    budget: &mut Budget,
    notes: &mut Notes,
) -> Result<bool, LoadProblem> {
    let mut expanded = false;
    for (index, node) in document.nodes.iter().enumerate() {
        if !node.extensions.contains_key(EXTENSION) {
            continue;
        }
        let name = document.node_place(index);
        let instancing = extension::<Instancing>(&node.extensions, EXTENSION, &name)?;
        let (Some(instancing), Some(mesh)) = (instancing, node.mesh) else {
            notes.add(&name, "has instances, but no mesh; left as it is");
            continue;
        };
        let instances = instances(&instancing, &name, buffers, budget)?;
        let custom: Vec<&str> =
            instancing.attributes.keys().filter(|name| name.starts_with('_')).map(String::as_str).collect();
        if !custom.is_empty() {
            notes.add(&name, format!("{} of its instances are not used", custom.join(", ")));
        }
        if node.extensions.contains_key(LIGHTMAP) {
            notes.add(
                &name,
                "has one LUMBRE_lightmap for all of its instances, which is not used; bake the file again",
            );
        }
        notes.add(&name, format!("its {} instances are nodes of their own here", instances.len()));
        write(patch, index, node, mesh, instances);
        expanded = true;
    }
    if expanded {
        without_unused(patch, EXTENSION, "nodes");
    }
    Ok(expanded)
}

/// The transform members of a node for every instance.
fn instances(
    instancing: &Instancing,
    name: &str,
    buffers: &Buffers<'_>,
    budget: &mut Budget,
) -> Result<Vec<Map<String, Value>>, LoadProblem> {
    let mut instances: Option<Vec<Map<String, Value>>> = None;
    for (attribute, key) in [("TRANSLATION", "translation"), ("ROTATION", "rotation"), ("SCALE", "scale")] {
        let Some(&accessor) = instancing.attributes.get(attribute) else { continue };
        let used_by = format!("{name}: {EXTENSION}.{attribute}");
        let values = if key == "rotation" {
            Values::Rotations(buffers.floats(accessor, &used_by, &["VEC4"], [0.0; 4], budget)?)
        } else {
            Values::Vectors(buffers.floats(accessor, &used_by, &["VEC3"], [0.0; 3], budget)?)
        };
        let refused = |problem| LoadProblem::Accessor { accessor, used_by: used_by.clone(), problem };
        let count = values.count();
        if instances.is_none() {
            budget.charge(count as u64, NODE, || used_by.clone())?;
        }
        let instances = instances.get_or_insert_with(|| vec![Map::new(); count]);
        if instances.len() != count {
            return Err(refused(format!(
                "has {count} elements, but another attribute of the instances {}; export the file again",
                instances.len()
            )));
        }
        for (at, instance) in instances.iter_mut().enumerate() {
            let value = values.get(at);
            if !value.iter().all(|number| number.is_finite()) {
                return Err(refused(format!("element {at} is NaN or infinite; export the file again")));
            }
            let value: Vec<f64> = value.iter().copied().map(f64::from).collect();
            instance.insert(key.to_owned(), json!(value));
        }
    }
    // Without any of the three attributes there is one instance, at the node itself.
    Ok(instances.unwrap_or_else(|| vec![Map::new()]))
}

/// The values of an attribute, one per instance.
enum Values {
    Vectors(Vec<[f32; 3]>),
    Rotations(Vec<[f32; 4]>),
}

impl Values {
    fn count(&self) -> usize {
        match self {
            Self::Vectors(values) => values.len(),
            Self::Rotations(values) => values.len(),
        }
    }

    fn get(&self, at: usize) -> &[f32] {
        match self {
            Self::Vectors(values) => values.get(at).map_or(&[], |value| &value[..]),
            Self::Rotations(values) => values.get(at).map_or(&[], |value| &value[..]),
        }
    }
}

/// Adds the instances as children of their node, which keeps everything except the mesh.
fn write(patch: &mut Patch, index: usize, node: &Node, mesh: usize, instances: Vec<Map<String, Value>>) {
    let mut children: Vec<Value> = node.children.iter().map(|&child| child.into()).collect();
    // Extensions of the node that concern its mesh apply to each instance.
    let own: Map<String, Value> =
        node.extensions.iter().filter(|(name, _)| FOR_MESHES.contains(&name.as_str())).map(cloned).collect();
    for (number, mut instance) in instances.into_iter().enumerate() {
        if let Some(name) = &node.name {
            instance.insert("name".to_owned(), format!("{name} {}", number + 1).into());
        }
        instance.insert("mesh".to_owned(), mesh.into());
        if !own.is_empty() {
            instance.insert("extensions".to_owned(), own.clone().into());
        }
        children.push(patch.push("nodes", instance.into()).into());
    }
    patch.set(&place!["nodes", index, "children"], children.into());
    patch.remove(&place!["nodes", index, "mesh"]);
    let extensions = place!["nodes", index, "extensions"];
    for name in [EXTENSION, QUADRIC, LIGHTMAP] {
        patch.remove(&[&extensions[..], &place![name]].concat());
    }
    if patch.get(&extensions).and_then(Value::as_object).is_some_and(Map::is_empty) {
        patch.remove(&extensions);
    }
}

/// Extensions of a node that concern its own mesh rather than its children.
const FOR_MESHES: [&str; 3] = ["LUMBRE_object", "LUMBRE_shading", QUADRIC];

/// Unlike the others, these must not stay at a node that no longer has a mesh.
const QUADRIC: &str = "LUMBRE_quadric";
const LIGHTMAP: &str = "LUMBRE_lightmap";

fn cloned((name, value): (&String, &Value)) -> (String, Value) {
    (name.clone(), value.clone())
}
