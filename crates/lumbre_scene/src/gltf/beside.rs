//! Copies the external files of a glTF file to the folder of an output in another folder. Their content is
//! not changed.

use std::collections::HashSet;
use std::fs;
use std::path::{Path, PathBuf};

use serde_json::Value;

use super::error::Notes;
use super::export::SaveError;
use super::export_files::Files;
use super::uri::{self, Base};
use super::{container, document, patch};

/// The URIs of the copies in the output, and notes.
#[derive(Default)]
pub(crate) struct Copied {
    pub uris: Vec<String>,
    pub notes: Notes,
}

/// Copies the files that a file's JSON refers to into the folder of the output, and updates the URIs in the
/// JSON.
///
/// An existing file of the same name is overwritten only if it is identical or was copied there by an earlier
/// bake; otherwise the copy gets a new name. Nothing is done if both folders are the same.
pub(crate) fn copy(
    root: &mut Value,
    base: Base<'_>,
    output: &Path,
    files: &mut Files,
) -> Result<Copied, SaveError> {
    copy_named(root, base, output, files, None)
}

/// As [`copy`], including the images of baked light, for an output that keeps them, except those with the URIs
/// `made`, which are written with the output.
pub(crate) fn copy_with_light(
    root: &mut Value,
    base: Base<'_>,
    output: &Path,
    files: &mut Files,
    made: HashSet<String>,
) -> Result<Copied, SaveError> {
    copy_named(root, base, output, files, Some(made))
}

fn copy_named(
    root: &mut Value,
    base: Base<'_>,
    output: &Path,
    files: &mut Files,
    made_light: Option<HashSet<String>>,
) -> Result<Copied, SaveError> {
    let beside = output.parent().unwrap_or(Path::new(""));
    let mut copies =
        Copies { base, output, beside, files, made_light, former: former(output), copied: Copied::default() };
    let real =
        |folder: &Path| fs::canonicalize(if folder.as_os_str().is_empty() { Path::new(".") } else { folder });
    match (real(base.folder.unwrap_or(Path::new(""))), real(beside)) {
        (Ok(from), Ok(to)) if from == to => {}
        _ => copies.walk(root)?,
    }
    Ok(copies.copied)
}

/// The URIs of the files that an earlier bake copied when it wrote the current output file; empty if there is
/// none.
fn former(output: &Path) -> HashSet<String> {
    let read = || {
        let bytes = uri::read(output).ok()?;
        let container = container::split(&bytes, &mut Notes::default()).ok()?;
        Some(patch::copied(&document::parse(container.json).ok()?))
    };
    read().unwrap_or_default().into_iter().collect()
}

/// Extensions whose `image` member is baked light.
const LIGHT: [&str; 2] = ["LUMBRE_lightmap", "LUMBRE_irradiance_volume"];

struct Copies<'a> {
    base: Base<'a>,
    output: &'a Path,
    beside: &'a Path,
    files: &'a mut Files,
    /// If the images of lightmaps and irradiance volumes are copied too, the URIs of those that are not.
    made_light: Option<HashSet<String>>,
    former: HashSet<String>,
    copied: Copied,
}

impl Copies<'_> {
    fn walk(&mut self, value: &mut Value) -> Result<(), SaveError> {
        match value {
            Value::Object(object) => {
                for (key, member) in
                    object.iter_mut().filter(|(key, _)| *key != "extras" && *key != patch::EXTENSION)
                {
                    match member {
                        Value::String(text) if key == "uri" && !text.starts_with("data:") => {
                            *text = self.copy(text)?;
                        }
                        Value::Object(light) if LIGHT.contains(&key.as_str()) => {
                            if let Some(Value::String(image)) = light.get_mut("image")
                                && self.made_light.as_ref().is_some_and(|made| !made.contains(image))
                            {
                                self.copy_packed(image)?;
                                *image = self.copy(image)?;
                            }
                        }
                        _ => self.walk(member)?,
                    }
                }
                Ok(())
            }
            Value::Array(list) => list.iter_mut().try_for_each(|element| self.walk(element)),
            _ => Ok(()),
        }
    }

    /// Copies the KTX2 version of a lightmap, which is written beside it for other programs, if it exists.
    fn copy_packed(&mut self, image: &str) -> Result<(), SaveError> {
        let Some(packed) = image.strip_suffix(".exr").map(|stem| format!("{stem}.ktx2")) else {
            return Ok(());
        };
        if self.base.file(&packed, "").is_ok_and(|file| file.is_file()) {
            self.copy(&packed)?;
        }
        Ok(())
    }

    /// Copies the file that a URI refers to, and returns the URI of the copy.
    fn copy(&mut self, named: &str) -> Result<String, SaveError> {
        let Ok(file) = self.base.file(named, "") else {
            let place = format!("the URI {:?}", document::shortened(named));
            self.copied.notes.add(place, "is not of a file that may be read; kept as it is");
            return Ok(named.to_owned());
        };
        // A file from outside of the source folder is copied directly into the output folder.
        let (relative, own) = match uri::relative(named) {
            Ok(relative) => (relative, named.to_owned()),
            Err(_) => {
                let name = PathBuf::from(file.file_name().unwrap_or_default());
                let own = uri::percent_encoded_path(&name);
                (name, own)
            }
        };
        let Ok(bytes) = uri::read(&file) else {
            self.copied
                .notes
                .add(relative.display().to_string(), "cannot be read; not copied beside the output");
            return Ok(named.to_owned());
        };
        let own = std::iter::once((relative.clone(), own));
        for (path, named) in own.chain(self.other_names(&relative)) {
            let target = self.beside.join(&path);
            let present = fs::read(&target).ok();
            let same = present.as_ref() == Some(&bytes);
            if !same && target.exists() && !self.former.contains(&named) && !self.copied.uris.contains(&named)
            {
                continue;
            }
            if !same {
                if let Some(folder) = target.parent() {
                    fs::create_dir_all(folder)
                        .map_err(|source| SaveError::Write { path: folder.to_owned(), source })?;
                }
                if !self.copied.uris.contains(&named) {
                    self.files.write(&target, &bytes)?;
                }
            }
            if (!same || self.former.contains(&named)) && !self.copied.uris.contains(&named) {
                self.copied.uris.push(named.clone());
            }
            return Ok(named);
        }
        Ok(named.to_owned())
    }

    /// Alternative names for a copy whose own name is taken.
    fn other_names(&self, relative: &Path) -> impl Iterator<Item = (PathBuf, String)> + use<> {
        let stem = self.output.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let name = relative.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let relative = relative.to_owned();
        (1..1000).map(move |number| {
            let name = if number == 1 { format!("{stem}.{name}") } else { format!("{stem}.{number}.{name}") };
            let path = relative.with_file_name(name);
            let uri = uri::percent_encoded_path(&path);
            (path, uri)
        })
    }
}
