//! Saves a World as a .glb, or as a .gltf with a .bin. Baked light is written as OpenEXR and KTX2 images into
//! a folder beside it.

use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use bevy_ecs::prelude::*;
use lumbre_mesh::MeshError;
use lumbre_optics::{FogError, LightError, MaterialError};
use serde_json::{Map, Value, json};

use super::error::{LoadError, Note};
use super::export_files::Files;
use super::export_nodes::Nodes;
use super::{container, export_scene, uri};
use crate::lightmap_files::{
    EncodingError, LightmapFileError, PackedFormat, Supercompression, lightmap_to_ktx2, lightmap_to_open_exr,
};
use crate::{IrradianceVolume, Lightmap, LightmapEncoding, LightmapImage, QuadricError, SeparateLight};

/// Options for the images of baked light that are written beside a glTF file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SaveOptions {
    /// Encoding of OpenEXR images, overriding that of each lightmap: half floats for
    /// [`LightmapEncoding::Rgb16Float`], otherwise 32-bit floats.
    pub encoding: Option<LightmapEncoding>,
    /// Also writes each lightmap as a KTX2 image in this format, under the name of its OpenEXR image with the
    /// extension `ktx2`.
    pub ktx2: Option<PackedFormat>,
    /// Compression of KTX2 images.
    pub supercompression: Supercompression,
}

/// An image of a lightmap or irradiance volume that was written.
#[derive(Clone, Debug, PartialEq)]
pub struct LightmapFile {
    /// Path of the file.
    pub path: PathBuf,
    /// Encoding of its texels: `rgb32f`, `rgb16f`, `rgb9e5` or `b10g11r11`.
    pub encoding: &'static str,
    /// Size of the file in bytes.
    pub bytes: u64,
    /// The error introduced by the encoding.
    pub error: EncodingError,
}

/// The result of saving.
#[derive(Clone, Debug, Default)]
pub struct SaveReport {
    /// Every file written, the glTF file last.
    pub files: Vec<PathBuf>,
    /// Total size of the glTF file and its .bin in bytes.
    pub bytes: u64,
    /// The images of lightmaps and irradiance volumes among these files.
    pub lightmaps: Vec<LightmapFile>,
    /// What could not be expressed and was left out.
    pub notes: Vec<Note>,
}

/// Why a World cannot be saved.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SaveError {
    /// The output path ends in neither .glb nor .gltf.
    #[error("{} ends in neither .glb nor .gltf; name the output with one of them", path.display())]
    Extension {
        /// The output path.
        path: PathBuf,
    },
    /// A file is to be rewritten with only its settings changed, but source and output are not both .glb or
    /// both .gltf.
    #[error("{} is of the other kind than its source; give it the same ending, .glb or .gltf", path.display())]
    Container {
        /// The output path.
        path: PathBuf,
    },
    /// The file to be rewritten cannot be read.
    #[error(transparent)]
    Unreadable(LoadError),
    /// The file has no scene that could hold the settings.
    #[error("{} has no scene that could hold the settings; give it one", path.display())]
    NoScene {
        /// The file.
        path: PathBuf,
    },
    /// A file cannot be written.
    #[error("cannot write {}: {source}; check the folder, its permissions and the space left", path.display())]
    Write {
        /// Path of the file.
        path: PathBuf,
        /// The error of the operating system.
        source: std::io::Error,
    },
    /// A mesh is invalid.
    #[error("{place}: {source}")]
    Mesh {
        /// The entity.
        place: String,
        /// What is wrong with it.
        source: MeshError,
    },
    /// A number is NaN or infinite, which JSON cannot represent.
    #[error("{place}: {field} holds a number that is NaN or infinite; correct it before saving")]
    NotFinite {
        /// The entity.
        place: String,
        /// The component, or a field of it.
        field: String,
    },
    /// A light is invalid and could not be loaded again.
    #[error("{place}: {source}")]
    Light {
        /// The entity.
        place: String,
        /// What is wrong with it.
        source: LightError,
    },
    /// A material is invalid and could not be loaded again.
    #[error("{place}: {source}")]
    Material {
        /// The entity.
        place: String,
        /// What is wrong with it.
        source: MaterialError,
    },
    /// An exact surface is invalid and could not be loaded again.
    #[error("{place}: LUMBRE_quadric: {source}")]
    Quadric {
        /// The entity.
        place: String,
        /// What is wrong with it.
        source: QuadricError,
    },
    /// Fog is invalid and could not be loaded again.
    #[error("scene: {source}")]
    Fog {
        /// What is wrong with it.
        source: FogError,
    },
    /// An image cannot be encoded.
    #[error("{place}: the image {image:?} cannot be written: {problem}; correct it before saving")]
    Image {
        /// The entity.
        place: String,
        /// Name of the image.
        image: String,
        /// What is wrong with it.
        problem: String,
    },
    /// The JSON cannot be serialized.
    #[error("cannot write the JSON: {source}")]
    Json {
        /// The error of the serializer.
        source: serde_json::Error,
    },
    /// A mesh differs from the one that was loaded by more than its lightmap coordinates.
    #[error(
        "{place}: its triangles are no longer those of the file, so that they cannot be written into it; save the World as a file of its own"
    )]
    MeshChanged {
        /// The primitive.
        place: String,
    },
    /// Data of the source file that must be rewritten cannot be read.
    #[error("{place}: {problem}")]
    Source {
        /// The primitive.
        place: String,
        /// What is wrong with it.
        problem: Box<super::error::LoadProblem>,
    },
    /// The output exceeds the size limit of a .glb.
    #[error("{} would exceed the 4 GiB that a .glb can hold; save as .gltf", path.display())]
    TooLarge {
        /// Path of the file.
        path: PathBuf,
    },
}

/// Saves every entity with a `Transform`, the scene's settings, lightmaps and irradiance volumes.
///
/// The extension of `path` selects the format. Textures are embedded as PNG. Images of baked light are
/// written into the folder `<stem>.lightmaps` beside the file. All files are written under temporary names
/// first and renamed when they are complete, the glTF file last.
///
/// # Errors
/// [`SaveError`] with the place and the remedy. No incomplete file is left behind.
pub fn save(world: &mut World, path: &Path) -> Result<SaveReport, SaveError> {
    save_with(world, path, &SaveOptions::default())
}

/// [`save`] with options.
///
/// # Errors
/// As [`save`].
pub fn save_with(world: &mut World, path: &Path, options: &SaveOptions) -> Result<SaveReport, SaveError> {
    let binary = is_glb(path)?;
    let stem = path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
    let mut lightmaps = LightmapFiles::new(&stem, options.encoding);
    let nodes = Nodes::collect(world, &mut lightmaps)?;
    lightmaps.add_separate_light(world);
    let scene = export_scene::settings(world)?;

    let mut files = Files::default();
    let written = write_lightmaps(&lightmaps, path, options, &mut files)?;
    let bin_name = format!("{stem}.bin");
    let (json, data, notes) = document(nodes, scene, (!binary).then_some(bin_name.as_str()));
    let mut bytes = data.len() as u64;
    if binary {
        let text = serde_json::to_vec(&json).map_err(|source| SaveError::Json { source })?;
        let file = container::join(&text, &data, &[])
            .ok_or_else(|| SaveError::TooLarge { path: path.to_owned() })?;
        bytes = file.len() as u64;
        files.write(path, &file)?;
    } else {
        if !data.is_empty() {
            files.write(&path.with_file_name(&bin_name), &data)?;
        }
        let mut text = serde_json::to_vec_pretty(&json).map_err(|source| SaveError::Json { source })?;
        text.push(b'\n');
        bytes += text.len() as u64;
        files.write(path, &text)?;
    }
    Ok(SaveReport { files: files.commit()?, bytes, lightmaps: written, notes })
}

/// Returns true for the extension .glb and false for .gltf; other extensions are an error.
pub(crate) fn is_glb(path: &Path) -> Result<bool, SaveError> {
    let extension = path.extension().and_then(|extension| extension.to_str()).map(str::to_ascii_lowercase);
    match extension.as_deref() {
        Some("glb") => Ok(true),
        Some("gltf") => Ok(false),
        _ => Err(SaveError::Extension { path: path.to_owned() }),
    }
}

/// Writes the images of lightmaps and irradiance volumes into their folder beside the glTF file at `path`.
pub(crate) fn write_lightmaps(
    lightmaps: &LightmapFiles,
    path: &Path,
    options: &SaveOptions,
    files: &mut Files,
) -> Result<Vec<LightmapFile>, SaveError> {
    let folder = path.with_file_name(&lightmaps.folder);
    if !lightmaps.images.is_empty() || !lightmaps.volumes.is_empty() {
        files.make_folder(&folder);
    }
    let mut written = Vec::new();
    for (name, image) in &lightmaps.images {
        let failed = |error: LightmapFileError| SaveError::Image {
            place: "lightmap".to_owned(),
            image: image.name.clone(),
            problem: error.to_string(),
        };
        let mut write = |path: PathBuf, encoding, (bytes, error): (Vec<u8>, EncodingError)| {
            files.write(&path, &bytes)?;
            written.push(LightmapFile { path, encoding, bytes: bytes.len() as u64, error });
            Ok::<_, SaveError>(())
        };
        let image_path = folder.join(name);
        let encoding = options.encoding.unwrap_or(image.encoding);
        let name = if encoding == LightmapEncoding::Rgb16Float { "rgb16f" } else { "rgb32f" };
        write(image_path.clone(), name, lightmap_to_open_exr(image, encoding).map_err(failed)?)?;
        if let Some(format) = options.ktx2 {
            let file = lightmap_to_ktx2(image, format, options.supercompression).map_err(failed)?;
            write(image_path.with_extension("ktx2"), format.name(), file)?;
        }
    }
    for (name, volume) in &lightmaps.volumes {
        let format = PackedFormat::Rgb9E5;
        let (image, error) =
            volume.to_ktx2(format, options.supercompression).map_err(|error| SaveError::Image {
                place: "irradiance volume".to_owned(),
                image: name.clone(),
                problem: error.to_string(),
            })?;
        let path = folder.join(name);
        files.write(&path, &image)?;
        written.push(LightmapFile { path, encoding: format.name(), bytes: image.len() as u64, error });
    }
    Ok(written)
}

/// The JSON and the binary data of a file, and the notes.
fn document(nodes: Nodes, scene: Option<Value>, bin_name: Option<&str>) -> (Value, Vec<u8>, Vec<Note>) {
    let Nodes { nodes, roots, meshes, materials, lights, cameras, data, notes } = nodes;
    let mut root = Map::new();
    let version = env!("CARGO_PKG_VERSION");
    root.insert("asset".to_owned(), json!({"version": "2.0", "generator": format!("Lumbre {version}")}));
    root.insert("scene".to_owned(), json!(0));
    let mut scenes = Map::new();
    if !roots.is_empty() {
        scenes.insert("nodes".to_owned(), json!(roots));
    }
    if let Some(scene) = scene {
        scenes.insert("extensions".to_owned(), json!({"LUMBRE_scene": scene}));
    }
    root.insert("scenes".to_owned(), json!([scenes]));
    if !data.binary.is_empty() {
        let mut buffer = json!({"byteLength": data.binary.len()});
        if let Some(name) = bin_name {
            buffer["uri"] = uri::percent_encoded(name).into();
        }
        root.insert("buffers".to_owned(), json!([buffer]));
    }
    if !lights.is_empty() {
        root.insert("extensions".to_owned(), json!({"KHR_lights_punctual": {"lights": lights}}));
    }
    for (name, list) in [
        ("nodes", nodes),
        ("meshes", meshes),
        ("materials", materials),
        ("cameras", cameras),
        ("accessors", data.accessors),
        ("bufferViews", data.buffer_views),
        ("images", data.images),
        ("samplers", data.samplers),
        ("textures", data.textures),
    ] {
        // The glTF specification does not allow empty lists.
        if !list.is_empty() {
            root.insert(name.to_owned(), list.into());
        }
    }
    let root = Value::Object(root);
    let mut used = HashSet::new();
    extensions_in(&root, &mut used);
    let mut used: Vec<_> = used.into_iter().collect();
    used.sort_unstable();
    let mut root = root;
    if !used.is_empty() {
        root["extensionsUsed"] = json!(used);
    }
    (root, data.binary, notes)
}

/// Collects the names of all extensions in a value, except in application data (`extras`).
fn extensions_in(value: &Value, used: &mut HashSet<String>) {
    match value {
        Value::Object(object) => {
            if let Some(Value::Object(extensions)) = object.get("extensions") {
                used.extend(extensions.keys().cloned());
            }
            object
                .iter()
                .filter(|(key, _)| *key != "extras")
                .for_each(|(_, value)| extensions_in(value, used));
        }
        Value::Array(list) => list.iter().for_each(|value| extensions_in(value, used)),
        _ => {}
    }
}

/// The images of baked light to be written, each once, with unique names in a folder of their own.
pub(crate) struct LightmapFiles {
    /// Name of the folder, which lies beside the glTF file.
    folder: String,
    encoding: Option<LightmapEncoding>,
    known: HashMap<*const LightmapImage, usize>,
    images: Vec<(String, Arc<LightmapImage>)>,
    volumes: Vec<(String, IrradianceVolume)>,
    names: HashSet<String>,
}

impl LightmapFiles {
    /// The folder for a file `<stem>.glb` is `<stem>.lightmaps`.
    pub(crate) fn new(stem: &str, encoding: Option<LightmapEncoding>) -> Self {
        let (images, volumes, names) = Default::default();
        Self { folder: format!("{stem}.lightmaps"), encoding, known: HashMap::new(), images, volumes, names }
    }

    /// The `LUMBRE_lightmap` object for a node that uses an image.
    pub(crate) fn reference(
        &mut self,
        image: &Arc<LightmapImage>,
        node: Option<&str>,
        index: usize,
    ) -> Value {
        let known = match self.known.get(&Arc::as_ptr(image)) {
            Some(&known) => known,
            None => {
                // An atlas is shared by several nodes, so it keeps its own name.
                // The name of an image that was loaded is a path.
                let file = Path::new(&image.name).file_name().and_then(|file| file.to_str());
                let atlas =
                    file.and_then(|file| file.split('.').next()).filter(|name| name.starts_with("atlas-"));
                let name = self.file_name(atlas.or(node), index, "exr");
                self.known.insert(Arc::as_ptr(image), self.images.len());
                self.images.push((name, image.clone()));
                self.images.len() - 1
            }
        };
        let encoding = self.encoding.unwrap_or(image.encoding).name();
        json!({"image": self.uri(&self.images[known].0), "texCoord": 1, "encoding": encoding})
    }

    /// The `LUMBRE_irradiance_volume` object for a node with a volume.
    pub(crate) fn volume_reference(
        &mut self,
        volume: &IrradianceVolume,
        node: Option<&str>,
        index: usize,
    ) -> Value {
        let name = self.file_name(node, index, "ktx2");
        let mut reference = json!({"image": self.uri(&name), "encoding": PackedFormat::Rgb9E5.name()});
        let runs = runs(&volume.inside);
        if !runs.is_empty() {
            reference["inside"] = runs.into();
        }
        self.volumes.push((name, volume.clone()));
        reference
    }

    /// Adds the separate direct and bounced light of the lightmaps added so far, where the World has it.
    /// Called last, since no node refers to these files.
    pub(crate) fn add_separate_light(&mut self, world: &mut World) {
        let mut query = world.query::<(&Lightmap, &SeparateLight)>();
        let separate: HashMap<_, _> =
            query.iter(world).map(|(map, own)| (Arc::as_ptr(&map.image), own)).collect();
        let beside = |(name, image): &(String, Arc<LightmapImage>)| {
            let SeparateLight { direct, bounced } = separate.get(&Arc::as_ptr(image))?;
            let stem = name.strip_suffix(".exr").unwrap_or(name);
            let file =
                |light: &str, image: &Arc<LightmapImage>| (format!("{stem}.{light}.exr"), Arc::clone(image));
            Some([file("direct", direct), file("bounced", bounced)])
        };
        let files: Vec<_> = self.images.iter().filter_map(beside).flatten().collect();
        self.images.extend(files);
    }

    /// The URI of an image, relative to the glTF file.
    fn uri(&self, name: &str) -> String {
        uri::percent_encoded_path(&Path::new(&self.folder).join(name))
    }

    /// A file name whose stem is not used by any other image.
    fn file_name(&mut self, node: Option<&str>, index: usize, extension: &str) -> String {
        let number = index.to_string();
        // The name comes from a node, so it is reduced to characters that every file system allows.
        let plain = |c: char| if c.is_alphanumeric() || "-_".contains(c) { c } else { '_' };
        let label: String =
            node.filter(|name| !name.is_empty()).unwrap_or(&number).chars().take(64).map(plain).collect();
        let candidates =
            std::iter::once(label.clone()).chain((index..).map(|number| format!("{label}.{number}")));
        // Compared in lower case, since some file systems ignore case.
        let name =
            candidates.into_iter().find(|name| self.names.insert(name.to_lowercase())).unwrap_or_default();
        format!("{name}.{extension}")
    }
}

/// Run-length encodes the indices of true flags as pairs of first index and count.
fn runs(marks: &[bool]) -> Vec<usize> {
    let mut runs = Vec::new();
    let mut first = 0;
    for run in marks.chunk_by(|a, b| a == b) {
        if run[0] {
            runs.extend([first, run.len()]);
        }
        first += run.len();
    }
    runs
}
