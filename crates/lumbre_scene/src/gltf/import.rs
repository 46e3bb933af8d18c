//! Loading: from a file or bytes to entities in a World.

use std::borrow::Cow;
use std::path::{Path, PathBuf};

use bevy_ecs::prelude::*;

use super::accessor::Buffers;
use super::decoders::{self, OptionalDecoder};
use super::document::{self, Document, shortened};
use super::error::{LoadError, LoadProblem, Note, Notes};
use super::limits::LoadLimits;
use super::options::LoadOptions;
use super::patch::Patch;
use super::prepared::{Prepared, PreparedNode, PreparedPrimitive, prepare};
use super::uri::{self, Base};
use super::{compressed, compressed_views, container, instancing};
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
    /// Lights whose strength is in candela or lux, as `KHR_lights_punctual` has it: numbers that a picture holds under an exposure only.
    pub photometric_lights: usize,
    /// Whether a camera says how its pictures are exposed (`LUMBRE_camera.exposure`).
    pub states_exposure: bool,
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
    load_with(world, path, &LoadOptions::default())
}

/// [`load`], with choices.
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
    let options = LoadOptions { limits, ..LoadOptions::default() };
    let (prepared, notes) = read(bytes, Base { folder: base, root: None }, &options)
        .map_err(|problem| LoadError { file: name.to_owned(), problem: problem.into() })?;
    Ok(spawn(world, prepared, notes))
}

fn read(bytes: &[u8], base: Base<'_>, options: &LoadOptions) -> Result<(Prepared, Notes), LoadProblem> {
    let mut notes = Notes { lenient: options.lenient, ..Notes::default() };
    let container = container::split(bytes, &mut notes)?;
    let root = document::parse(container.json)?;
    let mut patch = instancing::is_used(&root).then(|| Patch::new(root.clone()));
    let document = Document::from_root(root, &mut notes)?;
    check_extensions(&document)?;
    let contents = contents(&document, container.binary, base, &mut notes)?;
    let mut budget = options.limits.budget(bytes.len(), &document, &contents);
    let decoded = Cow::Owned(compressed::decode(&document, &contents, &mut budget)?);
    let mut buffers = Buffers { document: &document, bytes: contents, decoded };
    let document_of_instances;
    if let Some(patch) = &mut patch
        && instancing::expand(patch, &document, &buffers, &mut budget, &mut notes)?
    {
        document_of_instances = Document::from_root(patch.root(), &mut notes)?;
        buffers.document = &document_of_instances;
    }
    let prepared = decode(&buffers, bytes.len() as u64, base, options.limits, &mut notes)?;
    Ok((prepared, notes))
}

/// Refuses what cannot be shown without an extension that is not known here.
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

/// The bytes of every buffer, as long as each says it is.
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
            // Views into it are decoded from other buffers.
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
            // Four is what everything in a .glb is padded to.
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

/// Checks and decodes everything that is shown of a file of so many bytes.
pub(crate) fn decode(
    buffers: &Buffers<'_>,
    file_bytes: u64,
    base: Base<'_>,
    limits: LoadLimits,
    notes: &mut Notes,
) -> Result<Prepared, LoadProblem> {
    let document = buffers.document;
    let budget = limits.budget(file_bytes as usize, document, &buffers.bytes);
    let mut prepared = prepare(document, buffers, base, limits, budget, notes)?;
    prepared.files = files_beside(document, base);
    Ok(prepared)
}

fn files_beside(document: &Document, base: Base<'_>) -> Vec<PathBuf> {
    let uris = document.buffers.iter().filter_map(|buffer| buffer.uri.as_deref());
    let uris = uris.chain(document.images.iter().filter_map(|image| image.uri.as_deref()));
    uris.filter(|uri| !uri.starts_with("data:")).filter_map(|uri| base.file(uri, "").ok()).collect()
}

/// Makes entities of what was decoded.
pub(crate) fn spawn(world: &mut World, prepared: Prepared, notes: Notes) -> LoadReport {
    let mut report = LoadReport { notes: notes.list, files: prepared.files, ..LoadReport::default() };
    report.nodes = vec![Entity::PLACEHOLDER; prepared.node_count];
    (report.photometric_lights, report.states_exposure) =
        (prepared.photometric_lights, prepared.states_exposure);
    report.meshes = prepared.meshes.values().map(Vec::len).sum();
    // Entities in the order of the file, then children in the order of their parent's list.
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
