//! Form factors by Monte Carlo, visibility included: the numbers of rays or lines between two patches become one
//! exchange area G_ij = A_i F_ij = A_j F_ji, so that reciprocity is exact. Then rows are scaled so that they sum to the
//! share of the patch's rays that hit a surface, which is an estimate of the exact sum (1 in a closed scene). Rays are
//! counted in `cosine_rays` and `global_lines`; the linear system is solved in `solver`.

use super::ray_counts::{Counts, PatchRayCounts, merged};
use std::ops::Range;

use rayon::prelude::*;

use super::patch_index::PatchIndex;
use super::patches::Patches;
use super::{cosine_rays, global_lines};
use crate::BakeError;
use crate::cancel_token::CancelToken;
use crate::monitor::BakeMonitor;
use crate::options::FormFactorMethod;
use crate::scene::BakeScene;

/// The symmetric matrix of exchange areas, sparse, in compressed rows.
#[derive(Clone, Debug, Default)]
pub(crate) struct FormFactors {
    /// Row i is the range `starts[i]..starts[i + 1]` of `columns` and of `exchange`.
    pub starts: Vec<usize>,
    pub columns: Vec<PatchIndex>,
    /// G_ij, square canonical units.
    pub exchange: Vec<f32>,
    /// A_i: area of the patch's open part, which is not inside other geometry, square canonical units.
    pub areas: Vec<f32>,
    /// Share of each patch that is open, in [0, 1].
    pub open: Vec<f32>,
    /// Share of the rays from the open part that hit nothing, in [0, 1]: the sky's form factor.
    pub sky: Vec<f32>,
    /// Rays and lines cast.
    pub rays: u64,
    /// Share of all exchange that was cut so that no row sums to more than 1.
    pub energy_lost: f64,
    /// Whether the bake was cancelled, so that loops over the matrix may end early.
    pub stop: CancelToken,
}

impl FormFactors {
    /// Samples with about `rays` rays or lines. Returns the estimate from all of them and those from two halves: half
    /// the difference of these has the standard deviation of the error of the former.
    pub fn sample(
        scene: &BakeScene,
        patches: &Patches,
        method: FormFactorMethod,
        rays: usize,
        seed: u32,
        monitor: &mut BakeMonitor<'_>,
    ) -> Result<(Self, [Self; 2]), BakeError> {
        let (cast, rays) = match method {
            FormFactorMethod::CosineRays => cosine_rays::cast(scene, patches, rays, seed, monitor)?,
            FormFactorMethod::GlobalLines => global_lines::cast(scene, patches, rays, seed, monitor)?,
        };
        monitor.run_interruptible(1.0, || Self::from_counts(scene, patches, &cast, rays))
    }

    /// The matrices from all rays and from either half of them.
    fn from_counts(
        scene: &BakeScene,
        patches: &Patches,
        cast: &[PatchRayCounts],
        rays: u64,
    ) -> (Self, [Self; 2]) {
        let [whole, even, odd] = [
            |cast: &PatchRayCounts| cast.whole(),
            |cast: &PatchRayCounts| cast.half(0),
            |cast: &PatchRayCounts| cast.half(1),
        ]
        .map(|counts| cast.par_iter().map(counts).collect::<Vec<Counts>>());
        let areas = || patches.list.iter().map(|patch| patch.area).collect();
        let factors = |counts: &[Counts]| Self::new(counts, areas(), &scene.stop);
        let ((even, odd), mut whole) =
            rayon::join(|| rayon::join(|| factors(&even), || factors(&odd)), || factors(&whole));
        whole.rays = rays;
        (whole, [even, odd])
    }

    /// For patches that exchange no light.
    pub fn none(patches: &Patches) -> Self {
        let count = patches.list.len();
        let areas = patches.list.iter().map(|patch| patch.area).collect();
        let (open, sky) = (vec![1.0; count], vec![0.0; count]);
        Self { starts: vec![0; count + 1], areas, open, sky, ..Self::default() }
    }

    /// The matrix from the counts of all patches. `areas` are the patches' whole areas.
    fn new(counts: &[Counts], areas: Vec<f32>, stop: &CancelToken) -> Self {
        let mut factors = pool(counts, areas, stop);
        factors.open = counts.iter().map(Counts::open).collect();
        let sky = |counts: &Counts| counts.missed as f32 / (counts.count - counts.inside).max(1) as f32;
        factors.sky = counts.iter().map(sky).collect();
        for (area, open) in factors.areas.iter_mut().zip(&factors.open) {
            // A patch wholly inside other geometry exchanges nothing; this only keeps its area, which sums are divided
            // by, from being 0.
            *area *= open.max(1e-3);
        }
        let row_sums: Vec<f64> = counts
            .iter()
            .map(|counts| {
                let hits: f64 = counts.hits.iter().map(|&(_, n)| f64::from(n)).sum();
                hits / f64::from((counts.count - counts.inside).max(1))
            })
            .collect();
        factors.scale_rows(&row_sums);
        factors
    }

    /// Appends a row: pairs of a patch, ascending, and the exchange area.
    pub fn push_row(&mut self, row: Vec<(PatchIndex, f32)>) {
        let (columns, exchange): (Vec<PatchIndex>, Vec<f32>) = row.into_iter().unzip();
        self.columns.extend(columns);
        self.exchange.extend(exchange);
        self.starts.push(self.columns.len());
    }

    /// The entries of row i: (j, G_ij).
    pub fn row(&self, i: PatchIndex) -> impl Iterator<Item = (PatchIndex, f64)> + '_ {
        let range = self.row_range(i);
        let columns = self.columns[range.clone()].iter();
        columns.zip(&self.exchange[range]).map(|(&j, &g)| (j, f64::from(g)))
    }

    /// Where the entries of row i are in `columns` and `exchange`.
    fn row_range(&self, i: PatchIndex) -> Range<usize> {
        self.starts[i.place()]..self.starts[i.place() + 1]
    }

    /// Number of patches.
    pub fn len(&self) -> usize {
        self.areas.len()
    }

    /// Sum over j of F_ij.
    pub fn row_sum(&self, i: PatchIndex) -> f64 {
        self.row(i).map(|(_, g)| g).sum::<f64>() / f64::from(self.areas[i.place()])
    }

    /// Scales symmetrically, d_i G_ij d_j, towards the given row sums (Sinkhorn and Knopp); then cuts rows that still
    /// sum to more than 1.
    fn scale_rows(&mut self, targets: &[f64]) {
        // The square root of the correction keeps the alternation from overshooting. Pooled counts are off by some per
        // cent, and each round halves what is left of that.
        const ROUNDS: usize = 12;
        let mut scale = vec![1.0f64; self.len()];
        for _ in 0..ROUNDS {
            if self.stop.is_cancelled() {
                break;
            }
            let next: Vec<f64> = (0..self.len())
                .into_par_iter()
                .map(|i| {
                    let entries = self.row(PatchIndex::new(i));
                    let sum = entries.map(|(j, g)| g * scale[j.place()]).sum::<f64>() * scale[i];
                    let target = targets[i] * f64::from(self.areas[i]);
                    // A patch that sees patches which do not see it cannot reach its sum: bounded steps keep its
                    // estimate within a factor.
                    if sum > 0.0 && targets[i] > 0.0 {
                        scale[i] * (target / sum).sqrt().clamp(0.5, 2.0)
                    } else {
                        scale[i]
                    }
                })
                .collect();
            scale = next;
        }
        let scale: Vec<f64> = scale.iter().map(|s| s.clamp(0.25, 4.0)).collect();
        self.multiply(|i, j| scale[i.place()] * scale[j.place()]);
        let before = self.total();
        let cut: Vec<f64> = PatchIndex::all(self.len()).map(|i| 1.0 / self.row_sum(i).max(1.0)).collect();
        self.multiply(|i, j| cut[i.place()].min(cut[j.place()]));
        self.energy_lost = if before > 0.0 { 1.0 - self.total() / before } else { 0.0 };
    }

    /// The sum of all entries.
    fn total(&self) -> f64 {
        self.exchange.iter().map(|&g| f64::from(g)).sum()
    }

    /// Multiplies each entry by a factor that depends on its row and column.
    fn multiply(&mut self, factor: impl Fn(PatchIndex, PatchIndex) -> f64) {
        for i in PatchIndex::all(self.len()) {
            if self.stop.is_cancelled() {
                break;
            }
            for k in self.row_range(i) {
                self.exchange[k] = (f64::from(self.exchange[k]) * factor(i, self.columns[k])) as f32;
            }
        }
    }
}

/// Estimates exchange areas from the counts of both directions of each pair, with R_i rays from patch i: N_ij has mean
/// R_i G/A_i, N_ji has mean R_j G/A_j. The best estimate of G from two Poisson counts is their sum over the sum of
/// their rates. (A line counts in both directions, which gives the same weights.)
fn pool(counts: &[Counts], areas: Vec<f32>, stop: &CancelToken) -> FormFactors {
    let incoming = Incoming::new(counts, stop);
    let rates: Vec<f64> =
        counts.iter().zip(&areas).map(|(counts, &area)| f64::from(counts.count) / f64::from(area)).collect();
    let row = |i: PatchIndex| -> Vec<(PatchIndex, f32)> {
        if stop.is_cancelled() {
            return Vec::new();
        }
        let entry =
            |(j, n): (PatchIndex, u32)| (j, (f64::from(n) / (rates[i.place()] + rates[j.place()])) as f32);
        merged(&counts[i.place()].hits, incoming.row(i)).into_iter().map(entry).collect()
    };
    let mut factors = FormFactors { starts: vec![0], stop: stop.clone(), areas, ..FormFactors::default() };
    // In batches, so that only one batch of rows is in memory twice.
    for first in (0..counts.len()).step_by(ROW_BATCH) {
        let places = first..(first + ROW_BATCH).min(counts.len());
        let rows: Vec<_> = places.into_par_iter().map(|i| row(PatchIndex::new(i))).collect();
        rows.into_iter().for_each(|row| factors.push_row(row));
    }
    factors
}

/// Rows that are computed in parallel before they are appended to the matrix.
const ROW_BATCH: usize = 4096;

/// The transposed counts. Row i lists the patches whose rays hit patch i, ascending, with the numbers of hits.
struct Incoming {
    starts: Vec<usize>,
    list: Vec<(PatchIndex, u32)>,
}

impl Incoming {
    fn new(counts: &[Counts], stop: &CancelToken) -> Self {
        let mut starts = vec![0usize; counts.len() + 1];
        for &(hit, _) in counts.iter().flat_map(|counts| &counts.hits) {
            starts[hit.place() + 1] += 1;
        }
        for place in 1..starts.len() {
            starts[place] += starts[place - 1];
        }
        let mut next = starts.clone();
        let mut list = vec![(PatchIndex(0), 0); starts.last().copied().unwrap_or(0)];
        for (i, from_i) in PatchIndex::all(counts.len()).zip(counts).take_while(|_| !stop.is_cancelled()) {
            for &(hit, n) in &from_i.hits {
                list[next[hit.place()]] = (i, n);
                next[hit.place()] += 1;
            }
        }
        Self { starts, list }
    }

    fn row(&self, i: PatchIndex) -> &[(PatchIndex, u32)] {
        &self.list[self.starts[i.place()]..self.starts[i.place() + 1]]
    }
}
