//! Loading: from a file or bytes to entities in a World.

use std::borrow::Cow;
use std::path::{Path, PathBuf};

use bevy_ecs::prelude::*;

use super::accessor::Buffers;
use super::document::{Document, shortened};
use super::error::{LoadError, LoadProblem, Note, Notes};
use super::limits::{Budget, LoadLimits};
use super::prepared::{Prepared, PreparedNode, PreparedPrimitive, prepare};
use super::{container, uri};
use crate::{
    ActiveCamera, DynamicObject, EmissiveLight, Extras, Hidden, MaterialTextures, Mesh, StaticObject,
    update_transforms,
};

/// What loading did.
#[derive(Clone, Debug, Default)]
pub struct LoadReport {
    /// The entity of each glTF node, by the node's index; [`Entity::PLACEHOLDER`] for nodes that are not in the scene that is shown.
    pub nodes: Vec<Entity>,
    /// What was repaired, ignored or left out.
    pub notes: Vec<Note>,
    /// Different triangle meshes: primitives of meshes that are used.
    pub meshes: usize,
    /// Triangles of all entities.
    pub triangles: usize,
    /// The files beside the glTF file that its buffers and images are in, if a folder was given.
    pub files: Vec<PathBuf>,
}

/// Loads a .glb or .gltf file into a World, beside what is there.
///
/// Every node becomes an entity with `Transform` and `Name` (if it has one); every primitive of its mesh a child of that with `Mesh`,
/// `Material` and `Primitive`. Lights and cameras sit on the node's own entity. The scene's settings become the resource
/// [`SceneSettings`](crate::SceneSettings); global transforms are up to date.
///
/// # Errors
/// [`LoadError`] with the place and the remedy; the World is then unchanged.
pub fn load(world: &mut World, path: &Path) -> Result<LoadReport, LoadError> {
    let name = path.display().to_string();
    let bytes =
        uri::read(path).map_err(|problem| LoadError { file: name.clone(), problem: problem.into() })?;
    load_slice(world, &bytes, &name, Some(path.parent().unwrap_or(Path::new(""))))
}

/// Loads the bytes of a .glb or .gltf. `name` is for messages, `base` the folder that relative URIs start from.
///
/// # Errors
/// As [`load`]; also for URIs of files if there is no `base`.
pub fn load_slice(
    world: &mut World,
    bytes: &[u8],
    name: &str,
    base: Option<&Path>,
) -> Result<LoadReport, LoadError> {
    load_slice_within(world, bytes, name, base, LoadLimits::default())
}

/// [`load_slice`] with limits on what may be decoded.
///
/// # Errors
/// As [`load_slice`]; [`LoadProblem::TooLarge`] where a limit is met.
pub fn load_slice_within(
    world: &mut World,
    bytes: &[u8],
    name: &str,
    base: Option<&Path>,
    limits: LoadLimits,
) -> Result<LoadReport, LoadError> {
    let mut notes = Notes::default();
    let prepared = read(bytes, base, limits, &mut notes)
        .map_err(|problem| LoadError { file: name.to_owned(), problem: problem.into() })?;
    Ok(spawn(world, prepared, notes))
}

fn read(
    bytes: &[u8],
    base: Option<&Path>,
    limits: LoadLimits,
    notes: &mut Notes,
) -> Result<Prepared, LoadProblem> {
    let container = container::split(bytes)?;
    let document = Document::parse(container.json)?;
    for name in &document.extensions_required {
        if !super::SUPPORTED_EXTENSIONS.contains(&name.as_str()) {
            let (name, supported) = (shortened(name).to_owned(), super::SUPPORTED_EXTENSIONS.join(", "));
            return Err(LoadProblem::RequiredExtension { name, supported });
        }
    }
    let mut total = bytes.len() as u64;
    let mut contents = Vec::new();
    for (index, buffer) in document.buffers.iter().enumerate() {
        let place = format!("buffers[{index}]");
        let content = match (&buffer.uri, container.binary) {
            (Some(uri), _) => Cow::Owned(uri::fetch(uri, base, &place)?),
            (None, Some(binary)) if index == 0 => Cow::Borrowed(binary),
            (None, _) => {
                let problem =
                    "is missing, and there is no binary chunk for it; export the file again".to_owned();
                return Err(LoadProblem::Uri { place, uri: String::new(), problem });
            }
        };
        let found = content.len() as u64;
        if found < buffer.byte_length {
            return Err(LoadProblem::Truncated { what: place, needed: buffer.byte_length, found });
        }
        total = total.saturating_add(found);
        contents.push(match content {
            Cow::Borrowed(content) => Cow::Borrowed(&content[..buffer.byte_length as usize]),
            Cow::Owned(mut content) => {
                content.truncate(buffer.byte_length as usize);
                Cow::Owned(content)
            }
        });
    }
    let decoded_bytes =
        limits.decoded_bytes.unwrap_or_else(|| total.saturating_mul(64).saturating_add(64 << 20));
    let buffers = Buffers { document: &document, bytes: contents };
    let mut prepared = prepare(&document, &buffers, base, limits, Budget::new(decoded_bytes), notes)?;
    prepared.files = files_beside(&document, base);
    Ok(prepared)
}

fn files_beside(document: &Document, base: Option<&Path>) -> Vec<PathBuf> {
    let uris = document.buffers.iter().filter_map(|buffer| buffer.uri.as_deref());
    let uris = uris.chain(document.images.iter().filter_map(|image| image.uri.as_deref()));
    let files = uris.filter(|uri| !uri.starts_with("data:")).filter_map(|uri| uri::relative(uri).ok());
    base.map_or(Vec::new(), |base| files.map(|file| base.join(file)).collect())
}

fn spawn(world: &mut World, prepared: Prepared, notes: Notes) -> LoadReport {
    let mut report = LoadReport { notes: notes.0, files: prepared.files, ..LoadReport::default() };
    report.nodes = vec![Entity::PLACEHOLDER; prepared.node_count];
    report.meshes = prepared.meshes.values().map(Vec::len).sum();
    // Entities in the order of the file, then children in the order of their parent's list.
    let mut by_index: Vec<&PreparedNode> = prepared.nodes.iter().collect();
    by_index.sort_unstable_by_key(|node| node.index);
    for node in by_index {
        report.nodes[node.index] = spawn_node(world, node);
    }
    for node in &prepared.nodes {
        let entity = report.nodes[node.index];
        if let Some(parent) = node.parent {
            world.entity_mut(entity).insert(ChildOf(report.nodes[parent]));
        }
        for primitive in node.mesh.and_then(|mesh| prepared.meshes.get(&mesh)).into_iter().flatten() {
            report.triangles += primitive.mesh.triangle_count();
            spawn_primitive(world, node, primitive, entity);
        }
    }
    world.insert_resource(prepared.settings);
    update_transforms(world);
    report
}

fn spawn_node(world: &mut World, node: &PreparedNode) -> Entity {
    let mut entity = world.spawn(node.transform);
    if let Some(name) = &node.name {
        entity.insert(Name::new(name.clone()));
    }
    if let Some(light) = &node.light {
        entity.insert(light.clone());
    }
    if let Some(camera) = node.camera {
        entity.insert(camera);
    }
    if node.active_camera {
        entity.insert(ActiveCamera);
    }
    if node.dynamic {
        entity.insert(DynamicObject);
    }
    if let Some(volume) = &node.irradiance_volume {
        entity.insert(volume.clone());
    }
    if let Some(extras) = &node.extras {
        entity.insert(Extras(extras.clone()));
    }
    entity.id()
}

fn spawn_primitive(world: &mut World, node: &PreparedNode, primitive: &PreparedPrimitive, parent: Entity) {
    let mesh = Mesh(primitive.mesh.clone());
    let mut entity =
        world.spawn((mesh, primitive.material.clone(), primitive.label.clone(), ChildOf(parent)));
    if primitive.textures != MaterialTextures::default() {
        entity.insert(primitive.textures.clone());
    }
    if let Some(reflection) = node.reflection {
        entity.insert(reflection);
    }
    if let Some(shading) = node.shading {
        entity.insert(shading);
    }
    if let Some(lightmap) = node.lightmap.as_ref().filter(|_| !primitive.mesh.uv1.is_empty()) {
        entity.insert(lightmap.clone());
    }
    if node.hidden {
        entity.insert(Hidden);
    }
    if node.emissive_light {
        entity.insert(EmissiveLight);
    }
    if node.dynamic {
        entity.insert(DynamicObject);
    } else {
        entity.insert(StaticObject);
    }
}
