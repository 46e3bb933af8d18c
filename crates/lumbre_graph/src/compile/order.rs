//! Sorts the passes so that each runs after everything it depends on, in order of declaration where that leaves a
//! choice.
//!
//! Dependencies between all passes count, including skipped and culled ones, so that neither the order nor the
//! existence of a cycle depends on the content of the scene.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use crate::declaration::Declarations;
use crate::error::{CycleStep, GraphError, GraphResult};
use crate::nearest::nearest;

/// Why a pass waits for another; the text is only made for an error.
#[derive(Clone, Copy)]
enum Because {
    Reads(usize, u32),
    WritesUpon(usize, u32),
    OverwritesWhatIsRead(usize, u32),
    After,
}

impl Because {
    fn text(self, declarations: &Declarations) -> String {
        let name = |resource: usize| &declarations.resources[resource].name;
        match self {
            Self::Reads(resource, version) => {
                format!("writes version {version} of `{}`, read by", name(resource))
            }
            Self::WritesUpon(resource, version) => {
                format!("writes version {version} of `{}`, written upon by", name(resource))
            }
            Self::OverwritesWhatIsRead(resource, version) => {
                format!("reads version {version} of `{}`, overwritten by", name(resource))
            }
            Self::After => "named by .after() of".into(),
        }
    }
}

struct Edges {
    /// Per pass, the passes that wait for it.
    next: Vec<Vec<(usize, Because)>>,
    /// Per pass, the number of edges that lead to it.
    waits_for: Vec<usize>,
}

impl Edges {
    fn add(&mut self, from: usize, to: usize, because: Because) {
        if from != to {
            self.next[from].push((to, because));
            self.waits_for[to] += 1;
        }
    }
}

/// Returns the passes in a valid order.
pub(super) fn sort(declarations: &Declarations) -> GraphResult<Vec<usize>> {
    let Edges { next, mut waits_for } = edges(declarations)?;
    let count = next.len();
    let mut ready: BinaryHeap<Reverse<usize>> =
        (0..count).filter(|&pass| waits_for[pass] == 0).map(Reverse).collect();
    let mut order = Vec::with_capacity(count);
    while let Some(Reverse(pass)) = ready.pop() {
        order.push(pass);
        for &(then, _) in &next[pass] {
            waits_for[then] -= 1;
            if waits_for[then] == 0 {
                ready.push(Reverse(then));
            }
        }
    }
    if order.len() < count {
        return Err(Box::new(GraphError::Cycle { path: cycle(declarations, &next, &waits_for) }));
    }
    Ok(order)
}

fn edges(declarations: &Declarations) -> GraphResult<Edges> {
    let count = declarations.passes.len();
    let mut edges = Edges { next: vec![Vec::new(); count], waits_for: vec![0; count] };
    for (index, pass) in declarations.passes.iter().enumerate() {
        for declared in &pass.accesses {
            let (resource, version) = (declared.resource, declared.version);
            let producer = declarations.producer(resource, version);
            if declared.access.writes() {
                if let Some(producer) = producer {
                    edges.add(producer, index, Because::WritesUpon(resource, version));
                }
                continue;
            }
            if let Some(producer) = producer {
                edges.add(producer, index, Because::Reads(resource, version));
            }
            if let Some(overwriter) = declarations.producer(resource, version + 1) {
                edges.add(index, overwriter, Because::OverwritesWhatIsRead(resource, version));
            }
        }
        for name in &pass.after {
            let Some(earlier) = declarations.passes.iter().position(|other| other.name == *name) else {
                let names = declarations.passes.iter().map(|other| &*other.name);
                let near = nearest(name, names.filter(|other| *other != pass.name));
                return Err(Box::new(GraphError::UnknownPass {
                    pass: pass.name.clone(),
                    site: pass.site,
                    name: name.clone(),
                    nearest: near.map(|near| near.to_owned().into()),
                }));
            };
            if earlier == index {
                let because = Because::After.text(declarations);
                return Err(Box::new(GraphError::Cycle {
                    path: vec![CycleStep { pass: pass.name.clone(), because }],
                }));
            }
            edges.add(earlier, index, Because::After);
        }
    }
    Ok(edges)
}

/// Returns one cycle among the passes that could not be sorted. Each of them waits for another of them, so walking
/// against the edges from any of them must lead back to a pass already visited.
fn cycle(declarations: &Declarations, next: &[Vec<(usize, Because)>], waits_for: &[usize]) -> Vec<CycleStep> {
    let stuck = |pass: usize| waits_for[pass] > 0;
    let awaited = |pass: usize| {
        (0..next.len()).filter(|&from| stuck(from)).find_map(|from| {
            next[from].iter().find(|(to, _)| *to == pass).map(|&(_, because)| (from, because))
        })
    };
    let mut walked: Vec<(usize, Because)> = Vec::new();
    let Some(mut pass) = (0..next.len()).find(|&pass| stuck(pass)) else { return Vec::new() };
    while let Some((from, because)) = awaited(pass) {
        if let Some(start) = walked.iter().position(|&(seen, _)| seen == from) {
            walked.push((from, because));
            // The steps before `start + 1` lead into the cycle and are not part of it.
            return walked[start + 1..]
                .iter()
                .rev()
                .map(|&(pass, because)| CycleStep {
                    pass: declarations.passes[pass].name.clone(),
                    because: because.text(declarations),
                })
                .collect();
        }
        walked.push((from, because));
        pass = from;
    }
    Vec::new()
}
