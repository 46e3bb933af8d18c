//! Bounds of a group of emitters (position, emission directions, power), and from them an estimate of the light that
//! the group brings to a receiver: for one group, or with SIMD for eight groups and the same bits. The hierarchy of
//! groups is `emitter_tree`.

use std::sync::LazyLock;

use fearless_simd::{Level, Simd, dispatch, f32x8, prelude::*};
use glam::Vec3;

use crate::scene::Receiver;

/// Bounds of a group of emitters.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct EmitterBounds {
    /// Mean position, weighted by power.
    pub center: Vec3,
    /// Radius of the sphere about `center` that contains all corners.
    pub radius: f32,
    /// Mean emission direction, weighted by power: a unit vector, or zero.
    pub axis: Vec3,
    /// Largest distance (a chord, not an angle) of an emitter's normal from `axis`.
    pub spread: f32,
    /// Σ radiance · area, summed over the channels.
    pub power: f32,
}

/// Lower bound of the cosine factors in a weight, so that no weight is 0 where light may arrive.
pub(crate) const MIN_COSINE: f32 = 0.02;

impl EmitterBounds {
    /// Estimates the irradiance, summed over the channels and positive, that the group brings to receivers within
    /// `reach` of the given one.
    pub fn weight(&self, receiver: &Receiver, reach: f32) -> f32 {
        let towards = self.center - receiver.position;
        let size = self.radius + reach;
        let squared = towards.length_squared() + size * size;
        // Close to the group, this makes the direction shorter than a unit vector, but there `subtends` makes all of it
        // count.
        let inverse = 1.0 / squared.sqrt();
        let subtends = size * inverse;
        let receives = (towards.dot(receiver.normal) * inverse + subtends).clamp(MIN_COSINE, 1.0);
        let emits = (self.spread + subtends - towards.dot(self.axis) * inverse).clamp(MIN_COSINE, 1.0);
        self.power * receives * emits * inverse * inverse
    }
}

/// Groups that are evaluated together with SIMD.
pub(crate) const LANES: usize = 8;
/// Numbers that describe one group: its centre, radius, axis, spread and power.
const FIELDS: usize = 9;

/// The bounds of up to eight groups as a structure of arrays.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct BoundsEight([[f32; LANES]; FIELDS]);

/// The bounds of any number of groups, in blocks of eight.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct BoundsLanes {
    eights: Vec<BoundsEight>,
    count: usize,
}

/// A receiver's position and normal, broadcast to all lanes.
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

/// The SIMD instruction set of this machine; the results are the same bits with every one.
pub(crate) static LEVEL: LazyLock<Level> = LazyLock::new(Level::new);

impl BoundsEight {
    /// The bounds of at most eight groups; the weights of unused lanes are meaningless.
    pub fn new(groups: &[EmitterBounds]) -> Self {
        let mut fields = [[0.0; LANES]; FIELDS];
        for (lane, group) in groups.iter().enumerate().take(LANES) {
            let EmitterBounds { center, radius, axis, spread, power } = *group;
            let values = [center.x, center.y, center.z, radius, axis.x, axis.y, axis.z, spread, power];
            fields.iter_mut().zip(values).for_each(|(field, value)| field[lane] = value);
        }
        Self(fields)
    }

    /// The [`EmitterBounds::weight`] of each group.
    #[inline(always)]
    pub fn weights<S: Simd>(&self, receiver: &ReceiverLanes<S>) -> [f32; LANES] {
        let ReceiverLanes { position, normal, simd } = *receiver;
        let one = simd.splat_f32x8(1.0);
        let [x, y, z, radius, along_x, along_y, along_z, spread, power] =
            self.0.each_ref().map(|field| f32x8::from_slice(simd, field));
        let towards = [x - position[0], y - position[1], z - position[2]];
        let dot = |a: [f32x8<S>; 3], b: [f32x8<S>; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
        let squared = dot(towards, towards) + radius * radius;
        let inverse = one / squared.sqrt();
        let subtends = radius * inverse;
        let receives = (dot(towards, normal) * inverse + subtends).max(MIN_COSINE).min(1.0);
        let emits = spread + subtends - dot(towards, [along_x, along_y, along_z]) * inverse;
        let emits = emits.max(MIN_COSINE).min(1.0);
        let mut weights = [0.0; LANES];
        (power * receives * emits * inverse * inverse).store_slice(&mut weights);
        weights
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

    /// Writes the [`EmitterBounds::weight`] of each group to the front of `weights`, which must be long enough.
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
    fn simd_weights_equal_those_of_single_groups() {
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
