//! Pairs of patches that share an edge, or lie nearer than about a patch's side, and that nothing stands between: their exchange is a
//! contour integral, exact where counts are noisy and the kernel singular. Not the integral: that is `contour`.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::contour::exchange_area;
use super::form_factors::{Cast, FormFactors};
use super::patch_index::PatchIndex;
use super::patches::{Patch, Patches};
use crate::sampling::{Sequence, Stream, triangle_point};
use crate::scene::BakeScene;

/// Exact exchange areas, row by row.
#[derive(Clone, Debug, Default)]
pub(crate) struct NearPairs {
    rows: Vec<Vec<(PatchIndex, f32)>>,
}

impl NearPairs {
    /// The entries of row i, ascending: (j, G_ij).
    pub fn row(&self, i: PatchIndex) -> &[(PatchIndex, f32)] {
        self.rows.get(i.place()).map_or(&[], Vec::as_slice)
    }

    /// Pairs, each counted once.
    pub fn count(&self) -> usize {
        self.rows.iter().map(Vec::len).sum::<usize>() / 2
    }
}

/// Fewest rays that a pair is expected to have between it. So the chance is small that one has none, is not known to see each other, and
/// keeps its zero while others of its kind have the exact value.
const LEAST_EXPECTED: f64 = 6.0;
/// Rays for all form factors that take ten times as long as one pair's integral and visibility, about.
const RAYS_FOR_A_PAIR: u64 = 128;
/// Rays that decide whether anything stands between a pair; and how many standard errors fewer counts than expected mean that something does.
const SIGHT_LINES: u32 = 8;
const DOUBT: f64 = 4.0;
/// Of a patch's size, how far another's corner may lie behind its plane: the rounding of f32 coordinates.
const BEHIND: f64 = 1e-5;

/// A patch's shape.
struct Shape {
    corners: [DVec3; 3],
    center: Vec3,
    normal: Vec3,
    /// Farthest corner from the centre.
    reach: f32,
    area: f32,
    /// Rays for each unit of area; 0 where some of them began inside other geometry, which then stands between.
    rate: f64,
}

/// The near pairs among those that exchange light by `factors`, which count what `cast` has counted.
pub(crate) fn near_pairs(
    scene: &BakeScene,
    patches: &Patches,
    factors: &FormFactors,
    cast: &[Cast],
    seed: u32,
) -> NearPairs {
    let shapes: Vec<Shape> =
        cast.par_iter().zip(&patches.list).map(|(cast, patch)| shape(scene, patches, patch, cast)).collect();
    let rays: u64 = cast.iter().flat_map(|cast| cast.count).map(u64::from).sum();
    // (about how many rays, i, j, those that were counted).
    let mut candidates: Vec<(f64, PatchIndex, PatchIndex, f64)> = (0..cast.len())
        .into_par_iter()
        .flat_map_iter(|i| {
            let (i, shapes) = (PatchIndex::new(i), &shapes);
            let one = &shapes[i.place()];
            let later = factors.row(i).filter(move |&(j, _)| j > i && one.rate > 0.0);
            later.filter_map(move |(j, g)| {
                let two = &shapes[j.place()];
                let rate = one.rate + two.rate;
                let about = about(one, two)? * rate;
                (about > 0.5 * LEAST_EXPECTED).then_some((about, i, j, g * rate))
            })
        })
        .collect();
    // By geometry alone, not by counts: those that chance has left few must not be left so more often.
    candidates.sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then((a.1, a.2).cmp(&(b.1, b.2))));
    candidates.truncate((rays / RAYS_FOR_A_PAIR) as usize);
    let exact: Vec<(PatchIndex, PatchIndex, f32)> = candidates
        .into_par_iter()
        .filter_map(|(_, i, j, found)| {
            if scene.stop.is_cancelled() {
                return None;
            }
            let (one, two) = (&shapes[i.place()], &shapes[j.place()]);
            let exchange = exchange_area(&one.corners, &two.corners);
            let expected = exchange * (one.rate + two.rate);
            let seen = exchange.is_finite()
                && expected >= LEAST_EXPECTED
                && exchange < f64::from(one.area.min(two.area))
                && found > expected - DOUBT * expected.sqrt()
                && nothing_between(scene, patches, (i, j), seed);
            seen.then_some((i, j, exchange as f32))
        })
        .collect();
    let mut rows = vec![Vec::new(); cast.len()];
    for (i, j, g) in exact {
        rows[i.place()].push((j, g));
        rows[j.place()].push((i, g));
    }
    rows.par_iter_mut().for_each(|row| row.sort_unstable_by_key(|&(j, _)| j));
    NearPairs { rows }
}

fn shape(scene: &BakeScene, patches: &Patches, patch: &Patch, cast: &Cast) -> Shape {
    let mut corners = patches.corners(scene, patch);
    let normal = scene.triangles[patch.triangle as usize].side_normal(patch.side);
    if (corners[1] - corners[0]).cross(corners[2] - corners[0]).dot(normal) < 0.0 {
        corners.swap(1, 2);
    }
    let center = corners.iter().sum::<Vec3>() / 3.0;
    let reach = corners.iter().map(|&corner| (corner - center).length()).fold(0.0, f32::max);
    let open = cast.inside == [0; 2];
    let rate = if open { f64::from(cast.count.iter().sum::<u32>()) / f64::from(patch.area) } else { 0.0 };
    Shape { corners: corners.map(|corner| corner.as_dvec3()), center, normal, reach, area: patch.area, rate }
}

/// What two patches exchange, by their centres, if they are near and wholly before each other.
fn about(one: &Shape, two: &Shape) -> Option<f64> {
    let apart = two.center - one.center;
    let square = apart.length_squared();
    let near = one.reach + two.reach + one.area.min(two.area).sqrt();
    if two.rate == 0.0 || square > near * near {
        return None;
    }
    let before = |plane: &Shape, other: &Shape| {
        let normal = plane.normal.as_dvec3();
        let behind = -BEHIND * f64::from(plane.reach.max(other.reach));
        other.corners.iter().all(|&corner| (corner - plane.corners[0]).dot(normal) >= behind)
    };
    if !before(one, two) || !before(two, one) {
        return None;
    }
    let cosines = f64::from(apart.dot(one.normal) * -apart.dot(two.normal)) / f64::from(square);
    let areas = f64::from(one.area) * f64::from(two.area);
    let kernel = cosines / (std::f64::consts::PI * f64::from(square) + f64::from(one.area.max(two.area)));
    Some(areas * kernel)
}

/// Whether all of some lines between points spread over both patches are free.
fn nothing_between(
    scene: &BakeScene,
    patches: &Patches,
    (i, j): (PatchIndex, PatchIndex),
    seed: u32,
) -> bool {
    let sequence = Sequence::new(seed, Stream::NearPairs, i.0).of(j.0);
    (0..SIGHT_LINES).all(|line| {
        let [a, b, c, d] = sequence.point(line, 0);
        let [from, to] = [(i, a, b), (j, c, d)].map(|(index, x, y)| {
            let patch = &patches.list[index.place()];
            let (u, v) = patches.point(patch, triangle_point(x, y));
            let position = scene.triangles[patch.triangle as usize].position(u, v);
            scene.off_surface(patch.triangle, patch.side, position)
        });
        !scene.blocked(from, to)
    })
}
