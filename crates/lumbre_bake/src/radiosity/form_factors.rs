//! Form factors by Monte Carlo, visibility included: what rays or lines have counted between patches becomes one exchange area
//! G_ij = A_i F_ij = A_j F_ji per pair, so reciprocity is exact. Then rows are scaled to the share of rays that met a surface, which is the exact row sum's own estimate (1 in a closed scene).
//! Not the counting (`cosine_rays`, `global_lines`), nor the solution of the system they make.

use crate::radiosity::ray_counts::{Counts, PatchRayCounts, merged};
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

/// The symmetric matrix of exchange areas, row by row, sparse.
#[derive(Clone, Debug, Default)]
pub(crate) struct FormFactors {
    /// Row i is `starts[i]..starts[i + 1]` of the other two.
    pub starts: Vec<usize>,
    pub columns: Vec<PatchIndex>,
    /// G_ij, square canonical units.
    pub exchange: Vec<f32>,
    /// A_i: the area in the open, not inside other geometry.
    pub areas: Vec<f32>,
    /// Share of each patch that is in the open, in [0, 1].
    pub open: Vec<f32>,
    /// Share of the rays from the open that meet nothing, in [0, 1]: the sky's form factor.
    pub sky: Vec<f32>,
    /// Rays and lines cast.
    pub rays: u64,
    /// Share of all exchange that was cut so that no row exceeds 1.
    pub energy_lost: f64,
    /// Whether nobody waits for what is solved with it any more.
    pub stop: CancelToken,
}

impl FormFactors {
    /// By about `rays` rays or lines. Beside the estimate from all of them come those of two halves: half their difference is the
    /// standard error of the whole.
    ///
    /// # Errors
    /// [`BakeError::Cancelled`].
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
        monitor.run_interruptible(1.0, || Self::of_counts(scene, patches, &cast, rays))
    }

    fn of_counts(
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
        .map(|of| cast.par_iter().map(of).collect::<Vec<Counts>>());
        let areas = || patches.list.iter().map(|patch| patch.area).collect();
        let pooled = |counts: &[Counts]| Self::pooled(counts, areas(), &scene.stop);
        let ((even, odd), mut whole) =
            rayon::join(|| rayon::join(|| pooled(&even), || pooled(&odd)), || pooled(&whole));
        whole.rays = rays;
        (whole, [even, odd])
    }

    /// Of patches that exchange nothing.
    pub fn none(patches: &Patches) -> Self {
        let count = patches.list.len();
        let areas = patches.list.iter().map(|patch| patch.area).collect();
        let (open, sky) = (vec![1.0; count], vec![0.0; count]);
        Self { starts: vec![0; count + 1], areas, open, sky, ..Self::default() }
    }

    /// The matrix of some of the rays.
    fn pooled(counts: &[Counts], areas: Vec<f32>, stop: &CancelToken) -> Self {
        let mut factors = pool(counts, areas, stop);
        factors.open = counts.iter().map(Counts::open).collect();
        let sky = |own: &Counts| own.missed as f32 / (own.count - own.inside).max(1) as f32;
        factors.sky = counts.iter().map(sky).collect();
        for (area, open) in factors.areas.iter_mut().zip(&factors.open) {
            // A patch wholly inside exchanges nothing; its area only divides that nothing.
            *area *= open.max(1e-3);
        }
        let row_sums: Vec<f64> = counts
            .iter()
            .map(|own| {
                let hits: f64 = own.hits.iter().map(|&(_, n)| f64::from(n)).sum();
                hits / f64::from((own.count - own.inside).max(1))
            })
            .collect();
        factors.scale_rows(&row_sums);
        factors
    }

    /// The entries of row i: (j, G_ij).
    pub fn row(&self, i: PatchIndex) -> impl Iterator<Item = (PatchIndex, f64)> + '_ {
        let range = self.places(i);
        let columns = self.columns[range.clone()].iter();
        columns.zip(&self.exchange[range]).map(|(&j, &g)| (j, f64::from(g)))
    }

    /// Where the entries of row i are.
    fn places(&self, i: PatchIndex) -> Range<usize> {
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

    /// Symmetric scaling d_i G_ij d_j towards the given row sums (Sinkhorn and Knopp); then what still exceeds 1 is cut.
    fn scale_rows(&mut self, targets: &[f64]) {
        // The square root of the correction keeps the alternation from overshooting; pooling leaves some per cent,
        // and each round halves what is left.
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
                    // A patch that sees what does not see it keeps its own estimate within a factor.
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
        let over: Vec<f64> = PatchIndex::all(self.len()).map(|i| 1.0 / self.row_sum(i).max(1.0)).collect();
        self.multiply(|i, j| over[i.place()].min(over[j.place()]));
        self.energy_lost = if before > 0.0 { 1.0 - self.total() / before } else { 0.0 };
    }

    fn total(&self) -> f64 {
        self.exchange.iter().map(|&g| f64::from(g)).sum()
    }

    /// By a factor of an entry's row and column.
    fn multiply(&mut self, factor: impl Fn(PatchIndex, PatchIndex) -> f64) {
        for i in PatchIndex::all(self.len()) {
            if self.stop.is_cancelled() {
                break;
            }
            for k in self.places(i) {
                self.exchange[k] = (f64::from(self.exchange[k]) * factor(i, self.columns[k])) as f32;
            }
        }
    }
}

/// Both directions of a pair count the same flux: N_ij has mean R_i G/A_i, N_ji has mean R_j G/A_j. The best estimate of
/// G from two Poisson counts is their sum over the sum of their rates. (A line counts in both directions, which weighs the same.)
fn pool(counts: &[Counts], areas: Vec<f32>, stop: &CancelToken) -> FormFactors {
    let incoming = Incoming::new(counts, stop);
    let rates: Vec<f64> =
        counts.iter().zip(&areas).map(|(own, &area)| f64::from(own.count) / f64::from(area)).collect();
    let row = |i: PatchIndex| -> Vec<(PatchIndex, f32)> {
        if stop.is_cancelled() {
            return Vec::new();
        }
        let entry =
            |(j, n): (PatchIndex, u32)| (j, (f64::from(n) / (rates[i.place()] + rates[j.place()])) as f32);
        merged(&counts[i.place()].hits, incoming.row(i)).into_iter().map(entry).collect()
    };
    let mut factors = FormFactors { starts: vec![0], stop: stop.clone(), areas, ..FormFactors::default() };
    // Some rows at a time, so that they are not all there twice.
    for first in (0..counts.len()).step_by(ROWS) {
        let places = first..(first + ROWS).min(counts.len());
        let rows: Vec<_> = places.into_par_iter().map(|i| row(PatchIndex::new(i))).collect();
        for row in rows {
            factors.columns.extend(row.iter().map(|entry| entry.0));
            factors.exchange.extend(row.iter().map(|entry| entry.1));
            factors.starts.push(factors.columns.len());
        }
    }
    factors
}

/// Rows that are made side by side.
const ROWS: usize = 4096;

/// The counts by who was hit: (who has met it, how often), ascending.
struct Incoming {
    starts: Vec<usize>,
    list: Vec<(PatchIndex, u32)>,
}

impl Incoming {
    fn new(counts: &[Counts], stop: &CancelToken) -> Self {
        let mut starts = vec![0usize; counts.len() + 1];
        for &(hit, _) in counts.iter().flat_map(|own| &own.hits) {
            starts[hit.place() + 1] += 1;
        }
        for place in 1..starts.len() {
            starts[place] += starts[place - 1];
        }
        let mut next = starts.clone();
        let mut list = vec![(PatchIndex(0), 0); starts.last().copied().unwrap_or(0)];
        for (i, own) in PatchIndex::all(counts.len()).zip(counts).take_while(|_| !stop.is_cancelled()) {
            for &(hit, n) in &own.hits {
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
