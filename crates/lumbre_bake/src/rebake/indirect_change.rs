//! How the light by bounces changes: a linear estimate. What leaves a surface is what it was, but for three things: rays that pass through a
//! box see or do not see the changed object in it; direct light has changed where it was computed anew; and what bounces has changed by the same
//! estimate, one bounce later. By channel, between bounds: a box that was filled may or may not have been in a ray's way, and may have shown its
//! brightest or its darkest side. Bounds add up by themselves, so that what is more here and less there cancels only where that is certain.
//! Not exact: what is sampled has the error of its samples, of which one standard error counts.

use std::f32::consts::{PI, TAU};

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::changed_box::ChangedBox;
use super::changes::Changes;
use super::choice;
use super::direct_light_invalidation::ShadowVolumes;
use super::estimate::{Estimate, Range, cap, in_cap};
use crate::chunks::in_chunks;
use crate::coverage::covered_texels::CoveredTexels;
use crate::coverage::footprint::{Texel, receiver};
use crate::coverage::texel_groups::TexelGroups;
use crate::direct_light::DirectLight;
use crate::direct_light::local_light::LocalLight;
use crate::final_gather::reused_gather::ReusedGather;
use crate::monitor::BakeMonitor;
use crate::radiosity::exchange::Exchange;
use crate::radiosity::form_factors::FormFactors;
use crate::radiosity::patches::{Patch, Patches};
use crate::radiosity::solution::gather;
use crate::sampling::{Sequence, Stream, cosine_about, triangle_point};
use crate::scene::Receiver;
use crate::scene::material::Side;
use crate::scene::{BakeScene, LightmapLayout, SurfaceHit};
use crate::sources::direct::Direct;
use crate::sources::light_sources::Sources;
use crate::{BakeError, BakeOptions, BakeReport};

/// Rays of a patch and of a block of texels; every other one towards what has changed.
const RAYS: u32 = 32;
/// Texels along the side of a block.
const BLOCK: u32 = 4;
/// What is nearer to a box than this share of its size has changed for certain.
const BESIDE: f32 = 1.0 / 16.0;
/// Relative residual of a solution that is only an estimate.
const TOLERANCE: f64 = 1e-4;

/// The indirect light of a former bake that this one keeps. `exchange` is the new scene's, with its form factors. The report counts about how many rays
/// it took to decide.
///
/// # Errors
/// [`BakeError::Cancelled`].
#[expect(
    clippy::too_many_arguments,
    reason = "the light of three stages, and the frame that every stage takes"
)]
pub(crate) fn reused_gather(
    changes: &Changes<'_>,
    sources: &Sources<'_>,
    texels: &CoveredTexels<'_>,
    direct: &DirectLight,
    (exchange, factors): (&Exchange, &FormFactors),
    options: &BakeOptions,
    monitor: &mut BakeMonitor<'_>,
    report: &mut BakeReport,
) -> Result<ReusedGather, BakeError> {
    let change =
        monitor.run_interruptible(1.0, || IndirectChange::new(sources, changes, texels, &direct.texels))?;
    let of_patches = change.of_patches(exchange, factors, options, monitor)?;
    let reused = change.keep(exchange, &of_patches, &texels.list, &direct.local, options, monitor)?;
    report.rays += change.rays(&of_patches);
    Ok(reused)
}

/// The light before and now, as far as it is needed to tell the difference.
struct IndirectChange<'a> {
    scene: &'a BakeScene,
    layout: &'a LightmapLayout,
    changes: &'a Changes<'a>,
    blocks: TexelGroups,
    /// Per texel of all maps, by how much direct light (mixed lights included) has changed, W/m².
    direct: Vec<Vec3>,
    /// Irradiance of an unhidden sky now, W/m².
    sky: Vec3,
    /// The changed boxes as spheres: centre, radius.
    cones: Vec<(Vec3, f32)>,
    shadow_volumes: ShadowVolumes,
}

/// What leaves the patches now, and the change of what they receive by bounces, if it is known yet.
#[derive(Clone, Copy)]
struct PatchLight<'a> {
    patches: &'a Patches,
    /// W/m², without emission.
    exitance: &'a [Vec3],
    /// W/m²; empty if not known.
    change: &'a [Range],
    /// Backs, which no texel shows, whose direct light may be another than it was.
    unknown: &'a [bool],
}

impl<'a> IndirectChange<'a> {
    /// From the direct light of every covered texel as it is now.
    fn new(
        sources: &Sources<'a>,
        changes: &'a Changes<'a>,
        texels: &CoveredTexels<'a>,
        direct: &[Direct],
    ) -> Self {
        let CoveredTexels { layout, list: texels, charts, .. } = texels;
        let mut change = vec![Vec3::ZERO; layout.texels];
        for ((texel, now), known) in texels.iter().zip(direct).zip(&changes.known) {
            if let Some(known) = known {
                change[texel.index.place()] = now.total() - known.direct.total();
            }
        }
        Self {
            scene: sources.scene,
            layout,
            changes,
            blocks: TexelGroups::blocks(texels, charts, BLOCK),
            direct: change,
            sky: sources.sky,
            cones: changes.boxes.iter().map(|b| (b.center(), b.radius())).collect(),
            shadow_volumes: ShadowVolumes::new(sources, &changes.boxes),
        }
    }

    /// About how many rays the estimate takes.
    fn rays(&self, of_patches: &[Range]) -> u64 {
        let asked = if of_patches.is_empty() { 0 } else { of_patches.len() + self.blocks.members.len() };
        u64::from(RAYS) * asked as u64
    }

    /// The change of what each patch receives by bounces, W/m²: Δ = S + F ρ Δ, with the change S that is seen at first hand. Nothing in it is
    /// negative, so that bounds of the one are bounds of the other.
    fn of_patches(
        &self,
        exchange: &Exchange,
        factors: &FormFactors,
        options: &BakeOptions,
        monitor: &mut BakeMonitor<'_>,
    ) -> Result<Vec<Range>, BakeError> {
        if self.changes.none {
            return Ok(Vec::new());
        }
        let Exchange { patches, exitance, .. } = exchange;
        let solver = options.solver;
        let unknown = self.unknown_backs(patches);
        let light = PatchLight { patches, exitance, change: &[], unknown: &unknown };
        let is_new = |patch: &Patch| {
            self.changes.changed[self.scene.triangles[patch.triangle as usize].object as usize]
        };
        let first: Vec<(Vec3, Vec3)> = in_chunks(patches.list.len(), monitor, |index| {
            let patch = &patches.list[index];
            if is_new(patch) || patch.reflectance == Vec3::ZERO {
                return (Vec3::ZERO, Vec3::ZERO);
            }
            let sequence = Sequence::new(options.seed, Stream::ChangedPatches, index as u32);
            let point = |x: f32, y: f32| {
                let at = patches.point(patch, triangle_point(x, y));
                Some(Receiver::on_facet(self.scene, patch.triangle, patch.side, at))
            };
            self.seen(sequence, &|_, x, y| point(x, y), light).means().into()
        })?;
        let bound = |which: usize, patch: usize| if which == 0 { first[patch].0 } else { first[patch].1 };
        let job = |job: usize| {
            let (which, channel) = (job / 3, job % 3);
            // What changed objects themselves receive is not a change of theirs.
            let of_patch = |patch: &Patch| f64::from(patch.reflectance[channel]);
            let reflectance: Vec<f64> =
                patches.list.iter().map(|patch| if is_new(patch) { 0.0 } else { of_patch(patch) }).collect();
            // The solver knows light only: what is more and what is less, apart.
            let [more, less] = [1.0f64, -1.0].map(|sign| {
                let emission: Vec<f64> = reflectance
                    .iter()
                    .enumerate()
                    .map(|(patch, rho)| rho * (sign * f64::from(bound(which, patch)[channel])).max(0.0))
                    .collect();
                gather(factors, &solver.solve(factors, &reflectance, &emission, TOLERANCE).radiosity)
            });
            more.iter().zip(&less).map(|(more, less)| more - less).collect::<Vec<f64>>()
        };
        let solved: Vec<Vec<f64>> =
            monitor.run_interruptible(1.0, || (0..6usize).into_par_iter().map(job).collect())?;
        let of_patch = |which: usize, patch: usize| {
            let [red, green, blue] = [0, 1, 2].map(|channel| solved[3 * which + channel][patch]);
            bound(which, patch) + DVec3::new(red, green, blue).as_vec3()
        };
        Ok((0..patches.list.len()).map(|patch| [of_patch(0, patch), of_patch(1, patch)]).collect())
    }

    /// Per patch, whether it is a back whose direct light may have changed: no texel tells by how much.
    fn unknown_backs(&self, patches: &Patches) -> Vec<bool> {
        let is_unknown = |patch: &Patch| {
            patch.side == Side::Back
                && patch.reflectance != Vec3::ZERO
                && (self.changes.lights || self.shadow_volumes.cross(&patches.corners(self.scene, patch)))
        };
        patches.list.par_iter().map(is_unknown).collect()
    }

    /// What is kept of the light by bounces.
    fn keep(
        &self,
        exchange: &Exchange,
        of_patches: &[Range],
        texels: &[Texel],
        local: &LocalLight,
        options: &BakeOptions,
        monitor: &mut BakeMonitor<'_>,
    ) -> Result<ReusedGather, BakeError> {
        if self.changes.none {
            return Ok(choice::all(self.changes));
        }
        let Exchange { patches, exitance, .. } = exchange;
        let unknown = self.unknown_backs(patches);
        let light = PatchLight { patches, exitance, change: of_patches, unknown: &unknown };
        let change = self.of_texels(texels, light, options, monitor)?;
        Ok(choice::choose(self.changes, texels, &change, local, options.error))
    }

    /// By how much the light by bounces may have changed at every covered texel, W/m², root mean square of the channels: that of its block.
    /// Infinite within what has changed.
    fn of_texels(
        &self,
        texels: &[Texel],
        light: PatchLight<'_>,
        options: &BakeOptions,
        monitor: &mut BakeMonitor<'_>,
    ) -> Result<Vec<f32>, BakeError> {
        let found = in_chunks(self.blocks.members.len(), monitor, |block| {
            let members: Vec<&Texel> =
                self.blocks.members[block].iter().map(|&member| &texels[member as usize]).collect();
            if members.is_empty() {
                return 0.0f32;
            }
            let sequence = Sequence::new(options.seed, Stream::ChangedTexels, block as u32);
            // Each is asked in both ways in turn.
            let point = |ray: u32, x, y| {
                let texel = members[ray as usize / 2 % members.len()];
                texel.point(self.scene, x, y).map(|point| receiver(self.scene, &point))
            };
            let within = members.iter().any(|texel| {
                let point = texel.point(self.scene, 0.5, 0.5);
                point.is_some_and(|point| self.is_within(receiver(self.scene, &point).position))
            });
            if within { f32::INFINITY } else { self.seen(sequence, &point, light).most() }
        })?;
        Ok(self.blocks.group_of.iter().map(|&block| found[block as usize]).collect())
    }

    /// Whether a point is in a changed box, or next to it.
    fn is_within(&self, position: Vec3) -> bool {
        self.changes
            .boxes
            .iter()
            .any(|b| position.clamp(b.low, b.high).distance(position) <= BESIDE * b.radius())
    }

    /// The change of what a receiver gets by bounces, with the light as it is known: half the rays by the cosine, half into the cones about what
    /// has changed, in proportion to their solid angles, weighed by the balance heuristic (Veach and Guibas, "Optimally Combining Sampling Techniques for Monte
    /// Carlo Rendering", 1995, section 3.3).
    fn seen(
        &self,
        sequence: Sequence,
        point: &impl Fn(u32, f32, f32) -> Option<Receiver>,
        light: PatchLight<'_>,
    ) -> Estimate {
        let mut estimate = Estimate::default();
        // Solid angles of the cones over 2π, running.
        let mut ends = Vec::with_capacity(self.cones.len());
        for ray in 0..RAYS {
            let [x, y, u, v] = sequence.point(ray, 0);
            let Some(receiver) = point(ray, x, y) else { continue };
            let caps: Vec<(Vec3, f32)> =
                self.cones.iter().map(|&(center, radius)| cap(receiver.position, center, radius)).collect();
            ends.clear();
            let mut all = 0.0;
            for (_, size) in &caps {
                all += size;
                ends.push(all);
            }
            let aimed = ray % 2 == 1 && all > 0.0;
            let direction = if aimed {
                let place = u * all;
                let chosen = ends.partition_point(|&end| end <= place).min(caps.len() - 1);
                let (axis, size) = caps[chosen];
                let before = ends[chosen] - size;
                in_cap(axis, size, ((place - before) / size).clamp(0.0, 1.0), v)
            } else {
                cosine_about(receiver.geometric_normal, u, v)
            };
            let cosine = direction.dot(receiver.geometric_normal);
            if cosine <= 0.0 {
                estimate.add([Vec3::ZERO; 2], 0.0);
                continue;
            }
            let by_cosine = cosine / PI;
            let within = caps.iter().filter(|(axis, size)| 1.0 - direction.dot(*axis) <= *size).count();
            // Rounding puts none outside that it was aimed at.
            let within = within.max(usize::from(aimed));
            let by_caps = if all > 0.0 { within as f32 / (TAU * all) } else { by_cosine };
            let weight = by_cosine / (0.5 * by_cosine + 0.5 * by_caps);
            match self.along(receiver.origin, direction, light) {
                Some(range) => estimate.add(range, weight),
                None => {
                    estimate.add([Vec3::ZERO; 2], 0.0);
                    estimate.unknown = true;
                }
            }
        }
        estimate
    }

    /// By how much what comes along a ray has changed, times π. None if that cannot be told.
    fn along(&self, origin: Vec3, direction: Vec3, light: PatchLight<'_>) -> Option<Range> {
        let is_new =
            |triangle: u32| self.changes.changed[self.scene.triangles[triangle as usize].object as usize];
        let is_black = |hit| matches!(hit, SurfaceHit::Back | SurfaceHit::Inside);
        let now = self.scene.first_surface(origin, direction, |_| true);
        let shows_new = matches!(now, SurfaceHit::Lit { triangle, .. } if is_new(triangle));
        let behind = match shows_new || is_black(now) {
            true => self.scene.first_surface(origin, direction, |triangle| !is_new(triangle)),
            false => now,
        };
        let (was, more, distance) = match behind {
            SurfaceHit::Lit { triangle, side, at, distance } => {
                let (was, more) = self.at(triangle, side, at, light)?;
                (was, more, distance)
            }
            SurfaceHit::None => {
                let was = self.changes.former.sky;
                (was, [self.sky - was; 2], f32::INFINITY)
            }
            SurfaceHit::Back | SurfaceHit::Inside => (Vec3::ZERO, [Vec3::ZERO; 2], f32::INFINITY),
        };
        let arrives = match now {
            SurfaceHit::Lit { triangle, side, at, .. } if shows_new => {
                let patch = light.patches.at(triangle, side, at);
                [patch.map_or(Vec3::ZERO, |patch| light.exitance[patch.place()]); 2]
            }
            // The back of something new.
            _ if is_black(now) => [Vec3::ZERO; 2],
            _ => more.map(|more| was + more),
        };
        let (mut least, mut most) = (was, was);
        for [darkest, brightest] in self.crossed(origin, direction, distance) {
            (least, most) = (least.min(darkest), most.max(brightest));
        }
        Some([arrives[0] - most, arrives[1] - least])
    }

    /// What left the objects whose boxes a ray crosses on its way.
    fn crossed(&self, origin: Vec3, direction: Vec3, distance: f32) -> impl Iterator<Item = Range> {
        let crosses = move |b: &ChangedBox| {
            let (mut from, mut to) = (0.0f32, distance);
            for axis in 0..3 {
                let inverse = 1.0 / direction[axis];
                let (a, b) =
                    ((b.low[axis] - origin[axis]) * inverse, (b.high[axis] - origin[axis]) * inverse);
                // Not a number where the ray runs in the plane of a side: it then does not narrow the range.
                from = from.max(a.min(b));
                to = to.min(a.max(b));
            }
            from <= to
        };
        self.changes.boxes.iter().filter_map(move |b| b.left.filter(|_| crosses(b)))
    }

    /// What left a point of an unchanged surface before, and by how much more leaves it now. None if that cannot be told.
    fn at(
        &self,
        triangle: u32,
        side: Side,
        (u, v): (f32, f32),
        light: PatchLight<'_>,
    ) -> Option<(Vec3, Range)> {
        let Some(patch) = light.patches.at(triangle, side, (u, v)) else {
            return Some((Vec3::ZERO, [Vec3::ZERO; 2]));
        };
        let patch = patch.place();
        if light.unknown[patch] {
            return None;
        }
        let reflectance = light.patches.list[patch].reflectance;
        let bounced = light.change.get(patch).map_or([Vec3::ZERO; 2], |range| range.map(|c| reflectance * c));
        // Of what no texel shows the patches tell the light as it is now.
        let exitance = light.exitance[patch];
        let scene_triangle = &self.scene.triangles[triangle as usize];
        let map = &self.layout.maps[scene_triangle.object as usize];
        let [a, b, c] = scene_triangle.uv;
        let uv = a + (b - a) * u + (c - a) * v;
        let (x, y) = (uv.x as u32, uv.y as u32);
        if side == Side::Back || x >= map.width || y >= map.height {
            return Some((exitance, bounced));
        }
        let texel = map.first + (y * map.width + x) as usize;
        let before = self.changes.former_light[texel];
        // Hidden until now: whatever hid it was a box on the ray's way.
        let was = if before.is_nan() { exitance } else { reflectance * before };
        let direct = reflectance * self.direct[texel];
        Some((was, bounced.map(|bounced| bounced + direct)))
    }
}
