//! Importance sampling by the radiosity solution: it knows where the light that arrives at a surface comes from, and
//! the final gather sends a share of its samples there (Ureña and Torres, "Improved Irradiance Computation by
//! Importance Sampling", 1997). A sample chooses a region of several patches first, since with few rays a single
//! patch's form factors are noisy, and often 0 for a patch that does give light; then one of the region's patches by
//! how much light leaves each, so that a beam of sunlight in a dark region is found. Bright regions that the rays of the
//! form factors have missed are added by `unseen_regions`. The samples are taken in `final_gather`.

use std::collections::BTreeMap;

use glam::Vec3;

use super::form_factors::FormFactors;
use super::larger_patches::LargerPatches;
use super::patch_index::{PatchIndex, RegionIndex};
use super::patches::Patches;
use super::sparse_distributions::{Entry, RowPart, SparseDistributions, cumulative};
use super::unseen_regions::UnseenRegions;
use crate::sampling::interval_at;
use crate::scene::BakeScene;

/// For each region, the regions that light it by bounces, with probabilities in proportion to the irradiance that they
/// contribute; and for each region its patches, with probabilities in proportion to the light that leaves them.
#[derive(Clone, Debug)]
pub(crate) struct SamplingGuide {
    rows: SparseDistributions,
    /// The patches of all regions, one region after the other.
    members: Vec<Member>,
    /// Where each region's patches begin in that list, and at last the list's length.
    first_members: Vec<u32>,
    /// Per patch, how it is chosen within its region.
    patches: Vec<PatchInRegion>,
    unseen: UnseenRegions,
}

/// Light that reaches a region from a patch that the guide hardly ever chooses for it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Discovery {
    /// The region that receives the light.
    pub receiver: RegionIndex,
    /// Where it comes from.
    pub patch: PatchIndex,
    /// Its share of all light by bounces and by the sky that the region receives.
    pub share: f64,
}

/// A patch of a region, and the sum of the probabilities of the region's patches up to and including it; the last sum
/// is 1.
#[derive(Clone, Copy, Debug)]
struct Member {
    patch: PatchIndex,
    end: f32,
}

/// The region of a patch, and the density with which a sample of that region chooses a point of the patch, per square
/// canonical unit.
#[derive(Clone, Copy, Debug)]
struct PatchInRegion {
    region: RegionIndex,
    density: f32,
}

/// A patch that the guide has chosen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct GuidedPatch {
    pub patch: PatchIndex,
    /// The place of the sample's number in the patch's interval, stretched to [0, 1).
    pub u: f32,
    /// The density of a point of the patch, per square canonical unit.
    pub density: f32,
}

/// Largest share of the samples that the guide places. It is smaller where the sky contributes, which the guide does
/// not sample, and rounded to a multiple of 1 / `SHARE_STEPS`, so that the numbers of guided and of other samples match
/// the weights of both strategies.
const MAX_SHARE: f32 = 0.4;
const SHARE_STEPS: f32 = 8.0;

/// Most of a region's distribution that discoveries make up together: one sample says little about how much light comes
/// that way.
const MAX_DISCOVERED: f64 = 0.5;

/// So many regions may be added to any row.
const MIN_NEW_ENTRIES: usize = 8;

/// Patches along a region's side.
const REGION_SIDE: f32 = 4.0;

/// A patch counts as giving off at least this share of its region's mean, as its light may be known too roughly.
const MIN_RADIOSITY: f64 = 0.1;

impl SamplingGuide {
    /// From the patches, their form factors, the radiosity of each and its irradiance by
    /// the sky (W/m²).
    pub fn new(
        scene: &BakeScene,
        patches: &Patches,
        factors: &FormFactors,
        radiosity: &[f32],
        sky: &[Vec3],
    ) -> Self {
        let Some(larger) = LargerPatches::new(scene, patches, REGION_SIDE * patches.subdivision.side) else {
            return Self::empty();
        };
        let area = |member: &PatchIndex| f64::from(patches.list[member.place()].area);
        let power = |member: &PatchIndex| f64::from(radiosity[member.place()].max(0.0)) * area(member);
        let radiosity_of_regions: Vec<f64> = larger
            .members
            .iter()
            .map(|members| {
                let total = members.iter().map(area).sum::<f64>().max(f64::MIN_POSITIVE);
                members.iter().map(power).sum::<f64>() / total
            })
            .collect();
        let unseen = UnseenRegions::new(scene, &larger, &radiosity_of_regions);
        let share_and_row = |members: &[PatchIndex], exchange: Vec<(RegionIndex, f64)>| {
            let mut flux: Vec<(RegionIndex, f64)> = exchange
                .iter()
                .map(|&(region, g)| (region, g * radiosity_of_regions[region.place()]))
                .collect();
            let by_bounces: f64 = flux.iter().map(|(_, flux)| flux).sum();
            let sky_flux = |member: &PatchIndex| {
                f64::from(factors.areas[member.place()] * sky[member.place()].element_sum())
            };
            let by_sky: f64 = members.iter().map(sky_flux).sum();
            let share = by_bounces / (by_bounces + by_sky);
            let share = if share.is_finite() { rounded_share(share) } else { 0.0 };
            if share == 0.0 {
                return (share, Vec::new());
            }
            if let Some(first) = members.first() {
                unseen.add(larger.of[first.place()], &exchange, &mut flux);
            }
            (share, cumulative(flux.into_iter().map(|(region, flux)| (region.0, flux)).collect()))
        };
        let distributions = larger.rows(factors, share_and_row);
        let entries = distributions.iter().map(|(_, row)| row.len()).sum();
        let mut rows = SparseDistributions::new(distributions.len(), entries);
        distributions.into_iter().for_each(|(share, row)| rows.push(share, &row));
        let mut guide = Self {
            rows,
            members: Vec::with_capacity(patches.list.len()),
            patches: larger.of.iter().map(|&region| PatchInRegion { region, density: 0.0 }).collect(),
            unseen,
            ..Self::empty()
        };
        for (members, mean) in larger.members.iter().zip(&radiosity_of_regions) {
            let weight = |member: &PatchIndex| power(member).max(MIN_RADIOSITY * mean * area(member));
            guide.push_members(members, weight, area);
        }
        guide
    }

    /// Knows nothing of any patch.
    fn empty() -> Self {
        Self {
            rows: SparseDistributions::new(0, 0),
            members: Vec::new(),
            first_members: vec![0],
            patches: Vec::new(),
            unseen: UnseenRegions::default(),
        }
    }

    /// Appends the patches of the next region, each chosen in proportion to its weight.
    fn push_members(
        &mut self,
        members: &[PatchIndex],
        weight: impl Fn(&PatchIndex) -> f64,
        area: impl Fn(&PatchIndex) -> f64,
    ) {
        let weights: Vec<(u32, f64)> = members.iter().map(|member| (member.0, weight(member))).collect();
        let mut start = 0.0;
        for Entry { column, end } in cumulative(weights) {
            let patch = PatchIndex(column);
            self.patches[patch.place()].density = ((f64::from(end) - f64::from(start)) / area(&patch)) as f32;
            self.members.push(Member { patch, end });
            start = end;
        }
        self.first_members.push(self.members.len() as u32);
    }

    /// The guide with `discoveries`, which are sorted by their receivers. Half of what is discovered counts for the region
    /// that it came from, the other half for all bright regions around that one. No row more than doubles, or gets more
    /// than [`MIN_NEW_ENTRIES`] if it was short, so that memory still follows from the rays of the form factors.
    pub fn with(&self, discoveries: &[Discovery]) -> Self {
        let mut rows = SparseDistributions::like(&self.rows);
        let mut left = discoveries;
        for (number, (share, known)) in (0..).zip(self.rows.rows()) {
            let discovered;
            (discovered, left) =
                left.split_at(left.partition_point(|discovery| discovery.receiver.0 <= number));
            let total = discovered.iter().map(|discovery| discovery.share).sum::<f64>();
            if total == 0.0 {
                rows.push(share, known);
                continue;
            }
            let (share, weight) = match known.is_empty() {
                true => (rounded_share(total.min(1.0)).max(1.0 / SHARE_STEPS), total),
                false => (share, total.min(MAX_DISCOVERED)),
            };
            let mut new: BTreeMap<RegionIndex, f64> = BTreeMap::new();
            for (region, share) in discovered.iter().flat_map(|discovery| self.spread(discovery)) {
                *new.entry(region).or_default() += share;
            }
            let mut new: Vec<(RegionIndex, f64)> = new.into_iter().collect();
            new.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
            new.truncate(known.len().max(MIN_NEW_ENTRIES));
            let total = new.iter().map(|(_, share)| share).sum::<f64>();
            let mut weights: BTreeMap<u32, f64> =
                new.into_iter().map(|(region, share)| (region.0, weight * share / total)).collect();
            let mut start = 0.0;
            for entry in known {
                *weights.entry(entry.column).or_default() += (1.0 - weight) * f64::from(entry.end - start);
                start = entry.end;
            }
            rows.push(share, &cumulative(weights.into_iter().collect()));
        }
        Self {
            rows,
            members: self.members.clone(),
            first_members: self.first_members.clone(),
            patches: self.patches.clone(),
            unseen: self.unseen.clone(),
        }
    }

    /// The regions to which a discovery leads, with their parts of its share.
    fn spread(&self, discovery: &Discovery) -> Vec<(RegionIndex, f64)> {
        let origin = self.patches[discovery.patch.place()].region;
        let near = self.unseen.around(discovery.receiver, origin);
        let power: f64 = near.iter().map(|(_, power)| power).sum();
        if power.is_nan() || power <= 0.0 {
            return vec![(origin, discovery.share)];
        }
        let half = 0.5 * discovery.share;
        let of_near = near.into_iter().map(|(region, near_power)| (region, half * near_power / power));
        of_near.chain([(origin, half)]).collect()
    }

    /// The region of a patch; `None` if the guide knows nothing of it.
    pub fn region_of(&self, patch: PatchIndex) -> Option<RegionIndex> {
        self.patches.get(patch.place()).map(|patch| patch.region)
    }

    /// The share of the samples at a region that the guide places, in [0, 1); `None` if according to the solution no
    /// light arrives there by bounces.
    pub fn share(&self, region: RegionIndex) -> Option<f32> {
        self.rows.share(region.0)
    }

    /// Where to search for `u` in [0, 1) in the distribution of the regions that light `region`.
    pub fn near(&self, region: RegionIndex, u: f32) -> RowPart {
        self.rows.near(region.0, u)
    }

    /// Samples a patch at `u` from a distribution, given the `part` that [`near`](Self::near) returned.
    pub fn pick(&self, part: &RowPart, u: f32) -> Option<GuidedPatch> {
        let (region, u, probability) = self.rows.pick(part, u)?;
        let range =
            self.first_members[region as usize] as usize..self.first_members[region as usize + 1] as usize;
        let members = &self.members[range];
        let (place, start, end) = interval_at(members, |member| member.end, u)?;
        let patch = members[place].patch;
        let u = ((u - start) / (end - start)).clamp(0.0, 1.0 - f32::EPSILON);
        Some(GuidedPatch { patch, u, density: probability * self.patches[patch.place()].density })
    }

    /// Where to search for the region of `patch` in the distribution of the regions that light `region`.
    pub fn near_patch(&self, region: RegionIndex, patch: PatchIndex) -> RowPart {
        let other = self.patches[patch.place()].region;
        self.rows.near_column(region.0, other.0)
    }

    /// The density with which [`pick`](Self::pick) leads to a point of `patch`, per square canonical unit, given the
    /// `part` that [`near_patch`](Self::near_patch) returned.
    pub fn density(&self, part: &RowPart, patch: PatchIndex) -> f32 {
        let PatchInRegion { region, density } = self.patches[patch.place()];
        self.rows.probability(part, region.0) * density
    }
}

/// The share of the samples that the guide places where it knows the origin of this part of the light.
fn rounded_share(known: f64) -> f32 {
    (MAX_SHARE * SHARE_STEPS * known as f32).round() / SHARE_STEPS
}

#[cfg(test)]
mod tests {
    use super::*;

    fn probability(rows: &SparseDistributions, row: u32, column: u32) -> f32 {
        rows.probability(&rows.near_column(row, column), column)
    }

    #[test]
    fn patches_are_chosen_by_the_light_that_leaves_them() {
        // Two regions: patches 0 to 2 of unequal light and area, and patch 3.
        let (weights, areas) = ([1.0, 0.0, 3.0, 1.0], [1.0, 1.0, 2.0, 4.0]);
        let patches = [0, 0, 0, 1].map(|region| PatchInRegion { region: RegionIndex(region), density: 0.0 });
        let mut rows = SparseDistributions::new(2, 0);
        rows.push(0.4, &cumulative(vec![(0, 3.0), (1, 1.0)]));
        let mut guide = SamplingGuide { rows, patches: patches.to_vec(), ..SamplingGuide::empty() };
        for members in [&[PatchIndex(0), PatchIndex(1), PatchIndex(2)][..], &[PatchIndex(3)]] {
            let of = |numbers: [f64; 4]| move |member: &PatchIndex| numbers[member.place()];
            guide.push_members(members, of(weights), of(areas));
        }
        let region = guide.region_of(PatchIndex(0)).unwrap();
        for (patch, probability) in [(0, 0.1875), (1, 0.0), (2, 0.5625), (3, 0.25)] {
            let patch = PatchIndex(patch);
            let density = guide.density(&guide.near_patch(region, patch), patch);
            assert_eq!(f64::from(density) * areas[patch.place()], probability, "{patch:?}");
        }
        let mut picked = [0; 4];
        for step in 0..1600 {
            let u = step as f32 / 1600.0;
            let guided = guide.pick(&guide.near(region, u), u).unwrap();
            assert!((0.0..1.0).contains(&guided.u));
            assert_eq!(guided.density, guide.density(&guide.near_patch(region, guided.patch), guided.patch));
            picked[guided.patch.place()] += 1;
        }
        assert_eq!(picked, [300, 0, 900, 400]);
        assert_eq!(guide.region_of(PatchIndex(4)), None);
    }

    #[test]
    fn what_is_discovered_becomes_a_part_of_the_distribution() {
        let patches = [0, 1, 2].map(|region| PatchInRegion { region: RegionIndex(region), density: 0.0 });
        let mut rows = SparseDistributions::new(3, 0);
        rows.push(0.25, &cumulative(vec![(0, 3.0), (1, 1.0)]));
        rows.push(0.25, &cumulative(vec![(0, 1.0)]));
        rows.push(0.0, &[]);
        let guide = SamplingGuide { rows, patches: patches.to_vec(), ..SamplingGuide::empty() };
        let discovery = |receiver, patch, share| Discovery {
            receiver: RegionIndex(receiver),
            patch: PatchIndex(patch),
            share,
        };
        let learned = guide.with(&[discovery(0, 1, 0.125), discovery(0, 2, 0.125), discovery(2, 1, 0.01)]);
        let row = |number| [0, 1, 2].map(|column| probability(&learned.rows, number, column));
        assert_eq!(row(0), [0.75 * 0.75, 0.75 * 0.25 + 0.125, 0.125]);
        assert_eq!(row(1), [1.0, 0.0, 0.0], "nothing new");
        assert_eq!(row(2), [0.0, 1.0, 0.0], "nothing was known");
        assert_eq!([0, 1, 2].map(|number| learned.rows.share(number)), [Some(0.25), Some(0.25), Some(0.125)]);
        // However bright a single sample was, as much is left of what was known.
        let learned = guide.with(&[discovery(0, 2, 0.9)]);
        assert_eq!(f64::from(probability(&learned.rows, 0, 2)), MAX_DISCOVERED);
    }
}
