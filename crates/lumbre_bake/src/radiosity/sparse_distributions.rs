//! Sparse discrete distributions, which are sampled by inversion: a table of rows, each with probabilities of a few of
//! the columns. What rows and columns stand for is the matter of `sampling_guide`.

/// Sparse discrete distributions over the same columns, one per row. They are too large for the near caches, so what is
/// read together is stored together.
#[derive(Clone, Debug, Default)]
pub(super) struct SparseDistributions {
    /// The columns are divided into parts: columns of the same part differ in this many of their lowest bits only.
    part_bits: u32,
    heads: Vec<Head>,
    /// Of all rows, one after the other; columns ascend in each row.
    entries: Vec<Entry>,
    /// Per row, the entry at which each part of the columns begins, and that at which each part of the cumulative
    /// probability in [0, 1] begins: a search then looks at few entries (Chen and Asau, "On Generating Random Variates
    /// from an Empirical Distribution", 1974).
    column_index: Vec<u32>,
    cumulative_index: Vec<u32>,
}

/// Where a row is.
#[derive(Clone, Copy, Debug)]
struct Head {
    /// Its first entry.
    start: usize,
    /// Number of its entries.
    count: u32,
    /// Share of the samples that are placed by this row.
    share: f32,
}

/// A column of a row, and the sum of the row's probabilities up to and including it; the last sum is 1.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Entry {
    pub column: u32,
    pub end: f32,
}

/// A part of a row to be searched. Its middle entry is read in advance, so that the cache misses of several samples
/// overlap.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct RowPart {
    /// Where the row begins in the list of all entries, and the number of its entries.
    begin: usize,
    count: u32,
    /// The part is the range `first..last` of the row's entries; `entry` is the one at `middle`.
    first: u32,
    last: u32,
    middle: u32,
    entry: Entry,
}

/// Number of parts in each index of a row.
const PARTS: usize = 64;

/// The distribution in proportion to weights at ascending columns; empty if no weight is positive and finite.
pub(super) fn cumulative(mut weights: Vec<(u32, f64)>) -> Vec<Entry> {
    weights.retain(|(_, weight)| weight.is_finite() && *weight > 0.0);
    let sum: f64 = weights.iter().map(|(_, weight)| weight).sum();
    let (last, mut running) = (weights.len().saturating_sub(1), 0.0);
    let entry = |(place, (column, weight)): (usize, (u32, f64))| {
        running += weight / sum;
        Entry { column, end: if place == last { 1.0 } else { running as f32 } }
    };
    weights.into_iter().enumerate().map(entry).collect()
}

impl SparseDistributions {
    /// Without rows yet, for columns below `columns`, with room for so many `entries` of all rows together.
    pub fn new(columns: usize, entries: usize) -> Self {
        let part_bits = columns.div_ceil(PARTS).max(1).next_power_of_two().trailing_zeros();
        Self { part_bits, entries: Vec::with_capacity(entries), ..Self::default() }
    }

    /// Without rows yet, for the same columns as `other`, with room for as many entries.
    pub fn like(other: &Self) -> Self {
        let entries = Vec::with_capacity(other.entries.len());
        Self { part_bits: other.part_bits, entries, ..Self::default() }
    }

    /// The share and the entries of every row.
    pub fn rows(&self) -> impl Iterator<Item = (f32, &[Entry])> {
        self.heads
            .iter()
            .map(|head| (head.share, &self.entries[head.start..head.start + head.count as usize]))
    }

    /// Appends a row, whose columns ascend.
    pub fn push(&mut self, share: f32, row: &[Entry]) {
        self.heads.push(Head { start: self.entries.len(), count: row.len() as u32, share });
        self.entries.extend_from_slice(row);
        for part in 0..=PARTS {
            let first_column = (part as u64) << self.part_bits;
            self.column_index
                .push(row.partition_point(|entry| u64::from(entry.column) < first_column) as u32);
            let start = part as f32 / PARTS as f32;
            self.cumulative_index.push(row.partition_point(|entry| entry.end <= start) as u32);
        }
    }

    fn part(&self, index: &[u32], row: u32, part: usize) -> RowPart {
        let at = row as usize * (PARTS + 1) + part.min(PARTS - 1);
        let Head { start: begin, count, .. } = self.heads[row as usize];
        let (first, last) = (index[at], index[at + 1]);
        let middle = first.midpoint(last);
        let entry = self.entries.get(begin + middle as usize).copied().unwrap_or_default();
        RowPart { begin, count, first, last, middle, entry }
    }

    /// The share of the samples that are placed by a row; `None` for an empty row.
    pub fn share(&self, row: u32) -> Option<f32> {
        let head = self.heads[row as usize];
        (head.count > 0).then_some(head.share)
    }

    /// Where to search for `u` in [0, 1) in a row.
    pub fn near(&self, row: u32, u: f32) -> RowPart {
        self.part(&self.cumulative_index, row, (u * PARTS as f32) as usize)
    }

    /// Where to search for a column in a row.
    pub fn near_column(&self, row: u32, column: u32) -> RowPart {
        self.part(&self.column_index, row, (column >> self.part_bits) as usize)
    }

    /// The first entry of a part for which `is_before` is false, or the one after the part, `None` at the end of the
    /// row; and the `end` of the entry before it.
    fn find(&self, part: &RowPart, is_before: impl Fn(&Entry) -> bool) -> (Option<&Entry>, f32) {
        let range = if part.first < part.last && is_before(&part.entry) {
            part.middle + 1..part.last
        } else {
            part.first..part.middle
        };
        let searched = &self.entries[part.begin + range.start as usize..part.begin + range.end as usize];
        let at = range.start as usize + searched.partition_point(is_before);
        let start = if at == 0 { 0.0 } else { self.entries[part.begin + at - 1].end };
        (self.entries.get(part.begin + at).filter(|_| at < part.count as usize), start)
    }

    /// The column at `u`, given the `part` that [`near`](Self::near) returned; the place of `u` in the column's
    /// interval, stretched to [0, 1); and the column's probability.
    pub fn pick(&self, part: &RowPart, u: f32) -> Option<(u32, f32, f32)> {
        let (entry, start) = self.find(part, |entry| entry.end <= u);
        let &Entry { column, end } = entry?;
        let probability = end - start;
        (probability > 0.0)
            .then(|| (column, ((u - start) / probability).clamp(0.0, 1.0 - f32::EPSILON), probability))
    }

    /// The probability of a column, given the `part` that [`near_column`](Self::near_column) returned.
    pub fn probability(&self, part: &RowPart, column: u32) -> f32 {
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

    fn rows() -> SparseDistributions {
        let mut rows = SparseDistributions::new(8, 3);
        rows.push(0.4, &cumulative(vec![(1, 2.0), (4, 6.0), (7, 0.0)]));
        rows.push(0.4, &cumulative(vec![(0, 0.0), (3, f64::NAN)]));
        rows.push(0.25, &cumulative(vec![(5, 1e-30)]));
        rows
    }

    fn pick(rows: &SparseDistributions, row: u32, u: f32) -> Option<(u32, f32, f32)> {
        rows.pick(&rows.near(row, u), u)
    }

    fn probability(rows: &SparseDistributions, row: u32, column: u32) -> f32 {
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
    fn a_row_without_positive_weights_has_no_share() {
        let rows = rows();
        assert_eq!([0, 1, 2].map(|row| rows.share(row)), [Some(0.4), None, Some(0.25)]);
        assert_eq!(pick(&rows, 1, 0.5), None);
    }

    #[test]
    fn a_search_by_the_indices_gives_the_same_as_one_through_the_whole_row() {
        let mut rows = SparseDistributions::new(1000, 0);
        let weight = |column: u32| if column % 7 < 3 { 0.0 } else { f64::from(column % 13).powi(4) };
        rows.push(0.4, &cumulative((0..1000).map(|column| (column, weight(column))).collect()));
        let sparse = (0..1000).filter(|column| column % 250 == 3).map(|column| (column, 1.0));
        rows.push(0.4, &cumulative(sparse.collect()));
        for row in 0..2 {
            let head = rows.heads[row as usize];
            let entries = &rows.entries[head.start..head.start + head.count as usize];
            for step in 0..5000 {
                let u = step as f32 / 5000.0;
                let at = entries.partition_point(|entry| entry.end <= u);
                assert_eq!(pick(&rows, row, u).map(|picked| picked.0), Some(entries[at].column), "{u}");
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
