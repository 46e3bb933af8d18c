//! Texels that lie, wholly or in part, inside other geometry or pressed against it: told by rays that meet the insides of things, or
//! meet something at once. The hidden part is taken out of the footprint, so that a texel half under a box has the light of its open half.
//! What a texel shows belongs to the map and not to the light: it is the same for every seed.

use glam::Vec2;
use rayon::prelude::*;

use super::footprint::{FINE, Footprint, FootprintPoint, Texel, footprint, receiver};
use super::tiles::{Tiles, area, positions_of};
use crate::sampling::{Sequence, Stream, cosine_about};
use crate::scene::{BakeScene, LightmapLayout, SurfaceHit};
use crate::transport::box_tree::BoxTree;
use crate::transport::shaft::is_free_before;

/// Seed of all rays here.
const SEED: u32 = 0;
/// A point from which no ray comes further than this share of its texel's side, or of its triangle's, lies against something: faces
/// that touch are apart by what their corners are rounded by, and no light is seen in between.
const PRESSED: f32 = 1.0 / 64.0;

/// Rays that look for something odd in every texel, and in a tile that nothing crosses, and those that judge a point of an odd one.
const PROBES: u32 = 6;
const TILE_PROBES: u32 = 16;
const JUDGES: u32 = 8;
/// So many of those that judge have to see something: where faces touch, one may slip out along them.
const CLEAR: u32 = 2;

/// Takes what is hidden out of the footprints; returns how many texels are hidden in part or whole, and the rays cast. Contact lines cross the
/// texels that are `crossed`, and divide those that are `touched`: places in the row of all maps.
pub(crate) fn remove_hidden(
    scene: &BakeScene,
    layout: &LightmapLayout,
    texels: &mut [Texel],
    crossed: impl Iterator<Item = usize>,
    touched: &[usize],
) -> (usize, u64) {
    let (odd, mut rays) = odd(scene, texels);
    // Six rays may miss a corner of a texel; its neighbours' rays did not.
    let mut near = vec![false; layout.texels];
    touched.iter().for_each(|&index| near[index] = true);
    let mut mixed = vec![false; layout.texels];
    crossed.for_each(|index| mixed[index] = true);
    for (texel, _) in texels.iter().zip(&odd).filter(|(_, odd)| **odd) {
        let map = &layout.maps[texel.object as usize];
        for y in texel.y.saturating_sub(1)..=(texel.y + 1).min(map.height - 1) {
            for x in texel.x.saturating_sub(1)..=(texel.x + 1).min(map.width - 1) {
                near[map.first + (y * map.width + x) as usize] = true;
            }
        }
    }
    let (hidden, judged) = texels
        .par_iter_mut()
        .filter(|texel| near[texel.index as usize] && !scene.stop.is_set())
        .map(|texel| judge(scene, texel, mixed[texel.index as usize]))
        .reduce(|| (0, 0), |a, b| (a.0 + b.0, a.1 + b.1));
    rays += judged;
    (hidden, rays)
}

/// Rays that end before this go nowhere, canonical units.
fn pressed(scene: &BakeScene, texel: &Texel) -> f32 {
    let own = (2.0 * scene.triangles[texel.triangle as usize].area).sqrt();
    // The smaller one, and never NaN.
    PRESSED * own.min(texel.side(scene))
}

/// Texels that look odd, and the rays cast. Where nothing crosses the space before a tile, all of it is inside of something or none of it:
/// some rays of the whole tile tell.
fn odd(scene: &BakeScene, texels: &[Texel]) -> (Vec<bool>, u64) {
    let tiles = Tiles::new(texels);
    let tree = BoxTree::new(&scene.triangles, &scene.stop);
    let suspect: Vec<bool> = tiles
        .members
        .par_iter()
        .map(|members| {
            if scene.stop.is_set() {
                return false;
            }
            let members: Vec<&Texel> = members.iter().map(|&place| &texels[place as usize]).collect();
            let mut positions = Vec::new();
            members.iter().for_each(|texel| positions_of(scene, texel, &mut positions));
            let free = members.first().and_then(|first| area(scene, first.triangle, &positions));
            let free = free.is_some_and(|area| is_free_before(&area, scene, &tree));
            let of_tile =
                (0..TILE_PROBES).map(|ray| members[ray as usize * members.len() / TILE_PROBES as usize]);
            let fine = |(ray, texel): (usize, &Texel)| probe(scene, texel, ray as u32) == Probe::Clear;
            !(free && of_tile.enumerate().all(fine))
        })
        .collect();
    let suspects = |place: usize| suspect[tiles.tile_of[place] as usize];
    let odd: Vec<bool> = texels
        .par_iter()
        .enumerate()
        .map(|(place, texel)| suspects(place) && !scene.stop.is_set() && looks_odd(scene, texel))
        .collect();
    let asked = (0..texels.len()).filter(|&place| suspects(place)).count();
    let rays = tiles.members.len() as u64 * u64::from(TILE_PROBES) + asked as u64 * u64::from(PROBES);
    (odd, rays)
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
    let [x, y, u, v] = Sequence::new(SEED, Stream::HiddenTexel, texel.index).point(ray, 0);
    let Some(point) = texel.point(scene, x, y) else { return Probe::Clear };
    let receiver = receiver(scene, &point);
    let direction = cosine_about(receiver.geometric_normal, u, v);
    match scene.classify_hit(receiver.origin, direction) {
        SurfaceHit::Inside | SurfaceHit::Back => Probe::Hidden,
        SurfaceHit::Lit { distance, .. } if distance < pressed(scene, texel) => Probe::Pressed,
        SurfaceHit::Lit { .. } | SurfaceHit::None => Probe::Clear,
    }
}

fn looks_odd(scene: &BakeScene, texel: &Texel) -> bool {
    let mut ended = 0;
    (0..PROBES).any(|ray| match probe(scene, texel, ray) {
        Probe::Hidden => true,
        // One may end so in any corner.
        Probe::Pressed => {
            ended += 1;
            ended > 1
        }
        Probe::Clear => false,
    })
}

/// Keeps the points of a texel that are in the open. Returns 1 if some are not, and the rays cast. Between contact lines a surface is hidden or
/// is not: in a texel that is not `mixed`, having none, the corners and the middle tell for all, if they agree.
fn judge(scene: &BakeScene, texel: &mut Texel, mixed: bool) -> (usize, u64) {
    let mut triangles: Vec<u32> = match &texel.footprint {
        Footprint::Whole(triangle) => vec![*triangle],
        Footprint::Points(points) => points.iter().map(|point| point.triangle).collect(),
        Footprint::Hidden => return (0, 0),
    };
    triangles.sort_unstable();
    triangles.dedup();
    let Some(Footprint::Points(points)) = footprint(scene, triangles.into_iter(), texel.x, texel.y, FINE)
    else {
        return (0, 0);
    };
    let sequence = Sequence::new(SEED, Stream::HiddenView, texel.index);
    let pressed = pressed(scene, texel);
    let mut rays = 0;
    let mut is_open = |index: usize| {
        let (is_open, cast) = in_the_open(scene, &points[index], sequence, index as u32, pressed);
        rays += u64::from(cast);
        is_open
    };
    let telling = if mixed { Vec::new() } else { corners_and_middle(&points) };
    let told: Vec<bool> = telling.into_iter().map(&mut is_open).collect();
    let agreed = told.first().copied().filter(|first| told.iter().all(|told| told == first));
    let mut open: Vec<FootprintPoint> = Vec::new();
    for (index, point) in points.iter().enumerate() {
        if agreed.unwrap_or_else(|| is_open(index)) {
            open.push(*point);
        }
    }
    let reduced = open.len() < points.len();
    if open.is_empty() {
        texel.footprint = Footprint::Hidden;
    } else if reduced {
        texel.triangle = open[open.len() / 2].triangle;
        texel.footprint = Footprint::Points(open);
    }
    (usize::from(reduced), rays)
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
