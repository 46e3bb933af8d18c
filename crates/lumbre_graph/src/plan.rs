//! The plan: the result of compiling a graph. It is data only: [`explain`](crate::explain) explains it, and
//! [`run`](crate::run) executes it.

use crate::access::Part;
use crate::declaration::Declarations;
use crate::history::History;
use crate::resource::{Label, Shape};

/// Options for compiling a graph.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CompileOptions {
    /// Combine consecutive raster passes that draw into the same attachments into one wgpu pass. Without it each
    /// pass has its own wgpu pass, and therefore its own time even where timestamps cannot be taken inside passes.
    pub merge: bool,
    /// Keep everything that is drawn, so that [`FiniteProbe`](crate::FiniteProbe) can inspect it after each pass.
    /// This disables merging.
    pub probe: bool,
}

impl Default for CompileOptions {
    fn default() -> Self {
        Self { merge: true, probe: false }
    }
}

/// What happens to a pass, and why.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(tag = "status", rename_all = "snake_case")]
pub enum Status {
    /// It runs.
    Runs {
        /// What needs its results, or its side effect.
        reason: String,
    },
    /// Something that it requires is missing. The resources that it would have written keep their previous
    /// content.
    Skipped {
        /// "the scene has no …"
        reason: String,
    },
    /// Nothing that runs reads what it writes.
    Culled {
        /// "nothing reads …"
        reason: String,
    },
    /// What it writes is retained and already has the content that it would write.
    Unchanged {
        /// "same inputs as last frame …"
        reason: String,
    },
}

impl Status {
    /// Returns true if the pass runs.
    #[must_use]
    pub fn runs(&self) -> bool {
        matches!(self, Self::Runs { .. })
    }

    /// Returns the status in one word.
    #[must_use]
    pub fn word(&self) -> &'static str {
        match self {
            Self::Runs { .. } => "runs",
            Self::Skipped { .. } => "skipped",
            Self::Culled { .. } => "culled",
            Self::Unchanged { .. } => "unchanged",
        }
    }

    /// Returns why.
    #[must_use]
    pub fn reason(&self) -> &str {
        match self {
            Self::Runs { reason }
            | Self::Skipped { reason }
            | Self::Culled { reason }
            | Self::Unchanged { reason } => reason,
        }
    }
}

/// The subresource of an attachment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Target {
    pub resource: usize,
    pub part: Part,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ColorTarget {
    pub target: Target,
    /// The value to clear to; `None` means load.
    pub clear: Option<wgpu::Color>,
    pub store: bool,
    pub resolve: Option<Target>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct DepthTarget {
    pub target: Target,
    pub read_only: bool,
    /// The value to clear to; `None` means load.
    pub clear: Option<f32>,
    pub store: bool,
}

/// One wgpu pass, or one sequence of commands on the encoder, that executes one or more passes of the graph.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Step {
    pub passes: Vec<usize>,
    pub colors: Vec<ColorTarget>,
    pub depth: Option<DepthTarget>,
}

/// A piece of memory that the pool provides for the whole frame and that several resources use in turn.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Slot {
    /// With the usages of all its resources.
    pub shape: Shape,
    pub resources: Vec<usize>,
}

/// How a resource is realized in this frame.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct ResourcePlan {
    /// The declared shape with the usages that the passes need.
    pub shape: Shape,
    /// The first and last step that use it; `None` if none does.
    pub lifetime: Option<[usize; 2]>,
    /// The slot, if it is a transient resource that is used.
    pub slot: Option<usize>,
}

/// Bytes of the resources that the graph creates itself.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct Memory {
    /// Largest sum of the transients alive in one step: no allocator could do with less.
    pub peak_bytes: u64,
    /// Bytes that the pool provides: one piece of memory for each set of transients that use it in turn.
    pub pool_bytes: u64,
    /// Bytes that the transients would need without sharing.
    pub unshared_bytes: u64,
    /// Bytes kept from frame to frame.
    pub retained_bytes: u64,
}

/// A compiled graph.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    pub(crate) declarations: Declarations,
    pub(crate) options: CompileOptions,
    /// What was known about earlier frames when this was compiled.
    pub(crate) before: History,
    /// What will be known after this has run.
    pub(crate) after: History,
    /// All passes in an order that respects every dependency.
    pub(crate) order: Vec<usize>,
    pub(crate) status: Vec<Status>,
    pub(crate) steps: Vec<Step>,
    pub(crate) resources: Vec<ResourcePlan>,
    /// Per resource and version, the version whose content it has, as skipped passes write nothing.
    pub(crate) effective: Vec<Vec<u32>>,
    /// Per resource, whether its version 0 has any content.
    pub(crate) initial: Vec<bool>,
    pub(crate) slots: Vec<Slot>,
    pub(crate) memory: Memory,
}

impl Plan {
    /// Returns what happens to the pass with this name; `None` if there is no such pass.
    #[must_use]
    pub fn status(&self, pass: &str) -> Option<&Status> {
        self.declarations.passes.iter().position(|declared| declared.name == pass).map(|i| &self.status[i])
    }

    /// The names of the passes that run, in order.
    pub fn running(&self) -> impl Iterator<Item = &str> {
        self.steps.iter().flat_map(|step| &step.passes).map(|&pass| &*self.declarations.passes[pass].name)
    }

    /// The names of the passes of each wgpu pass, in order; passes in one entry were merged.
    pub fn groups(&self) -> impl Iterator<Item = Vec<&str>> {
        self.steps
            .iter()
            .map(|step| step.passes.iter().map(|&pass| &*self.declarations.passes[pass].name).collect())
    }

    /// Returns the bytes of the resources that the graph creates itself.
    #[must_use]
    pub fn memory(&self) -> Memory {
        self.memory
    }

    /// Returns what will be known about retained resources once this plan has run. It is used to compile the next
    /// frame without a device.
    #[must_use]
    pub fn history(&self) -> &History {
        &self.after
    }

    /// Returns the index of the memory that a transient resource uses; resources with the same index use it in
    /// turn. `None` for other resources and for those that no running pass uses.
    #[must_use]
    pub fn slot(&self, resource: &str) -> Option<usize> {
        self.resource_index(resource).and_then(|index| self.resources[index].slot)
    }

    /// Returns the first and last group (indices into [`groups`](Self::groups)) that use a resource.
    #[must_use]
    pub fn lifetime(&self, resource: &str) -> Option<[usize; 2]> {
        self.resource_index(resource).and_then(|index| self.resources[index].lifetime)
    }

    /// Returns this plan as it is if none of it is executed again: each pass that would run is
    /// [`Unchanged`](Status::Unchanged) for this reason.
    #[must_use]
    pub fn unchanged(&self, reason: &str) -> Self {
        let mut plan = self.clone();
        for status in plan.status.iter_mut().filter(|status| status.runs()) {
            *status = Status::Unchanged { reason: reason.into() };
        }
        plan.steps.clear();
        plan.slots.clear();
        plan.resources.iter_mut().for_each(|resource| (resource.lifetime, resource.slot) = (None, None));
        plan
    }

    pub(crate) fn pass_name(&self, pass: usize) -> &Label {
        &self.declarations.passes[pass].name
    }

    fn resource_index(&self, name: &str) -> Option<usize> {
        self.declarations.resources.iter().position(|declared| declared.name == name)
    }
}
