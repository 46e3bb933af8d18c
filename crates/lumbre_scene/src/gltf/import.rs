//! Loads a glTF file or its bytes: splits the container, decodes everything, and spawns the entities.

use std::borrow::Cow;
use std::path::{Path, PathBuf};

use bevy_ecs::prelude::*;

use super::accessor::Buffers;
use super::decoders::{self, OptionalDecoder};
use super::document::{self, Document, shortened};
use super::error::{LoadError, LoadProblem, Note, Notes};
use super::limits::{Budget, LoadLimits};
use super::options::LoadOptions;
use super::patch::Patch;
use super::prepared::{Prepared, PreparedNode, PreparedPrimitive, prepare};
use super::uri::{self, Base};
use super::{compressed, compressed_primitives, compressed_views, container, instancing, quadric_fallback};
use crate::{
    ActiveCamera, DynamicObject, EmissiveLight, Extras, Hidden, MaterialTextures, Mesh, StaticObject,
    update_transforms,
};

/// The result of loading a file.
#[derive(Clone, Debug, Default)]
pub struct LoadReport {
    /// The entity of each glTF node, by the node's index; [`Entity::PLACEHOLDER`] for nodes outside of the
    /// loaded scene.
    pub nodes: Vec<Entity>,
    /// What was repaired, ignored or left out.
    pub notes: Vec<Note>,
    /// Number of distinct triangle meshes: the primitives of all glTF meshes in use.
    pub meshes: usize,
    /// Number of triangles of all entities.
    pub triangles: usize,
    /// The external files that the buffers and images refer to, if a folder was given.
    pub files: Vec<PathBuf>,
    /// Number of lights with an intensity in candela or lux, as in `KHR_lights_punctual`. Such values need an
    /// exposure to be displayed.
    pub photometric_lights: usize,
    /// Whether a camera states its exposure (`LUMBRE_camera.exposure`).
    pub states_exposure: bool,
}

/// Loads a .glb or .gltf file and adds its entities to a World.
///
/// Every node becomes an entity with `Transform` and, if it is named, `Name`. Every primitive of its mesh
/// becomes a child of that entity with `Mesh`, `Material` and `Primitive`. Lights and cameras are components
/// of the node's own entity. The scene's settings become the resource
/// [`SceneSettings`](crate::SceneSettings). Global transforms are up to date afterwards.
///
/// # Errors
/// [`LoadError`] with the place and the remedy; the World is then unchanged.
pub fn load(world: &mut World, path: &Path) -> Result<LoadReport, LoadError> {
    load_with(world, path, &LoadOptions::default())
}

/// [`load`] with options.
///
/// # Errors
/// As [`load`].
pub fn load_with(world: &mut World, path: &Path, options: &LoadOptions) -> Result<LoadReport, LoadError> {
    let name = path.display().to_string();
    let read = || {
        let folder = Some(path.parent().unwrap_or(Path::new("")));
        read(&uri::read(path)?, Base { folder, root: options.root.as_deref() }, options)
    };
    let (prepared, notes) =
        read().map_err(|problem| LoadError { file: name.clone(), problem: problem.into() })?;
    Ok(spawn(world, prepared, notes))
}

/// Loads the bytes of a .glb or .gltf file. `name` is used in messages; `base` is the folder to which
/// relative URIs refer.
///
/// # Errors
/// As [`load`], and for a URI of an external file if `base` is `None`.
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
/// As [`load_slice`], and [`LoadProblem::TooLarge`] if a limit is exceeded.
pub fn load_slice_within(
    world: &mut World,
    bytes: &[u8],
    name: &str,
    base: Option<&Path>,
    limits: LoadLimits,
) -> Result<LoadReport, LoadError> {
    let options = LoadOptions { limits, ..LoadOptions::default() };
    let (prepared, notes) = read(bytes, Base { folder: base, root: None }, &options)
        .map_err(|problem| LoadError { file: name.to_owned(), problem: problem.into() })?;
    Ok(spawn(world, prepared, notes))
}

fn read(bytes: &[u8], base: Base<'_>, options: &LoadOptions) -> Result<(Prepared, Notes), LoadProblem> {
    let mut notes = Notes { lenient: options.lenient, ..Notes::default() };
    let container = container::split(bytes, &mut notes)?;
    let root = document::parse(container.json)?;
    let is_changed = instancing::is_used(&root)
        || quadric_fallback::is_used(&root)
        || compressed_primitives::is_used(&root);
    let mut patch = is_changed.then(|| Patch::new(root.clone()));
    let mut document = Document::from_root(root, &mut notes)?;
    check_extensions(&document)?;
    let mut contents = contents(&document, container.binary, base, &mut notes)?;
    let mut budget = options.limits.budget(bytes.len(), &document, &contents);
    if let Some(patch) = &mut patch
        && quadric_fallback::add(patch, &document, &mut contents, &mut budget, &mut notes)?
    {
        document = Document::from_root(patch.root(), &mut notes)?;
    }
    if let Some(patch) = &mut patch
        && compressed_primitives::separate_accessors(patch, &document, &mut budget)?
    {
        document = Document::from_root(patch.root(), &mut notes)?;
    }
    let decoded = Cow::Owned(compressed::decode(&document, &contents, &mut budget)?);
    let mut buffers = Buffers { document: &document, bytes: contents, decoded };
    let document_of_instances;
    if let Some(patch) = &mut patch
        && instancing::expand(patch, &document, &buffers, &mut budget, &mut notes)?
    {
        document_of_instances = Document::from_root(patch.root(), &mut notes)?;
        buffers.document = &document_of_instances;
    }
    let prepared = decode(&buffers, budget, base, options.limits, &mut notes)?;
    Ok((prepared, notes))
}

/// Refuses a file that requires an extension this crate does not support.
pub(crate) fn check_extensions(document: &Document) -> Result<(), LoadProblem> {
    for name in &document.extensions_required {
        if !super::SUPPORTED_EXTENSIONS.contains(&name.as_str()) {
            if let Some(&OptionalDecoder { feature, remedy, .. }) = decoders::missing(name) {
                return Err(LoadProblem::SwitchedOff { name: name.clone(), feature, remedy });
            }
            let (name, supported) = (shortened(name).to_owned(), super::SUPPORTED_EXTENSIONS.join(", "));
            return Err(LoadProblem::RequiredExtension { name, supported });
        }
    }
    Ok(())
}

/// The bytes of every buffer, truncated to its `byteLength`.
pub(crate) fn contents<'a>(
    document: &Document,
    binary: Option<&'a [u8]>,
    base: Base<'_>,
    notes: &mut Notes,
) -> Result<Vec<Cow<'a, [u8]>>, LoadProblem> {
    let mut contents = Vec::new();
    for (index, buffer) in document.buffers.iter().enumerate() {
        let place = format!("buffers[{index}]");
        let content = match (&buffer.uri, binary) {
            (Some(uri), _) => Cow::Owned(uri::fetch(uri, base, &place)?),
            // A fallback buffer has no bytes: the views into it are decoded from other buffers.
            (None, _) if compressed_views::is_fallback(document, index)? => {
                contents.push(Cow::Borrowed(&[][..]));
                continue;
            }
            (None, Some(binary)) if index == 0 => Cow::Borrowed(binary),
            (None, _) => {
                let problem =
                    "is missing, and there is no binary chunk for it; export the file again".to_owned();
                return Err(LoadProblem::Uri { place, uri: String::new(), problem });
            }
        };
        let byte_length = buffer.byte_length.0;
        let found = content.len() as u64;
        if found < byte_length {
            let problem = LoadProblem::Truncated { what: place.clone(), needed: byte_length, found };
            // Everything in a .glb is padded to four bytes, so fewer than four missing bytes are padding.
            if byte_length - found >= 4 {
                return Err(problem);
            }
            notes.repair(&place, problem, "zeros stand for the padding that is missing")?;
            let mut padded = content.into_owned();
            padded.resize(byte_length as usize, 0);
            contents.push(Cow::Owned(padded));
            continue;
        }
        contents.push(match content {
            Cow::Borrowed(content) => Cow::Borrowed(&content[..byte_length as usize]),
            Cow::Owned(mut content) => {
                content.truncate(byte_length as usize);
                Cow::Owned(content)
            }
        });
    }
    Ok(contents)
}

/// Validates and decodes everything in the scene of a file. `budget` is what decompression and instances have
/// left of the limit on decoded bytes.
pub(crate) fn decode(
    buffers: &Buffers<'_>,
    budget: Budget,
    base: Base<'_>,
    limits: LoadLimits,
    notes: &mut Notes,
) -> Result<Prepared, LoadProblem> {
    let document = buffers.document;
    let mut prepared = prepare(document, buffers, base, limits, budget, notes)?;
    prepared.files = files_beside(document, base);
    Ok(prepared)
}

fn files_beside(document: &Document, base: Base<'_>) -> Vec<PathBuf> {
    let uris = document.buffers.iter().filter_map(|buffer| buffer.uri.as_deref());
    let uris = uris.chain(document.images.iter().filter_map(|image| image.uri.as_deref()));
    uris.filter(|uri| !uri.starts_with("data:")).filter_map(|uri| base.file(uri, "").ok()).collect()
}

/// Spawns the entities of a decoded file.
pub(crate) fn spawn(world: &mut World, prepared: Prepared, notes: Notes) -> LoadReport {
    let mut report = LoadReport { notes: notes.list, files: prepared.files, ..LoadReport::default() };
    report.nodes = vec![Entity::PLACEHOLDER; prepared.node_count];
    (report.photometric_lights, report.states_exposure) =
        (prepared.photometric_lights, prepared.states_exposure);
    report.meshes = prepared.meshes.values().map(Vec::len).sum();
    // Spawn entities in file order first, then attach children in the order of their parents' lists.
    let mut by_index: Vec<&PreparedNode> = prepared.nodes.iter().collect();
    by_index.sort_unstable_by_key(|node| node.index);
    for node in by_index {
        report.nodes[node.index] = spawn_node(world, node);
    }
    for node in &prepared.nodes {
        let entity = report.nodes[node.index];
        let parent = node.parent.map(|parent| report.nodes[parent]);
        if let Some(parent) = parent.filter(|parent| *parent != Entity::PLACEHOLDER) {
            world.entity_mut(entity).insert(ChildOf(parent));
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
    if let Some(medium) = primitive.medium {
        entity.insert(medium);
    }
    if let Some(quadric) = &node.quadric {
        entity.insert(quadric.clone());
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
    if let Some(scale) = node.lightmap_scale {
        entity.insert(scale);
    }
    if node.dynamic {
        entity.insert(DynamicObject);
    } else {
        entity.insert(StaticObject);
    }
}
