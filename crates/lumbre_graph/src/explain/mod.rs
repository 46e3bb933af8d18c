//! Explains a plan: what happens to every pass and resource, and why, as data. Text, JSON and DOT are three
//! renderings of the same data, with the same information.

mod dot;
mod text;

use crate::declaration::{AccessDeclaration, PassKind};
use crate::plan::{Memory, Plan, Status};
use crate::resource::{Origin, Shape, flags};

/// A plan with its reasons, as data.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Explanation {
    /// The graph's label.
    pub graph: String,
    /// All passes in execution order; those that do not run are where they would have been.
    pub passes: Vec<PassExplanation>,
    /// All resources in order of declaration.
    pub resources: Vec<ResourceExplanation>,
    /// Memory use in bytes.
    pub memory: Memory,
}

/// What happens to a pass.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct PassExplanation {
    /// Its name.
    pub name: String,
    /// The part of the program that declared it, if the graph knows it
    /// ([`Graph::set_owner`](crate::Graph::set_owner)).
    pub owner: Option<String>,
    /// Raster, compute or transfer.
    pub kind: PassKind,
    /// Whether it runs, and why.
    #[serde(flatten)]
    pub status: Status,
    /// What it requires, each with whether it is there.
    #[serde(rename = "calls_for")]
    pub requirements: Vec<Requirement>,
    /// Index of its wgpu pass in the frame, from 0; passes of the same group are merged. `None` if it does not run.
    pub group: Option<usize>,
    /// What it reads.
    pub reads: Vec<Use>,
    /// What it writes.
    pub writes: Vec<Use>,
}

/// One thing that a pass requires.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Requirement {
    /// "a lightmapped mesh"
    pub what: String,
    /// Whether the scene has it.
    pub there: bool,
}

/// One use of a resource by a pass.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Use {
    /// The resource's name.
    pub resource: String,
    /// The version that is read or made.
    pub version: u32,
    /// "colour attachment (load)"
    pub access: String,
    /// The pass that wrote the content that is read or written over, not counting skipped ones; `None` if the
    /// content comes from outside or there is none.
    pub from: Option<String>,
}

/// How a resource is realized.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct ResourceExplanation {
    /// Its name.
    pub name: String,
    /// Transient, retained or imported.
    pub origin: Origin,
    /// "1280x720 Rgba16Float, 4 samples"
    pub shape: String,
    /// "RENDER_ATTACHMENT | TEXTURE_BINDING"
    pub usage: String,
    /// Size in bytes.
    pub bytes: u64,
    /// The memory that it uses in turn with other resources of the same slot.
    pub slot: Option<usize>,
    /// The first and last group that use it.
    pub lifetime: Option<[usize; 2]>,
}

impl Plan {
    /// Returns the plan as data for people and programs.
    #[must_use]
    pub fn explain(&self) -> Explanation {
        Explanation::of(self)
    }
}

impl Explanation {
    pub(crate) fn of(plan: &Plan) -> Self {
        let mut groups = vec![None; plan.status.len()];
        for (group, step) in plan.steps.iter().enumerate() {
            for &pass in &step.passes {
                groups[pass] = Some(group);
            }
        }
        let pass = |&index: &usize| {
            let declared = &plan.declarations.passes[index];
            let uses = |writes: bool| {
                declared
                    .accesses
                    .iter()
                    .filter(|access| access.access.writes() == writes)
                    .map(|access| describe_use(plan, access))
                    .collect()
            };
            PassExplanation {
                name: declared.name.to_string(),
                owner: declared.owner.as_ref().map(ToString::to_string),
                kind: declared.kind,
                status: plan.status[index].clone(),
                requirements: declared
                    .requirements
                    .iter()
                    .map(|(there, what)| Requirement { what: what.to_string(), there: *there })
                    .collect(),
                group: groups[index],
                reads: uses(false),
                writes: uses(true),
            }
        };
        let resource = |(index, planned): (usize, &crate::plan::ResourcePlan)| {
            let declared = &plan.declarations.resources[index];
            ResourceExplanation {
                name: declared.name.to_string(),
                origin: declared.origin,
                shape: describe_shape(&planned.shape),
                usage: match planned.shape {
                    Shape::Texture(texture) => flags(&texture.usage),
                    Shape::Buffer(buffer) => flags(&buffer.usage),
                },
                bytes: planned.shape.bytes(),
                slot: planned.slot,
                lifetime: planned.lifetime,
            }
        };
        Self {
            graph: plan.declarations.label.to_string(),
            passes: plan.order.iter().map(pass).collect(),
            resources: plan.resources.iter().enumerate().map(resource).collect(),
            memory: plan.memory,
        }
    }

    /// Formats it for people, with one line per pass and per resource.
    #[must_use]
    pub fn to_text(&self) -> String {
        text::render(self)
    }

    /// Formats it for programs, as JSON.
    #[must_use]
    pub fn to_json(&self) -> String {
        serde_json::to_string_pretty(self)
            .expect("only strings, numbers and string keys, which JSON can hold")
    }

    /// Formats it for Graphviz: `dot -Tsvg`.
    #[must_use]
    pub fn to_dot(&self) -> String {
        dot::render(self)
    }
}

fn describe_use(plan: &Plan, declared: &AccessDeclaration) -> Use {
    let resource = declared.resource;
    let standing = plan.effective[resource][declared.version as usize];
    let from = plan.declarations.producer(resource, standing);
    Use {
        resource: plan.declarations.resources[resource].name.to_string(),
        version: declared.written().unwrap_or(declared.version),
        access: declared.access.describe().into(),
        from: from.map(|pass| plan.pass_name(pass).to_string()),
    }
}

fn describe_shape(shape: &Shape) -> String {
    match shape {
        Shape::Texture(texture) => {
            let size = texture.size;
            let mut text = format!("{}x{}", size.width, size.height);
            if size.depth_or_array_layers > 1 {
                text.push_str(&format!("x{}", size.depth_or_array_layers));
            }
            text.push_str(&format!(" {:?}", texture.format));
            if texture.sample_count > 1 {
                text.push_str(&format!(", {} samples", texture.sample_count));
            }
            if texture.mip_level_count > 1 {
                text.push_str(&format!(", {} mips", texture.mip_level_count));
            }
            text
        }
        Shape::Buffer(_) => "buffer".into(),
    }
}
