//! Form factors by Monte Carlo: cosine rays from every patch, visibility included. The two estimates of a pair are
//! pooled into one exchange area G_ij = A_i F_ij = A_j F_ji, so reciprocity is exact; then rows are scaled to the share
//! of rays that met a surface, which is the exact row sum's own estimate (1 in a closed scene).
//! Not the solution of the system they make.

use rayon::prelude::*;

use super::patches::Patches;
use crate::BakeError;
use crate::progress::Watch;
use crate::sampling::{Sequence, cosine_about, triangle_point};
use crate::scene::{BakeScene, SurfaceHit};
use crate::texels::chunks::in_chunks;

/// The symmetric matrix of exchange areas, row by row, sparse.
#[derive(Clone, Debug, Default)]
pub(crate) struct FormFactors {
    /// Row i is `starts[i]..starts[i + 1]` of the other two.
    pub starts: Vec<usize>,
    pub columns: Vec<u32>,
    /// G_ij, square canonical units.
    pub exchange: Vec<f32>,
    /// A_i: the area in the open, not inside other geometry.
    pub areas: Vec<f32>,
    /// Share of each patch that is in the open, in [0, 1].
    pub open: Vec<f32>,
    /// Share of the rays from the open that meet nothing, in [0, 1]: the sky's form factor.
    pub sky: Vec<f32>,
    /// Rays cast.
    pub rays: u64,
    /// Share of all exchange that was cut so that no row exceeds 1.
    pub energy_lost: f64,
}

/// Least and most rays of a patch. The sequence has 65,536 points.
const RAYS: (f64, f64) = (32.0, 65_536.0);

impl FormFactors {
    /// Casts about `rays` rays, in proportion to the patches' areas. Beside the estimate from all rays come those of the even and of
    /// the odd ones: half their difference is the standard error of the whole.
    ///
    /// # Errors
    /// [`BakeError::Cancelled`].
    pub fn sample(
        scene: &BakeScene,
        patches: &Patches,
        rays: usize,
        seed: u32,
        watch: &mut Watch<'_>,
    ) -> Result<(Self, [Self; 2]), BakeError> {
        let total: f64 = patches.list.iter().map(|patch| f64::from(patch.area)).sum();
        let counts: Vec<u32> = patches
            .list
            .iter()
            .map(|patch| (rays as f64 * f64::from(patch.area) / total).round().clamp(RAYS.0, RAYS.1) as u32)
            .collect();
        let clock = watch.clock();
        let cast = in_chunks(patches.list.len(), watch, |index| {
            let count = if clock.late() { RAYS.0 as u32 } else { counts[index] };
            cast(scene, patches, index as u32, count, seed)
        })?;
        let counts: Vec<u32> = cast.iter().map(|cast| cast.count).collect();
        let whole = Self::pooled(&cast, patches, &counts, |cast| {
            (cast.whole(), [cast.inside[0] + cast.inside[1], cast.missed[0] + cast.missed[1]])
        });
        let halves = [0, 1].map(|half| {
            // Of an odd number of rays the even ones are one more.
            let counts: Vec<u32> = counts.iter().map(|&count| (count + 1 - half as u32) / 2).collect();
            Self::pooled(&cast, patches, &counts, |cast| {
                (cast.met[half].clone(), [cast.inside[half], cast.missed[half]])
            })
        });
        Ok((whole, halves))
    }

    /// Of patches that exchange nothing.
    pub fn none(patches: &Patches) -> Self {
        let count = patches.list.len();
        let areas = patches.list.iter().map(|patch| patch.area).collect();
        let (open, sky) = (vec![1.0; count], vec![0.0; count]);
        Self { starts: vec![0; count + 1], areas, open, sky, ..Self::default() }
    }

    /// The matrix of some of the rays: of each patch those that `of` picks, `counts` altogether.
    fn pooled(
        cast: &[Cast],
        patches: &Patches,
        counts: &[u32],
        of: impl Fn(&Cast) -> (Vec<(u32, u32)>, [u32; 2]),
    ) -> Self {
        let (hits, others): (Vec<_>, Vec<[u32; 2]>) = cast.iter().map(of).unzip();
        let (inside, missed): (Vec<u32>, Vec<u32>) = others.into_iter().map(<(u32, u32)>::from).unzip();
        let areas: Vec<f32> = patches.list.iter().map(|patch| patch.area).collect();
        let mut factors = pool(&hits, counts, areas);
        factors.open =
            counts.iter().zip(&inside).map(|(&n, &inside)| (n - inside) as f32 / n.max(1) as f32).collect();
        let open_rays = counts.iter().zip(&inside).map(|(&n, &inside)| (n - inside).max(1));
        factors.sky =
            missed.iter().zip(open_rays).map(|(&missed, open)| missed as f32 / open as f32).collect();
        for (area, open) in factors.areas.iter_mut().zip(&factors.open) {
            // A patch wholly inside exchanges nothing; its area only divides that nothing.
            *area *= open.max(1e-3);
        }
        factors.rays = counts.iter().map(|&count| u64::from(count)).sum();
        let row_sums: Vec<f64> = hits
            .iter()
            .zip(counts.iter().zip(&inside))
            .map(|(row, (&count, &inside))| {
                let met: f64 = row.iter().map(|&(_, n)| f64::from(n)).sum();
                met / f64::from((count - inside).max(1))
            })
            .collect();
        factors.scale_rows(&row_sums);
        factors
    }

    /// The entries of row i: (j, G_ij).
    pub fn row(&self, i: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
        let range = self.starts[i]..self.starts[i + 1];
        let columns = self.columns[range.clone()].iter();
        columns.zip(&self.exchange[range]).map(|(&j, &g)| (j as usize, f64::from(g)))
    }

    /// Number of patches.
    pub fn len(&self) -> usize {
        self.areas.len()
    }

    /// Sum over j of F_ij.
    pub fn row_sum(&self, i: usize) -> f64 {
        self.row(i).map(|(_, g)| g).sum::<f64>() / f64::from(self.areas[i])
    }

    /// Symmetric scaling d_i G_ij d_j towards the given row sums (Sinkhorn and Knopp), then what still exceeds 1 is cut.
    fn scale_rows(&mut self, targets: &[f64]) {
        // The square root of the correction keeps the alternation from overshooting; pooling leaves some per cent,
        // and each round halves what is left.
        const ROUNDS: usize = 12;
        let mut scale = vec![1.0f64; self.len()];
        for _ in 0..ROUNDS {
            let next: Vec<f64> = (0..self.len())
                .into_par_iter()
                .map(|i| {
                    let sum: f64 = self.row(i).map(|(j, g)| g * scale[j]).sum::<f64>() * scale[i];
                    let target = targets[i] * f64::from(self.areas[i]);
                    // A patch that sees what does not see it keeps its own estimate within a factor.
                    if sum > 0.0 && target > 0.0 {
                        scale[i] * (target / sum).sqrt().clamp(0.5, 2.0)
                    } else {
                        scale[i]
                    }
                })
                .collect();
            scale = next;
        }
        let scale: Vec<f64> = scale.iter().map(|s| s.clamp(0.25, 4.0)).collect();
        self.multiply(|i, j| scale[i] * scale[j]);
        let over: Vec<f64> = (0..self.len()).map(|i| 1.0 / self.row_sum(i).max(1.0)).collect();
        let before: f64 = self.exchange.iter().map(|&g| f64::from(g)).sum();
        self.multiply(|i, j| over[i].min(over[j]));
        let after: f64 = self.exchange.iter().map(|&g| f64::from(g)).sum();
        self.energy_lost = if before > 0.0 { 1.0 - after / before } else { 0.0 };
    }

    fn multiply(&mut self, factor: impl Fn(usize, usize) -> f64) {
        for i in 0..self.areas.len() {
            for k in self.starts[i]..self.starts[i + 1] {
                self.exchange[k] = (f64::from(self.exchange[k]) * factor(i, self.columns[k] as usize)) as f32;
            }
        }
    }
}

/// Rays of one patch, the even and the odd ones: how many met each other patch, by index, began inside other geometry, met nothing.
pub(crate) struct Cast {
    pub met: [Vec<(u32, u32)>; 2],
    pub inside: [u32; 2],
    pub missed: [u32; 2],
    /// How many they were.
    pub count: u32,
}

impl Cast {
    /// Both halves together.
    fn whole(&self) -> Vec<(u32, u32)> {
        let [even, odd] = &self.met;
        let mut both = [even.as_slice(), odd].concat();
        both.sort_unstable();
        both.dedup_by(|next, kept| {
            let same = next.0 == kept.0;
            kept.1 += if same { next.1 } else { 0 };
            same
        });
        both
    }
}

fn cast(scene: &BakeScene, patches: &Patches, index: u32, count: u32, seed: u32) -> Cast {
    let patch = &patches.list[index as usize];
    let triangle = &scene.triangles[patch.triangle as usize];
    let normal = triangle.side_normal(patch.side);
    let [p, q, r] = patches.corners(scene, patch);
    let sequence = Sequence::new(seed, 1, index);
    let mut met = [Vec::with_capacity(count as usize / 2 + 1), Vec::with_capacity(count as usize / 2)];
    let (mut inside, mut missed) = ([0; 2], [0; 2]);
    for ray in 0..count {
        let half = ray as usize % 2;
        let [a, b, c, d] = sequence.point(ray, 0);
        let (u, v) = triangle_point(a, b);
        let position = p + (q - p) * u + (r - p) * v;
        let origin = scene.off_surface(patch.triangle, patch.side, position);
        match scene.first_hit(origin, cosine_about(normal, c, d)) {
            SurfaceHit::Lit { triangle, side, at, .. } => {
                met[half].extend(patches.at(triangle, side, at).filter(|&other| other != index));
            }
            SurfaceHit::Inside => inside[half] += 1,
            SurfaceHit::None => missed[half] += 1,
            SurfaceHit::Back => {}
        }
    }
    Cast { met: met.map(counted), inside, missed, count }
}

/// How often each number occurs, in order.
fn counted(mut numbers: Vec<u32>) -> Vec<(u32, u32)> {
    numbers.sort_unstable();
    let mut row: Vec<(u32, u32)> = Vec::new();
    for number in numbers {
        match row.last_mut() {
            Some((last, n)) if *last == number => *n += 1,
            _ => row.push((number, 1)),
        }
    }
    row
}

/// Both directions of a pair count the same flux: N_ij has mean R_i G/A_i, N_ji has mean R_j G/A_j. The best estimate of
/// G from two Poisson counts is their sum over the sum of their rates.
fn pool(hits: &[Vec<(u32, u32)>], counts: &[u32], areas: Vec<f32>) -> FormFactors {
    let mut incoming: Vec<Vec<(u32, u32)>> = vec![Vec::new(); hits.len()];
    for (i, row) in hits.iter().enumerate() {
        for &(j, n) in row {
            incoming[j as usize].push((i as u32, n));
        }
    }
    let rate = |i: usize| f64::from(counts[i]) / f64::from(areas[i]);
    let mut factors = FormFactors { starts: vec![0], ..FormFactors::default() };
    for (i, (out, into)) in hits.iter().zip(&incoming).enumerate() {
        let (mut x, mut y) = (out.iter().peekable(), into.iter().peekable());
        loop {
            let (j, n) = match (x.peek(), y.peek()) {
                (Some(&&(a, n)), Some(&&(b, m))) if a == b => {
                    x.next();
                    y.next();
                    (a, n + m)
                }
                (Some(&&(a, n)), other) if other.is_none_or(|&&(b, _)| a < b) => {
                    x.next();
                    (a, n)
                }
                (_, Some(&&(b, m))) => {
                    y.next();
                    (b, m)
                }
                _ => break,
            };
            factors.columns.push(j);
            factors.exchange.push((f64::from(n) / (rate(i) + rate(j as usize))) as f32);
        }
        factors.starts.push(factors.columns.len());
    }
    factors.areas = areas;
    factors
}
