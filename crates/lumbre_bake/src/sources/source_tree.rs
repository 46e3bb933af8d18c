//! What the tree of emitters and the tree of punctual lights have in common: the kinds of nodes, the split of a node in
//! two, and the apparent size of a node's bounding sphere. The trees themselves are `emitter_tree` and `light_tree`.

use glam::Vec3;

use crate::bounds::Bounds;
use crate::scene::Receiver;

/// The kind of a node in a binary tree over sources.
#[derive(Clone, Copy, Debug)]
pub(crate) enum NodeKind {
    /// One source, by its index.
    Leaf(u32),
    /// The indices of the two children.
    Inner([u32; 2]),
}

/// Sorts sources along the widest axis of their positions; returns how many belong to the first half.
pub(crate) fn split_at_median(sources: &mut [u32], position: impl Fn(&u32) -> Vec3) -> usize {
    let mut positioned: Vec<(Vec3, u32)> = sources.iter().map(|source| (position(source), *source)).collect();
    let Bounds::<Vec3> { low, high } = positioned.iter().map(|(position, _)| *position).collect();
    let axis = (high - low).max_position();
    positioned.sort_unstable_by(|a, b| a.0[axis].total_cmp(&b.0[axis]).then(a.1.cmp(&b.1)));
    for (source, (_, sorted)) in sources.iter_mut().zip(positioned) {
        *source = sorted;
    }
    sources.len() / 2
}

/// The sine of the angular radius at which a sphere, enlarged by `reach`, appears from a receiver; 1 from inside the
/// sphere.
pub(crate) fn apparent_sine(center: Vec3, radius: f32, receiver: &Receiver, reach: f32) -> f32 {
    let distance = center.distance(receiver.position);
    let size = radius + reach;
    if size < distance { size / distance } else { 1.0 }
}

/// The distance from a receiver to a sphere; 0 inside.
pub(crate) fn distance_to_sphere(center: Vec3, radius: f32, receiver: &Receiver) -> f32 {
    (center.distance(receiver.position) - radius).max(0.0)
}

/// Keeps in [0, 1) a random number that was rescaled to it, despite rounding.
#[inline]
pub(crate) fn clamp_below_one(u: f32) -> f32 {
    u.clamp(0.0, 1.0 - f32::EPSILON)
}

/// Samples one of some weights by `u` in [0, 1): its index, its probability, and `u` rescaled from its interval to [0,
/// 1). If the sum is zero or not finite, all have the same probability.
#[inline(always)]
pub(crate) fn pick(weights: &[f32], u: f32) -> (usize, f32, f32) {
    let sum: f32 = weights.iter().sum();
    if !(sum > 0.0 && sum.is_finite()) {
        let along = u * weights.len() as f32;
        let place = (along as usize).min(weights.len() - 1);
        return (place, 1.0 / weights.len() as f32, clamp_below_one(along - place as f32));
    }
    let target = u * sum;
    let (mut running, mut last) = (0.0, 0);
    for (place, &weight) in weights.iter().enumerate() {
        if target < running + weight {
            return (place, weight / sum, clamp_below_one((target - running) / weight));
        }
        if weight > 0.0 {
            last = place;
        }
        running += weight;
    }
    // Rounding put `target` beyond the end of the sums.
    (last, weights[last] / sum, clamp_below_one(1.0))
}
