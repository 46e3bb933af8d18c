//! Where the light that arrives comes from, as the solution knows it: the final gather sends a share of its samples there
//! (Ureña and Torres, "Improved Irradiance Computation by Importance Sampling", 1997). By regions of several patches: few rays
//! tell each patch's part of the light badly, and many a patch that gives light is met by none. Not the gather.

use glam::Vec3;

use super::form_factors::FormFactors;
use super::larger_patches::LargerPatches;
use super::patch_index::PatchIndex;
use super::patches::{Patch, Patches};
use crate::scene::BakeScene;
use crate::scene::material::Side;

/// A region of the guide, by its place among all of them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Region(u32);

/// For each region, those that light it by bounces, with a probability in proportion to the irradiance they bring.
#[derive(Clone, Debug)]
pub(crate) struct SamplingGuide {
    /// Cut as patches are, but larger.
    regions: Patches,
    rows: Rows,
}

/// Share of the samples that the guide places, at most; where the sky shines, which it does not know, fewer, in steps of one in
/// so many: so that the others are as many as their weight says.
const GUIDED: f32 = 0.4;
const STEPS: f32 = 8.0;

/// Patches along a region's side.
const REGION: f32 = 4.0;

impl SamplingGuide {
    /// From the patches (of `side` canonical units), their exchange, what leaves each of them and what the sky brings it (W/m²).
    pub fn new(
        scene: &BakeScene,
        patches: &Patches,
        side: f32,
        factors: &FormFactors,
        radiosity: &[f32],
        sky: &[Vec3],
    ) -> Self {
        let Some(larger) = LargerPatches::new(scene, patches, REGION * side) else {
            return Self { regions: Patches::outlines(scene, REGION * side), rows: Rows::new(0) };
        };
        let bright = |region: usize| -> f64 {
            let area = larger.patches.list[region].area;
            let of_member = |member: &PatchIndex| {
                let share = patches.list[member.place()].area / area;
                f64::from(radiosity[member.place()].max(0.0) * share)
            };
            larger.members[region].iter().map(of_member).sum()
        };
        let bright: Vec<f64> = (0..larger.members.len()).map(bright).collect();
        let of_row = |members: &[PatchIndex], exchange: Vec<(PatchIndex, f64)>| {
            let flux: Vec<(u32, f64)> =
                exchange.into_iter().map(|(region, g)| (region.0, g * bright[region.place()])).collect();
            let by_bounces: f64 = flux.iter().map(|(_, flux)| flux).sum();
            let of_sky = |member: &PatchIndex| {
                f64::from(factors.areas[member.place()] * sky[member.place()].element_sum())
            };
            let by_sky: f64 = members.iter().map(of_sky).sum();
            let share = by_bounces / (by_bounces + by_sky);
            let share = if share.is_finite() { (GUIDED * STEPS * share as f32).round() / STEPS } else { 0.0 };
            (share, if share > 0.0 { cumulative(flux) } else { Vec::new() })
        };
        let found = larger.rows(factors, of_row);
        let mut rows = Rows::new(found.len());
        rows.entries.reserve_exact(found.iter().map(|(_, row)| row.len()).sum());
        found.into_iter().for_each(|(share, row)| rows.push(share, &row));
        let regions = larger.patches;
        Self { regions, rows }
    }

    /// The region at a point of a triangle's side; none where light does not arrive.
    pub fn region_at(&self, triangle: u32, side: Side, at: (f32, f32)) -> Option<Region> {
        self.regions.at(triangle, side, at).map(|region| Region(region.0))
    }

    /// Its surface.
    pub fn region(&self, region: Region) -> &Patch {
        &self.regions.list[region.0 as usize]
    }

    /// Barycentric weights (second, third vertex) of a point of a region given by weights of its own.
    pub fn point(&self, region: Region, at: (f32, f32)) -> (f32, f32) {
        self.regions.point(self.region(region), at)
    }

    /// The share of the samples at a region that it places, in [0, 1); none if the solution knows of no light by bounces that arrives there.
    pub fn share(&self, region: Region) -> Option<f32> {
        self.rows.share(region.0)
    }

    /// Where in the list of those that light `region` to look for the one at `u` in [0, 1).
    pub fn near(&self, region: Region, u: f32) -> RowPart {
        self.rows.near(region.0, u)
    }

    /// Of those that light a region, the one at `u`, of which `part` is [near](Self::near); the place within its interval, stretched to
    /// [0, 1); its probability.
    pub fn pick(&self, part: &RowPart, u: f32) -> Option<(Region, f32, f32)> {
        let (region, u, probability) = self.rows.pick(part, u)?;
        Some((Region(region), u, probability))
    }

    /// Where in the list of those that light `region` to look for `other`.
    pub fn near_region(&self, region: Region, other: Region) -> RowPart {
        self.rows.near_column(region.0, other.0)
    }

    /// The probability that [`pick`](Self::pick) takes `other`, of which `part` is [near](Self::near_region).
    pub fn probability(&self, part: &RowPart, other: Region) -> f32 {
        self.rows.probability(part, other.0)
    }
}

/// Discrete distributions over the same numbers, sparse. What is read together lies together: most of it is in no near cache.
#[derive(Clone, Debug, Default)]
struct Rows {
    /// Columns of one part are the same but for so many of their lowest bits.
    part_bits: u32,
    heads: Vec<Head>,
    /// Of all rows; columns ascend in each.
    entries: Vec<Entry>,
    /// Of each row where its columns of each part of the numbers begin, and its sums of each part of [0, 1]: so few have to be looked
    /// through (Chen and Asau, "On Generating Random Variates from an Empirical Distribution", 1974).
    column_index: Vec<u32>,
    cumulative_index: Vec<u32>,
}

/// A row.
#[derive(Clone, Copy, Debug)]
struct Head {
    /// Its first entry.
    start: usize,
    /// How many it has.
    count: u32,
    /// Share of the samples that it places.
    share: f32,
}

/// Of a row: a column, and the running sum of the probabilities up to it; the last is 1.
#[derive(Clone, Copy, Debug)]
struct Entry {
    column: u32,
    end: f32,
}

/// A part of a row, and what stands in its middle: read before it is needed, together with those of other samples.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RowPart {
    /// Where the row begins in the list of all entries, and how many it has; the rest counts from there.
    begin: usize,
    count: u32,
    first: u32,
    last: u32,
    middle: u32,
    entry: Entry,
}

impl RowPart {
    /// Of no row.
    pub const NONE: Self =
        Self { begin: 0, count: 0, first: 0, last: 0, middle: 0, entry: Entry { column: 0, end: 1.0 } };
}

/// Parts of a row's index.
const PARTS: usize = 64;

/// The distribution in proportion to weights at ascending columns; empty if none is positive and finite.
fn cumulative(mut weights: Vec<(u32, f64)>) -> Vec<Entry> {
    weights.retain(|(_, weight)| weight.is_finite() && *weight > 0.0);
    let sum: f64 = weights.iter().map(|(_, weight)| weight).sum();
    let (last, mut running) = (weights.len().saturating_sub(1), 0.0);
    let entry = |(place, (column, weight)): (usize, (u32, f64))| {
        running += weight / sum;
        Entry { column, end: if place == last { 1.0 } else { running as f32 } }
    };
    weights.into_iter().enumerate().map(entry).collect()
}

impl Rows {
    /// Of columns below `numbers`.
    fn new(numbers: usize) -> Self {
        let part_bits = numbers.div_ceil(PARTS).max(1).next_power_of_two().trailing_zeros();
        Self { part_bits, ..Self::default() }
    }

    /// A row: ascending columns.
    fn push(&mut self, share: f32, row: &[Entry]) {
        self.heads.push(Head { start: self.entries.len(), count: row.len() as u32, share });
        self.entries.extend_from_slice(row);
        for part in 0..=PARTS {
            let first = (part as u64) << self.part_bits;
            self.column_index.push(row.partition_point(|entry| u64::from(entry.column) < first) as u32);
            let least = part as f32 / PARTS as f32;
            self.cumulative_index.push(row.partition_point(|entry| entry.end <= least) as u32);
        }
    }

    fn part(&self, index: &[u32], row: u32, part: usize) -> RowPart {
        let at = row as usize * (PARTS + 1) + part.min(PARTS - 1);
        let Head { start: begin, count, .. } = self.heads[row as usize];
        let (first, last) = (index[at], index[at + 1]);
        let middle = first.midpoint(last);
        let entry =
            self.entries.get(begin + middle as usize).copied().unwrap_or(Entry { column: 0, end: 1.0 });
        RowPart { begin, count, first, last, middle, entry }
    }

    fn share(&self, row: u32) -> Option<f32> {
        let head = self.heads[row as usize];
        (head.count > 0).then_some(head.share)
    }

    fn near(&self, row: u32, u: f32) -> RowPart {
        self.part(&self.cumulative_index, row, (u * PARTS as f32) as usize)
    }

    fn near_column(&self, row: u32, column: u32) -> RowPart {
        self.part(&self.column_index, row, (column >> self.part_bits) as usize)
    }

    /// The first entry of a part that is not `before`, or the end of the part; and the end of the one before it.
    fn find(&self, part: &RowPart, before: impl Fn(&Entry) -> bool) -> (Option<&Entry>, f32) {
        let range = if part.first < part.last && before(&part.entry) {
            part.middle + 1..part.last
        } else {
            part.first..part.middle
        };
        let within = &self.entries[part.begin + range.start as usize..part.begin + range.end as usize];
        let at = range.start as usize + within.partition_point(before);
        let start = if at == 0 { 0.0 } else { self.entries[part.begin + at - 1].end };
        (self.entries.get(part.begin + at).filter(|_| at < part.count as usize), start)
    }

    fn pick(&self, part: &RowPart, u: f32) -> Option<(u32, f32, f32)> {
        let (entry, start) = self.find(part, |entry| entry.end <= u);
        let &Entry { column, end } = entry?;
        let probability = end - start;
        (probability > 0.0)
            .then(|| (column, ((u - start) / probability).clamp(0.0, 1.0 - f32::EPSILON), probability))
    }

    fn probability(&self, part: &RowPart, column: u32) -> f32 {
        if part.first == part.last {
            return 0.0;
        }
        let (entry, start) = self.find(part, |entry| entry.column < column);
        entry.filter(|entry| entry.column == column).map_or(0.0, |entry| entry.end - start)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rows() -> Rows {
        let mut rows = Rows::new(8);
        rows.push(0.4, &cumulative(vec![(1, 2.0), (4, 6.0), (7, 0.0)]));
        rows.push(0.4, &cumulative(vec![(0, 0.0), (3, f64::NAN)]));
        rows.push(0.25, &cumulative(vec![(5, 1e-30)]));
        rows
    }

    fn pick(rows: &Rows, row: u32, u: f32) -> Option<(u32, f32, f32)> {
        rows.pick(&rows.near(row, u), u)
    }

    fn probability(rows: &Rows, row: u32, column: u32) -> f32 {
        rows.probability(&rows.near_column(row, column), column)
    }

    #[test]
    fn probabilities_are_in_proportion_to_the_weights() {
        let rows = rows();
        for (row, column, expected) in [(0, 1, 0.25), (0, 4, 0.75), (0, 7, 0.0), (0, 5, 0.0), (2, 5, 1.0)] {
            assert_eq!(probability(&rows, row, column), expected);
        }
        for (u, column, within, probability) in
            [(0.125, 1, 0.5, 0.25), (0.25, 4, 0.0, 0.75), (0.625, 4, 0.5, 0.75)]
        {
            assert_eq!(pick(&rows, 0, u), Some((column, within, probability)));
        }
    }

    #[test]
    fn what_gets_no_light_is_not_guided() {
        let rows = rows();
        assert_eq!([0, 1, 2].map(|row| rows.share(row)), [Some(0.4), None, Some(0.25)]);
        assert_eq!(pick(&rows, 1, 0.5), None);
    }

    #[test]
    fn the_indices_find_what_a_search_through_the_whole_row_finds() {
        let mut rows = Rows::new(1000);
        let weight = |column: u32| if column % 7 < 3 { 0.0 } else { f64::from(column % 13).powi(4) };
        rows.push(0.4, &cumulative((0..1000).map(|column| (column, weight(column))).collect()));
        let few = (0..1000).filter(|column| column % 250 == 3).map(|column| (column, 1.0));
        rows.push(0.4, &cumulative(few.collect()));
        for row in 0..2 {
            let head = rows.heads[row as usize];
            let entries = &rows.entries[head.start..head.start + head.count as usize];
            for step in 0..5000 {
                let u = step as f32 / 5000.0;
                let at = entries.partition_point(|entry| entry.end <= u);
                assert_eq!(pick(&rows, row, u).map(|found| found.0), Some(entries[at].column), "{u}");
            }
            for column in 0..1000 {
                let expected = entries
                    .binary_search_by_key(&column, |entry| entry.column)
                    .map_or(0.0, |at| entries[at].end - if at == 0 { 0.0 } else { entries[at - 1].end });
                assert_eq!(probability(&rows, row, column), expected, "{column}");
            }
        }
    }
}
