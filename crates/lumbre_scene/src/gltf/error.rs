//! Errors of loading glTF files, and notes on repairs and omissions. The checks themselves are in the import
//! modules.

use std::fmt;
use std::path::PathBuf;

use lumbre_optics::{FogError, LightError, MaterialError};

/// Why a glTF file cannot be loaded.
#[derive(Debug, thiserror::Error)]
#[error("{file}: {}", described(file, problem))]
pub struct LoadError {
    /// Path of the file, or the name given for its bytes.
    pub file: String,
    /// What is wrong, and where. It is part of this error's message and therefore not its `source`, so that
    /// printing the chain of causes does not repeat it.
    pub problem: Box<LoadProblem>,
}

impl LoadError {
    /// A problem of the file at this path.
    pub(crate) fn of(file: &std::path::Path, problem: LoadProblem) -> Self {
        Self { file: file.display().to_string(), problem: problem.into() }
    }
}

/// Text of a problem, without the file's name if the problem is that this very file cannot be read.
fn described(file: &str, problem: &LoadProblem) -> String {
    match problem {
        LoadProblem::Read { path, source } if path.display().to_string() == file => {
            format!("cannot be read: {source}; check that the file exists and may be read")
        }
        other => other.to_string(),
    }
}

/// What is wrong with a glTF file. A `place` is a JSON path such as `nodes[3].mesh`.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum LoadProblem {
    /// The file, or one that it refers to, cannot be read.
    #[error("cannot read {}: {source}; check that the file exists and may be read", path.display())]
    Read {
        /// Path of the file that cannot be read.
        path: PathBuf,
        /// The error of the operating system.
        source: std::io::Error,
    },
    /// The file is neither binary glTF nor JSON.
    #[error(
        "starts with {magic:?}, so it is neither a .glb (\"glTF\") nor a .gltf (JSON); export it as glTF 2.0"
    )]
    Magic {
        /// The first bytes, as text.
        magic: String,
    },
    /// The glTF version is not 2.
    #[error("its glTF version is {version}; only 2.x is supported, export it again as glTF 2.0")]
    Version {
        /// The version stated in the file.
        version: String,
    },
    /// The binary container or a buffer ends too early.
    #[error(
        "{what} needs {needed} bytes but {found} are there; the file is truncated, copy or export it again"
    )]
    Truncated {
        /// The header, chunk or buffer that is incomplete.
        what: String,
        /// Size in bytes that it claims.
        needed: u64,
        /// Bytes that are present.
        found: u64,
    },
    /// A chunk of a binary glTF is not of the type required in its position.
    #[error("{what}; export the file again")]
    Container {
        /// What is wrong.
        what: String,
    },
    /// The JSON cannot be parsed, or a value has the wrong type.
    #[error("{place}: {source}; export the file again or correct this value")]
    Json {
        /// The object in question.
        place: String,
        /// The error of the JSON parser.
        source: serde_json::Error,
    },
    /// The file requires an extension that this crate does not support.
    #[error(
        "requires the extension {name}, which is not supported; export without it (supported: {supported})"
    )]
    RequiredExtension {
        /// Name of the extension.
        name: String,
        /// Names of the supported extensions.
        supported: String,
    },
    /// The file requires an extension whose decoder was not compiled into this program.
    #[error(
        "requires the extension {name}, whose decoder was left out of this program; build it with the feature `{feature}` of lumbre_scene, \
         or convert the file: {remedy}"
    )]
    SwitchedOff {
        /// Name of the extension.
        name: String,
        /// The cargo feature that enables the decoder.
        feature: &'static str,
        /// A command that converts the file to one without the extension.
        remedy: &'static str,
    },
    /// An index is out of range.
    #[error("{place} refers to {list}[{index}], but the file has {count} {list}")]
    Reference {
        /// The field that holds the index.
        place: String,
        /// The list that it points into.
        list: &'static str,
        /// The index.
        index: usize,
        /// Length of the list.
        count: usize,
    },
    /// A node is its own ancestor.
    #[error("nodes[{node}] ({name}) is its own ancestor; nodes must form trees")]
    Cycle {
        /// Index of a node on the cycle.
        node: usize,
        /// Name of that node.
        name: String,
    },
    /// A node is a child of two nodes, or listed twice by one.
    #[error("nodes[{node}] ({name}) is listed by {first} and by {second}; a node may have one parent only")]
    TwoParents {
        /// Index of the node.
        node: usize,
        /// Name of the node.
        name: String,
        /// The place that lists it first.
        first: String,
        /// The place that lists it again.
        second: String,
    },
    /// An accessor is invalid, or its type is not allowed in this use.
    #[error("accessors[{accessor}] ({used_by}): {problem}")]
    Accessor {
        /// Index of the accessor.
        accessor: usize,
        /// The mesh, primitive and attribute that use it.
        used_by: String,
        /// What is wrong, and the remedy.
        problem: String,
    },
    /// A buffer view exceeds its buffer.
    #[error("bufferViews[{view}]: bytes {offset} to {end} leave buffers[{buffer}], which has {length}")]
    BufferView {
        /// Index of the view.
        view: usize,
        /// Offset of its first byte.
        offset: u64,
        /// Offset one past its last byte.
        end: u64,
        /// Index of the buffer.
        buffer: usize,
        /// Size of the buffer in bytes.
        length: u64,
    },
    /// Compressed data cannot be decoded.
    #[error("{place}: {problem}; compress the file again, or export it without compression")]
    Compressed {
        /// The buffer view or primitive.
        place: String,
        /// What is wrong with the data.
        problem: String,
    },
    /// A URI must not be followed, or its data cannot be decoded.
    #[error("{place}: the URI {uri:?} {problem}")]
    Uri {
        /// The field that holds it.
        place: String,
        /// The beginning of the URI.
        uri: String,
        /// Why it is refused, and the remedy.
        problem: String,
    },
    /// An image cannot be decoded.
    #[error("{place}: {problem}")]
    Image {
        /// The place of the image.
        place: String,
        /// What the decoder reports, and the remedy.
        problem: String,
    },
    /// A number, name or combination of values that is not allowed.
    #[error("{place}: {field} is {value}; {expected}")]
    Value {
        /// The light, material, camera, node or scene, with its name.
        place: String,
        /// The field.
        field: String,
        /// The value found.
        value: String,
        /// The values allowed.
        expected: String,
    },
    /// A light has invalid parameters.
    #[error("{place}: {source}")]
    Light {
        /// The light, or the node it belongs to.
        place: String,
        /// What is wrong with it.
        source: LightError,
    },
    /// A material has invalid parameters.
    #[error("{place}: {source}")]
    Material {
        /// The material.
        place: String,
        /// What is wrong with it.
        source: MaterialError,
    },
    /// Fog has invalid parameters.
    #[error("{place}: {source}")]
    Fog {
        /// The scene.
        place: String,
        /// What is wrong with it.
        source: FogError,
    },
    /// The decoded scene would exceed the limit.
    #[error(
        "{what} would take the decoded scene to {needed} bytes, above the limit of {limit}; \
         split the file, or raise LoadLimits::decoded_bytes"
    )]
    TooLarge {
        /// What was about to be decoded.
        what: String,
        /// Total size in bytes that would be needed.
        needed: u64,
        /// The limit in bytes.
        limit: u64,
    },
}

/// Something that was repaired, ignored or left out while loading or saving.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Note {
    /// The node, mesh, material or extension concerned.
    pub place: String,
    /// What is wrong and what was done about it.
    pub text: String,
}

impl fmt::Display for Note {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{}: {}", self.place, self.text)
    }
}

/// Collects notes without duplicates.
#[derive(Debug, Default)]
pub(crate) struct Notes {
    pub list: Vec<Note>,
    /// Whether repairable faults are repaired instead of refused.
    pub lenient: bool,
}

impl Notes {
    pub(crate) fn add(&mut self, place: impl Into<String>, text: impl Into<String>) {
        let note = Note { place: place.into(), text: text.into() };
        if !self.list.contains(&note) {
            tracing::debug!("{note}");
            self.list.push(note);
        }
    }

    /// Adds a note that a problem was repaired by doing `instead`, or returns the problem as an error if
    /// repairs are not allowed.
    pub(crate) fn repair(
        &mut self,
        place: &str,
        problem: LoadProblem,
        instead: &str,
    ) -> Result<(), LoadProblem> {
        if !self.lenient {
            return Err(problem);
        }
        let text = problem.to_string();
        // Most problems start with their place, which the note already names.
        let text = text.strip_prefix(place).map_or(text.as_str(), |rest| rest.trim_start_matches([':', ' ']));
        self.add(place, format!("{text}; {instead}"));
        Ok(())
    }
}
