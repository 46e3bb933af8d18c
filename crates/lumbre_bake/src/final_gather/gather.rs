//! The final gather: rays from every texel read the light that leaves what they meet. Direct light there is that of
//! the texel hit. From the second round on earlier bounces are read from that texel, too; in the first round they come from its patch, and where a
//! patch is too coarse for so near a hit the ray goes on. Emission is not read: `direct` has counted it. Not which way rays go, nor what they meet: that is `incident`.

use crate::denoise::replicates::REPLICATES;
use crate::final_gather::gather_sums::GatherSums;
use std::cell::RefCell;

use glam::{Vec2, Vec3};

use super::incident::{GatherRequest, Hit, IncidentSample, SamplePath};
use super::radiance_cache::RadianceCache;
use crate::coverage::footprint::{Texel, receiver};
use crate::coverage::tile_sequence::TileSequence;
use crate::radiosity::patch_index::PatchIndex;
use crate::sampling::Stream;
use crate::scene::Receiver;
use crate::scene::material::Side;

/// One in so many samples asks a real bounce beside the patch that it reads.
pub(crate) const CHECKED: u32 = 4;

/// Most real bounces that one ray makes between surfaces too near for patches.
const NEAR_BOUNCES: u32 = 6;

/// Samples that are followed together: what they read is then on its way from memory at the same time.
const BATCH: usize = 16;

/// Samples to follow, each with what tells it from others, and how far they are.
struct Batch<Name> {
    requests: [GatherRequest; BATCH],
    names: [Name; BATCH],
    count: usize,
    paths: [SamplePath; BATCH],
    found: [IncidentSample; BATCH],
}

/// A batch of samples and one of those that check them.
struct Batches {
    /// By replicate and number of the sample.
    samples: Batch<(usize, u32)>,
    contributions: [GatherContribution; BATCH],
    /// By place of the sample and the patch that it read.
    checks: Batch<(usize, PatchIndex)>,
}

thread_local! {
    /// ReusedGather, as to clear them for every texel takes as long as some of its rays. What a batch leaves in them nothing reads.
    static BATCHES: RefCell<Batches> = const {
        RefCell::new(Batches {
            samples: Batch::empty((0, 0)),
            contributions: [GatherContribution::NONE; BATCH],
            checks: Batch::empty((0, PatchIndex(0))),
        })
    };
}

impl<Name: Copy> Batch<Name> {
    const fn empty(name: Name) -> Self {
        Self {
            requests: [GatherRequest::NOWHERE; BATCH],
            names: [name; BATCH],
            count: 0,
            paths: [SamplePath::NONE; BATCH],
            found: [IncidentSample::NOTHING; BATCH],
        }
    }

    fn push(&mut self, request: GatherRequest, name: Name) {
        self.requests[self.count] = request;
        self.names[self.count] = name;
        self.count += 1;
    }

    fn follow(&mut self, cache: &RadianceCache<'_>) {
        cache.incident(&self.requests[..self.count], &mut self.paths, &mut self.found);
    }
}

/// What one sample of the gather found.
#[derive(Clone, Copy)]
struct GatherContribution {
    light: Vec3,
    weight: f32,
    /// What the patches' errors leave in it.
    error: Vec2,
    /// The variance that this sample adds since the light of the texel that it read is itself uncertain.
    texel_variance: f32,
    /// Whether the light of a texel was read, and not a patch's.
    of_texel: bool,
    /// Whether the patch that was read was checked, and by how much it is more than the real bounce.
    checked: bool,
    difference: Vec3,
    /// Rays beyond the first.
    rays: u32,
}

impl GatherContribution {
    const NONE: Self = Self {
        light: Vec3::ZERO,
        weight: 0.0,
        error: Vec2::ZERO,
        texel_variance: 0.0,
        of_texel: false,
        checked: false,
        difference: Vec3::ZERO,
        rays: 0,
    };
}

impl RadianceCache<'_> {
    /// Adds samples `self.samples..samples` of every replicate.
    pub fn gather(&self, texel: &Texel, gathered: &mut GatherSums, samples: u32, seed: u32) {
        BATCHES.with_borrow_mut(|batches| self.gather_with(batches, texel, gathered, samples, seed));
    }

    fn gather_with(
        &self,
        batches: &mut Batches,
        texel: &Texel,
        gathered: &mut GatherSums,
        samples: u32,
        seed: u32,
    ) {
        let from = gathered.samples;
        let sequences: [TileSequence; REPLICATES] = std::array::from_fn(|replicate| {
            TileSequence::new(seed, Stream::Gather(replicate as u32), texel, self.run)
        });
        let numbers =
            (0..REPLICATES).flat_map(|replicate| (from..samples).map(move |sample| (replicate, sample)));
        batches.samples.count = 0;
        for (replicate, sample) in numbers {
            let [x, y, u, v] = sequences[replicate].first(sample);
            if let Some(point) = texel.point(self.scene, x, y) {
                let region = self.guide.region_at(point.triangle, Side::Front, point.at);
                let request = GatherRequest { receiver: receiver(self.scene, &point), region, u, v };
                batches.samples.push(request, (replicate, sample));
            }
            if batches.samples.count == BATCH {
                self.gather_batch(texel, &sequences, batches, gathered);
            }
        }
        self.gather_batch(texel, &sequences, batches, gathered);
        gathered.samples = from.max(samples);
    }

    /// Adds some samples, and empties their list.
    fn gather_batch(
        &self,
        texel: &Texel,
        sequences: &[TileSequence; REPLICATES],
        Batches { samples, contributions, checks }: &mut Batches,
        gathered: &mut GatherSums,
    ) {
        samples.follow(self);
        checks.count = 0;
        let names = &samples.names[..samples.count];
        for (place, (found, &(replicate, sample))) in samples.found.iter().zip(names).enumerate() {
            let reading = &mut contributions[place];
            *reading =
                GatherContribution { light: found.light, weight: found.weight, ..GatherContribution::NONE };
            let Some(hit) = &found.hit else { continue };
            gathered.inverse_distances += found.weight / hit.distance.max(f32::MIN_POSITIVE);
            // In turn over replicates, samples and texels, so that every neighbourhood has some at any number of samples.
            let turn =
                (sample * REPLICATES as u32 + replicate as u32).wrapping_add(texel.index.0.wrapping_mul(7));
            reading.checked = turn.is_multiple_of(CHECKED);
            let receiver = &samples.requests[place].receiver;
            let last = self.read(receiver, hit, &sequences[replicate], sample, reading);
            if let Some(last) = last.filter(|_| reading.checked) {
                let [u, v, ..] = sequences[replicate].point(sample, 1);
                let region = self.guide.region_at(last.triangle, last.side, last.at);
                let request = GatherRequest { receiver: self.receiver_at(&last), region, u, v };
                checks.push(request, (place, last.patch));
            }
        }
        checks.follow(self);
        for (found, &(place, patch)) in checks.found.iter().zip(&checks.names[..checks.count]) {
            let leaving = |hit: &Hit| found.weight * hit.reflectance * (hit.direct + hit.indirect);
            let real = found.hit.as_ref().map_or(found.light, leaving);
            contributions[place].rays += 1;
            contributions[place].difference *= self.patch_indirect[patch.place()] - real;
        }
        for (reading, &(replicate, _)) in contributions.iter().zip(names) {
            gathered.sums[replicate] += reading.light;
            gathered.weights[replicate].add(reading.weight, reading.light);
            gathered.rays += 1 + u64::from(reading.rays);
            gathered.patch_errors += reading.error;
            gathered.texel_variances += reading.texel_variance;
            gathered.texel_reads += u32::from(reading.of_texel);
            gathered.checks += u32::from(reading.checked);
            gathered.differences += reading.difference;
            gathered.squared_differences += (reading.difference.element_sum() / 3.0).powi(2);
        }
        samples.count = 0;
    }

    /// The light that leaves a point that was met, emission apart, times a weight. Returns the surface whose patch was read, if one was; the
    /// difference of that to a real bounce is then still to be multiplied by it. Where a texel was read instead, there is nothing to check.
    fn read(
        &self,
        receiver: &Receiver,
        hit: &Hit,
        sequence: &TileSequence,
        sample: u32,
        reading: &mut GatherContribution,
    ) -> Option<Hit> {
        let mut weight = reading.weight * hit.reflectance;
        let (mut light, mut last) = (weight * hit.direct, *hit);
        let mut receiver = *receiver;
        // In a gap narrower than patches there may be many.
        for bounce in 0..NEAR_BOUNCES {
            let is_coarse = last.variance.is_none() && last.distance < self.near[last.patch.place()];
            if !is_coarse || weight == Vec3::ZERO {
                break;
            }
            let [u, v, ..] = sequence.point(sample, 2 + bounce);
            reading.rays += 1;
            receiver = self.receiver_at(&last);
            let request = GatherRequest { receiver, region: None, u, v };
            let mut found = [IncidentSample::NOTHING];
            self.incident(&[request], &mut [SamplePath::NONE], &mut found);
            let [found] = found;
            let Some(hit) = found.hit else {
                reading.light = light + weight * found.light;
                return None;
            };
            weight *= found.weight * hit.reflectance;
            light += weight * hit.direct;
            last = hit;
        }
        reading.light = light + weight * last.indirect;
        let grey = weight.element_sum() / 3.0;
        if let Some(variance) = last.variance {
            // Errors within a disc about the hit are correlated: the share of cosine rays that land in it is its form factor.
            let normal = self.scene.triangles[last.triangle as usize].side_normal(last.side);
            let cosines = -last.direction.dot(normal) * last.direction.dot(receiver.normal);
            let under = self.correlated / last.distance.max(f32::MIN_POSITIVE);
            let share = (cosines.max(0.0) * under * under).min(1.0);
            reading.texel_variance = share * grey * grey * variance;
            reading.error = last.error * grey;
            (reading.of_texel, reading.checked) = (true, false);
            return None;
        }
        reading.error = last.error * grey;
        if reading.checked {
            reading.difference = weight;
        }
        Some(last)
    }
}
