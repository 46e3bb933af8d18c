//! The samples of the final gather: rays from every texel read the light that leaves the surfaces they hit. Direct
//! light is read from the texel that was hit. The light of earlier bounces is read from that texel, too, from the
//! second round on; in the first round it is read from the patch that was hit, and where that patch is too coarse for
//! so near a hit, the path makes another bounce instead. Emission is not read: `direct_light` has already counted it.
//! Not where rays go and what they hit: that is `incident`.

use super::gather_sums::{GatherSums, UnguidedLight};
use crate::color::channel_mean;
use crate::denoise::{Nearness, REPLICATES};
use std::cell::RefCell;

use glam::{Vec2, Vec3};

use super::incident::{GatherRequest, Hit, IncidentSample, SamplePath};
use super::radiance_cache::RadianceCache;
use crate::BakeError;
use crate::coverage::{Texel, TileSequence, receiver};
use crate::monitor::BakeMonitor;
use crate::radiosity::PatchIndex;
use crate::sample_allocation::{SampleAllocation, take_samples};
use crate::sampling::Stream;
use crate::scene::{Receiver, Side};

/// One in this many samples also traces a real bounce, to check the patch that it reads.
const CHECK_INTERVAL: u32 = 4;

/// The guide would hardly have led to a point if a sample's weight is more than this share of what it would be there
/// without the guide's samples.
const UNGUIDED: f32 = 0.9;

/// Most real bounces that one path makes between surfaces too near to each other for patches.
const NEAR_BOUNCES: u32 = 6;

/// Samples that are followed together, so that what they read is on its way from memory at the same time.
const WAVEFRONT: usize = 16;

/// Samples to follow, each with a tag that identifies it, and their results.
#[derive(Default)]
struct Wavefront<Tag> {
    requests: [GatherRequest; WAVEFRONT],
    tags: [Tag; WAVEFRONT],
    count: usize,
    paths: [SamplePath; WAVEFRONT],
    results: [IncidentSample; WAVEFRONT],
}

/// A wavefront of samples, and that of the real bounces that check them.
#[derive(Default)]
struct Wavefronts {
    /// Tagged with replicate and sample number.
    samples: Wavefront<(usize, u32)>,
    contributions: [GatherContribution; WAVEFRONT],
    /// Tagged with the slot of the sample in its wavefront, and the patch that the sample read.
    checks: Wavefront<(usize, PatchIndex)>,
}

thread_local! {
    /// Reused, since clearing them for every texel takes as long as some of its rays. Nothing reads what an earlier
    /// wavefront left.
    static WAVEFRONTS: RefCell<Wavefronts> = RefCell::default();
}

impl<Tag: Copy> Wavefront<Tag> {
    fn push(&mut self, request: GatherRequest, tag: Tag) {
        self.requests[self.count] = request;
        self.tags[self.count] = tag;
        self.count += 1;
    }

    fn follow(&mut self, cache: &RadianceCache<'_>) {
        cache.incident(&self.requests[..self.count], &mut self.paths, &mut self.results);
    }
}

/// What one sample adds to a texel's sums.
#[derive(Clone, Copy, Default)]
struct GatherContribution {
    light: Vec3,
    weight: f32,
    /// The patches' errors in `light`, each with its sign.
    error: Vec2,
    /// The variance in `light` that comes from the uncertain light of the texel that was read.
    texel_variance: f32,
    /// Whether the light of a texel was read, not that of a patch.
    reads_texel: bool,
    /// Whether the patch that was read is checked against a real bounce.
    is_checked: bool,
    /// By how much the patch gives more light than the real bounce; before the check has run, the weight of that.
    difference: Vec3,
    /// Rays beyond the first.
    rays: u32,
}

impl RadianceCache<'_> {
    /// Casts the wanted samples. Returns true if there was time for all of them.
    pub fn cast(
        &self,
        texels: &[Texel],
        wanted: &[SampleAllocation],
        gathered: &mut [GatherSums],
        seed: u32,
        monitor: &mut BakeMonitor<'_>,
    ) -> Result<bool, BakeError> {
        let taken = take_samples(wanted, gathered, monitor, |to, mut sums| {
            self.gather(&texels[to.texel.place()], &mut sums, to.samples, seed);
            sums
        })?;
        Ok(taken.len() == wanted.len())
    }

    /// Adds the samples `gathered.samples..samples` of every replicate.
    pub fn gather(&self, texel: &Texel, gathered: &mut GatherSums, samples: u32, seed: u32) {
        WAVEFRONTS.with_borrow_mut(|wavefronts| self.gather_with(wavefronts, texel, gathered, samples, seed));
    }

    fn gather_with(
        &self,
        wavefronts: &mut Wavefronts,
        texel: &Texel,
        gathered: &mut GatherSums,
        samples: u32,
        seed: u32,
    ) {
        let first = gathered.samples;
        let sequences: [TileSequence; REPLICATES] = std::array::from_fn(|replicate| {
            TileSequence::new(seed, Stream::Gather(replicate as u32), texel, self.first_round_samples)
        });
        let tags =
            (0..REPLICATES).flat_map(|replicate| (first..samples).map(move |sample| (replicate, sample)));
        wavefronts.samples.count = 0;
        for (replicate, sample) in tags {
            let [x, y, u, v] = sequences[replicate].first(sample);
            if let Some(point) = texel.point(self.scene, x, y) {
                let patch = self.exchange.patches.at(point.triangle, Side::Front, point.at);
                let region = patch.and_then(|patch| self.guide.region_of(patch));
                let request = GatherRequest { receiver: receiver(self.scene, &point), region, u, v };
                wavefronts.samples.push(request, (replicate, sample));
            }
            if wavefronts.samples.count == WAVEFRONT {
                self.gather_wavefront(texel, &sequences, wavefronts, gathered);
            }
        }
        self.gather_wavefront(texel, &sequences, wavefronts, gathered);
        gathered.samples = first.max(samples);
    }

    /// Follows the samples of a wavefront, adds what they find to the sums, and empties it.
    fn gather_wavefront(
        &self,
        texel: &Texel,
        sequences: &[TileSequence; REPLICATES],
        Wavefronts { samples, contributions, checks }: &mut Wavefronts,
        gathered: &mut GatherSums,
    ) {
        samples.follow(self);
        let map_axes = texel.map_axes(self.scene);
        checks.count = 0;
        let tags = &samples.tags[..samples.count];
        for (slot, (incident, &(replicate, sample))) in samples.results.iter_mut().zip(tags).enumerate() {
            let contribution = &mut contributions[slot];
            *contribution = GatherContribution {
                light: incident.light,
                weight: incident.weight,
                ..GatherContribution::default()
            };
            let Some(hit) = &mut incident.hit else {
                gathered.sky_reads += u32::from(incident.light != Vec3::ZERO);
                continue;
            };
            let inverse_distance = incident.weight / hit.distance.max(f32::MIN_POSITIVE);
            let normal = self.scene.triangles[hit.triangle as usize].normal;
            gathered.nearness.add(Nearness::of_surface(inverse_distance, normal, &map_axes));
            // Takes turns over replicates, samples and texels: every neighbourhood gets checks, however few samples
            // there are.
            let turn =
                (sample * REPLICATES as u32 + replicate as u32).wrapping_add(texel.index.0.wrapping_mul(7));
            contribution.is_checked = turn.is_multiple_of(CHECK_INTERVAL);
            let receiver = &samples.requests[slot].receiver;
            let last = self.read(receiver, hit, &sequences[replicate], sample, contribution);
            if let Some(last) = last.filter(|_| contribution.is_checked) {
                let [u, v, ..] = sequences[replicate].point(sample, 1);
                let region = self.guide.region_of(last.patch);
                let request = GatherRequest { receiver: self.receiver_at(&last), region, u, v };
                checks.push(request, (slot, last.patch));
            }
        }
        checks.follow(self);
        for (incident, &(slot, patch)) in checks.results.iter().zip(&checks.tags[..checks.count]) {
            let leaving = |hit: &Hit| incident.weight * hit.reflectance * (hit.direct + hit.indirect);
            let real_bounce = incident.hit.as_ref().map_or(incident.light, leaving);
            contributions[slot].rays += 1;
            contributions[slot].difference *= self.exchange.indirect[patch.place()] - real_bounce;
        }
        for (slot, (contribution, &(replicate, _))) in contributions.iter().zip(tags).enumerate() {
            gathered.sums[replicate] += contribution.light;
            gathered.weights[replicate].add(contribution.weight, contribution.light);
            gathered.rays += 1 + u64::from(contribution.rays);
            gathered.patch_errors += contribution.error;
            gathered.texel_variances += contribution.texel_variance;
            gathered.texel_reads += u32::from(contribution.reads_texel);
            gathered.checks += u32::from(contribution.is_checked);
            gathered.differences += contribution.difference;
            gathered.squared_differences += channel_mean(contribution.difference).powi(2);
            let light = channel_mean(contribution.light);
            if let Some(hit) = &samples.results[slot].hit
                && light > gathered.unguided.light
                && samples.paths[slot].cosine_share() * contribution.weight > UNGUIDED
            {
                gathered.unguided = UnguidedLight { patch: hit.patch, light };
            }
        }
        samples.count = 0;
    }

    /// Reads the light, without emission, that leaves the surface a sample hit, times the sample's weight, into
    /// `contribution`.
    ///
    /// Returns the surface whose patch was read, if one was. Where that patch is to be checked,
    /// `contribution.difference` is then the weight of the difference between the patch and a real bounce. Where a
    /// texel was read instead, there is nothing to check.
    fn read(
        &self,
        receiver: &Receiver,
        hit: &Hit,
        sequence: &TileSequence,
        sample: u32,
        contribution: &mut GatherContribution,
    ) -> Option<Hit> {
        let mut weight = contribution.weight * hit.reflectance;
        let (mut light, mut last) = (weight * hit.direct, *hit);
        let mut receiver = *receiver;
        // In a gap narrower than patches a path may bounce many times.
        for bounce in 0..NEAR_BOUNCES {
            let is_coarse = last.variance.is_none()
                && last.distance < self.exchange.min_read_distance[last.patch.place()];
            if !is_coarse || weight == Vec3::ZERO {
                break;
            }
            let [u, v, ..] = sequence.point(sample, 2 + bounce);
            contribution.rays += 1;
            receiver = self.receiver_at(&last);
            let request = GatherRequest { receiver, region: None, u, v };
            let mut incident = [IncidentSample::default()];
            self.incident(&[request], &mut [SamplePath::default()], &mut incident);
            let [incident] = incident;
            let Some(hit) = incident.hit else {
                contribution.light = light + weight * incident.light;
                return None;
            };
            weight *= incident.weight * hit.reflectance;
            light += weight * hit.direct;
            last = hit;
        }
        contribution.light = light + weight * last.indirect;
        let mean_weight = channel_mean(weight);
        if let Some(variance) = last.variance {
            // Errors within a disc about the hit are correlated. The share of cosine rays that land in it is its form
            // factor.
            let normal = self.scene.triangles[last.triangle as usize].side_normal(last.side);
            let cosines = -last.direction.dot(normal) * last.direction.dot(receiver.normal);
            let radius = self.correlation_radius / last.distance.max(f32::MIN_POSITIVE);
            let form_factor = (cosines.max(0.0) * radius * radius).min(1.0);
            contribution.texel_variance = form_factor * mean_weight * mean_weight * variance;
            contribution.error = last.error * mean_weight;
            (contribution.reads_texel, contribution.is_checked) = (true, false);
            return None;
        }
        contribution.error = last.error * mean_weight;
        if contribution.is_checked {
            contribution.difference = weight;
        }
        Some(last)
    }
}
