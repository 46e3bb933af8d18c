//! Combines consecutive raster passes that draw into the same attachments into one wgpu render pass. On tile-based
//! GPUs and software rasterizers each additional render pass means waiting for the previous one and moving the
//! attachments through memory.

use crate::access::{Access, LoadOp};
use crate::compile::cull::Needs;
use crate::compile::flow::{Flow, Need};
use crate::declaration::{AccessDeclaration, PassKind};
use crate::plan::{ColorTarget, DepthTarget, Step, Target};

/// Returns the steps of the passes that run, in order. Whether attachments are stored is decided later.
pub(super) fn steps(
    flow: &Flow<'_>,
    needs: &Needs,
    order: &[usize],
    runs: &dyn Fn(usize) -> bool,
    merge: bool,
) -> Vec<Step> {
    let mut steps: Vec<Step> = Vec::new();
    for &pass in order.iter().filter(|&&pass| runs(pass)) {
        let step = step(flow, needs, pass);
        match steps.last_mut() {
            Some(last) if merge && can_join(flow, last, &step, pass) => join(last, step),
            _ => steps.push(step),
        }
    }
    steps
}

/// Returns the accesses that a running pass really makes: no resolve whose result is not read, and no optional read
/// of content that does not exist.
pub(super) fn live<'f>(
    flow: &'f Flow<'_>,
    needs: &'f Needs,
    pass: usize,
) -> impl Iterator<Item = &'f AccessDeclaration> {
    flow.declarations.passes[pass].accesses.iter().filter(move |declared| match declared.access {
        Access::Resolve { .. } => needs.versions[declared.resource][declared.version as usize + 1],
        _ => !(declared.optional && flow.need(declared) == Need::Nothing),
    })
}

fn step(flow: &Flow<'_>, needs: &Needs, pass: usize) -> Step {
    let mut step = Step { passes: vec![pass], colors: Vec::new(), depth: None };
    if flow.declarations.passes[pass].kind != PassKind::Raster {
        return step;
    }
    for declared in live(flow, needs, pass) {
        let target = Target { resource: declared.resource, part: declared.part.unwrap_or_default() };
        let loads = flow.loads(declared);
        match declared.access {
            Access::Color(load) => step.colors.push(ColorTarget {
                target,
                clear: value(load).filter(|_| !loads),
                store: true,
                resolve: None,
            }),
            Access::Resolve { of } => {
                if let Some(color) = step.colors.get_mut(of) {
                    color.resolve = Some(target);
                }
            }
            Access::Depth(load) => {
                let clear = value(load).filter(|_| !loads);
                step.depth = Some(DepthTarget { target, read_only: false, clear, store: true });
            }
            Access::DepthReadOnly => {
                step.depth = Some(DepthTarget { target, read_only: true, clear: None, store: true });
            }
            _ => {}
        }
    }
    step
}

fn value<V>(load: LoadOp<V>) -> Option<V> {
    match load {
        LoadOp::Clear(value) | LoadOp::ClearIfFirst(value) => Some(value),
        LoadOp::Load => None,
    }
}

fn can_join(flow: &Flow<'_>, group: &Step, step: &Step, pass: usize) -> bool {
    let raster = |pass: usize| flow.declarations.passes[pass].kind == PassKind::Raster;
    let colors = group.colors.len() == step.colors.len()
        && group.colors.iter().zip(&step.colors).all(|(held, asked)| {
            held.target == asked.target
                && asked.clear.is_none()
                // A resolve may only move to the end of the group if the last pass resolves into the same target.
                && (held.resolve.is_none() || held.resolve == asked.resolve)
        });
    let depth = match (&group.depth, &step.depth) {
        (None, None) => true,
        (Some(held), Some(asked)) => held.target == asked.target && asked.clear.is_none(),
        _ => false,
    };
    raster(pass)
        && group.passes.iter().all(|&member| raster(member))
        && colors
        && depth
        && group.passes.iter().all(|&member| compatible(flow, member, pass))
}

/// Returns true if two passes can share a render pass: what one writes, the other may only use as the same
/// attachment.
fn compatible(flow: &Flow<'_>, a: usize, b: usize) -> bool {
    let accesses = |pass: usize| &flow.declarations.passes[pass].accesses;
    accesses(a).iter().all(|first| {
        accesses(b).iter().filter(|second| second.resource == first.resource).all(|second| {
            let writes = first.access.writes() || second.access.writes();
            !writes || (first.access.is_attachment() && second.access.is_attachment())
        })
    })
}

fn join(group: &mut Step, step: Step) {
    group.passes.extend(step.passes);
    for (held, asked) in group.colors.iter_mut().zip(step.colors) {
        held.resolve = asked.resolve.or(held.resolve);
    }
    if let (Some(held), Some(asked)) = (&mut group.depth, step.depth) {
        held.read_only &= asked.read_only;
    }
}
