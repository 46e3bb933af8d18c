//! Content numbers, where equal numbers mean equal content. There is a number for each part of each version of a
//! resource. It is made from the fingerprint of the pass that wrote the part and the numbers of the content that
//! this pass read. Content that depends on anything without a number has none.

use std::hash::{DefaultHasher, Hash, Hasher};

use crate::access::Part;
use crate::compile::flow::{Flow, Need};
use crate::declaration::AccessDeclaration;
use crate::history::{Content, History};
use crate::resource::Origin;

/// The content of each version of each resource.
pub(super) struct Contents {
    held: Vec<Vec<Content>>,
}

impl Contents {
    pub fn new(flow: &Flow<'_>, order: &[usize], history: &History) -> Self {
        let empty = |versions: &Vec<u32>| vec![Content::new(); versions.len()];
        let mut contents = Self { held: flow.effective.iter().map(empty).collect() };
        for (index, resource) in flow.declarations.resources.iter().enumerate() {
            let kept = history.retained.get(&resource.name).filter(|_| flow.initial[index]);
            contents.held[index][0] = match (resource.origin, kept) {
                (Origin::Imported, _) => Content::from([(None, resource.fingerprint)]),
                (Origin::Retained, Some(kept)) => kept.content.clone(),
                _ => Content::new(),
            };
        }
        for &pass in order {
            if flow.declarations.passes[pass].is_called_for() {
                contents.write(flow, pass);
            }
        }
        contents
    }

    /// Returns the number of all parts of a version together.
    pub fn all(&self, resource: usize, version: u32) -> Option<u64> {
        let held = &self.held[resource][version as usize];
        held.values().all(Option::is_some).then(|| number(held))
    }

    /// Returns the number of one part, or with `None` of all parts.
    pub fn part(&self, resource: usize, version: u32, part: Option<Part>) -> Option<u64> {
        match part {
            Some(_) => *self.held[resource][version as usize].get(&part)?,
            None => self.all(resource, version),
        }
    }

    fn write(&mut self, flow: &Flow<'_>, pass: usize) {
        let inputs = self.inputs(flow, pass);
        for (at, declared) in flow.declarations.passes[pass].accesses.iter().enumerate() {
            let Some(version) = declared.written() else { continue };
            let own = inputs.map(|inputs| number((inputs, at)));
            let part = declared.touched_part();
            // Writing one part leaves the others as they were, possibly since last frame.
            let mut held = match flow.need(declared) {
                Need::Version(below) if part.is_some() => {
                    self.held[declared.resource][below as usize].clone()
                }
                _ => Content::new(),
            };
            held.insert(part, own);
            self.held[declared.resource][version as usize] = held;
        }
    }

    fn inputs(&self, flow: &Flow<'_>, pass: usize) -> Option<u64> {
        let pass = &flow.declarations.passes[pass];
        let mut hasher = DefaultHasher::new();
        (&pass.name, pass.fingerprint?).hash(&mut hasher);
        for declared in &pass.accesses {
            let taken = input(flow, declared);
            taken.is_some().hash(&mut hasher);
            if let Some(version) = taken {
                self.all(declared.resource, version)?.hash(&mut hasher);
            }
            // The content also depends on which part is drawn, into which resource, and what it is cleared to.
            let resource = &flow.declarations.resources[declared.resource];
            (&resource.name, declared.part, resource.shape).hash(&mut hasher);
            declared.access.hash_clear(&mut hasher);
        }
        Some(hasher.finish())
    }
}

/// Returns the version whose content this access reads. What last frame left below a write does not count: a pass
/// with a fingerprint states that its result does not depend on it.
fn input(flow: &Flow<'_>, declared: &AccessDeclaration) -> Option<u32> {
    let Need::Version(version) = flow.need(declared) else { return None };
    let reads = !declared.access.writes() || flow.loads(declared);
    let perhaps_reads = version > 0 && !declared.access.is_attachment();
    (reads || perhaps_reads).then_some(version)
}

fn number(parts: impl Hash) -> u64 {
    let mut hasher = DefaultHasher::new();
    parts.hash(&mut hasher);
    hasher.finish()
}
