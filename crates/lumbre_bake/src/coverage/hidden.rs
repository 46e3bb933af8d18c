//! Texels that lie, wholly or in part, inside other geometry or pressed against it: told by rays that meet the insides of things, or
//! meet something at once. The hidden part is taken out of the footprint, so that a texel half under a box has the light of its open half.
//! What a texel shows belongs to the map and not to the light: it is the same for every seed, as long as there is time to look closely.

use glam::Vec2;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::footprint::{FINE, Footprint, FootprintPoint, Texel, footprint, receiver};
use super::tiles::{Tiles, area, positions_of};
use crate::BakeError;
use crate::chunks::in_chunks;
use crate::monitor::{BakeMonitor, Clock};
use crate::sampling::{Sequence, Stream, cosine_about};
use crate::scene::{BakeScene, LightmapLayout, SurfaceHit};
use crate::texel_index::MapTexel;
use crate::visibility::shaft::is_free_before;

/// Seed of all rays here.
const SEED: u32 = 0;
/// A point from which no ray comes further than this share of its texel's side, or of its triangle's, lies against something: faces
/// that touch are apart by what their corners are rounded by, and no light is seen in between.
const PRESSED: f32 = 1.0 / 64.0;

/// Rays that look for something odd in every texel, and in a tile that nothing crosses, and those that judge a point of an odd one.
const PROBES: u32 = 6;
const TILE_PROBES: u32 = 16;
/// Those of a texel when it has to go fast.
const LATE_PROBES: u32 = 2;
const JUDGES: u32 = 8;
/// So many of those that judge have to see something: where faces touch, one may slip out along them.
const CLEAR: u32 = 2;

/// Of the time until the running stage takes no more samples, what may pass before texels are judged roughly: light wants some of it, too.
const CLOSELY: f64 = 0.5;
/// So many texels are looked at as closely as ever, whatever time it takes: no small map loses anything.
const ALWAYS_CLOSELY: usize = 4096;
/// Of the running stage's time, what it usually takes to find texels that look odd, and of the rest, to judge them.
const PASSES: [f32; 2] = [0.1, 0.2];

/// Takes what is hidden out of the footprints; returns how many texels are hidden in part or whole, and the rays cast. Contact lines cross the
/// texels that are `crossed`, and divide those that are `touched`.
///
/// # Errors
/// [`BakeError::Cancelled`].
pub(crate) fn remove_hidden(
    scene: &BakeScene,
    layout: &LightmapLayout,
    texels: &mut [Texel],
    crossed: impl Iterator<Item = MapTexel>,
    touched: &[MapTexel],
    monitor: &mut BakeMonitor<'_>,
) -> Result<(usize, u64), BakeError> {
    let clock = monitor.clock().until(CLOSELY);
    let (odd, mut rays) = odd(scene, texels, clock, monitor)?;
    // Six rays may miss a corner of a texel; its neighbours' rays did not.
    let mut near = vec![false; layout.texels];
    touched.iter().for_each(|texel| near[texel.place()] = true);
    let mut mixed = vec![false; layout.texels];
    crossed.for_each(|texel| mixed[texel.place()] = true);
    for (texel, _) in texels.iter().zip(&odd).filter(|(_, odd)| **odd) {
        let map = &layout.maps[texel.object as usize];
        for y in texel.y.saturating_sub(1)..=(texel.y + 1).min(map.height - 1) {
            for x in texel.x.saturating_sub(1)..=(texel.x + 1).min(map.width - 1) {
                near[map.texel(x, y).place()] = true;
            }
        }
    }
    let mut suspects: Vec<&mut Texel> = texels.iter_mut().filter(|texel| near[texel.index.place()]).collect();
    monitor.pass(PASSES[1]);
    let judged = in_chunks(suspects.len(), monitor, |place| {
        let texel = &*suspects[place];
        if place >= ALWAYS_CLOSELY && clock.is_over() {
            judge_roughly(scene, texel)
        } else {
            judge(scene, texel, mixed[texel.index.place()])
        }
    })?;
    rays += judged.iter().map(|judged| u64::from(judged.rays)).sum::<u64>();
    let hidden = monitor.run_interruptible(1.0, || {
        let pairs = suspects.par_iter_mut().zip(&judged);
        pairs.map(|(texel, judged)| usize::from(keep_open(scene, texel, judged))).sum()
    })?;
    Ok((hidden, rays))
}

/// Rays that end before this go nowhere, canonical units.
fn pressed(scene: &BakeScene, texel: &Texel) -> f32 {
    let own = (2.0 * scene.triangles[texel.triangle as usize].area).sqrt();
    // The smaller one, and never NaN.
    PRESSED * own.min(texel.side(scene))
}

/// Texels that look odd, and the rays cast. Where nothing crosses the space before a tile, all of it is inside of something or none of it:
/// some rays of the whole tile tell.
fn odd(
    scene: &BakeScene,
    texels: &[Texel],
    clock: Clock,
    monitor: &mut BakeMonitor<'_>,
) -> Result<(Vec<bool>, u64), BakeError> {
    let tiles = Tiles::new(texels);
    let suspect = monitor.run_interruptible(0.0, || suspect(scene, texels, &tiles))?;
    let suspects = |place: usize| suspect[tiles.tile_of[place] as usize];
    monitor.pass(PASSES[0]);
    let odd = in_chunks(texels.len(), monitor, |place| {
        let probes = if place >= ALWAYS_CLOSELY && clock.is_over() { LATE_PROBES } else { PROBES };
        suspects(place) && looks_odd(scene, &texels[place], probes)
    })?;
    let asked = (0..texels.len()).filter(|&place| suspects(place)).count();
    let rays = tiles.members.len() as u64 * u64::from(TILE_PROBES) + asked as u64 * u64::from(PROBES);
    Ok((odd, rays))
}

/// Of each tile, whether its texels have to be looked at one by one.
fn suspect(scene: &BakeScene, texels: &[Texel], tiles: &Tiles) -> Vec<bool> {
    tiles
        .members
        .par_iter()
        .map(|members| {
            if scene.stop.is_cancelled() {
                return false;
            }
            let members: Vec<&Texel> = members.iter().map(|&place| &texels[place as usize]).collect();
            let mut positions = Vec::new();
            members.iter().for_each(|texel| positions_of(scene, texel, &mut positions));
            let free = members.first().and_then(|first| area(scene, first.triangle, &positions));
            let free = free.is_some_and(|area| is_free_before(&area, scene));
            let of_tile =
                (0..TILE_PROBES).map(|ray| members[ray as usize * members.len() / TILE_PROBES as usize]);
            let fine = |(ray, texel): (usize, &Texel)| probe(scene, texel, ray as u32) == Probe::Clear;
            !(free && of_tile.enumerate().all(fine))
        })
        .collect()
}

/// What a ray of a texel meets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Probe {
    Clear,
    /// Something at once.
    Pressed,
    /// The inside of something, or a back, or nothing where it is dark outside.
    Hidden,
}

fn probe(scene: &BakeScene, texel: &Texel, ray: u32) -> Probe {
    let [x, y, u, v] = Sequence::new(SEED, Stream::HiddenTexel, texel.index.0).point(ray, 0);
    let Some(point) = texel.point(scene, x, y) else { return Probe::Clear };
    let receiver = receiver(scene, &point);
    let direction = cosine_about(receiver.geometric_normal, u, v);
    match scene.classify_hit(receiver.origin, direction) {
        SurfaceHit::Inside | SurfaceHit::Back => Probe::Hidden,
        SurfaceHit::Lit { distance, .. } if distance < pressed(scene, texel) => Probe::Pressed,
        SurfaceHit::Lit { .. } | SurfaceHit::None => Probe::Clear,
    }
}

fn looks_odd(scene: &BakeScene, texel: &Texel, probes: u32) -> bool {
    let mut ended = 0;
    (0..probes).any(|ray| match probe(scene, texel, ray) {
        Probe::Hidden => true,
        // One may end so in any corner.
        Probe::Pressed => {
            ended += 1;
            ended > 1
        }
        Probe::Clear => false,
    })
}

/// What was found out about a texel.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
struct Judged {
    /// Whether each of the points of its fine footprint is in the open, bit by bit; empty where all are.
    open: Vec<u64>,
    rays: u32,
}

/// The evenly spread points of a texel that are judged, the same ones each time.
fn fine_points(scene: &BakeScene, texel: &Texel) -> Option<Vec<FootprintPoint>> {
    let mut triangles: Vec<u32> = match &texel.footprint {
        Footprint::Whole(triangle) => vec![*triangle],
        Footprint::Points(points) => points.iter().map(|point| point.triangle).collect(),
        Footprint::Hidden => return None,
    };
    triangles.sort_unstable();
    triangles.dedup();
    match footprint(scene, triangles.into_iter(), texel.x, texel.y, FINE) {
        Some(Footprint::Points(points)) => Some(points),
        _ => None,
    }
}

/// Which points of a texel are in the open. Between contact lines a surface is hidden or is not: in a texel that is not `mixed`, having none,
/// the corners and the middle tell for all, if they agree.
fn judge(scene: &BakeScene, texel: &Texel, mixed: bool) -> Judged {
    let Some(points) = fine_points(scene, texel) else { return Judged::default() };
    let sequence = Sequence::new(SEED, Stream::HiddenView, texel.index.0);
    let pressed = pressed(scene, texel);
    let mut rays = 0;
    let mut is_open = |index: usize| {
        let (is_open, cast) = in_the_open(scene, &points[index], sequence, index as u32, pressed);
        rays += cast;
        is_open
    };
    let telling = if mixed { Vec::new() } else { corners_and_middle(&points) };
    let told: Vec<bool> = telling.into_iter().map(&mut is_open).collect();
    let agreed = told.first().copied().filter(|first| told.iter().all(|told| told == first));
    let mut open = vec![0u64; points.len().div_ceil(64)];
    let mut all = true;
    for index in 0..points.len() {
        if agreed.unwrap_or_else(|| is_open(index)) {
            open[index / 64] |= 1 << (index % 64);
        } else {
            all = false;
        }
    }
    if all {
        open.clear();
    }
    Judged { open, rays }
}

/// All of a texel or nothing of it, by what most of the rays meet that look for something odd.
fn judge_roughly(scene: &BakeScene, texel: &Texel) -> Judged {
    let clear = (0..PROBES).filter(|&ray| probe(scene, texel, ray) == Probe::Clear).count();
    let open = if 2 * clear >= PROBES as usize { Vec::new() } else { vec![0] };
    Judged { open, rays: PROBES }
}

/// Keeps the points of a texel that are in the open; whether it has lost some.
fn keep_open(scene: &BakeScene, texel: &mut Texel, judged: &Judged) -> bool {
    if judged.open.is_empty() {
        return false;
    }
    let Some(points) = fine_points(scene, texel) else { return false };
    let is_open =
        |index: usize| judged.open.get(index / 64).is_some_and(|bits| bits >> (index % 64) & 1 == 1);
    let open: Vec<FootprintPoint> =
        points.iter().enumerate().filter(|(index, _)| is_open(*index)).map(|(_, point)| *point).collect();
    if open.is_empty() {
        texel.footprint = Footprint::Hidden;
    } else {
        texel.triangle = open[open.len() / 2].triangle;
        texel.footprint = Footprint::Points(open);
    }
    true
}

/// The points of a footprint that are nearest to its square's corners and middle, by index.
fn corners_and_middle(points: &[FootprintPoint]) -> Vec<usize> {
    let places = [Vec2::ZERO, Vec2::X, Vec2::Y, Vec2::ONE, Vec2::splat(0.5)];
    let nearest = |place: Vec2| {
        let distance = |index: &usize| points[*index].offset.distance_squared(place);
        (0..points.len()).min_by(|a, b| distance(a).total_cmp(&distance(b)))
    };
    places.into_iter().filter_map(nearest).collect()
}

/// Half the rays see the inside of something closed, or all see backs or end at once, or all but one where some end at once: the point is
/// hidden. With it come the rays cast: fewer where the others cannot change that.
fn in_the_open(
    scene: &BakeScene,
    point: &FootprintPoint,
    sequence: Sequence,
    index: u32,
    at_once: f32,
) -> (bool, u32) {
    let receiver = receiver(scene, point);
    let (mut inside, mut pressed, mut clear) = (0, 0, 0);
    for ray in 0..JUDGES {
        let [u, v, ..] = sequence.point(index * JUDGES + ray, 0);
        match scene.classify_hit(receiver.origin, cosine_about(receiver.geometric_normal, u, v)) {
            SurfaceHit::Inside => inside += 1,
            SurfaceHit::Back => {}
            SurfaceHit::Lit { distance, .. } if distance < at_once => pressed += 1,
            SurfaceHit::Lit { .. } => clear += 1,
            SurfaceHit::None => clear += 1,
        }
        let cast = ray + 1;
        if 2 * inside >= JUDGES {
            return (false, cast);
        }
        let enough = if pressed > 0 { CLEAR } else { 1 };
        if 2 * (cast - inside) > JUDGES && clear >= enough {
            return (true, cast);
        }
    }
    (false, JUDGES)
}
