//! What can go wrong while a compiled graph runs. Faults of the declarations are [`GraphError`]s.

use crate::error::{GraphError, did_you_mean};
use crate::resource::Label;
use crate::run::context::BodyError;

/// Why a frame could not be run.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
#[expect(missing_docs, reason = "each variant's message says what its fields are")]
pub enum RunError {
    /// The graph does not compile.
    #[error(transparent)]
    Graph(#[from] Box<GraphError>),

    /// A pass returned an error.
    #[error("pass `{pass}`: {source}")]
    Pass { pass: Label, source: BodyError },

    /// A pass was declared without `.run()`.
    #[error("pass `{pass}` has nothing to run: end its declaration with .run()")]
    NoBody { pass: Label },

    /// An import to which nothing is bound.
    #[error("`{resource}` is imported, but nothing is bound to that name{}", did_you_mean(.nearest))]
    ImportNotBound { resource: Label, nearest: Option<Label> },

    /// The bound resource is not as declared.
    #[error("`{resource}` was imported with {what} {declared}, but what is bound has {bound}")]
    ImportMismatch { resource: Label, what: &'static str, declared: String, bound: String },

    /// The bound resource does not allow the usages that the passes need.
    #[error(
        "`{resource}` needs usage {needs} in this graph, but what is bound allows {bound}: create it with the former"
    )]
    ImportUsage { resource: Label, needs: String, bound: String },

    /// A pass asks for a resource, or a version, that it did not declare.
    #[error(
        "pass `{pass}` asks for version {version} of `{resource}`, which it did not declare (it declared {declared}): add the read or the write"
    )]
    Undeclared { pass: Label, resource: Label, version: u32, declared: String },

    /// A pass asks for an optional resource that no pass wrote.
    #[error(
        "pass `{pass}` asks for `{resource}`, which no pass wrote in this frame: its read is optional, use optional_view() or optional_buffer()"
    )]
    Absent { pass: Label, resource: Label },

    /// A resource larger than the device allows.
    #[error("`{resource}`: {what} of {asked} is more than this device's limit of {limit}")]
    Limit { resource: Label, what: &'static str, asked: u64, limit: u64 },

    /// The device was lost, or took too long, while waiting for results.
    #[error("waiting for the GPU's measurements failed: {0}")]
    Wait(String),
}
