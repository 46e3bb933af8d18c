//! Texels that lie, wholly or in part, inside other geometry: told by rays that meet the insides of things. The hidden
//! part is taken out of the footprint, so that a texel half under a box has the light of its open half.

use rayon::prelude::*;

use super::footprint::{FINE, Footprint, FootprintPoint, Texel, footprint, receiver};
use super::tiles::{Tiles, area, positions_of};
use crate::sampling::{Sequence, cosine_about};
use crate::scene::{BakeScene, LightmapLayout, SurfaceHit};
use crate::transport::box_tree::BoxTree;
use crate::transport::shaft::is_free_before;

/// Rays that look for something odd in every texel, and in a tile that nothing crosses, and those that judge a point of an odd one.
const PROBES: u32 = 6;
const TILE_PROBES: u32 = 16;
const JUDGES: u32 = 8;

/// Takes what is hidden out of the footprints; returns how many texels are hidden in part or whole, and the rays cast.
pub(crate) fn remove_hidden(
    scene: &BakeScene,
    layout: &LightmapLayout,
    texels: &mut [Texel],
    seed: u32,
) -> (usize, u64) {
    let (odd, mut rays) = odd(scene, texels, seed);
    // Six rays may miss a corner of a texel; its neighbours' rays did not.
    let mut near = vec![false; layout.texels];
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
        .filter(|texel| near[texel.index as usize])
        .map(|texel| judge(scene, texel, seed))
        .reduce(|| (0, 0), |a, b| (a.0 + b.0, a.1 + b.1));
    rays += judged;
    (hidden, rays)
}

/// Texels that look odd, and the rays cast. Where nothing crosses the space before a tile, all of it is inside of something or none of it:
/// some rays of the whole tile tell.
fn odd(scene: &BakeScene, texels: &[Texel], seed: u32) -> (Vec<bool>, u64) {
    let tiles = Tiles::new(texels);
    let tree = BoxTree::new(&scene.triangles);
    let suspect: Vec<bool> = tiles
        .members
        .par_iter()
        .map(|members| {
            let members: Vec<&Texel> = members.iter().map(|&place| &texels[place as usize]).collect();
            let mut positions = Vec::new();
            members.iter().for_each(|texel| positions_of(scene, texel, &mut positions));
            let free = members.first().and_then(|first| area(scene, first.triangle, &positions));
            let free = free.is_some_and(|area| is_free_before(&area, scene, &tree));
            let of_tile =
                (0..TILE_PROBES).map(|ray| members[ray as usize * members.len() / TILE_PROBES as usize]);
            !free || of_tile.enumerate().any(|(ray, texel)| is_odd(scene, texel, seed, ray as u32))
        })
        .collect();
    let suspects = |place: usize| suspect[tiles.tile_of[place] as usize];
    let odd: Vec<bool> = texels
        .par_iter()
        .enumerate()
        .map(|(place, texel)| suspects(place) && (0..PROBES).any(|ray| is_odd(scene, texel, seed, ray)))
        .collect();
    let asked = (0..texels.len()).filter(|&place| suspects(place)).count();
    let rays = tiles.members.len() as u64 * u64::from(TILE_PROBES) + asked as u64 * u64::from(PROBES);
    (odd, rays)
}

/// Whether a ray of a texel meets the inside of something, or a back.
fn is_odd(scene: &BakeScene, texel: &Texel, seed: u32, ray: u32) -> bool {
    let [x, y, u, v] = Sequence::new(seed, 2, texel.index).point(ray, 0);
    let Some(point) = texel.point(scene, x, y) else { return false };
    let receiver = receiver(scene, &point);
    let direction = cosine_about(receiver.geometric_normal, u, v);
    matches!(scene.first_hit(receiver.origin, direction), SurfaceHit::Inside | SurfaceHit::Back)
}

/// Keeps the points of a texel that are in the open. Returns 1 if some are not, and the rays cast.
fn judge(scene: &BakeScene, texel: &mut Texel, seed: u32) -> (usize, u64) {
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
    let sequence = Sequence::new(seed, 3, texel.index);
    let mut rays = 0;
    let is_open = |(index, point): &(usize, &FootprintPoint)| {
        let (open, asked) = in_the_open(scene, point, sequence, *index as u32);
        rays += u64::from(asked);
        open
    };
    let open: Vec<FootprintPoint> =
        points.iter().enumerate().filter(is_open).map(|(_, point)| *point).collect();
    let reduced = open.len() < points.len();
    if open.is_empty() {
        texel.footprint = Footprint::Hidden;
    } else if reduced {
        texel.triangle = open[open.len() / 2].triangle;
        texel.footprint = Footprint::Points(open);
    }
    (usize::from(reduced), rays)
}

/// Half the rays see the inside of something closed, or all see backs: the point is hidden. With the rays that it took to tell.
fn in_the_open(scene: &BakeScene, point: &FootprintPoint, sequence: Sequence, index: u32) -> (bool, u32) {
    let receiver = receiver(scene, point);
    let (mut inside, mut backs) = (0, 0);
    for ray in 0..JUDGES {
        let [u, v, ..] = sequence.point(index * JUDGES + ray, 0);
        match scene.first_hit(receiver.origin, cosine_about(receiver.geometric_normal, u, v)) {
            SurfaceHit::Inside => inside += 1,
            SurfaceHit::Back => backs += 1,
            _ => {}
        }
        // However the others end.
        let (others, open) = (JUDGES - 1 - ray, ray + 1 - inside - backs);
        if open > 0 && 2 * (inside + others) < JUDGES {
            return (true, ray + 1);
        }
        if 2 * inside >= JUDGES {
            return (false, ray + 1);
        }
    }
    (2 * inside < JUDGES && inside + backs < JUDGES, JUDGES)
}
