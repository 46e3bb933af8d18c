//! The declarations of a graph as plain data that can be compared. If nothing differs from last frame, last frame's
//! plan is used again.

use crate::access::{Access, Part};
use crate::error::GraphError;
use crate::resource::{Label, ResourceDeclaration};
use crate::site::Site;

/// What kind of commands a pass records.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum PassKind {
    /// Draws, inside a render pass.
    Raster,
    /// Dispatches, inside a compute pass.
    Compute,
    /// Commands on the encoder itself: copies, or passes that are begun by hand.
    Transfer,
}

impl PassKind {
    /// Returns its name.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Raster => "raster",
            Self::Compute => "compute",
            Self::Transfer => "transfer",
        }
    }
}

/// One use of one version of a resource by a pass.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct AccessDeclaration {
    pub resource: usize,
    /// The version that the handle named: the one that is read, or the one that the write is applied to.
    pub version: u32,
    pub access: Access,
    pub part: Option<Part>,
    pub optional: bool,
}

impl AccessDeclaration {
    /// Returns the part that is accessed; `None` for all of it. An attachment is always a single part.
    pub fn touched_part(&self) -> Option<Part> {
        self.part.or_else(|| self.access.is_attachment().then(Part::default))
    }

    /// Returns the version that this access makes, if it writes.
    pub fn written(&self) -> Option<u32> {
        self.access.writes().then_some(self.version + 1)
    }
}

/// A declared pass without its body.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct PassDeclaration {
    pub name: Label,
    /// The part of the program that declared it, see `Graph::set_owner`.
    pub owner: Option<Label>,
    pub kind: PassKind,
    pub accesses: Vec<AccessDeclaration>,
    /// What the pass requires, each with whether it is there.
    pub requirements: Vec<(bool, Label)>,
    pub side_effects: Vec<Label>,
    pub fingerprint: Option<u64>,
    pub after: Vec<Label>,
    pub site: Site,
}

impl PassDeclaration {
    pub fn is_called_for(&self) -> bool {
        self.requirements.iter().all(|(there, _)| *there)
    }
}

/// A declared graph without the bodies of its passes.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Declarations {
    pub label: Label,
    pub resources: Vec<ResourceDeclaration>,
    pub passes: Vec<PassDeclaration>,
    /// Faults found while declaring, in order.
    pub faults: Vec<GraphError>,
}

impl Declarations {
    /// Returns the pass that makes `version` of `resource`; `None` for version 0.
    pub fn producer(&self, resource: usize, version: u32) -> Option<usize> {
        let index = version.checked_sub(1)?;
        self.resources[resource].writers.get(index as usize).copied()
    }
}
