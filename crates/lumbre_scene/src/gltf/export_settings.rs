//! Rewrites a file with changed settings and everything else preserved: buffers, animations and what Lumbre does
//! not understand, and baked light unless its lightmaps are to have fewer texels.

use std::collections::HashSet;
use std::path::Path;

use bevy_ecs::world::World;
use lumbre_optics::Shading;
use serde_json::{Map, Value, json};

use super::error::{LoadError, LoadProblem, Notes};
use super::export::{LightmapFiles, SaveError, SaveOptions, SaveReport, is_glb, write_lightmaps};
use super::export_files::Files;
use super::import::load_with;
use super::options::LoadOptions;
use super::{beside, container, document, frame_settings, uri};
use crate::lightmap_files::{Ktx2Header, PackedFormat};
use crate::{Children, FrameSettings, Lightmap, reduce_lightmaps};

/// The settings that [`save_settings`] writes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FileSettings {
    /// Shading of objects that do not set their own (`LUMBRE_scene.shading`).
    pub shading: Shading,
    /// Frame settings (`LUMBRE_scene.frame`), which replace those of the file.
    pub frame: FrameSettings,
    /// How many texels of a lightmap become one along each side (see [`reduce_lightmaps`]). With 0 or 1, files
    /// of lightmaps are not written again.
    pub lightmap_reduction: u32,
}

/// Writes a .glb or .gltf file again with these settings. If the output is in another folder, the files that
/// it refers to are copied there. Reduced lightmaps are written into the folder `<stem>.lightmaps` beside the
/// output as OpenEXR, and as KTX2 too where the file's lightmaps are.
///
/// # Errors
/// [`SaveError::Unreadable`] if the file cannot be read, [`SaveError::Container`] if source and output are
/// not both .glb or both .gltf, [`SaveError::NoScene`] if the file has no scene, [`SaveError::Image`] if a
/// lightmap cannot be encoded; otherwise as
/// [`save`](super::save()). No incomplete file is left behind.
pub fn save_settings(source: &Path, path: &Path, settings: FileSettings) -> Result<SaveReport, SaveError> {
    let unread = |problem: LoadProblem| SaveError::Unreadable(LoadError::of(source, problem));
    let mut notes = Notes::default();
    let bytes = uri::read(source).map_err(unread)?;
    let parts = container::split(&bytes, &mut notes).map_err(unread)?;
    let mut root = Value::Object(document::parse(parts.json).map_err(unread)?);
    let binary = is_glb(path)?;
    if binary != bytes.starts_with(container::MAGIC) {
        return Err(SaveError::Container { path: path.to_owned() });
    }
    let frame = frame_settings::written(&settings.frame)?;
    let frame = frame.map(serde_json::to_value).transpose().map_err(|source| SaveError::Json { source })?;
    set_scene(&mut root, settings.shading, frame)
        .ok_or_else(|| SaveError::NoScene { path: source.to_owned() })?;
    let mut files = Files::default();
    let base = uri::Base { folder: Some(source.parent().unwrap_or(Path::new(""))), root: None };
    let (mut made, mut lightmaps) = (HashSet::new(), Vec::new());
    if settings.lightmap_reduction > 1 {
        let reduced = reduced_lightmaps(&mut root, source, path, settings.lightmap_reduction)?;
        let ktx2 = packed_format(&reduced.former, base);
        let options = SaveOptions { ktx2, ..SaveOptions::default() };
        lightmaps = write_lightmaps(&reduced.files, path, &options, &mut files)?;
        made = reduced.made;
    }
    let copied = beside::copy_with_light(&mut root, base, path, &mut files, made)?;
    notes.list.extend(copied.notes.list);
    let failed = |source| SaveError::Json { source };
    let file = match binary {
        true => {
            let others: Vec<(u32, Vec<u8>)> =
                parts.others.iter().map(|(kind, bytes)| (*kind, bytes.to_vec())).collect();
            let text = serde_json::to_vec(&root).map_err(failed)?;
            container::join(&text, parts.binary.unwrap_or_default(), &others)
                .ok_or_else(|| SaveError::TooLarge { path: path.to_owned() })?
        }
        false => {
            let mut text = serde_json::to_vec_pretty(&root).map_err(failed)?;
            text.push(b'\n');
            text
        }
    };
    files.write(path, &file)?;
    let bytes = file.len() as u64;
    Ok(SaveReport { files: files.commit()?, bytes, lightmaps, notes: notes.list })
}

/// Sets shading and frame settings of the default scene, or returns `None` if there is no such scene.
fn set_scene(root: &mut Value, shading: Shading, frame: Option<Value>) -> Option<()> {
    let shown = root.get("scene").and_then(Value::as_u64).unwrap_or(0);
    let scene = root.pointer_mut(&format!("/scenes/{shown}"))?.as_object_mut()?;
    let extension = object_in(object_in(scene, "extensions")?, "LUMBRE_scene")?;
    extension.insert("shading".to_owned(), shading.to_string().into());
    match frame {
        Some(frame) => extension.insert("frame".to_owned(), frame),
        None => extension.remove("frame"),
    };
    let used = root.as_object_mut()?.entry("extensionsUsed").or_insert_with(|| json!([])).as_array_mut()?;
    if !used.iter().any(|name| name == "LUMBRE_scene") {
        used.push("LUMBRE_scene".into());
    }
    Some(())
}

/// Lightmaps to be written, and the URIs in the JSON.
struct Reduced {
    files: LightmapFiles,
    /// URIs of the former images.
    former: Vec<String>,
    /// URIs of the new ones.
    made: HashSet<String>,
}

/// Loads a file, reduces its lightmaps, and makes its JSON refer to the new ones.
fn reduced_lightmaps(
    root: &mut Value,
    source: &Path,
    path: &Path,
    reduction: u32,
) -> Result<Reduced, SaveError> {
    let mut world = World::new();
    let options = LoadOptions { lenient: true, ..LoadOptions::default() };
    let loaded = load_with(&mut world, source, &options).map_err(SaveError::Unreadable)?;
    reduce_lightmaps(&mut world, reduction);
    let stem = path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
    let (former, made) = Default::default();
    let mut reduced = Reduced { files: LightmapFiles::new(&stem, None), former, made };
    let nodes = root.get_mut("nodes").and_then(Value::as_array_mut).into_iter().flatten();
    for (number, (node, entity)) in nodes.zip(&loaded.nodes).enumerate() {
        let parts = world.get::<Children>(*entity).into_iter().flat_map(|children| children.iter());
        let Some(map) = parts.filter_map(|part| world.get::<Lightmap>(*part)).next() else { continue };
        let name = node.get("name").and_then(Value::as_str).map(ToOwned::to_owned);
        let Some(named) = node.pointer_mut("/extensions/LUMBRE_lightmap") else { continue };
        let new = reduced.files.reference(&map.image, name.as_deref(), number);
        let uri = |of: &Value| of["image"].as_str().map(ToOwned::to_owned);
        reduced.former.extend(uri(named));
        reduced.made.extend(uri(&new));
        *named = new;
    }
    Ok(reduced)
}

/// Returns the format of the KTX2 image beside the first of these images, if there is one.
fn packed_format(images: &[String], base: uri::Base<'_>) -> Option<PackedFormat> {
    let packed = format!("{}.ktx2", images.first()?.strip_suffix(".exr")?);
    let bytes = uri::read(&base.file(&packed, "").ok()?).ok()?;
    Ktx2Header::read(&bytes).ok().map(|header| header.format)
}

fn object_in<'a>(parent: &'a mut Map<String, Value>, name: &str) -> Option<&'a mut Map<String, Value>> {
    parent.entry(name).or_insert_with(|| json!({})).as_object_mut()
}
