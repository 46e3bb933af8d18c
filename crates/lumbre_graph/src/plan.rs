//! The plan: what compiling a graph answers with. Data only; it explains itself in [`explain`](crate::explain) and is
//! carried out by [`run`](crate::run).

use crate::access::Part;
use crate::declaration::Declarations;
use crate::history::History;
use crate::resource::{Label, Shape};

/// Choices of how to compile.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CompileOptions {
    /// Make one wgpu pass of raster passes in a row that draw into the same attachments. Off, each has its own, and
    /// so its own time where timestamps can not be taken inside passes.
    pub merge: bool,
    /// Keep all that is drawn so that [`FiniteProbe`](crate::FiniteProbe) can look at it after each pass. Merges
    /// nothing.
    pub probe: bool,
}

impl Default for CompileOptions {
    fn default() -> Self {
        Self { merge: true, probe: false }
    }
}

/// What becomes of a pass, and why.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(tag = "status", rename_all = "snake_case")]
pub enum Status {
    /// It runs.
    Runs {
        /// Who wants what it writes, or its side effect.
        reason: String,
    },
    /// What it calls for is not there. What it would have written is left as it was.
    Skipped {
        /// "the scene has no …"
        reason: String,
    },
    /// Nothing that runs reads what it writes.
    Culled {
        /// "nothing reads …"
        reason: String,
    },
    /// What it writes is retained and holds already what it would write.
    Unchanged {
        /// "same inputs as last frame …"
        reason: String,
    },
}

impl Status {
    /// Whether the pass runs.
    #[must_use]
    pub fn runs(&self) -> bool {
        matches!(self, Self::Runs { .. })
    }

    /// The status in one word.
    #[must_use]
    pub fn word(&self) -> &'static str {
        match self {
            Self::Runs { .. } => "runs",
            Self::Skipped { .. } => "skipped",
            Self::Culled { .. } => "culled",
            Self::Unchanged { .. } => "unchanged",
        }
    }

    /// Why.
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

/// Where an attachment lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Target {
    pub resource: usize,
    pub part: Part,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ColorTarget {
    pub target: Target,
    /// The value to clear to; `None` loads.
    pub clear: Option<wgpu::Color>,
    pub store: bool,
    pub resolve: Option<Target>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct DepthTarget {
    pub target: Target,
    pub read_only: bool,
    /// The value to clear to; `None` loads.
    pub clear: Option<f32>,
    pub store: bool,
}

/// One wgpu pass, or one stretch of the encoder, that carries out one or more passes of the graph.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Step {
    pub passes: Vec<usize>,
    pub colors: Vec<ColorTarget>,
    pub depth: Option<DepthTarget>,
}

/// A piece of memory that the pool provides for the whole frame, and that resources take turns in.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Slot {
    /// With the usages of all its resources.
    pub shape: Shape,
    pub resources: Vec<usize>,
}

/// How a resource lives in this frame.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct ResourcePlan {
    /// The declared shape with the usages that the passes need.
    pub shape: Shape,
    /// First and last step that use it; `None` if none does.
    pub lifetime: Option<[usize; 2]>,
    /// The slot of a transient that is used.
    pub slot: Option<usize>,
}

/// Bytes of the resources that the graph makes by itself.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct Memory {
    /// Largest sum of the transients alive in one step: no allocator could do with less.
    pub peak_bytes: u64,
    /// What the pool provides: one piece for each set of transients that take turns.
    pub pool_bytes: u64,
    /// What the transients would take if none shared memory.
    pub unshared_bytes: u64,
    /// What is kept from frame to frame.
    pub retained_bytes: u64,
}

/// A compiled graph.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    pub(crate) declarations: Declarations,
    pub(crate) options: CompileOptions,
    /// What was known of earlier frames when this was compiled.
    pub(crate) before: History,
    /// What will be known after this ran.
    pub(crate) after: History,
    /// All passes in an order that respects every dependency.
    pub(crate) order: Vec<usize>,
    pub(crate) status: Vec<Status>,
    pub(crate) steps: Vec<Step>,
    pub(crate) resources: Vec<ResourcePlan>,
    /// Per resource and version: the version that stands for it, since skipped passes write nothing.
    pub(crate) effective: Vec<Vec<u32>>,
    /// Per resource: whether its version 0 holds anything.
    pub(crate) initial: Vec<bool>,
    pub(crate) slots: Vec<Slot>,
    pub(crate) memory: Memory,
}

impl Plan {
    /// What becomes of the pass of this name; `None` if there is no such pass.
    #[must_use]
    pub fn status(&self, pass: &str) -> Option<&Status> {
        self.declarations.passes.iter().position(|declared| declared.name == pass).map(|i| &self.status[i])
    }

    /// The names of the passes that run, in order.
    pub fn running(&self) -> impl Iterator<Item = &str> {
        self.steps.iter().flat_map(|step| &step.passes).map(|&pass| &*self.declarations.passes[pass].name)
    }

    /// The names of the passes of each wgpu pass, in order: those of one entry were merged.
    pub fn groups(&self) -> impl Iterator<Item = Vec<&str>> {
        self.steps
            .iter()
            .map(|step| step.passes.iter().map(|&pass| &*self.declarations.passes[pass].name).collect())
    }

    /// Bytes of the resources that the graph makes by itself.
    #[must_use]
    pub fn memory(&self) -> Memory {
        self.memory
    }

    /// What earlier frames' results will be known to hold once this ran; for compiling the next frame without a device.
    #[must_use]
    pub fn history(&self) -> &History {
        &self.after
    }

    /// The index of the memory that a transient lives in; resources of the same index take turns. `None` for others
    /// and for those that no running pass uses.
    #[must_use]
    pub fn slot(&self, resource: &str) -> Option<usize> {
        self.resource_index(resource).and_then(|index| self.resources[index].slot)
    }

    /// First and last group (index into [`groups`](Self::groups)) that use a resource.
    #[must_use]
    pub fn lifetime(&self, resource: &str) -> Option<[usize; 2]> {
        self.resource_index(resource).and_then(|index| self.resources[index].lifetime)
    }

    /// This plan, if none of it is carried out again: each pass that would run is [`Unchanged`](Status::Unchanged) for this reason.
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
