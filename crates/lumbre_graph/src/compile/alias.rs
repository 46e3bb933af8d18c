//! Lifetimes, memory, and whether attachments are stored. Transient resources of the same shape whose lifetimes do
//! not overlap use one slot in turn. Lifetimes are counted in steps, so passes merged into one render pass are
//! alive together.

use crate::compile::cull::Needs;
use crate::compile::flow::{Flow, Need};
use crate::compile::merge::live;
use crate::plan::CompileOptions;
use crate::plan::{Memory, ResourcePlan, Slot, Step};
use crate::resource::{Origin, Shape};

/// The result of this stage.
pub(super) struct Allocation {
    pub resources: Vec<ResourcePlan>,
    pub slots: Vec<Slot>,
    pub memory: Memory,
}

pub(super) fn allocate(
    flow: &Flow<'_>,
    needs: &Needs,
    steps: &mut [Step],
    shapes: &mut [Shape],
    options: CompileOptions,
) -> Allocation {
    let declared = &flow.declarations.resources;
    let mut resources: Vec<ResourcePlan> =
        shapes.iter().map(|&shape| ResourcePlan { shape, lifetime: None, slot: None }).collect();
    // The last step that needs the content of a resource.
    let mut last_need: Vec<Option<usize>> = vec![None; resources.len()];
    for (time, step) in steps.iter().enumerate() {
        for access in step.passes.iter().flat_map(|&pass| live(flow, needs, pass)) {
            let lifetime = &mut resources[access.resource].lifetime;
            *lifetime = Some([lifetime.map_or(time, |[first, _]| first), time]);
            if matches!(flow.need(access), Need::Version(_)) {
                last_need[access.resource] = Some(time);
            }
        }
    }
    let end = steps.len().saturating_sub(1);
    for (plan, declared) in resources.iter_mut().zip(declared) {
        if let (Some([first, _]), Some(_)) = (plan.lifetime, declared.exported) {
            plan.lifetime = Some([first, end]);
        }
    }
    for (time, step) in steps.iter_mut().enumerate() {
        let wanted = |resource: usize| {
            declared[resource].origin != Origin::Transient
                || declared[resource].exported.is_some()
                || options.probe
                || last_need[resource].is_some_and(|last| last > time)
        };
        for color in &mut step.colors {
            color.store = wanted(color.target.resource);
        }
        if let Some(depth) = &mut step.depth {
            depth.store = wanted(depth.target.resource);
        }
    }
    let slots = share(flow, &mut resources);
    let memory = count(flow, &resources, &slots, steps.len());
    Allocation { resources, slots, memory }
}

/// Gives each transient resource, in order of first use, the slot of its shape that has been free for the shortest
/// time, or a new one.
fn share(flow: &Flow<'_>, resources: &mut [ResourcePlan]) -> Vec<Slot> {
    let mut waiting: Vec<(usize, [usize; 2])> = (0..resources.len())
        .filter(|&index| flow.declarations.resources[index].origin == Origin::Transient)
        .filter_map(|index| Some((index, resources[index].lifetime?)))
        .collect();
    waiting.sort_by_key(|&(index, [first, _])| (first, index));
    let mut slots: Vec<Slot> = Vec::new();
    let mut busy_until: Vec<usize> = Vec::new();
    for (index, [first, last]) in waiting {
        let shape = resources[index].shape;
        let free = (0..slots.len())
            .filter(|&slot| {
                busy_until[slot] < first && slots[slot].shape.without_usage() == shape.without_usage()
            })
            .max_by_key(|&slot| busy_until[slot]);
        let slot = free.unwrap_or_else(|| {
            slots.push(Slot { shape, resources: Vec::new() });
            busy_until.push(last);
            slots.len() - 1
        });
        busy_until[slot] = last;
        slots[slot].resources.push(index);
        match (&mut slots[slot].shape, shape) {
            (Shape::Texture(held), Shape::Texture(asked)) => held.usage |= asked.usage,
            (Shape::Buffer(held), Shape::Buffer(asked)) => held.usage |= asked.usage,
            _ => {}
        }
        resources[index].slot = Some(slot);
    }
    slots
}

fn count(flow: &Flow<'_>, resources: &[ResourcePlan], slots: &[Slot], steps: usize) -> Memory {
    let mut memory = Memory::default();
    // Change of the bytes in use at the start of each step.
    let mut change = vec![0_i128; steps + 1];
    for (plan, declared) in resources.iter().zip(&flow.declarations.resources) {
        let bytes = plan.shape.bytes();
        match (declared.origin, plan.lifetime) {
            (Origin::Transient, Some([first, last])) => {
                memory.unshared_bytes = memory.unshared_bytes.saturating_add(bytes);
                change[first] += i128::from(bytes);
                change[last + 1] -= i128::from(bytes);
            }
            (Origin::Retained, _) => {
                memory.retained_bytes = memory.retained_bytes.saturating_add(bytes);
            }
            _ => {}
        }
    }
    let mut living = 0_i128;
    let mut peak = 0_i128;
    for step in change {
        living += step;
        peak = peak.max(living);
    }
    memory.peak_bytes = u64::try_from(peak).unwrap_or(u64::MAX);
    memory.pool_bytes = slots.iter().fold(0, |sum, slot| slot.shape.bytes().saturating_add(sum));
    memory
}
