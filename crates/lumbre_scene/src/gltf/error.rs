//! What can be wrong with a file, by name, and what is merely worth a remark. Not the checks themselves.

use std::fmt;
use std::path::PathBuf;

use lumbre_optics::{FogError, LightError, MaterialError};

/// Why a glTF file cannot be loaded.
#[derive(Debug, thiserror::Error)]
#[error("{file}: {}", described(file, problem))]
pub struct LoadError {
    /// The file, or the name given to its bytes.
    pub file: String,
    /// What is wrong, and where; part of the message, so that a chain of causes does not say it twice.
    pub problem: Box<LoadProblem>,
}

impl LoadError {
    /// Of a file.
    pub(crate) fn of(file: &std::path::Path, problem: LoadProblem) -> Self {
        Self { file: file.display().to_string(), problem: problem.into() }
    }
}

/// A problem, which does not name the file again if it is the one that cannot be read.
fn described(file: &str, problem: &LoadProblem) -> String {
    match problem {
        LoadProblem::Read { path, source } if path.display().to_string() == file => {
            format!("cannot be read: {source}; check that the file exists and may be read")
        }
        other => other.to_string(),
    }
}

/// What is wrong with a glTF file. Places are JSON paths such as `nodes[3].mesh`.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum LoadProblem {
    /// The file, or one that it names, cannot be read.
    #[error("cannot read {}: {source}; check that the file exists and may be read", path.display())]
    Read {
        /// The file that was asked for.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// Neither binary glTF nor JSON.
    #[error(
        "starts with {magic:?}, so it is neither a .glb (\"glTF\") nor a .gltf (JSON); export it as glTF 2.0"
    )]
    Magic {
        /// The first bytes, as text.
        magic: String,
    },
    /// A version other than 2.
    #[error("its glTF version is {version}; only 2.x is supported, export it again as glTF 2.0")]
    Version {
        /// The version as the file states it.
        version: String,
    },
    /// The binary container ends too early.
    #[error(
        "{what} needs {needed} bytes but {found} are there; the file is truncated, copy or export it again"
    )]
    Truncated {
        /// The header, chunk or buffer.
        what: String,
        /// Bytes that it claims.
        needed: u64,
        /// Bytes that exist.
        found: u64,
    },
    /// A chunk of a binary glTF is not what the format wants there.
    #[error("{what}; export the file again")]
    Container {
        /// What is wrong.
        what: String,
    },
    /// The JSON cannot be parsed, or a value has the wrong type.
    #[error("{place}: {source}; export the file again or correct this value")]
    Json {
        /// Which object.
        place: String,
        /// What the parser said.
        source: serde_json::Error,
    },
    /// The file cannot be shown without an extension that this crate does not know.
    #[error(
        "requires the extension {name}, which is not supported; export without it (supported: {supported})"
    )]
    RequiredExtension {
        /// Its name.
        name: String,
        /// The names of those that are supported.
        supported: String,
    },
    /// The file cannot be shown without an extension whose decoder was left out of this program.
    #[error(
        "requires the extension {name}, whose decoder was left out of this program; build it with the feature `{feature}` of lumbre_scene, \
         or convert the file: {remedy}"
    )]
    SwitchedOff {
        /// Its name.
        name: String,
        /// The cargo feature that brings the decoder.
        feature: &'static str,
        /// A command that writes the file without the extension.
        remedy: &'static str,
    },
    /// An index points at nothing.
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
        /// A node on the cycle.
        node: usize,
        /// Its name.
        name: String,
    },
    /// A node hangs below two others, or twice below one.
    #[error("nodes[{node}] ({name}) is listed by {first} and by {second}; a node may have one parent only")]
    TwoParents {
        /// The node.
        node: usize,
        /// Its name.
        name: String,
        /// Who lists it first.
        first: String,
        /// Who lists it again.
        second: String,
    },
    /// An accessor does not describe data that exists and can be used.
    #[error("accessors[{accessor}] ({used_by}): {problem}")]
    Accessor {
        /// The accessor.
        accessor: usize,
        /// The mesh, primitive and attribute that read it.
        used_by: String,
        /// What is wrong and what to do.
        problem: String,
    },
    /// A buffer view leaves its buffer.
    #[error("bufferViews[{view}]: bytes {offset} to {end} leave buffers[{buffer}], which has {length}")]
    BufferView {
        /// The view.
        view: usize,
        /// Its first byte.
        offset: u64,
        /// One past its last byte.
        end: u64,
        /// The buffer.
        buffer: usize,
        /// Bytes that the buffer has.
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
    /// A URI that is not followed, or that holds no data.
    #[error("{place}: the URI {uri:?} {problem}")]
    Uri {
        /// The field that holds it.
        place: String,
        /// Its first characters.
        uri: String,
        /// Why it is refused and what to do.
        problem: String,
    },
    /// An image cannot be decoded.
    #[error("{place}: {problem}")]
    Image {
        /// The image.
        place: String,
        /// What the decoder said and what to do.
        problem: String,
    },
    /// A number, word or combination that the field does not allow.
    #[error("{place}: {field} is {value}; {expected}")]
    Value {
        /// The light, material, camera, node or scene, with its name.
        place: String,
        /// The field.
        field: String,
        /// What was found.
        value: String,
        /// What is allowed.
        expected: String,
    },
    /// A light that cannot be evaluated.
    #[error("{place}: {source}")]
    Light {
        /// The light, or the node that carries it.
        place: String,
        /// What is wrong with it.
        source: LightError,
    },
    /// A material that cannot be lit.
    #[error("{place}: {source}")]
    Material {
        /// The material.
        place: String,
        /// What is wrong with it.
        source: MaterialError,
    },
    /// A fog that cannot be evaluated.
    #[error("{place}: {source}")]
    Fog {
        /// The scene.
        place: String,
        /// What is wrong with it.
        source: FogError,
    },
    /// The decoded scene would be larger than the limit.
    #[error(
        "{what} would take the decoded scene to {needed} bytes, above the limit of {limit}; \
         split the file, or raise LoadLimits::decoded_bytes"
    )]
    TooLarge {
        /// What was about to be decoded.
        what: String,
        /// Bytes that would be needed in all.
        needed: u64,
        /// The limit.
        limit: u64,
    },
}

/// Something that was repaired, ignored or left out while loading or saving.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Note {
    /// The node, mesh, material or extension.
    pub place: String,
    /// What was done about it.
    pub text: String,
}

impl fmt::Display for Note {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{}: {}", self.place, self.text)
    }
}

/// Collects notes, each one once.
#[derive(Debug, Default)]
pub(crate) struct Notes {
    pub list: Vec<Note>,
    /// Whether faults that can be repaired are.
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

    /// Notes what is done about a problem, or refuses it where nothing may be.
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
        // Most problems begin with their place.
        let text = text.strip_prefix(place).map_or(text.as_str(), |rest| rest.trim_start_matches([':', ' ']));
        self.add(place, format!("{text}; {instead}"));
        Ok(())
    }
}
