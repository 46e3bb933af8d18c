//! Saves a baked file: the artist's file as it was, with baked light added. Worlds that were not loaded from
//! a file are saved by `export`.

use std::collections::{BTreeMap, HashMap, HashSet};
use std::path::Path;
use std::sync::Arc;

use bevy_ecs::prelude::*;
use lumbre_mesh::TriangleMesh;
use lumbre_optics::{BakeMode, Light};
use serde_json::{Map, Value, json};

use super::compressed_primitives::EXTENSION as COMPRESSED;
use super::document::{Document, extension};
use super::error::Notes;
use super::export::{LightmapFiles, SaveError, SaveOptions, SaveReport, is_glb, write_lightmaps};
use super::export_files::Files;
use super::export_light::phong;
use super::export_nodes::transform_keys;
use super::extensions::LightReference;
use super::hierarchy::hierarchy;
use super::lightmapped::Primitives;
use super::patch::{EXTENSION, Patch, place, record_copied, without_unused};
use super::source::SourceFile;
use super::vertex_data::NewData;
use super::{beside, container, import_scene, uri};
use crate::{IrradianceVolume, Lightmap, LightmapImage, Mesh, Name, Primitive, SceneSettings, Transform};

/// Writes a file again with the light that was baked for the World it was loaded into.
///
/// Everything in the file is kept, including what this crate does not understand. The following is changed or
/// added, and recorded in the file's extension `LUMBRE_bake`:
///
/// - `LUMBRE_lightmap` of nodes, and `TEXCOORD_1` of their meshes. Where charts meet, vertices are split with
///   all their attributes and morph targets, and the indices are rewritten. A `TEXCOORD_1` in use moves to
///   another set, and the materials are adapted. Nodes that share a mesh but need different coordinates get
///   meshes of their own.
/// - `"bake": "static"` of lights whose light is in the lightmaps.
/// - `LUMBRE_irradiance_volume` of nodes, and new nodes for volumes without one.
/// - `LUMBRE_scene.sky`, if the World's sky differs.
/// - `extensionsUsed`.
///
/// New data is appended, so that existing indices stay valid. Nothing else of the World is written. A .gltf
/// keeps its buffers and gets one more, `<stem>.bake.bin`. From .gltf to .glb the first buffer becomes the
/// binary chunk; from .glb to .gltf the chunk becomes `<stem>.bin`. If the output is in another folder, the
/// files that the JSON refers to are copied there.
///
/// # Errors
/// [`SaveError`] with the place and the remedy. No incomplete file is left behind.
pub fn save_baked(
    world: &mut World,
    source: &SourceFile,
    path: &Path,
    options: &SaveOptions,
) -> Result<SaveReport, SaveError> {
    let binary = is_glb(path)?;
    let stem = path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
    let buffers = source.buffers();
    let (buffer, start) = if binary {
        (0, source.contents.first().map_or(0, |content| content.len().next_multiple_of(4)))
    } else {
        (source.contents.len(), 0)
    };
    let data = NewData { buffer, start, bytes: Vec::new() };
    let mut baked = Baked {
        patch: source.patch.clone(),
        lightmaps: LightmapFiles::new(&stem, options.encoding),
        primitives: Primitives::new(&buffers, data),
        used: HashSet::new(),
        source,
    };
    baked.meshes(world)?;
    baked.lights(world);
    baked.volumes(world)?;
    baked.sky(world)?;
    baked.extensions_used();
    let Baked { mut patch, mut lightmaps, primitives, .. } = baked;
    lightmaps.add_separate_light(world);
    let (data, mut notes) = (primitives.data, primitives.notes);

    let mut files = Files::default();
    let written = write_lightmaps(&lightmaps, path, options, &mut files)?;
    let added = &data.bytes;
    if !added.is_empty() {
        let length = data.start + added.len();
        if patch.get(&place!["buffers", buffer]).is_some() {
            patch.set(&place!["buffers", buffer, "byteLength"], length.into());
        } else {
            patch.push("buffers", json!({"byteLength": length}));
        }
    }
    let failed = |source| SaveError::Json { source };
    // What follows depends on where the output lies. It is not part of the bake and thus not recorded.
    let mut root = patch.finish().map_err(failed)?;
    // In a .glb the first buffer is the binary chunk; in a .gltf a former chunk becomes a file.
    let chunk_name = format!("{stem}.bin");
    let was_chunk = source.document.buffers.first().is_some_and(|first| first.uri.is_none());
    let mut chunk = Vec::new();
    if binary || was_chunk {
        chunk.extend(source.contents.first().into_iter().flatten());
    }
    if binary && !added.is_empty() {
        chunk.resize(data.start, 0);
        chunk.extend_from_slice(added);
    }
    if let Some(Value::Object(first)) = root.pointer_mut("/buffers/0").filter(|_| binary) {
        first.shift_remove("uri");
    }
    let copied = beside::copy(&mut root, source.base(), path, &mut files)?;
    notes.list.extend(copied.notes.list);
    record_copied(&mut root, copied.uris);
    let mut bytes = 0;
    if binary {
        let text = serde_json::to_vec(&root).map_err(failed)?;
        let file = container::join(&text, &chunk, &source.chunks)
            .ok_or_else(|| SaveError::TooLarge { path: path.to_owned() })?;
        bytes += file.len() as u64;
        files.write(path, &file)?;
    } else {
        let new_name = format!("{stem}.bake.bin");
        for (buffer, name, content) in [(0, &chunk_name, &chunk), (buffer, &new_name, added)] {
            let written = root.pointer_mut(&format!("/buffers/{buffer}"));
            if let Some(written) = written.filter(|_| !content.is_empty()) {
                written["uri"] = uri::percent_encoded(name).into();
                files.write(&path.with_file_name(name), content)?;
                bytes += content.len() as u64;
            }
        }
        let mut text = serde_json::to_vec_pretty(&root).map_err(failed)?;
        text.push(b'\n');
        bytes += text.len() as u64;
        files.write(path, &text)?;
    }
    Ok(SaveReport { files: files.commit()?, bytes, lightmaps: written, notes: notes.list })
}

/// State of writing a baked file.
struct Baked<'a> {
    source: &'a SourceFile,
    patch: Patch,
    lightmaps: LightmapFiles,
    primitives: Primitives<'a>,
    /// Names of the extensions written.
    used: HashSet<&'static str>,
}

/// The primitives of a node's mesh that get lightmap coordinates, as JSON by index.
type Shown = BTreeMap<usize, Value>;

impl Baked<'_> {
    fn document(&self) -> &Document {
        &self.source.document
    }

    /// The nodes whose entities are in the World.
    fn entities(&self, world: &World) -> Vec<(usize, Entity)> {
        let nodes = self.source.nodes.iter().copied().enumerate();
        nodes.filter(|(_, entity)| world.get_entity(*entity).is_ok()).collect()
    }

    fn name(&self, node: usize) -> Option<&str> {
        self.document().nodes.get(node).and_then(|node| node.name.as_deref())
    }

    fn meshes(&mut self, world: &World) -> Result<(), SaveError> {
        let mut made: HashMap<(usize, usize, *const TriangleMesh), Value> = HashMap::new();
        let mut shown: BTreeMap<usize, Shown> = BTreeMap::new();
        for (node, entity) in self.entities(world) {
            let mut lightmap: Option<Arc<LightmapImage>> = None;
            let mut parts = Shown::new();
            if let Some(mesh) = self.document().nodes[node].mesh {
                for (index, triangles, image) in lightmapped_parts(world, entity) {
                    let key = (mesh, index, Arc::as_ptr(&triangles));
                    let primitive = match made.get(&key) {
                        Some(known) => known.clone(),
                        None => {
                            let new =
                                self.primitives.lightmapped(&mut self.patch, mesh, index, &triangles)?;
                            made.insert(key, new.clone());
                            new
                        }
                    };
                    parts.insert(index, primitive);
                    lightmap.get_or_insert(image);
                }
            }
            let at = place!["nodes", node, "extensions", "LUMBRE_lightmap"];
            match lightmap {
                Some(image) => {
                    let name = self.source.document.nodes[node].name.as_deref();
                    let reference = self.lightmaps.reference(&image, name, node);
                    self.patch.set(&at, reference);
                    self.used.insert("LUMBRE_lightmap");
                }
                None => self.patch.remove(&at),
            }
            shown.insert(node, parts);
        }
        self.share(&shown);
        Ok(())
    }

    /// Writes the changed primitives into their meshes, or into copies of a mesh where nodes that share it
    /// differ.
    fn share(&mut self, shown: &BTreeMap<usize, Shown>) {
        let mut users: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
        for (node, of) in self.source.document.nodes.iter().enumerate() {
            if let Some(mesh) = of.mesh {
                users.entry(mesh).or_default().push(node);
            }
        }
        let unchanged = Shown::new();
        for (mesh, nodes) in users {
            let original = self.patch.get(&place!["meshes", mesh]).cloned().unwrap_or_default();
            let differs = |parts: &Shown| {
                parts.iter().any(|(index, primitive)| original["primitives"].get(*index) != Some(primitive))
            };
            let wanted = |node: &usize| shown.get(node).filter(|parts| differs(parts)).unwrap_or(&unchanged);
            let mut places: Vec<(&Shown, usize)> = Vec::new();
            if nodes.iter().any(|node| wanted(node).is_empty()) {
                places.push((&unchanged, mesh));
            }
            for node in &nodes {
                let parts = wanted(node);
                let known = places.iter().find(|(known, _)| *known == parts).map(|(_, place)| *place);
                let place = match known {
                    Some(known) => known,
                    None if places.is_empty() => {
                        for (index, primitive) in parts {
                            self.patch.replace(&place!["meshes", mesh, "primitives", *index], primitive);
                        }
                        mesh
                    }
                    None => {
                        let mut copy = original.clone();
                        for (index, primitive) in parts {
                            copy["primitives"][*index] = primitive.clone();
                        }
                        self.patch.push("meshes", copy)
                    }
                };
                if known.is_none() {
                    places.push((parts, place));
                }
                if place != mesh {
                    self.patch.set(&place!["nodes", *node, "mesh"], place.into());
                }
            }
        }
    }

    /// Marks every light whose light is in the lightmaps as static.
    fn lights(&mut self, world: &World) {
        if !self.used.contains("LUMBRE_lightmap") {
            return;
        }
        for (node, entity) in self.entities(world) {
            let Some(light) = world.get::<Light>(entity).filter(|light| light.bake == BakeMode::Static)
            else {
                continue;
            };
            let of = &self.document().nodes[node].extensions;
            let Ok(Some(LightReference { light: index })) =
                extension::<LightReference>(of, "KHR_lights_punctual", "")
            else {
                continue;
            };
            let at = place![
                "extensions",
                "KHR_lights_punctual",
                "lights",
                index,
                "extensions",
                "LUMBRE_lights_phong"
            ];
            if self.patch.get(&at).is_some() {
                self.patch.set(&[&at[..], &place!["bake"]].concat(), "static".into());
            } else if let Ok(written) = serde_json::to_value(phong(light, light.spot)) {
                self.patch.set(&at, written);
            }
            self.used.insert("LUMBRE_lights_phong");
        }
    }

    fn volumes(&mut self, world: &mut World) -> Result<(), SaveError> {
        let known: HashMap<Entity, usize> =
            self.entities(world).into_iter().map(|(node, entity)| (entity, node)).collect();
        let mut volumes = world.query::<(Entity, &IrradianceVolume, Option<&Name>, Option<&Transform>)>();
        let mut with_volume = HashSet::new();
        for (entity, volume, name, transform) in volumes.iter(world) {
            let node = known.get(&entity).copied();
            let number = node.unwrap_or_else(|| {
                self.patch.get(&place!["nodes"]).and_then(Value::as_array).map_or(0, Vec::len)
            });
            let name = match node {
                Some(node) => self.name(node).map(ToOwned::to_owned),
                None => name.map(ToString::to_string),
            };
            let reference = self.lightmaps.volume_reference(volume, name.as_deref(), number);
            if node.is_none() {
                let mut new = Map::new();
                if let Some(name) = name {
                    new.insert("name".to_owned(), name.into());
                }
                let transform = transform.copied().unwrap_or_default();
                if !transform.affine().is_finite() {
                    let place = "irradiance volume".to_owned();
                    return Err(SaveError::NotFinite { place, field: "Transform".to_owned() });
                }
                transform_keys(&mut new, &transform);
                self.patch.push("nodes", new.into());
                self.show(number);
            }
            self.patch.set(&place!["nodes", number, "extensions", "LUMBRE_irradiance_volume"], reference);
            with_volume.insert(number);
            self.used.insert("LUMBRE_irradiance_volume");
        }
        // Volumes no longer in the World, such as those of an earlier bake whose record did not match the
        // file.
        for node in (0..self.source.nodes.len()).filter(|node| !with_volume.contains(node)) {
            if self.source.nodes[node] != Entity::PLACEHOLDER {
                self.patch.remove(&place!["nodes", node, "extensions", "LUMBRE_irradiance_volume"]);
            }
        }
        Ok(())
    }

    /// Adds a new node to the default scene.
    fn show(&mut self, node: usize) {
        let scene = self.scene();
        let at = place!["scenes", scene, "nodes"];
        let mut nodes = self.patch.get(&at).and_then(Value::as_array).cloned().unwrap_or_default();
        nodes.push(node.into());
        self.patch.set(&at, nodes.into());
    }

    /// The default scene. If the file has no scenes, one with all root nodes is added.
    fn scene(&mut self) -> usize {
        if self.document().scenes.is_empty() && self.patch.get(&place!["scenes", 0]).is_none() {
            let shown = hierarchy(self.document(), &mut Notes::default());
            let (parents, order) = shown.map_or_else(|_| Default::default(), |all| (all.parents, all.order));
            let roots: Vec<usize> = order.into_iter().filter(|&node| parents[node].is_none()).collect();
            self.patch.set(&place!["scenes"], json!([{"nodes": roots}]));
        }
        self.document().scene.unwrap_or(0)
    }

    /// Writes the sky if it was changed since the file was loaded.
    fn sky(&mut self, world: &World) -> Result<(), SaveError> {
        let Some(settings) = world.get_resource::<SceneSettings>() else { return Ok(()) };
        let scene = self.document().scene.unwrap_or(0);
        if import_scene::settings(self.document(), scene).is_ok_and(|own| own.sky == settings.sky) {
            return Ok(());
        }
        if !settings.sky.is_finite() {
            let (place, field) = ("scene".to_owned(), "sky".to_owned());
            return Err(SaveError::NotFinite { place, field });
        }
        let scene = self.scene();
        let sky = super::export_material::color(settings.sky);
        self.patch.set(&place!["scenes", scene, "extensions", "LUMBRE_scene", "sky"], json!(sky));
        self.used.insert("LUMBRE_scene");
        Ok(())
    }

    fn extensions_used(&mut self) {
        let mut primitives = self.document().meshes.iter().flat_map(|mesh| &mesh.primitives);
        if primitives.any(|primitive| primitive.extensions.contains_key(COMPRESSED)) {
            without_unused(&mut self.patch, COMPRESSED, "meshes");
        }
        let used = self.patch.get(&place!["extensionsUsed"]).and_then(Value::as_array).into_iter().flatten();
        let mut used: Vec<String> = used.filter_map(Value::as_str).map(ToOwned::to_owned).collect();
        if !self.patch.is_unchanged() {
            self.used.insert(EXTENSION);
        }
        let mut new: Vec<&str> =
            self.used.iter().copied().filter(|name| !used.iter().any(|known| known == name)).collect();
        new.sort_unstable();
        if !new.is_empty() {
            used.extend(new.into_iter().map(ToOwned::to_owned));
            self.patch.set(&place!["extensionsUsed"], used.into());
        }
    }
}

/// The primitives of a node's mesh that have a lightmap, as (index, triangles, image).
fn lightmapped_parts(world: &World, node: Entity) -> Vec<(usize, Arc<TriangleMesh>, Arc<LightmapImage>)> {
    let children = world.get::<crate::Children>(node).into_iter().flat_map(|children| children.iter());
    let parts = children.filter_map(|part| {
        let (label, mesh) = (world.get::<Primitive>(part)?, world.get::<Mesh>(part)?);
        let lightmap = world.get::<Lightmap>(part)?;
        Some((label.index, Arc::clone(&mesh.0), Arc::clone(&lightmap.image)))
    });
    parts.collect()
}
