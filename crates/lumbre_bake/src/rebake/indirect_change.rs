//! A linear estimate of how the light by bounces changes. The light that arrives at a point differs from the former
//! bake's for three reasons: a ray through a changed box hits, or no longer hits, the object in it; the direct light of
//! the surface at its end has been computed anew; and the bounced light of that surface has changed by the same
//! estimate, one bounce later. The change is bounded from below and from above, by channel: an object that is gone may
//! or may not have been hit by a ray through its box, and may have shown its brightest or its darkest side. Lower and
//! upper bounds add up separately, so that increases and decreases cancel only where they are certain. Bounds are means
//! of samples, so they are not exact: one standard error is added. What to keep is decided in `choice`.

use std::f32::consts::{PI, TAU};

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::change_sums::{ChangeSums, Range, cone_to_sphere, direction_in_cone};
use super::changed_box::ChangedBox;
use super::changes::Changes;
use super::choice;
use crate::bounds::Bounds;
use crate::chunks::in_chunks;
use crate::coverage::{CoveredTexels, Texel, TexelGroups, receiver};
use crate::direct_light::LocalLight;
use crate::final_gather::ReusedGather;
use crate::monitor::BakeMonitor;
use crate::radiosity::solution::gather;
use crate::radiosity::{Exchange, FormFactors, Patch, Patches};
use crate::report::StageNotes;
use crate::sampling::{Sequence, Stream, cosine_about};
use crate::scene::{BakeScene, Receiver, Side, SurfaceHit};
use crate::sources::{Direct, Sources};
use crate::texel_index::MapTexel;
use crate::{BakeError, BakeOptions};

/// Rays from a patch or from a block of texels. Every other one is aimed at what has changed.
const RAYS: u32 = 32;
/// Texels along the side of a block.
const BLOCK_SIDE: u32 = 4;
/// Nothing is kept of texels that are nearer to a changed box than this share of its size.
const NEAR_BOX: f32 = 1.0 / 16.0;
/// Relative residual of a solution that is only an estimate.
const TOLERANCE: f64 = 1e-4;

/// The light before and after, as far as the estimate needs it.
pub(super) struct IndirectChange<'a> {
    scene: &'a BakeScene,
    texels: &'a CoveredTexels<'a>,
    changes: &'a Changes<'a>,
    blocks: TexelGroups,
    /// Per texel of all maps, the change of direct light (mixed lights included), W/m².
    direct: Vec<Vec3>,
    /// Irradiance by an unoccluded sky in the new scene, W/m².
    sky: Vec3,
    /// Bounding spheres of the changed boxes: centre and radius.
    spheres: Vec<(Vec3, f32)>,
}

/// The light that leaves the patches in the new scene, and the change of their irradiance by bounces.
#[derive(Clone, Copy)]
struct PatchChange<'a> {
    patches: &'a Patches,
    /// Without emission, W/m².
    exitance: &'a [Vec3],
    /// W/m²; empty if not known yet.
    change: &'a [Range],
    /// Backs, which no texel shows, whose direct light may have changed.
    unknown: &'a [bool],
}

impl<'a> IndirectChange<'a> {
    /// `direct` is the direct light of every covered texel in the new scene.
    pub fn new(
        sources: &Sources<'a>,
        changes: &'a Changes<'a>,
        texels: &'a CoveredTexels<'a>,
        direct: &[Direct],
    ) -> Self {
        let mut change = vec![Vec3::ZERO; texels.layout.texels];
        for ((texel, now), known) in texels.list.iter().zip(direct).zip(&changes.known) {
            if let Some(known) = known {
                change[texel.index.place()] = now.total() - known.direct.total();
            }
        }
        Self {
            scene: sources.scene,
            texels,
            changes,
            blocks: TexelGroups::blocks(&texels.list, &texels.charts, BLOCK_SIDE),
            direct: change,
            sky: sources.sky,
            spheres: changes.boxes.iter().map(|b| (b.center(), b.radius())).collect(),
        }
    }

    /// The light by bounces of the former bake that this one keeps, given the new scene's `exchange` with its form
    /// factors. The notes count about how many rays it took to decide.
    pub fn kept(
        &self,
        exchange: &Exchange,
        factors: &FormFactors,
        local: &LocalLight,
        options: &BakeOptions,
        monitor: &mut BakeMonitor<'_>,
    ) -> Result<(ReusedGather, StageNotes), BakeError> {
        if self.changes.nothing_changed {
            return Ok((choice::keep_all(self.changes), StageNotes::default()));
        }
        let unknown = self.unknown_backs(&exchange.patches);
        let light = PatchChange {
            patches: &exchange.patches,
            exitance: &exchange.exitance,
            change: &[],
            unknown: &unknown,
        };
        let of_patches = self.of_patches(light, factors, options, monitor)?;
        let light = PatchChange { change: &of_patches, ..light };
        let of_texels = self.of_texels(light, options, monitor)?;
        let reused = choice::choose(self.changes, &self.texels.list, &of_texels, local, options.error);
        let origins = of_patches.len() + self.blocks.members.len();
        Ok((reused, StageNotes::of_rays(u64::from(RAYS) * origins as u64)))
    }

    /// The change of each patch's irradiance by bounces, W/m²: Δ = S + F ρ Δ, where S is the immediate change. F and ρ
    /// are not negative, so that bounds of S give bounds of Δ.
    fn of_patches(
        &self,
        light: PatchChange<'_>,
        factors: &FormFactors,
        options: &BakeOptions,
        monitor: &mut BakeMonitor<'_>,
    ) -> Result<Vec<Range>, BakeError> {
        let (patches, solver) = (light.patches, options.solver);
        let is_new =
            |patch: &Patch| self.changes.changed[self.scene.triangles[patch.triangle as usize].map.place()];
        let immediate: Vec<Range> = in_chunks(patches.list.len(), monitor, |index| {
            let patch = &patches.list[index];
            if is_new(patch) || patch.reflectance == Vec3::ZERO {
                return [Vec3::ZERO; 2];
            }
            let sequence = Sequence::new(options.seed, Stream::ChangedPatches, index as u32);
            let point = |x: f32, y: f32| {
                let (triangle, at) = patches.point(patch, [x, y]);
                Some(Receiver::on_facet(self.scene, triangle, patch.side, at))
            };
            self.sampled_change(sequence, &|_, x, y| point(x, y), light).means()
        })?;
        // One job per bound and channel.
        let solve = |job: usize| {
            let (which, channel) = (job / 3, job % 3);
            // The light of changed objects is part of the immediate change: rays that hit them read their new exitance.
            let reflectance_of = |patch: &Patch| match is_new(patch) {
                true => 0.0,
                false => f64::from(patch.reflectance[channel]),
            };
            let reflectance: Vec<f64> = patches.list.iter().map(reflectance_of).collect();
            // The solver allows no negative emission: increases and decreases are solved separately.
            let [increase, decrease] = [1.0f64, -1.0].map(|sign| {
                let emission: Vec<f64> = reflectance
                    .iter()
                    .enumerate()
                    .map(|(patch, rho)| rho * (sign * f64::from(immediate[patch][which][channel])).max(0.0))
                    .collect();
                gather(factors, &solver.solve(factors, &reflectance, &emission, TOLERANCE).radiosity)
            });
            increase.iter().zip(&decrease).map(|(more, less)| more - less).collect::<Vec<f64>>()
        };
        let solved: Vec<Vec<f64>> =
            monitor.run_interruptible(1.0, || (0..6usize).into_par_iter().map(solve).collect())?;
        let change = |which: usize, patch: usize| {
            let [red, green, blue] = [0, 1, 2].map(|channel| solved[3 * which + channel][patch]);
            immediate[patch][which] + DVec3::new(red, green, blue).as_vec3()
        };
        Ok((0..patches.list.len()).map(|patch| [change(0, patch), change(1, patch)]).collect())
    }

    /// Per patch, whether it is a back whose direct light may have changed: as no texel shows it, the change is not
    /// known.
    fn unknown_backs(&self, patches: &Patches) -> Vec<bool> {
        let is_unknown = |patch: &Patch| {
            patch.side == Side::Back
                && patch.reflectance != Vec3::ZERO
                && (self.changes.lights_changed
                    || patches
                        .facets(self.scene, patch)
                        .any(|facet| self.changes.shadow_volumes.cross(&facet)))
        };
        patches.list.par_iter().map(is_unknown).collect()
    }

    /// By how much the light by bounces may have changed at every covered texel, W/m², root mean square of the
    /// channels. It is estimated for blocks of texels, and infinite in and next to changed boxes.
    fn of_texels(
        &self,
        light: PatchChange<'_>,
        options: &BakeOptions,
        monitor: &mut BakeMonitor<'_>,
    ) -> Result<Vec<f32>, BakeError> {
        let of_blocks = in_chunks(self.blocks.members.len(), monitor, |block| {
            let members = &self.blocks.members[block];
            let members: Vec<&Texel> =
                members.iter().map(|member| &self.texels.list[member.place()]).collect();
            if members.is_empty() {
                return 0.0f32;
            }
            let sequence = Sequence::new(options.seed, Stream::ChangedTexels, block as u32);
            // Two successive rays, one of each kind, share a texel.
            let point = |ray: u32, x, y| {
                let texel = members[ray as usize / 2 % members.len()];
                texel.point(self.scene, x, y).map(|point| receiver(self.scene, &point))
            };
            let is_changed = members.iter().any(|texel| {
                let point = texel.point(self.scene, 0.5, 0.5);
                point.is_some_and(|point| self.is_near_box(receiver(self.scene, &point).position))
            });
            if is_changed { f32::INFINITY } else { self.sampled_change(sequence, &point, light).largest() }
        })?;
        Ok(self.blocks.group_of.iter().map(|&block| of_blocks[block as usize]).collect())
    }

    /// Whether a point is in a changed box, or next to it.
    fn is_near_box(&self, position: Vec3) -> bool {
        self.changes
            .boxes
            .iter()
            .any(|b| position.clamp(b.bounds.low, b.bounds.high).distance(position) <= NEAR_BOX * b.radius())
    }

    /// Samples the change of a receiver's irradiance by bounces: half the rays are cosine-distributed, half are aimed
    /// into the cones around what has changed, in proportion to their solid angles. They are combined by the balance
    /// heuristic (Veach and Guibas, "Optimally Combining Sampling Techniques for Monte Carlo Rendering", 1995, section
    /// 3.3).
    fn sampled_change(
        &self,
        sequence: Sequence,
        point: &impl Fn(u32, f32, f32) -> Option<Receiver>,
        light: PatchChange<'_>,
    ) -> ChangeSums {
        let mut sums = ChangeSums::default();
        // Running sums of the cones' solid angles over 2π.
        let mut ends = Vec::with_capacity(self.spheres.len());
        for ray in 0..RAYS {
            let [x, y, u, v] = sequence.point(ray, 0);
            let Some(receiver) = point(ray, x, y) else { continue };
            let cone = |&(center, radius): &(Vec3, f32)| cone_to_sphere(receiver.position, center, radius);
            let cones: Vec<(Vec3, f32)> = self.spheres.iter().map(cone).collect();
            ends.clear();
            let mut total = 0.0;
            for (_, size) in &cones {
                total += size;
                ends.push(total);
            }
            let is_aimed = ray % 2 == 1 && total > 0.0;
            let direction = if is_aimed {
                let place = u * total;
                let chosen = ends.partition_point(|&end| end <= place).min(cones.len() - 1);
                let (axis, size) = cones[chosen];
                let start = ends[chosen] - size;
                direction_in_cone(axis, size, ((place - start) / size).clamp(0.0, 1.0), v)
            } else {
                cosine_about(receiver.geometric_normal, u, v)
            };
            let cosine = direction.dot(receiver.geometric_normal);
            if cosine <= 0.0 {
                sums.add([Vec3::ZERO; 2], 0.0);
                continue;
            }
            // Probability densities of both strategies. Cones may overlap.
            let cosine_density = cosine / PI;
            let containing = cones.iter().filter(|(axis, size)| 1.0 - direction.dot(*axis) <= *size).count();
            // A direction that was sampled in a cone counts as inside it, whatever rounding says.
            let containing = containing.max(usize::from(is_aimed));
            let cone_density = if total > 0.0 { containing as f32 / (TAU * total) } else { cosine_density };
            let weight = cosine_density / (0.5 * cosine_density + 0.5 * cone_density);
            match self.change_along(receiver.origin, direction, light) {
                Some(range) => sums.add(range, weight),
                None => {
                    sums.add([Vec3::ZERO; 2], 0.0);
                    sums.unknown = true;
                }
            }
        }
        sums
    }

    /// The change of the light that arrives along a ray, as radiance times π. `None` if it is not known.
    fn change_along(&self, origin: Vec3, direction: Vec3, light: PatchChange<'_>) -> Option<Range> {
        let is_new =
            |triangle: u32| self.changes.changed[self.scene.triangles[triangle as usize].map.place()];
        let is_black = |hit| matches!(hit, SurfaceHit::Back | SurfaceHit::Inside);
        let now = self.scene.first_surface(origin, direction, |_| true);
        let shows_new = matches!(now, SurfaceHit::Lit { triangle, .. } if is_new(triangle));
        let behind = match shows_new || is_black(now) {
            true => self.scene.first_surface(origin, direction, |triangle| !is_new(triangle)),
            false => now,
        };
        // The light of what is behind new objects: before, its change, and how far away it is.
        let (before, change, distance) = match behind {
            SurfaceHit::Lit { triangle, side, at, distance } => {
                let (before, change) = self.exitance_change(triangle, side, at, light)?;
                (before, change, distance)
            }
            SurfaceHit::None => {
                let before = self.changes.former.sky;
                (before, [self.sky - before; 2], f32::INFINITY)
            }
            SurfaceHit::Back | SurfaceHit::Inside => (Vec3::ZERO, [Vec3::ZERO; 2], f32::INFINITY),
        };
        let after = match now {
            SurfaceHit::Lit { triangle, side, at, .. } if shows_new => {
                let patch = light.patches.at(triangle, side, at);
                [patch.map_or(Vec3::ZERO, |patch| light.exitance[patch.place()]); 2]
            }
            // The back of a new object.
            _ if is_black(now) => [Vec3::ZERO; 2],
            _ => change.map(|change| before + change),
        };
        // Objects that are gone may have been hit before, instead of what is behind them.
        let (mut least, mut most) = (before, before);
        for [darkest, brightest] in self.former_exitances_along(origin, direction, distance) {
            (least, most) = (least.min(darkest), most.max(brightest));
        }
        Some([after[0] - most, after[1] - least])
    }

    /// Light that left the objects of the former scene whose boxes a ray crosses within a distance.
    fn former_exitances_along(
        &self,
        origin: Vec3,
        direction: Vec3,
        distance: f32,
    ) -> impl Iterator<Item = Range> {
        let crosses = move |b: &ChangedBox| {
            let Bounds { low, high } = b.bounds;
            let (mut from, mut to) = (0.0f32, distance);
            for axis in 0..3 {
                let inverse = 1.0 / direction[axis];
                let (a, b) = ((low[axis] - origin[axis]) * inverse, (high[axis] - origin[axis]) * inverse);
                // Both are NaN for a ray in the plane of a flat box, and `min` and `max` ignore them. (Only one is NaN
                // for a ray in the plane of a side of another box: the ray then counts as outside.)
                from = from.max(a.min(b));
                to = to.min(a.max(b));
            }
            from <= to
        };
        self.changes.boxes.iter().filter_map(move |b| b.former_exitance.filter(|_| crosses(b)))
    }

    /// Light that left a point of an unchanged surface before, and its change, W/m². `None` if that is not known.
    fn exitance_change(
        &self,
        triangle: u32,
        side: Side,
        at: (f32, f32),
        light: PatchChange<'_>,
    ) -> Option<(Vec3, Range)> {
        let Some(patch) = light.patches.at(triangle, side, at) else {
            return Some((Vec3::ZERO, [Vec3::ZERO; 2]));
        };
        let patch = patch.place();
        if light.unknown[patch] {
            return None;
        }
        let reflectance = light.patches.list[patch].reflectance;
        let bounced = light.change.get(patch).map_or([Vec3::ZERO; 2], |range| range.map(|c| reflectance * c));
        // Where no texel shows the surface, its former light is taken to be the patch's present light.
        let exitance = light.exitance[patch];
        let shown = self.texels.layout.texel_at(&self.scene.triangles[triangle as usize], at);
        let Some(texel) = shown.filter(|_| side == Side::Front).map(MapTexel::place) else {
            return Some((exitance, bounced));
        };
        let before = self.changes.former_light[texel];
        // A texel without former light was hidden: the object that hid it is gone, and the ray crosses its box.
        let before = if before.is_nan() { exitance } else { reflectance * before };
        let direct = reflectance * self.direct[texel];
        Some((before, bounced.map(|bounced| bounced + direct)))
    }
}
