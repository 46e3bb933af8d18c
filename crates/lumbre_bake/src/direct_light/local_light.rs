//! The local light of each texel: the level to which an eye in that room adapts, so that errors are measured as that
//! eye sees them and not relative to the noon outside. It averages the light of the surfaces in view within two steps
//! (from a wall, its room and, with less weight, what lies beyond the door) as the square of the mean square root. That
//! lies between the arithmetic mean, which one bright window dominates, and the geometric mean, which one closed
//! cupboard pulls to zero. A texel that is itself brighter, as where the sun falls on the floor, counts for a third of
//! the mean. The result is not an exact solution: it comes from a few random walks through the scene, which read direct
//! light where they hit. As no eye fits into a gap of a few texels, surfaces nearer than that are not in view.

use rayon::prelude::*;

use super::views::Views;
use crate::BakeError;
use crate::chunks::{decide, in_chunks_uncheckpointed};
use crate::color::channel_mean;
use crate::coverage::{CoveredTexels, TexelGroups, receiver};
use crate::monitor::BakeMonitor;
use crate::sampling::{Sequence, Stream, cosine_about};
use crate::scene::{Receiver, Side, SurfaceHit};
use crate::sources::{Direct, Sources};
use crate::squared_errors::SquaredErrors;
use crate::texel_index::CoveredTexel;

/// Walks from a block, unless it has fewer texels.
const WALKS: u32 = 32;
/// Walks from a block of few texels.
const MIN_WALKS: u32 = 8;
/// Walks from any block once the time is up.
const LATE_WALKS: u32 = 4;
/// The most steps of a walk.
const BOUNCES: u32 = 48;
/// The steps within which a walk notes what is in view, however little light is left.
const STEPS_TO_SEE: u32 = 6;
/// A walk ends once its weight is below this: after seven bounces off surfaces that reflect half of the light.
const LEAST_WEIGHT: f32 = 1.0 / 64.0;
/// Blocks in view that a walk notes.
const VIEW: usize = 2;
/// The least distance of such a block from the point before, in texels.
const NEAREST: f32 = 8.0;
/// Least local light, as a share of the mean over the whole level: four stops, about the range that an automatic
/// exposure follows.
const FLOOR: f64 = 1.0 / 16.0;

/// The seed of the walks, independent of the bake's seed: local light is a yardstick for errors.
const SEED: u32 = 0;

/// The local light of each covered texel: irradiance, mean of the channels.
#[derive(Clone, Debug, Default)]
pub(crate) struct LocalLight {
    irradiance: Vec<f32>,
    /// What is in view from each block of texels.
    pub views: Views,
}

/// The result of one walk from a block.
#[derive(Clone, Default)]
struct Walk {
    /// Irradiance by bounces and by the sky at the walk's start.
    indirect: f32,
    /// Blocks in view; fewer than [`VIEW`] if the walk left the scene or hit a back face.
    in_view: [Option<u32>; VIEW],
    /// Whether the walk ended in a gap too narrow to look into.
    in_gap: bool,
}

/// What walks need to know of the level.
struct Walker<'a> {
    sources: &'a Sources<'a>,
    texels: &'a CoveredTexels<'a>,
    blocks: &'a TexelGroups,
    direct: &'a [Direct],
}

impl LocalLight {
    /// Estimates local light, the same for all texels of a block, from the direct light that is known so far.
    pub fn new(
        sources: &Sources<'_>,
        texels: &CoveredTexels<'_>,
        blocks: &TexelGroups,
        direct: &[Direct],
        monitor: &mut BakeMonitor<'_>,
    ) -> Result<Self, BakeError> {
        let walker = Walker { sources, texels, blocks, direct };
        // Kept in the checkpoint, so that a bake which resumes there measures errors by the same light.
        let clock = monitor.clock();
        let is_late = decide(monitor, clock.is_over())?;
        let walks: Vec<Vec<Walk>> = in_chunks_uncheckpointed(blocks.members.len(), monitor, |block| {
            let members = &blocks.members[block];
            let walks = match is_late {
                _ if members.is_empty() => 0,
                true => LATE_WALKS,
                false => (members.len() as u32).clamp(MIN_WALKS, WALKS),
            };
            (0..walks).map(|walk| walker.walk(members, block as u32, walk)).collect()
        })?;
        let mean_of = |members: &Vec<CoveredTexel>, of: &dyn Fn(CoveredTexel) -> f32| {
            members.iter().map(|&member| f64::from(of(member))).sum::<f64>() / members.len().max(1) as f64
        };
        let block_light: Vec<f64> = blocks
            .members
            .par_iter()
            .zip(&walks)
            .map(|(members, walks)| {
                let direct = mean_of(members, &|member| channel_mean(direct[member.place()].baked));
                let indirect = walks.iter().map(|walk| f64::from(walk.indirect)).sum::<f64>();
                direct + indirect / walks.len().max(1) as f64
            })
            .collect();
        let (sum, count) =
            blocks.members.iter().zip(&block_light).fold((0.0, 0usize), |(sum, count), (members, light)| {
                (sum + light * members.len() as f64, count + members.len())
            });
        let mean = sum / count.max(1) as f64;
        // The mean square root of the light of the blocks in view.
        let mean_root_in_view = |block: usize| -> f64 {
            // Where a walk has left the scene the eye sees no surface, and the block's own light counts instead. Into a
            // gap it cannot look at all, and the mean over the level counts.
            let roots_of_walk = |walk: &Walk| {
                let otherwise = if walk.in_gap { mean } else { block_light[block] };
                walk.in_view.map(|seen| seen.map_or(otherwise, |seen| block_light[seen as usize]).sqrt())
            };
            let roots = walks[block].iter().flat_map(roots_of_walk);
            let (sum, count) = roots.fold((0.0, 0u32), |(sum, count), root| (sum + root, count + 1));
            if count == 0 { block_light[block].sqrt() } else { sum / f64::from(count) }
        };
        let local_light: Vec<f32> = (0..block_light.len())
            .into_par_iter()
            .map(|block| {
                let in_view = mean_root_in_view(block);
                let with_own = (block_light[block].sqrt() + VIEW as f64 * in_view) / (1 + VIEW) as f64;
                let root = in_view.max(with_own);
                (root * root).max(FLOOR * mean).max(f64::from(f32::MIN_POSITIVE)) as f32
            })
            .collect();
        let views = Views::new(texels, blocks, |block| {
            let seen = walks[block].iter().flat_map(|walk| walk.in_view);
            seen.map(|seen| seen.unwrap_or(block as u32)).collect()
        });
        let irradiance = blocks.group_of.iter().map(|&block| local_light[block as usize]).collect();
        Ok(Self { irradiance, views })
    }
}

impl LocalLight {
    /// The local light of a covered texel, W/m²; positive.
    pub fn at(&self, texel: CoveredTexel) -> f64 {
        f64::from(self.irradiance[texel.place()])
    }

    /// Squared errors relative to the squared local light of their texels.
    pub fn relative_errors(&self, errors: &SquaredErrors) -> SquaredErrors {
        SquaredErrors { cautious: self.relative(&errors.cautious), expected: self.relative(&errors.expected) }
    }

    /// Squares of irradiance relative to the squared local light of their texels.
    pub fn relative(&self, squares: &[f32]) -> Vec<f32> {
        squares.par_iter().zip(&self.irradiance).map(|(square, light)| square / light / light).collect()
    }
}

impl Walker<'_> {
    /// Walk `number` from a random point of a block.
    fn walk(&self, members: &[CoveredTexel], block: u32, number: u32) -> Walk {
        let scene = self.sources.scene;
        let sequence = Sequence::new(SEED, Stream::LocalLight, block);
        let mut walk = Walk::default();
        let [choice, x, y, _] = sequence.point(number, 0);
        let member = members[((choice * members.len() as f32) as usize).min(members.len() - 1)];
        let texel = &self.texels.list[member.place()];
        let Some(point) = texel.point(scene, x, y) else { return walk };
        let mut at: Receiver = receiver(scene, &point);
        let side = texel.side(scene);
        let nearest = if side.is_finite() { NEAREST * side } else { 0.0 };
        let (mut weight, mut seen) = (1.0, 0);
        for bounce in 0..BOUNCES {
            let [u, v, ..] = sequence.point(number, 1 + bounce);
            let direction = cosine_about(at.geometric_normal, u, v);
            let (triangle, side, (u, v), distance) = match scene.first_hit(at.origin, direction) {
                SurfaceHit::Lit { triangle, side, at, distance } => (triangle, side, at, distance),
                SurfaceHit::None => {
                    walk.indirect += weight * channel_mean(self.sources.sky);
                    walk.in_gap = seen == 0 && bounce >= STEPS_TO_SEE;
                    return walk;
                }
                SurfaceHit::Back | SurfaceHit::Inside => break,
            };
            let surface = &scene.triangles[triangle as usize];
            let material = &scene.surfaces[surface.surface as usize];
            weight *= channel_mean(material.reflectance(side, surface.vertices, [1.0 - u - v, u, v]));
            let place = (side == Side::Front).then(|| self.covered_texel_at(triangle, (u, v))).flatten();
            if let Some(place) = place {
                if seen < VIEW && bounce < STEPS_TO_SEE && distance >= nearest {
                    walk.in_view[seen] = Some(self.blocks.group_of[place.place()]);
                    seen += 1;
                }
                walk.indirect += weight * channel_mean(self.direct[place.place()].total());
            }
            if weight < LEAST_WEIGHT && (seen == VIEW || bounce + 1 >= STEPS_TO_SEE) {
                break;
            }
            at = Receiver::on_facet(scene, triangle, side, (u, v));
        }
        walk.in_gap = seen == 0;
        walk
    }

    /// The index of the covered texel at a point on a triangle's front.
    fn covered_texel_at(&self, triangle: u32, at: (f32, f32)) -> Option<CoveredTexel> {
        let triangle = &self.sources.scene.triangles[triangle as usize];
        self.texels.open_at(self.texels.layout.texel_at(triangle, at)?)
    }
}
