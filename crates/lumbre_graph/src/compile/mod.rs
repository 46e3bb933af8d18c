//! Compiling: from declarations to a plan, without a device. Each stage has its own file:
//!
//! ```text
//! names ─► shapes ─► order ─► flow ─► retain ─► cull ─► merge ─► alias
//! unique   formats   cycle    what a  what is   what is one wgpu  memory
//!          sizes     or sort  version unchanged needed  pass      shared
//!                             holds
//! ```

mod alias;
mod content;
mod cull;
mod flow;
mod merge;
mod names;
mod order;
mod retain;
mod shapes;
mod usage;

use crate::declaration::{Declarations, PassDeclaration};
use crate::error::GraphResult;
use crate::history::History;
use crate::plan::{CompileOptions, Plan, Status};

/// Compiles a graph.
pub(crate) fn compile(
    declarations: &Declarations,
    history: &History,
    options: CompileOptions,
) -> GraphResult<Plan> {
    if let Some(first) = declarations.faults.first() {
        return Err(Box::new(first.clone()));
    }
    names::check(declarations)?;
    let mut shapes = usage::infer(declarations, options);
    shapes::check(declarations)?;
    let order = order::sort(declarations)?;
    let flow = flow::Flow::new(declarations, &shapes, history);
    flow.check_reads()?;
    let retention = retain::find(&flow, &order, history);
    let needs = cull::find(&flow, &retention)?;
    let status = statuses(declarations, &retention, &needs);
    let runs = |pass: usize| status[pass].runs();
    let mut steps = merge::steps(&flow, &needs, &order, &runs, options.merge && !options.probe);
    let memory = alias::allocate(&flow, &needs, &mut steps, &mut shapes, options);
    let after = retain::after(&flow, &retention, history, &shapes, &runs);
    Ok(Plan {
        declarations: declarations.clone(),
        options,
        before: history.clone(),
        after,
        order,
        status,
        steps,
        resources: memory.resources,
        effective: flow.effective,
        initial: flow.initial,
        slots: memory.slots,
        memory: memory.memory,
    })
}

fn statuses(declarations: &Declarations, retention: &retain::Retention, needs: &cull::Needs) -> Vec<Status> {
    let status = |(index, pass): (usize, &PassDeclaration)| {
        if !pass.is_called_for() {
            return Status::Skipped { reason: skip_reason(pass) };
        }
        match &needs.wanted[index] {
            Some(_) if retention.unchanged[index] => Status::Unchanged {
                reason: "same inputs as last frame, and what it wrote then is still there".into(),
            },
            Some(reason) => Status::Runs { reason: reason.clone() },
            None => Status::Culled { reason: needs.cull_reason(declarations, index) },
        }
    };
    declarations.passes.iter().enumerate().map(status).collect()
}

/// Returns a reason such as "the scene has no lightmapped mesh and no fog".
pub(crate) fn skip_reason(pass: &PassDeclaration) -> String {
    let absent: Vec<String> = pass
        .requirements
        .iter()
        .filter(|(there, _)| !there)
        .map(|(_, what)| {
            let bare = ["a ", "an ", "any ", "some "].iter().find_map(|article| what.strip_prefix(article));
            format!("no {}", bare.unwrap_or(what))
        })
        .collect();
    format!("the scene has {}", absent.join(" and "))
}
