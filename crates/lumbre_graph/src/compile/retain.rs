//! Finds the passes whose retained results are still valid from an earlier frame.
//!
//! This uses the numbers of [`content`](super::content): a retained resource is unchanged if the number that its
//! last version will have is the number that it has now, and no pass reads a version in between. A pass is
//! unchanged if everything that it writes is. Resources with many layers or mip levels that are only written part
//! by part are tracked part by part, so that one shadow map in an array can be drawn again without the others.
//! Content without a number is never unchanged: in doubt a pass runs.

use crate::access::Part;
use crate::compile::content::Contents;
use crate::compile::flow::Flow;
use crate::history::{Content, History, Retained};
use crate::resource::{Origin, Shape};

/// Which passes are unchanged, and the numbers that this follows from.
pub(crate) struct Retention {
    /// Per pass.
    pub unchanged: Vec<bool>,
    groups: Vec<Group>,
}

/// The writes to one part of a retained resource (or to all of it).
struct Group {
    resource: usize,
    part: Option<Part>,
    writers: Vec<usize>,
    content: Option<u64>,
    same: bool,
}

pub(super) fn find(flow: &Flow<'_>, order: &[usize], history: &History) -> Retention {
    let declarations = flow.declarations;
    let mut unchanged = vec![false; declarations.passes.len()];
    let anything = declarations.resources.iter().any(|resource| resource.origin == Origin::Retained);
    if !anything {
        return Retention { unchanged, groups: Vec::new() };
    }
    let contents = Contents::new(flow, order, history);
    let mut groups = groups(flow, &contents, history);
    for (index, pass) in declarations.passes.iter().enumerate() {
        let mut writes = pass.accesses.iter().filter(|declared| declared.access.writes()).peekable();
        unchanged[index] = pass.is_called_for()
            && pass.fingerprint.is_some()
            && pass.side_effects.is_empty()
            && writes.peek().is_some()
            && writes.all(|write| declarations.resources[write.resource].origin == Origin::Retained);
    }
    // A pass runs if any group that it writes differs, and a group differs if any of its writers runs; repeat until
    // nothing changes.
    loop {
        let mut settled = true;
        for group in &mut groups {
            if group.same && group.writers.iter().any(|&writer| !unchanged[writer]) {
                group.same = false;
            }
            if !group.same {
                for &writer in &group.writers {
                    settled &= !std::mem::replace(&mut unchanged[writer], false);
                }
            }
        }
        if settled {
            return Retention { unchanged, groups };
        }
    }
}

/// Returns what will be known once the passes that run have run.
pub(super) fn after(
    flow: &Flow<'_>,
    retention: &Retention,
    before: &History,
    shapes: &[Shape],
    runs: &dyn Fn(usize) -> bool,
) -> History {
    let mut after = History::default();
    for (index, resource) in flow.declarations.resources.iter().enumerate() {
        if resource.origin != Origin::Retained {
            continue;
        }
        let kept = before.find(&resource.name, &shapes[index]).cloned();
        let mut record = kept.unwrap_or_else(|| Retained { shape: shapes[index], content: Content::new() });
        let mut written = !record.content.is_empty();
        for group in retention.groups.iter().filter(|group| group.resource == index) {
            let running = group.writers.iter().filter(|&&writer| runs(writer)).count();
            if running > 0 {
                // Writing everything invalidates what was known about single parts.
                if group.part.is_none() {
                    record.content.clear();
                }
                let all = running == group.writers.len();
                record.content.insert(group.part, group.content.filter(|_| all));
                written = true;
            }
        }
        if written {
            after.retained.insert(resource.name.clone(), record);
        }
    }
    // Resources that this frame does not declare may come back; the executor decides how long they are kept.
    for (name, record) in &before.retained {
        if !flow.declarations.resources.iter().any(|resource| resource.name == *name) {
            after.retained.insert(name.clone(), record.clone());
        }
    }
    after
}

fn groups(flow: &Flow<'_>, contents: &Contents, history: &History) -> Vec<Group> {
    let mut groups: Vec<Group> = Vec::new();
    for (index, resource) in flow.declarations.resources.iter().enumerate() {
        if resource.origin != Origin::Retained {
            continue;
        }
        let writes: Vec<(u32, usize)> = (1..)
            .zip(resource.writers.iter().copied())
            .filter(|&(version, _)| flow.standing(index, version) == version)
            .collect();
        let part = |&(version, writer): &(u32, usize)| flow.written_part(writer, index, version);
        let by_parts = writes.iter().all(|write| part(write).is_some());
        let seen_between = read_between(flow, index);
        let kept = history.retained.get(&resource.name).filter(|_| flow.initial[index]);
        let first = groups.len();
        for write in &writes {
            let key = if by_parts { part(write) } else { None };
            let number = contents.part(index, write.0, key);
            match groups[first..].iter_mut().find(|group| group.part == key) {
                Some(group) => {
                    group.writers.push(write.1);
                    group.content = number;
                }
                None => groups.push(Group {
                    resource: index,
                    part: key,
                    writers: vec![write.1],
                    content: number,
                    same: false,
                }),
            }
        }
        for group in &mut groups[first..] {
            // The number of the whole is only valid as long as no single part was written since.
            let alone = |content: &Content| group.part.is_some() || content.len() == 1;
            let held =
                kept.filter(|kept| alone(&kept.content)).and_then(|kept| *kept.content.get(&group.part)?);
            group.same = !seen_between && held.is_some() && held == group.content;
        }
    }
    groups
}

/// Returns true if a pass that is not skipped reads a version of this frame other than the last. Then what the last
/// frame left cannot replace it.
fn read_between(flow: &Flow<'_>, resource: usize) -> bool {
    let last = flow.last(resource);
    flow.declarations.passes.iter().filter(|pass| pass.is_called_for()).any(|pass| {
        pass.accesses.iter().any(|declared| {
            declared.resource == resource
                && !declared.access.writes()
                && flow.standing(resource, declared.version) != last
        })
    })
}
