//! A glTF file kept as it was read, so that it can be written again with baked light added.

use std::borrow::Cow;
use std::path::{Path, PathBuf};

use bevy_ecs::prelude::*;

use super::accessor::Buffers;
use super::compressed::Decoded;
use super::document::{self, Document};
use super::error::{LoadError, LoadProblem, Notes};
use super::import::{LoadReport, check_extensions, contents, decode, spawn};
use super::limits::Budget;
use super::options::LoadOptions;
use super::patch::{EarlierBake, Patch, undo_bake};
use super::uri::{self, Base};
use super::{compressed, compressed_primitives, container, instancing, quadric_fallback};

/// A glTF file as the artist made it, with its JSON, buffers and unknown chunks preserved. Changes made by an
/// earlier bake are undone when it is read.
#[derive(Debug)]
pub struct SourceFile {
    /// The JSON; GPU instances are already expanded to nodes.
    pub(crate) patch: Patch,
    pub(crate) document: Document,
    /// The bytes of every buffer.
    pub(crate) contents: Vec<Vec<u8>>,
    /// The decoded form of compressed data.
    decoded: Decoded,
    /// Type and bytes of chunks that are neither JSON nor BIN.
    pub(crate) chunks: Vec<(u32, Vec<u8>)>,
    /// The folder of the file.
    pub(crate) folder: PathBuf,
    /// The entity of each node; empty until the file is loaded into a World.
    pub(crate) nodes: Vec<Entity>,
    name: String,
    /// What decompression and instances have left of the limit on decoded bytes.
    budget: Budget,
    notes: Notes,
    options: LoadOptions,
}

impl SourceFile {
    /// Reads a .glb file, or a .gltf file with its buffers.
    ///
    /// # Errors
    /// [`LoadError`] with the place and the remedy.
    pub fn read(path: &Path, options: &LoadOptions) -> Result<Self, LoadError> {
        let name = path.display().to_string();
        Self::read_named(path, &name, options)
            .map_err(|problem| LoadError { file: name, problem: problem.into() })
    }

    fn read_named(path: &Path, name: &str, options: &LoadOptions) -> Result<Self, LoadProblem> {
        let bytes = uri::read(path)?;
        let folder = path.parent().unwrap_or(Path::new("")).to_owned();
        let mut notes = Notes { lenient: options.lenient, ..Notes::default() };
        let container = container::split(&bytes, &mut notes)?;
        let mut root = document::parse(container.json)?;
        match undo_bake(&mut root) {
            EarlierBake::None => {}
            EarlierBake::Undone => notes.add("LUMBRE_bake", "was baked before; begins as it was then"),
            EarlierBake::Modified => notes.add(
                "LUMBRE_bake",
                "was changed by another program after a bake; what that bake added is taken for the artist's",
            ),
        }
        let mut document = Document::from_root(root.clone(), &mut notes)?;
        check_extensions(&document)?;
        let mut contents = contents(
            &document,
            container.binary,
            Base { folder: Some(&folder), root: options.root.as_deref() },
            &mut notes,
        )?;
        let mut budget = options.limits.budget(bytes.len(), &document, &contents);
        let mut patch = Patch::new(root);
        if quadric_fallback::add(&mut patch, &document, &mut contents, &mut budget, &mut notes)? {
            document = Document::from_root(patch.root(), &mut notes)?;
        }
        if compressed_primitives::separate_accessors(&mut patch, &document, &mut budget)? {
            document = Document::from_root(patch.root(), &mut notes)?;
        }
        let decoded = compressed::decode(&document, &contents, &mut budget)?;
        let buffers = Buffers { document: &document, bytes: contents, decoded: Cow::Borrowed(&decoded) };
        let expanded = instancing::expand(&mut patch, &document, &buffers, &mut budget, &mut notes)?;
        let contents = buffers.bytes.into_iter().map(Cow::into_owned).collect();
        let document = if expanded { Document::from_root(patch.root(), &mut notes)? } else { document };
        let chunks = container.others.into_iter().map(|(kind, bytes)| (kind, bytes.to_vec())).collect();
        let name = name.to_owned();
        let (nodes, options) = (Vec::new(), options.clone());
        Ok(Self { patch, document, contents, chunks, decoded, folder, nodes, name, budget, notes, options })
    }

    /// Spawns its entities in a World, as [`load`](super::load()) does, and remembers them for
    /// [`save_baked`](super::save_baked).
    ///
    /// # Errors
    /// [`LoadError`] with the place and the remedy; the World is then unchanged.
    pub fn load_into(&mut self, world: &mut World) -> Result<LoadReport, LoadError> {
        let mut notes = std::mem::take(&mut self.notes);
        let limits = self.options.limits;
        let budget = self.budget.clone();
        let prepared = decode(&self.buffers(), budget, self.base(), limits, &mut notes)
            .map_err(|problem| LoadError { file: self.name.clone(), problem: problem.into() })?;
        let report = spawn(world, prepared, notes);
        self.nodes.clone_from(&report.nodes);
        Ok(report)
    }

    /// The folders to which its URIs may refer.
    pub(crate) fn base(&self) -> Base<'_> {
        Base { folder: Some(&self.folder), root: self.options.root.as_deref() }
    }

    /// The buffers with the document that describes them.
    pub(crate) fn buffers(&self) -> Buffers<'_> {
        let bytes = self.contents.iter().map(|content| Cow::Borrowed(content.as_slice())).collect();
        Buffers { document: &self.document, bytes, decoded: Cow::Borrowed(&self.decoded) }
    }
}
