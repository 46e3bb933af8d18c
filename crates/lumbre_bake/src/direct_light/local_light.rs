//! The light around each texel: what an eye in that room adapts to, so that an error is told as that eye sees it and not beside the noon
//! outside: the light of what can be seen from there in two steps (from a wall its room, and what lies beyond the door a little), of which it is
//! the square of the mean square root, between the arithmetic mean, which one bright window outshines, and the logarithmic one, which one closed
//! cupboard pulls to nothing. What is brighter itself, as the sun on the floor, counts as a third of it. Not an exact solution: a few walks
//! through the scene, which read direct light where they hit. No eye fits into a gap of a few texels: what is nearer is not in view.

use crate::squared_errors::SquaredErrors;
use glam::Vec3;
use rayon::prelude::*;

use crate::BakeError;
use crate::chunks::{in_chunks, in_chunks_uncheckpointed};
use crate::coverage::blocks::Blocks;
use crate::coverage::footprint::{Texel, receiver};
use crate::monitor::BakeMonitor;
use crate::sampling::{Sequence, Stream, cosine_about};
use crate::scene::Receiver;
use crate::scene::material::Side;
use crate::scene::{LightmapLayout, SurfaceHit};
use crate::sources::direct::Direct;
use crate::sources::light_sources::Sources;

/// Texels along the side of a block that has one number.
const BLOCK: u32 = 16;
/// Walks of a block, those when the time is up, and most steps of one.
const WALKS: u32 = 32;
const LATE_WALKS: u32 = 4;
const BOUNCES: u32 = 6;
/// Things in view that a walk looks at, none of them nearer to the one before than so many texels.
const VIEW: usize = 2;
const NEAREST: f32 = 8.0;
/// Least local light, in shares of the whole level's mean: four stops, about as far as an automatic exposure follows.
const FLOOR: f64 = 1.0 / 16.0;

/// Of the walks: the light around is a yardstick, the same for every seed.
const SEED: u32 = 0;

/// The light around each covered texel, irradiance, mean of the channels.
#[derive(Clone, Debug, Default)]
pub(crate) struct LocalLight {
    of: Vec<f32>,
}

/// What one walk of a block found.
#[derive(Clone, Default)]
struct Walk {
    /// Irradiance by bounces and the sky at its begin.
    indirect: f32,
    /// Blocks in view: fewer where the walk left the scene or met a back.
    seen: [Option<u32>; VIEW],
    /// Whether it ended in a gap that nobody can look into.
    in_gap: bool,
}

/// Where the walks go.
struct Level<'a> {
    sources: &'a Sources<'a>,
    layout: &'a LightmapLayout,
    /// Of each texel of all maps, its place among the covered ones.
    places: Vec<u32>,
    blocks: &'a Blocks,
    direct: &'a [Direct],
}

impl LocalLight {
    /// From direct light as it is known so far.
    ///
    /// # Errors
    /// [`BakeError::Cancelled`].
    pub fn new(
        sources: &Sources<'_>,
        layout: &LightmapLayout,
        texels: &[Texel],
        charts: &[u32],
        direct: &[Direct],
        monitor: &mut BakeMonitor<'_>,
    ) -> Result<Self, BakeError> {
        let blocks = Blocks::new(texels, charts, BLOCK);
        let mut places = vec![u32::MAX; layout.texels];
        for (place, texel) in texels.iter().enumerate().filter(|(_, texel)| !texel.is_hidden()) {
            places[texel.index.place()] = place as u32;
        }
        let level = Level { sources, layout, places, blocks: &blocks, direct };
        // ReusedGather in the checkpoint, so that a bake which goes on from there judges by the same light.
        let clock = monitor.clock();
        let late = in_chunks(1, monitor, |_| clock.is_over())?.contains(&true);
        let walks: Vec<Vec<Walk>> = in_chunks_uncheckpointed(blocks.members.len(), monitor, |block| {
            let members = &blocks.members[block];
            let walks = match late {
                _ if members.is_empty() => 0,
                true => LATE_WALKS,
                false => WALKS,
            };
            (0..walks).map(|walk| level.walk(texels, members, block as u32, walk)).collect()
        })?;
        let mean_of = |members: &Vec<u32>, of: &dyn Fn(u32) -> f32| {
            members.iter().map(|&member| f64::from(of(member))).sum::<f64>() / members.len().max(1) as f64
        };
        let own: Vec<f64> = blocks
            .members
            .par_iter()
            .zip(&walks)
            .map(|(members, walks)| {
                let direct = mean_of(members, &|member| grey(direct[member as usize].baked));
                let indirect = walks.iter().map(|walk| f64::from(walk.indirect)).sum::<f64>();
                direct + indirect / walks.len().max(1) as f64
            })
            .collect();
        let (sum, count) =
            blocks.members.iter().zip(&own).fold((0.0, 0usize), |(sum, count), (members, own)| {
                (sum + own * members.len() as f64, count + members.len())
            });
        let mean = sum / count.max(1) as f64;
        let view = |block: usize| -> f64 {
            // Where a walk has left the scene, the eye sees no surface: what is here counts for it. Of a gap it sees nothing at all.
            let of_walk = |walk: &Walk| {
                let otherwise = if walk.in_gap { mean } else { own[block] };
                walk.seen.map(|seen| seen.map_or(otherwise, |seen| own[seen as usize]).sqrt())
            };
            let roots = walks[block].iter().flat_map(of_walk);
            let (sum, count) = roots.fold((0.0, 0u32), |(sum, count), root| (sum + root, count + 1));
            if count == 0 { own[block].sqrt() } else { sum / f64::from(count) }
        };
        let of_blocks: Vec<f32> = (0..own.len())
            .into_par_iter()
            .map(|block| {
                let seen = view(block);
                let root = seen.max((own[block].sqrt() + VIEW as f64 * seen) / (1 + VIEW) as f64);
                (root * root).max(FLOOR * mean).max(f64::from(f32::MIN_POSITIVE)) as f32
            })
            .collect();
        Ok(Self { of: blocks.of.iter().map(|&block| of_blocks[block as usize]).collect() })
    }
}

impl LocalLight {
    /// Of a covered texel, W/m²; positive.
    pub fn at(&self, place: usize) -> f64 {
        f64::from(self.of[place])
    }

    /// Squared errors in shares of the squared light around their texels.
    pub fn relative_errors(&self, errors: &SquaredErrors) -> SquaredErrors {
        SquaredErrors { cautious: self.relative(&errors.cautious), expected: self.relative(&errors.expected) }
    }

    /// Squared, what numbers of irradiance are of the light around their texels.
    pub fn relative(&self, squares: &[f32]) -> Vec<f32> {
        squares.par_iter().zip(&self.of).map(|(square, light)| square / light / light).collect()
    }
}

impl Level<'_> {
    fn walk(&self, texels: &[Texel], members: &[u32], block: u32, number: u32) -> Walk {
        let scene = self.sources.scene;
        let sequence = Sequence::new(SEED, Stream::LocalLight, block);
        let mut walk = Walk::default();
        let [choice, x, y, _] = sequence.point(number, 0);
        let member = members[((choice * members.len() as f32) as usize).min(members.len() - 1)];
        let texel = &texels[member as usize];
        let Some(point) = texel.point(scene, x, y) else { return walk };
        let mut at: Receiver = receiver(scene, &point);
        let side = texel.side(scene);
        let nearest = if side.is_finite() { NEAREST * side } else { 0.0 };
        let (mut weight, mut in_view) = (1.0, 0);
        for bounce in 0..BOUNCES {
            let [u, v, ..] = sequence.point(number, 1 + bounce);
            let direction = cosine_about(at.geometric_normal, u, v);
            let (triangle, side, (u, v), distance) = match scene.first_hit(at.origin, direction) {
                SurfaceHit::Lit { triangle, side, at, distance } => (triangle, side, at, distance),
                SurfaceHit::None => {
                    walk.indirect += weight * grey(self.sources.sky);
                    return walk;
                }
                SurfaceHit::Back | SurfaceHit::Inside => break,
            };
            let surface = &scene.triangles[triangle as usize];
            let material = &scene.surfaces[surface.surface as usize];
            weight *= grey(material.reflectance(side, surface.vertices, [1.0 - u - v, u, v]));
            let place = (side == Side::Front).then(|| self.place_at(triangle, (u, v))).flatten();
            if let Some(place) = place {
                if in_view < VIEW && distance >= nearest {
                    walk.seen[in_view] = Some(self.blocks.of[place as usize]);
                    in_view += 1;
                }
                walk.indirect += weight * grey(self.direct[place as usize].total());
            }
            at = Receiver::on_facet(scene, triangle, side, (u, v));
        }
        walk.in_gap = in_view == 0;
        walk
    }

    /// The covered texel at a point of a triangle's front.
    fn place_at(&self, triangle: u32, at: (f32, f32)) -> Option<u32> {
        let texel = self.layout.texel_at(&self.sources.scene.triangles[triangle as usize], at)?;
        Some(self.places[texel.place()]).filter(|place| *place != u32::MAX)
    }
}

fn grey(light: Vec3) -> f32 {
    light.element_sum() / 3.0
}
