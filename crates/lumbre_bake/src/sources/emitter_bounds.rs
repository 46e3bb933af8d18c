//! Where some emitters are, where they shine to and how much, and from that about what they bring a receiver: of one group of them, or of eight
//! side by side with the same bits. Not the hierarchy of such groups: that is `emitter_tree`.

use std::sync::LazyLock;

use fearless_simd::{Level, Simd, dispatch, f32x8, prelude::*};
use glam::Vec3;

use crate::scene::Receiver;

/// Some emitters as a whole.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct EmitterBounds {
    /// By power.
    pub center: Vec3,
    /// Around the centre, of all corners.
    pub radius: f32,
    /// Unit, or zero: by power, where it shines to; no normal differs from it by more than `spread`, a chord.
    pub axis: Vec3,
    pub spread: f32,
    /// Σ radiance · area, the sum of its channels.
    pub power: f32,
}

/// Least share of a cosine in a weight, so that none is 0 where light may arrive.
pub(crate) const MIN_COSINE: f32 = 0.02;

impl EmitterBounds {
    /// About what they bring receivers within `reach` of one (irradiance, sum of the channels); positive.
    pub fn weight(&self, receiver: &Receiver, reach: f32) -> f32 {
        let towards = self.center - receiver.position;
        let size = self.radius + reach;
        let squared = towards.length_squared() + size * size;
        // Directions are a little short where they are near: all of it counts there anyway.
        let inverse = 1.0 / squared.sqrt();
        let subtends = size * inverse;
        let receives = (towards.dot(receiver.normal) * inverse + subtends).clamp(MIN_COSINE, 1.0);
        let emits = (self.spread + subtends - towards.dot(self.axis) * inverse).clamp(MIN_COSINE, 1.0);
        self.power * receives * emits * inverse * inverse
    }
}

/// Groups side by side.
pub(crate) const LANES: usize = 8;
/// Numbers of one group: its centre, radius, axis, spread and power.
const NUMBERS: usize = 9;

/// The bounds of up to eight groups, number by number.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct BoundsEight([[f32; LANES]; NUMBERS]);

/// The bounds of several groups, eight by eight.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct BoundsLanes {
    eights: Vec<BoundsEight>,
    count: usize,
}

/// A receiver's place and normal in all lanes.
#[derive(Clone, Copy)]
pub(crate) struct ReceiverLanes<S: Simd> {
    position: [f32x8<S>; 3],
    normal: [f32x8<S>; 3],
    simd: S,
}

impl<S: Simd> ReceiverLanes<S> {
    #[inline(always)]
    pub fn new(simd: S, receiver: &Receiver) -> Self {
        let splat = |vector: Vec3| vector.to_array().map(|number| simd.splat_f32x8(number));
        Self { position: splat(receiver.position), normal: splat(receiver.normal), simd }
    }
}

/// The instructions that this machine has; every level computes the same bits.
pub(crate) static LEVEL: LazyLock<Level> = LazyLock::new(Level::new);

impl BoundsEight {
    /// Of at most eight; the lanes that are left weigh nothing that may be read.
    pub fn new(groups: &[EmitterBounds]) -> Self {
        let mut numbers = [[0.0; LANES]; NUMBERS];
        for (lane, group) in groups.iter().enumerate().take(LANES) {
            let EmitterBounds { center, radius, axis, spread, power } = *group;
            let own = [center.x, center.y, center.z, radius, axis.x, axis.y, axis.z, spread, power];
            numbers.iter_mut().zip(own).for_each(|(number, own)| number[lane] = own);
        }
        Self(numbers)
    }

    /// The [`EmitterBounds::weight`] of each group.
    #[inline(always)]
    pub fn weights<S: Simd>(&self, receiver: &ReceiverLanes<S>) -> [f32; LANES] {
        let ReceiverLanes { position, normal, simd } = *receiver;
        let one = simd.splat_f32x8(1.0);
        let [x, y, z, radius, along_x, along_y, along_z, spread, power] =
            self.0.each_ref().map(|number| f32x8::from_slice(simd, number));
        let towards = [x - position[0], y - position[1], z - position[2]];
        let dot = |a: [f32x8<S>; 3], b: [f32x8<S>; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
        let squared = dot(towards, towards) + radius * radius;
        let inverse = one / squared.sqrt();
        let subtends = radius * inverse;
        let receives = (dot(towards, normal) * inverse + subtends).max(MIN_COSINE).min(1.0);
        let emits = spread + subtends - dot(towards, [along_x, along_y, along_z]) * inverse;
        let emits = emits.max(MIN_COSINE).min(1.0);
        let mut found = [0.0; LANES];
        (power * receives * emits * inverse * inverse).store_slice(&mut found);
        found
    }
}

impl BoundsLanes {
    pub fn new(groups: &[EmitterBounds]) -> Self {
        Self { eights: groups.chunks(LANES).map(BoundsEight::new).collect(), count: groups.len() }
    }

    /// How many groups there are.
    pub fn len(&self) -> usize {
        self.count
    }

    /// The [`EmitterBounds::weight`] of each group, in the first places of `weights`, which has room for all.
    pub fn weights(&self, receiver: &Receiver, weights: &mut [f32]) {
        #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
        if let Some(simd) = LEVEL.as_avx2() {
            return simd.vectorize(
                #[inline(always)]
                || self.weights_with(simd, receiver, weights),
            );
        }
        dispatch!(*LEVEL, simd => self.weights_with(simd, receiver, weights));
    }

    #[inline(always)]
    fn weights_with<S: Simd>(&self, simd: S, receiver: &Receiver, weights: &mut [f32]) {
        let receiver = ReceiverLanes::new(simd, receiver);
        for (eight, weights) in self.eights.iter().zip(weights[..self.count].chunks_mut(LANES)) {
            weights.copy_from_slice(&eight.weights(&receiver)[..weights.len()]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::{Sequence, Stream};

    #[test]
    fn eight_side_by_side_weigh_what_each_does() {
        let sequence = Sequence::new(9, Stream::Test(91), 0);
        let vector = |index: u32, set: u32| {
            let [x, y, z, _] = sequence.point(index, set);
            Vec3::new(x, y, z) * 2.0 - 1.0
        };
        let group = |index: u32| {
            let [radius, spread, power, _] = sequence.point(index, 2);
            let axis = vector(index, 1).normalize_or_zero();
            EmitterBounds { center: vector(index, 0) * 3.0, radius, axis, spread: 2.0 * spread, power }
        };
        for count in [0, 1, 7, 8, 9, 48] {
            let groups: Vec<EmitterBounds> = (0..count).map(group).collect();
            let lanes = BoundsLanes::new(&groups);
            assert_eq!(lanes.len(), groups.len());
            for place in 0..20 {
                let position = vector(place, 3);
                let normal = vector(place, 4).normalize_or(Vec3::X);
                let receiver = Receiver { position, origin: position, geometric_normal: normal, normal };
                let mut weights = [f32::NAN; 48];
                lanes.weights(&receiver, &mut weights);
                for (group, weight) in groups.iter().zip(weights) {
                    assert_eq!(weight.to_bits(), group.weight(&receiver, 0.0).to_bits());
                }
                assert!(weights[groups.len()..].iter().all(|weight| weight.is_nan()));
            }
        }
    }
}
