//! Counts for form factors by global lines: straight lines spread evenly over all that cross the scene's bounding sphere. A patch of area A
//! is crossed by N · 2A / A_sphere of N lines, and the parts of lines that leave its front have the cosine's density; so each part of a line
//! between two surfaces that face each other is a ray of both at once (Sbert, "An integral geometry based method for fast form-factor
//! computation", Computer Graphics Forum 12(3), 1993; Sbert, Pueyo, Neumann, Purgathofer, "Global multipath Monte Carlo algorithms for
//! radiosity", 1996). One low-discrepancy sequence serves all patches. Small patches are crossed seldom: those have cosine rays beside.
//! Not what becomes of the counts: that is `form_factors`.

use glam::Vec3;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::cosine_rays::{self, MIN_RAYS};
use super::patch_index::PatchIndex;
use super::patches::Patches;
use crate::BakeError;
use crate::chunks::{in_chunks, in_chunks_until_deadline};
use crate::monitor::BakeMonitor;
use crate::radiosity::ray_counts::{PatchRayCounts, counted};
use crate::sampling::{Sequence, Stream, cosine_direction, frame, sphere_direction};
use crate::scene::BakeScene;
use crate::scene::crossings::Face;

/// Lines of one value of the list that is computed in chunks.
const BATCH: u32 = 64;

/// What stands at an end of a line's part: a patch, or one of three numbers that no patch has, as a list of them may be very long.
#[derive(Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
struct LineEnd(u32);

impl LineEnd {
    const NOTHING: Self = Self(u32::MAX);
    const BACK: Self = Self(u32::MAX - 1);
    const INSIDE: Self = Self(u32::MAX - 2);

    fn new(patches: &Patches, face: Face) -> Self {
        match face {
            Face::Lit { triangle, side, at } => {
                patches.at(triangle, side, at).map_or(Self::BACK, |patch| Self(patch.0))
            }
            Face::Back => Self::BACK,
            Face::Inside => Self::INSIDE,
        }
    }

    fn patch(self) -> Option<PatchIndex> {
        (self.0 < Self::INSIDE.0).then_some(PatchIndex(self.0))
    }
}

/// Lines that cost about as much as `rays` rays, and how many they were, with the rays of small patches.
///
/// # Errors
/// [`BakeError::Cancelled`].
pub(crate) fn cast(
    scene: &BakeScene,
    patches: &Patches,
    rays: usize,
    seed: u32,
    monitor: &mut BakeMonitor<'_>,
) -> Result<(Vec<PatchRayCounts>, u64), BakeError> {
    let lines = Lines::new(scene, seed);
    let count = (rays as f64 / lines.cost(scene)).ceil();
    let batches = (count / f64::from(BATCH)).ceil() as usize;
    let parts =
        in_chunks_until_deadline(batches, monitor, |batch| lines.parts(scene, patches, batch as u32))?;
    let lines = parts.len() as u64 * u64::from(BATCH);
    let mut cast = counts_of(&parts, patches.list.len());
    let few = |cast: &PatchRayCounts| cast.count.iter().sum::<u32>() < MIN_RAYS;
    let seldom: Vec<PatchIndex> =
        PatchIndex::all(cast.len()).filter(|index| few(&cast[index.place()])).collect();
    let rays = in_chunks(seldom.len(), monitor, |place| {
        cosine_rays::of_patch(scene, patches, seldom[place], MIN_RAYS, seed)
    })?;
    for (index, rays) in seldom.iter().zip(&rays) {
        cast[index.place()].add(rays);
    }
    Ok((cast, lines + rays.len() as u64 * u64::from(MIN_RAYS)))
}

/// All lines that cross the bounding sphere.
struct Lines {
    center: Vec3,
    radius: f32,
    halves: [Sequence; 2],
}

impl Lines {
    fn new(scene: &BakeScene, seed: u32) -> Self {
        let corners = || scene.triangles.iter().filter(|t| !t.is_hidden_duplicate).flat_map(|t| t.corners);
        let (low, high) = corners().fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), corner| {
            (low.min(corner), high.max(corner))
        });
        let center = 0.5 * (low + high);
        let radius = corners().map(|corner| (corner - center).length()).fold(0.0, f32::max);
        let halves = [0, 1].map(|half| Sequence::new(seed, Stream::GlobalLines(half), 0));
        Self { center, radius, halves }
    }

    /// Rays that a line takes the time of: one, and a part for each surface that it crosses, 2A / A_sphere of every area A on average.
    fn cost(&self, scene: &BakeScene) -> f64 {
        const CROSSING: f64 = 0.5;
        let area: f64 =
            scene.triangles.iter().filter(|t| !t.is_hidden_duplicate).map(|t| f64::from(t.area)).sum();
        let sphere = 4.0 * std::f64::consts::PI * f64::from(self.radius).powi(2);
        let crossings = if sphere > 0.0 { 2.0 * area / sphere } else { 0.0 };
        LINE + CROSSING * crossings
    }

    /// Line `index` of a half: where it begins, outside the sphere, and its direction. Either direction of a line is the same line: half a
    /// sphere of them is all.
    fn line(&self, half: u32, index: u32) -> (Vec3, Vec3) {
        let [u, v, a, b] = self.halves[half as usize].point(index, 0);
        let direction = sphere_direction(0.5 * u, v).normalize_or(Vec3::Z);
        let [x, y] = frame(direction);
        let on_disc = cosine_direction(a, b);
        let across = (x * on_disc.x + y * on_disc.y) * self.radius;
        // A little outside, so that nothing lies before the line's beginning.
        (self.center + across - direction * (1.125 * self.radius), direction)
    }

    /// What stands at both ends of each part of a batch's lines, where one of them is a patch. Batches take turns in the halves.
    fn parts(&self, scene: &BakeScene, patches: &Patches, batch: u32) -> Vec<(LineEnd, LineEnd)> {
        let reach = self.center.length() + self.radius;
        let mut parts = Vec::with_capacity(2 * BATCH as usize);
        for line in 0..BATCH {
            let (origin, direction) = self.line(batch % 2, batch / 2 * BATCH + line);
            let mut behind = LineEnd::NOTHING;
            let mut add = |a: LineEnd, b: LineEnd| {
                if a.patch().or(b.patch()).is_some() {
                    parts.push((a, b));
                }
            };
            for crossing in scene.crossings(origin, direction, reach) {
                add(behind, LineEnd::new(patches, crossing.before));
                behind = LineEnd::new(patches, crossing.beyond);
            }
            add(behind, LineEnd::NOTHING);
        }
        parts
    }
}

/// Of a line that meets nothing, in rays.
const LINE: f64 = 1.0;

/// Both ends of each part count it.
fn counts_of(batches: &[Vec<(LineEnd, LineEnd)>], patches: usize) -> Vec<PatchRayCounts> {
    let mut cast = vec![PatchRayCounts::default(); patches];
    for half in 0..2 {
        let mut hits: Vec<Vec<PatchIndex>> = vec![Vec::new(); patches];
        for &(a, b) in batches.iter().skip(half).step_by(2).flatten() {
            for (from, to) in [(a, b), (b, a)] {
                let Some(from) = from.patch() else { continue };
                let own = &mut cast[from.place()];
                own.count[half] += 1;
                match to {
                    LineEnd::NOTHING => own.missed[half] += 1,
                    LineEnd::INSIDE => own.inside[half] += 1,
                    // What a patch sees of itself across a rounded edge is nothing.
                    _ => hits[from.place()].extend(to.patch().filter(|&patch| patch != from)),
                }
            }
        }
        hits.into_par_iter().map(counted).zip(&mut cast).for_each(|(met, own)| own.hits[half] = met);
    }
    cast
}
