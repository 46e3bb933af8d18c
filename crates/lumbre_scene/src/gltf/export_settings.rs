//! Rewrites a file with changed settings and everything else preserved: buffers, baked light, animations and
//! what Lumbre does not understand. No World is involved.

use std::path::Path;

use lumbre_optics::Shading;
use serde_json::{Map, Value, json};

use super::error::{LoadError, LoadProblem, Notes};
use super::export::{SaveError, SaveReport, is_glb};
use super::export_files::Files;
use super::{beside, container, document, frame_settings, uri};
use crate::FrameSettings;

/// The settings that [`save_settings`] writes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FileSettings {
    /// Shading of objects that do not set their own (`LUMBRE_scene.shading`).
    pub shading: Shading,
    /// Whether lights that cast shadows keep doing so (`LUMBRE_lights_phong.shadow`).
    pub shadows: bool,
    /// Frame settings (`LUMBRE_scene.frame`), which replace those of the file.
    pub frame: FrameSettings,
}

/// Writes a .glb or .gltf file again with these settings. If the output is in another folder, the files that
/// it refers to are copied there.
///
/// # Errors
/// [`SaveError::Unreadable`] if the file cannot be read, [`SaveError::Container`] if source and output are
/// not both .glb or both .gltf, [`SaveError::NoScene`] if the file has no scene; otherwise as
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
    if !settings.shadows {
        without_shadows(&mut root);
    }
    let mut files = Files::default();
    let base = uri::Base { folder: Some(source.parent().unwrap_or(Path::new(""))), root: None };
    let copied = beside::copy_with_light(&mut root, base, path, &mut files)?;
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
    Ok(SaveReport { files: files.commit()?, bytes, lightmaps: Vec::new(), notes: notes.list })
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

fn object_in<'a>(parent: &'a mut Map<String, Value>, name: &str) -> Option<&'a mut Map<String, Value>> {
    parent.entry(name).or_insert_with(|| json!({})).as_object_mut()
}

fn without_shadows(root: &mut Value) {
    let lights = root.pointer_mut("/extensions/KHR_lights_punctual/lights").and_then(Value::as_array_mut);
    for light in lights.into_iter().flatten() {
        if let Some(shadow) = light.pointer_mut("/extensions/LUMBRE_lights_phong/shadow") {
            *shadow = false.into();
        }
    }
}
