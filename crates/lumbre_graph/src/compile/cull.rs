//! Finds the passes that are needed, going backwards from side effects, from imported resources that are written,
//! and from exported ones. All others are culled, with a reason that names the passes that would have read their
//! results.

use crate::compile::flow::{Flow, Need};
use crate::compile::retain::Retention;
use crate::declaration::Declarations;
use crate::error::GraphResult;
use crate::resource::Origin;

/// Which passes and versions are needed, and why.
pub(crate) struct Needs {
    /// Per pass, why it is needed; `None` if it is not.
    pub wanted: Vec<Option<String>>,
    /// Per resource and version, whether a running pass or something outside the graph reads it.
    pub versions: Vec<Vec<bool>>,
}

/// Finds the needs. It is an error if a running pass needs content that does not exist.
pub(crate) fn find(flow: &Flow<'_>, retention: &Retention) -> GraphResult<Needs> {
    let declarations = flow.declarations;
    let mut needs = Needs {
        wanted: vec![None; declarations.passes.len()],
        versions: flow.effective.iter().map(|versions| vec![false; versions.len()]).collect(),
    };
    let mut open = Vec::new();
    for (index, pass) in declarations.passes.iter().enumerate() {
        if pass.is_called_for() && !pass.side_effects.is_empty() {
            needs.wanted[index] = Some(pass.side_effects.join(", "));
            open.push(index);
        }
    }
    let want = |needs: &mut Needs,
                open: &mut Vec<usize>,
                resource: usize,
                version: u32,
                reason: &dyn Fn() -> String| {
        needs.versions[resource][version as usize] = true;
        if let Some(producer) = declarations.producer(resource, version)
            && needs.wanted[producer].is_none()
        {
            needs.wanted[producer] = Some(reason());
            open.push(producer);
        }
    };
    for (index, resource) in declarations.resources.iter().enumerate() {
        let reason = if resource.origin == Origin::Imported {
            "is imported"
        } else if resource.exported.is_some() {
            "is exported"
        } else if resource.origin == Origin::Retained && reads_last_frame(flow, index) {
            "is read by the next frame"
        } else {
            continue;
        };
        let text = || format!("it writes `{}`, which {reason}", resource.name);
        want(&mut needs, &mut open, index, flow.last(index), &text);
    }
    while let Some(index) = open.pop() {
        let pass = &declarations.passes[index];
        for declared in &pass.accesses {
            // An unchanged pass reads nothing, but its result is still on top of what others write in the same
            // resource: other layers, which may have changed.
            if retention.unchanged[index] && !declared.access.writes() {
                continue;
            }
            match flow.need(declared) {
                Need::Nothing => {}
                Need::Absent => return Err(Box::new(flow.absent(index, declared))),
                Need::Version(version) => {
                    let resource = &declarations.resources[declared.resource].name;
                    let verb = if declared.access.writes() { "builds on" } else { "reads" };
                    let text = || format!("`{}` {verb} its `{resource}`", pass.name);
                    want(&mut needs, &mut open, declared.resource, version, &text);
                }
            }
        }
    }
    Ok(needs)
}

/// Returns true if a pass that is not skipped reads what the last frame left in a retained resource.
fn reads_last_frame(flow: &Flow<'_>, resource: usize) -> bool {
    flow.declarations.passes.iter().filter(|pass| pass.is_called_for()).any(|pass| {
        pass.accesses.iter().any(|declared| {
            declared.resource == resource && declared.version == 0 && !declared.access.writes()
        })
    })
}

impl Needs {
    /// Returns why a pass is culled: for each resource that it writes, which passes
    /// would read it.
    pub fn cull_reason(&self, declarations: &Declarations, pass: usize) -> String {
        let mut reasons = Vec::new();
        for declared in &declarations.passes[pass].accesses {
            let Some(written) = declared.written() else { continue };
            let readers: Vec<&str> = declarations
                .passes
                .iter()
                .enumerate()
                .filter(|(index, reader)| {
                    *index != pass
                        && reader
                            .accesses
                            .iter()
                            .any(|read| read.resource == declared.resource && read.version >= written)
                })
                .map(|(_, reader)| &*reader.name)
                .collect();
            let resource = &declarations.resources[declared.resource].name;
            reasons.push(if readers.is_empty() {
                format!("nothing reads `{resource}`")
            } else {
                format!("nothing that runs reads `{resource}` (only `{}`)", readers.join("`, `"))
            });
        }
        if reasons.is_empty() {
            return "it writes nothing and has no side effect".into();
        }
        reasons.dedup();
        reasons.join("; ")
    }
}
