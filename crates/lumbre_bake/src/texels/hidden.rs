//! Texels that lie, wholly or in part, inside other geometry or pressed against it: told by rays that meet the insides of things, or
//! meet something at once. The hidden part is taken out of the footprint, so that a texel half under a box has the light of its open half.
//! What a texel shows belongs to the map and not to the light: it is the same for every seed.

use rayon::prelude::*;

use super::footprint::{FINE, Footprint, FootprintPoint, Texel, footprint, receiver};
use crate::sampling::{Sequence, cosine_about};
use crate::scene::{BakeScene, LightmapLayout, SurfaceHit};

/// Seed of all rays here.
const SEED: u32 = 0;
/// A point from which no ray comes further than this share of its texel's side, or of its triangle's, lies against something: faces
/// that touch are apart by what their corners are rounded by, and no light is seen in between.
const PRESSED: f32 = 1.0 / 64.0;

/// Rays that look for something odd in every texel, and those that judge a point of an odd one.
const PROBES: u32 = 6;
const JUDGES: u32 = 8;

/// Takes what is hidden out of the footprints; returns how many texels are hidden in part or whole, and the rays cast. `touched` are the
/// places, in the row of all maps, of texels that something stands on.
pub(crate) fn remove_hidden(
    scene: &BakeScene,
    layout: &LightmapLayout,
    texels: &mut [Texel],
    touched: &[usize],
) -> (usize, u64) {
    let odd: Vec<bool> = texels.par_iter().map(|texel| looks_odd(scene, texel)).collect();
    let mut rays = texels.len() as u64 * u64::from(PROBES);
    // Six rays may miss a corner of a texel; its neighbours' rays did not.
    let mut near = vec![false; layout.texels];
    touched.iter().for_each(|&index| near[index] = true);
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
        .map(|texel| judge(scene, texel))
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

fn looks_odd(scene: &BakeScene, texel: &Texel) -> bool {
    let sequence = Sequence::new(SEED, 2, texel.index);
    let pressed = pressed(scene, texel);
    let mut ended = 0;
    (0..PROBES).any(|ray| {
        let [x, y, u, v] = sequence.point(ray, 0);
        let Some(point) = texel.point(scene, x, y) else { return false };
        let receiver = receiver(scene, &point);
        let direction = cosine_about(receiver.geometric_normal, u, v);
        match scene.first_hit(receiver.origin, direction) {
            SurfaceHit::Inside | SurfaceHit::Back => true,
            // One may end so in any corner.
            SurfaceHit::Lit { distance, .. } if distance < pressed => {
                ended += 1;
                ended > 1
            }
            SurfaceHit::Lit { .. } | SurfaceHit::None => false,
        }
    })
}

/// Keeps the points of a texel that are in the open. Returns 1 if some are not, and the rays cast.
fn judge(scene: &BakeScene, texel: &mut Texel) -> (usize, u64) {
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
    let sequence = Sequence::new(SEED, 3, texel.index);
    let pressed = pressed(scene, texel);
    let mut rays = 0;
    let mut open: Vec<FootprintPoint> = Vec::new();
    for (index, point) in points.iter().enumerate() {
        let (is_open, cast) = in_the_open(scene, point, sequence, index as u32, pressed);
        rays += u64::from(cast);
        if is_open {
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

/// Half the rays see the inside of something closed, or all see backs or end at once: the point is hidden. With it come the rays cast:
/// fewer where the others cannot change that.
fn in_the_open(
    scene: &BakeScene,
    point: &FootprintPoint,
    sequence: Sequence,
    index: u32,
    pressed: f32,
) -> (bool, u32) {
    let receiver = receiver(scene, point);
    let (mut inside, mut clear) = (0, 0);
    for ray in 0..JUDGES {
        let [u, v, ..] = sequence.point(index * JUDGES + ray, 0);
        match scene.first_hit(receiver.origin, cosine_about(receiver.geometric_normal, u, v)) {
            SurfaceHit::Inside => inside += 1,
            SurfaceHit::Back => {}
            SurfaceHit::Lit { distance, .. } => clear += u32::from(distance >= pressed),
            SurfaceHit::None => clear += 1,
        }
        let cast = ray + 1;
        if 2 * inside >= JUDGES {
            return (false, cast);
        }
        if 2 * (cast - inside) > JUDGES && clear > 0 {
            return (true, cast);
        }
    }
    (false, JUDGES)
}
