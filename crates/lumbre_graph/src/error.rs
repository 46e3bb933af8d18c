//! Faults of a declared graph. Each error names the pass, the resource and where both were declared. What can go
//! wrong while a graph runs is [`RunError`](crate::RunError).

use crate::resource::Label;
use crate::site::Site;

/// A fault of a declared graph, found without a device.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[expect(missing_docs, reason = "each variant's message says what its fields are")]
pub enum GraphError {
    /// A handle that belongs to another graph.
    #[error(
        "pass `{pass}` ({site}) uses a {kind} handle (resource {index}) that graph #{foreign} made, not this one: declare it here, or \
         import it"
    )]
    ForeignHandle { pass: Label, site: Site, kind: &'static str, index: u32, foreign: u64 },

    /// Two passes, or two resources, with the same name.
    #[error("two {kind} are named `{name}`: one declared at {first}, one at {second}; names must be unique")]
    DuplicateName { kind: &'static str, name: Label, first: Site, second: Site },

    /// Two passes that write the same version.
    #[error(
        "passes `{first}` ({first_site}) and `{second}` ({second_site}) both write version {version} of `{resource}`: the second holds a \
         handle copied before the first wrote; pass it the handle that the first moved on"
    )]
    TwoWriters {
        resource: Label,
        version: u32,
        first: Label,
        first_site: Site,
        second: Label,
        second_site: Site,
    },

    /// A pass that reads a resource that no pass ever writes.
    #[error(
        "pass `{pass}` ({site}) reads `{resource}` (declared at {resource_site}) as {access}, but no pass writes it: add its producer, or \
         import it"
    )]
    MissingProducer { pass: Label, site: Site, resource: Label, resource_site: Site, access: &'static str },

    /// A pass that reads a version older than the first write.
    #[error(
        "pass `{pass}` ({site}) reads `{resource}` as {access} before `{writer}` ({writer_site}) writes it: its handle was copied before that \
         write; declare the pass after the writer, with the writer's handle"
    )]
    ReadBeforeWrite {
        pass: Label,
        site: Site,
        resource: Label,
        access: &'static str,
        writer: Label,
        writer_site: Site,
    },

    /// A running pass that reads a resource that only skipped passes would have written.
    #[error(
        "pass `{pass}` ({site}) reads `{resource}` as {access}, but every pass that writes it is skipped ({skipped}): read it as optional, call \
         for the same in `{pass}`, or write it with LoadOp::ClearIfFirst in a pass that runs"
    )]
    ProducersSkipped { pass: Label, site: Site, resource: Label, access: &'static str, skipped: String },

    /// Passes that wait for each other.
    #[error("passes wait for each other: {}", display_cycle(.path))]
    Cycle {
        /// The passes of the cycle; the last waits for the first.
        path: Vec<CycleStep>,
    },

    /// `.after()` with a name that no pass has.
    #[error("pass `{pass}` ({site}) is to run after `{name}`, which no pass is called{}", did_you_mean(.nearest))]
    UnknownPass { pass: Label, site: Site, name: Label, nearest: Option<Label> },

    /// A pass that uses one resource in two ways that the GPU cannot combine.
    #[error(
        "pass `{pass}` ({site}) uses `{resource}` as {first} and as {second} at once: split the pass, or name separate parts"
    )]
    AccessConflict { pass: Label, site: Site, resource: Label, first: &'static str, second: &'static str },

    /// A format that does not support this use.
    #[error(
        "pass `{pass}` ({site}) uses `{resource}` (declared at {resource_site}) as {access}, which needs {expected}, but its format is {format:?}"
    )]
    FormatMismatch {
        pass: Label,
        site: Site,
        resource: Label,
        resource_site: Site,
        access: &'static str,
        format: wgpu::TextureFormat,
        expected: String,
    },

    /// Attachments of different sizes.
    #[error(
        "pass `{pass}` ({site}) draws into `{first}` (declared at {first_site}) of {}x{} and `{second}` (declared at {second_site}) of {}x{} texels: \
         attachments must have one size",
        .first_size[0], .first_size[1], .second_size[0], .second_size[1]
    )]
    SizeMismatch {
        pass: Label,
        site: Site,
        first: Label,
        first_site: Site,
        first_size: [u32; 2],
        second: Label,
        second_site: Site,
        second_size: [u32; 2],
    },

    /// A sample count that does not support this use.
    #[error(
        "pass `{pass}` ({site}) uses `{resource}` (declared at {resource_site}) as {access} with {count} samples per texel, but needs {expected}"
    )]
    SampleCountMismatch {
        pass: Label,
        site: Site,
        resource: Label,
        resource_site: Site,
        access: &'static str,
        count: u32,
        expected: String,
    },

    /// An imported resource whose usages do not allow what a pass does with it.
    #[error(
        "pass `{pass}` ({site}) uses `{resource}` (declared at {resource_site}) as {access}, which needs usage {needs}, but it was imported with {declared}"
    )]
    UsageMismatch {
        pass: Label,
        site: Site,
        resource: Label,
        resource_site: Site,
        access: &'static str,
        needs: String,
        declared: String,
    },

    /// A shape that no GPU object can have.
    #[error("resource `{resource}` (declared at {site}): {reason}")]
    InvalidShape { resource: Label, site: Site, reason: String },

    /// A mip level or layer that the texture does not have.
    #[error(
        "pass `{pass}` ({site}) uses mip {mip}, layer {layer} of `{resource}`, which has {mips} mip level(s) and {layers} layer(s)"
    )]
    PartOutOfRange { pass: Label, site: Site, resource: Label, mip: u32, layer: u32, mips: u32, layers: u32 },

    /// `.resolve()` or `.part()` without a preceding declaration that it could apply to.
    #[error(
        "pass `{pass}` ({site}): .{method}() applies to the {wanted} declared just before it, and there is none"
    )]
    NothingToModify { pass: Label, site: Site, method: &'static str, wanted: &'static str },

    /// A raster pass without an attachment.
    #[error("raster pass `{pass}` ({site}) draws into nothing: declare a colour or depth attachment")]
    NoAttachment { pass: Label, site: Site },

    /// An exported version that a later pass overwrites.
    #[error(
        "version {version} of `{resource}` is exported, but pass `{pass}` ({site}) writes over it: export the handle after that pass"
    )]
    ExportOverwritten { resource: Label, version: u32, pass: Label, site: Site },
}

/// The result of declaring and compiling. The error is boxed because it contains many names and results should be
/// small.
pub type GraphResult<T> = Result<T, Box<GraphError>>;

/// One pass of a [`GraphError::Cycle`] and why the next one waits for it.
#[derive(Clone, Debug, PartialEq)]
pub struct CycleStep {
    /// The pass.
    pub pass: Label,
    /// Why the next pass of the cycle runs after it.
    pub because: String,
}

fn display_cycle(path: &[CycleStep]) -> String {
    let mut text: String =
        path.iter().map(|step| format!("`{}` -({})-> ", step.pass, step.because)).collect();
    if let Some(first) = path.first() {
        text.push_str(&format!("`{}`", first.pass));
    }
    text
}

pub(crate) fn did_you_mean(nearest: &Option<Label>) -> String {
    nearest.as_ref().map_or(String::new(), |name| format!("; did you mean `{name}`?"))
}
