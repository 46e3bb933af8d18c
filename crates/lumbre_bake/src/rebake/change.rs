//! How the light by bounces changes: a linear estimate. What leaves a surface is what it was, but for three things: rays that pass through a
//! box see or do not see the changed object in it; direct light has changed where it was computed anew; and what bounces has changed by the same
//! estimate, one bounce later. Not exact: boxes count as filled, and what they hid is taken to be as bright as it was.

use std::f32::consts::{PI, TAU};
use std::sync::atomic::{AtomicU64, Ordering};

use glam::Vec3;

use super::blocks::Blocks;
use super::changes::{ChangedBox, Changes};
use super::kept::Kept;
use crate::progress::Watch;
use crate::sampling::{Sequence, cosine_about, frame, triangle_point};
use crate::scene::material::Side;
use crate::scene::{BakeScene, LightmapLayout, SurfaceHit};
use crate::texels::chunks::in_chunks;
use crate::texels::footprint::{Texel, receiver};
use crate::transport::direct::{Direct, Receiver};
use crate::transport::exchange::Exchange;
use crate::transport::form_factors::FormFactors;
use crate::transport::patches::{Patch, Patches};
use crate::transport::solver::{Solver, gather};
use crate::{BakeError, BakeOptions};

/// Rays of a patch and of a block of texels; every other one towards what has changed.
const RAYS: u32 = 32;
/// Texels along the side of a block.
pub(crate) const BLOCK: u32 = 4;
/// What the seed is hashed with.
const PURPOSE: u32 = 50;
/// What is nearer to a box than this share of its size has changed for certain.
const BESIDE: f32 = 1.0 / 16.0;
/// Relative residual of a solution that is only an estimate.
const TOLERANCE: f64 = 1e-4;

/// The light before and now, as far as it is needed to tell the difference.
pub(crate) struct Change<'a> {
    pub scene: &'a BakeScene,
    pub layout: &'a LightmapLayout,
    pub changes: &'a Changes<'a>,
    /// Per texel of all maps, by how much direct light (mixed lights included) has changed, W/m².
    pub direct: Vec<Vec3>,
    /// Irradiance of an unhidden sky now, W/m².
    pub sky: Vec3,
    /// The changed boxes as spheres: centre, radius.
    cones: Vec<(Vec3, f32)>,
    rays: AtomicU64,
}

/// What leaves the patches now, and the change of what they receive by bounces, if it is known yet.
#[derive(Clone, Copy)]
pub(crate) struct PatchLight<'a> {
    pub patches: &'a Patches,
    /// W/m², without emission.
    pub exitance: &'a [Vec3],
    /// W/m², mean of the channels; empty if not known.
    pub change: &'a [f32],
}

/// A mean of samples and its standard error.
#[derive(Clone, Copy, Debug, Default)]
struct Estimate {
    sum: f64,
    squares: f64,
    count: f64,
}

impl Estimate {
    fn add(&mut self, value: f32) {
        self.sum += f64::from(value);
        self.squares += f64::from(value * value);
        self.count += 1.0;
    }

    fn mean(&self) -> f32 {
        (self.sum / self.count.max(1.0)) as f32
    }

    fn standard_error(&self) -> f32 {
        let mean = self.sum / self.count.max(1.0);
        let variance = (self.squares / self.count.max(1.0) - mean * mean).max(0.0);
        (variance / self.count.max(1.0)).sqrt() as f32
    }
}

fn grey(light: Vec3) -> f32 {
    light.element_sum() / 3.0
}

impl<'a> Change<'a> {
    /// From the direct light of every covered texel as it is now.
    pub fn new(
        scene: &'a BakeScene,
        layout: &'a LightmapLayout,
        changes: &'a Changes<'a>,
        texels: &[Texel],
        direct: &[Direct],
        sky: Vec3,
    ) -> Self {
        let mut change = vec![Vec3::ZERO; layout.texels];
        for ((texel, now), known) in texels.iter().zip(direct).zip(&changes.known) {
            if let Some(known) = known {
                change[texel.index as usize] = now.total() - known.direct.total();
            }
        }
        let cones = changes.boxes.iter().map(|b| (b.center(), b.radius())).collect();
        Self { scene, layout, changes, direct: change, sky, cones, rays: AtomicU64::new(0) }
    }

    /// Rays cast so far.
    pub fn rays(&self) -> u64 {
        self.rays.load(Ordering::Relaxed)
    }

    /// The change of what each patch receives by bounces, W/m², mean of the channels: Δ = S + F ρ Δ, with the change S that is seen at first hand.
    ///
    /// # Errors
    /// [`BakeError::Cancelled`].
    pub fn of_patches(
        &self,
        patches: &Patches,
        exitance: &[Vec3],
        factors: &FormFactors,
        solver: Solver,
        options: &BakeOptions,
        watch: &mut Watch<'_>,
    ) -> Result<Vec<f32>, BakeError> {
        let light = PatchLight { patches, exitance, change: &[] };
        let is_new = |patch: &Patch| {
            self.changes.changed[self.scene.triangles[patch.triangle as usize].object as usize]
        };
        let first = in_chunks(patches.list.len(), watch, |index| {
            let patch = &patches.list[index];
            if is_new(patch) || patch.reflectance == Vec3::ZERO {
                return 0.0f32;
            }
            let sequence = Sequence::new(options.seed, PURPOSE, index as u32);
            let triangle = &self.scene.triangles[patch.triangle as usize];
            let point = |x: f32, y: f32| {
                let (u, v) = patches.point(patch, triangle_point(x, y));
                let position = triangle.position(u, v);
                let origin = self.scene.off_surface(patch.triangle, patch.side, position);
                let normal = triangle.side_normal(patch.side);
                Some(Receiver { position, origin, geometric_normal: normal, normal })
            };
            self.seen(sequence, &|_, x, y| point(x, y), light).mean()
        })?;
        // What changed objects themselves receive is not a change of theirs.
        let reflectance: Vec<f64> = patches
            .list
            .iter()
            .map(|patch| if is_new(patch) { 0.0 } else { f64::from(grey(patch.reflectance)) })
            .collect();
        // The solver knows light only: what is more and what is less, apart.
        let [more, less] = [1.0f64, -1.0].map(|sign| {
            let emission: Vec<f64> = first
                .iter()
                .zip(&reflectance)
                .map(|(&first, rho)| rho * (sign * f64::from(first)).max(0.0))
                .collect();
            gather(factors, &solver.solve(factors, &reflectance, &emission, TOLERANCE).radiosity)
        });
        Ok(first
            .iter()
            .zip(more.iter().zip(&less))
            .map(|(&first, (more, less))| first + (more - less) as f32)
            .collect())
    }

    /// By how much the light by bounces may have changed at every covered texel, W/m², mean of the channels: the mean over its block, with one standard
    /// error. Infinite within what has changed.
    ///
    /// # Errors
    /// [`BakeError::Cancelled`].
    pub fn of_texels(
        &self,
        texels: &[Texel],
        light: PatchLight<'_>,
        options: &BakeOptions,
        watch: &mut Watch<'_>,
    ) -> Result<Vec<f32>, BakeError> {
        let blocks = Blocks::new(texels, BLOCK);
        let found = in_chunks(blocks.members.len(), watch, |block| {
            let members: Vec<&Texel> =
                blocks.members[block].iter().map(|&member| &texels[member as usize]).collect();
            if members.is_empty() {
                return 0.0f32;
            }
            let sequence = Sequence::new(options.seed, PURPOSE + 1, block as u32);
            let point = |ray: u32, x, y| {
                let texel = members[ray as usize % members.len()];
                texel.point(self.scene, x, y).map(|point| receiver(self.scene, &point))
            };
            let within = members.iter().any(|texel| {
                let point = texel.point(self.scene, 0.5, 0.5);
                point.is_some_and(|point| self.is_within(receiver(self.scene, &point).position))
            });
            if within {
                return f32::INFINITY;
            }
            let seen = self.seen(sequence, &point, light);
            seen.mean().abs() + seen.standard_error()
        })?;
        Ok(blocks.of.iter().map(|&block| found[block as usize]).collect())
    }

    /// What is kept of the light by bounces.
    ///
    /// # Errors
    /// [`BakeError::Cancelled`].
    pub fn keep(
        &self,
        exchange: &Exchange,
        texels: &[Texel],
        options: &BakeOptions,
        watch: &mut Watch<'_>,
    ) -> Result<Kept, BakeError> {
        let Exchange { patches, exitance, change, .. } = exchange;
        let light = PatchLight { patches, exitance, change };
        let change = self.of_texels(texels, light, options, watch)?;
        // The error asked for is relative to the light that there is: as it was, where that is known.
        let lit = self.changes.known.iter().flatten();
        let (sum, count) = lit.fold((0.0, 0u32), |(sum, count), own| {
            (sum + f64::from(grey(own.direct.baked + own.bounced)), count + 1)
        });
        let asked = options.error * sum / f64::from(count.max(1));
        Ok(Kept::choose(self.changes, texels, &change, asked))
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
                estimate.add(0.0);
                continue;
            }
            let by_cosine = cosine / PI;
            let within = caps.iter().filter(|(axis, size)| 1.0 - direction.dot(*axis) <= *size).count();
            // Rounding puts none outside that it was aimed at.
            let within = within.max(usize::from(aimed));
            let by_caps = if all > 0.0 { within as f32 / (TAU * all) } else { by_cosine };
            let weight = by_cosine / (0.5 * by_cosine + 0.5 * by_caps);
            estimate.add(weight * self.along(receiver.origin, direction, light));
        }
        estimate
    }

    /// By how much what comes along a ray has changed, times π.
    fn along(&self, origin: Vec3, direction: Vec3, light: PatchLight<'_>) -> f32 {
        let is_new =
            |triangle: u32| self.changes.changed[self.scene.triangles[triangle as usize].object as usize];
        let now = self.scene.first_surface(origin, direction, |_| true);
        self.rays.fetch_add(1, Ordering::Relaxed);
        let (shows_new, behind) = match now {
            SurfaceHit::Lit { triangle, .. } if is_new(triangle) => {
                self.rays.fetch_add(1, Ordering::Relaxed);
                (true, self.scene.first_surface(origin, direction, |triangle| !is_new(triangle)))
            }
            _ => (false, now),
        };
        let (was, more, distance) = match behind {
            SurfaceHit::Lit { triangle, side, at, distance } => {
                let (was, more) = self.at(triangle, side, at, light);
                (was, more, distance)
            }
            SurfaceHit::None => {
                let was = self.changes.former.sky;
                (was, grey(self.sky - was), f32::INFINITY)
            }
            SurfaceHit::Back | SurfaceHit::Inside => (Vec3::ZERO, 0.0, f32::INFINITY),
        };
        let arrives = match now {
            SurfaceHit::Lit { triangle, side, at, .. } if shows_new => {
                let patch = light.patches.at(triangle, side, at);
                grey(patch.map_or(Vec3::ZERO, |patch| light.exitance[patch as usize]))
            }
            _ => grey(was) + more,
        };
        // A box that was filled may or may not have been in the way: what differs more counts.
        let mut change = arrives - grey(was);
        for left in self.crossed(origin, direction, distance) {
            let other = arrives - grey(left);
            if other.abs() > change.abs() {
                change = other;
            }
        }
        change
    }

    /// What left the objects whose boxes a ray crosses on its way.
    fn crossed(&self, origin: Vec3, direction: Vec3, distance: f32) -> impl Iterator<Item = Vec3> {
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

    /// What left a point of an unchanged surface before, and by how much more leaves it now, mean of the channels.
    fn at(&self, triangle: u32, side: Side, (u, v): (f32, f32), light: PatchLight<'_>) -> (Vec3, f32) {
        let Some(patch) = light.patches.at(triangle, side, (u, v)) else { return (Vec3::ZERO, 0.0) };
        let reflectance = light.patches.list[patch as usize].reflectance;
        let bounced = light.change.get(patch as usize).copied().unwrap_or(0.0);
        let bounced = grey(reflectance) * bounced;
        // Of what no texel shows, the backs of sheets, the patches tell the light as it is now.
        let exitance = light.exitance[patch as usize];
        if side == Side::Back {
            return (exitance, bounced);
        }
        let scene_triangle = &self.scene.triangles[triangle as usize];
        let map = &self.layout.maps[scene_triangle.object as usize];
        let [a, b, c] = scene_triangle.uv;
        let uv = a + (b - a) * u + (c - a) * v;
        let (x, y) = (uv.x as u32, uv.y as u32);
        if x >= map.width || y >= map.height {
            return (exitance, bounced);
        }
        let texel = map.first + (y * map.width + x) as usize;
        let before = self.changes.former_light[texel];
        // Hidden until now: whatever hid it was a box on the ray's way.
        let was = if before.is_nan() { exitance } else { reflectance * before };
        (was, bounced + grey(reflectance * self.direct[texel]))
    }
}

/// The cone from a point about a sphere: its axis, and 1 - cos of half its angle, which is its solid angle over 2π. All directions from within.
fn cap(from: Vec3, center: Vec3, radius: f32) -> (Vec3, f32) {
    let apart = center - from;
    let distance = apart.length();
    if distance <= radius {
        return (Vec3::Z, 2.0);
    }
    let sine = radius / distance;
    let cosine = (1.0 - sine * sine).max(0.0).sqrt();
    (apart / distance, sine * sine / (1.0 + cosine))
}

/// A direction of a cone, spread evenly over its solid angle.
fn in_cap(axis: Vec3, size: f32, u: f32, v: f32) -> Vec3 {
    let height = u * size;
    let cosine = 1.0 - height;
    let sine = (height * (2.0 - height)).max(0.0).sqrt();
    let (y, x) = (TAU * v).sin_cos();
    let [a, b] = frame(axis);
    (a * (x * sine) + b * (y * sine) + axis * cosine).normalize_or(axis)
}
