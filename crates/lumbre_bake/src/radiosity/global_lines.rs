//! Counts for form factors by global lines: straight lines distributed uniformly over all that cross the scene's
//! bounding sphere. Of N lines, N · 2A / A_sphere cross a patch of area A, and where they leave its front their
//! directions are cosine-distributed; so each segment of a line between two surfaces that face each other is a ray from
//! both at once (Sbert, "An integral geometry based method for fast form-factor computation", Computer Graphics Forum
//! 12(3), 1993; Sbert, Pueyo, Neumann, Purgathofer, "Global multipath Monte Carlo algorithms for radiosity", 1996). One
//! low-discrepancy sequence serves all patches. Few lines cross a small patch, so small patches cast cosine rays as
//! well. The counts become form factors in `form_factors`.

use glam::Vec3;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::cosine_rays::{self, MIN_RAYS};
use super::patch_index::PatchIndex;
use super::patches::Patches;
use super::ray_counts::{PatchRayCounts, counted};
use crate::BakeError;
use crate::bounds::Bounds;
use crate::chunks::{in_chunks, in_chunks_until_deadline};
use crate::monitor::BakeMonitor;
use crate::sampling::{Sequence, Stream, cosine_direction, frame, sphere_direction};
use crate::scene::{BakeScene, Face};

/// Lines that are cast together, as one value of a list that is computed in chunks.
const BATCH: u32 = 64;

/// What is at an end of a line's segment: a patch, or one of three values that are no patch's number. One word each,
/// since the list of them may be very long.
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

/// Casts as many lines as take about the time of `rays` rays. Returns the counts per patch, and the number of lines and
/// of the rays from small patches together.
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
    let segments =
        in_chunks_until_deadline(batches, monitor, |batch| lines.segments(scene, patches, batch as u32))?;
    let lines = segments.len() as u64 * u64::from(BATCH);
    let mut counts = counts_of(&segments, patches);
    let is_crossed_seldom = |index: &PatchIndex| counts[index.place()].count.iter().sum::<u32>() < MIN_RAYS;
    let seldom: Vec<PatchIndex> = PatchIndex::all(counts.len()).filter(is_crossed_seldom).collect();
    let rays = in_chunks(seldom.len(), monitor, |place| {
        cosine_rays::cast_from_patch(scene, patches, seldom[place], MIN_RAYS, seed)
    })?;
    for (index, rays) in seldom.iter().zip(&rays) {
        counts[index.place()].add(rays);
    }
    Ok((counts, lines + rays.len() as u64 * u64::from(MIN_RAYS)))
}

/// The lines that cross the scene's bounding sphere.
struct Lines {
    center: Vec3,
    radius: f32,
    /// Of two independent halves of the lines.
    halves: [Sequence; 2],
}

impl Lines {
    fn new(scene: &BakeScene, seed: u32) -> Self {
        let corners = || scene.triangles.iter().filter(|t| !t.is_hidden_duplicate).flat_map(|t| t.corners);
        let Bounds { low, high } = corners().collect();
        let center = 0.5 * (low + high);
        let radius = corners().map(|corner| (corner - center).length()).fold(0.0, f32::max);
        let halves = [0, 1].map(|half| Sequence::new(seed, Stream::GlobalLines(half), 0));
        Self { center, radius, halves }
    }

    /// Time that a line takes, in rays. On average a line crosses 2A / A_sphere surfaces of a total area A.
    fn cost(&self, scene: &BakeScene) -> f64 {
        let area: f64 =
            scene.triangles.iter().filter(|t| !t.is_hidden_duplicate).map(|t| f64::from(t.area)).sum();
        let sphere = 4.0 * std::f64::consts::PI * f64::from(self.radius).powi(2);
        let crossings = if sphere > 0.0 { 2.0 * area / sphere } else { 0.0 };
        LINE_COST + CROSSING_COST * crossings
    }

    /// Line `index` of a half: where it begins, outside the sphere, and its direction. Opposite directions give the
    /// same line, so a hemisphere of directions is enough.
    fn line(&self, half: u32, index: u32) -> (Vec3, Vec3) {
        let [u, v, a, b] = self.halves[half as usize].point(index, 0);
        let direction = sphere_direction(0.5 * u, v).normalize_or(Vec3::Z);
        let [x, y] = frame(direction);
        let on_disc = cosine_direction(a, b);
        let across = (x * on_disc.x + y * on_disc.y) * self.radius;
        // It begins a little outside, so that nothing of the scene lies before its beginning.
        (self.center + across - direction * (1.125 * self.radius), direction)
    }

    /// Both ends of each segment of a batch's lines, if at least one of them is a patch. Even batches are of one half,
    /// odd ones of the other.
    fn segments(&self, scene: &BakeScene, patches: &Patches, batch: u32) -> Vec<(LineEnd, LineEnd)> {
        let reach = self.center.length() + self.radius;
        let mut segments = Vec::with_capacity(2 * BATCH as usize);
        for line in 0..BATCH {
            let (origin, direction) = self.line(batch % 2, batch / 2 * BATCH + line);
            let mut behind = LineEnd::NOTHING;
            let mut add = |a: LineEnd, b: LineEnd| {
                if a.patch().or(b.patch()).is_some() {
                    segments.push((a, b));
                }
            };
            for crossing in scene.crossings(origin, direction, reach) {
                add(behind, LineEnd::new(patches, crossing.before));
                behind = LineEnd::new(patches, crossing.beyond);
            }
            add(behind, LineEnd::NOTHING);
        }
        segments
    }
}

/// Time that a line takes which crosses nothing, and that each crossing adds, in rays.
const LINE_COST: f64 = 1.0;
const CROSSING_COST: f64 = 0.5;

/// The counts per patch, from the segments of all batches: a segment is a ray from each of its ends.
fn counts_of(batches: &[Vec<(LineEnd, LineEnd)>], patches: &Patches) -> Vec<PatchRayCounts> {
    let count = patches.list.len();
    let mut counts = vec![PatchRayCounts::default(); count];
    for half in 0..2 {
        let mut hits: Vec<Vec<PatchIndex>> = vec![Vec::new(); count];
        for &(a, b) in batches.iter().skip(half).step_by(2).flatten() {
            for (from, to) in [(a, b), (b, a)] {
                let Some(from) = from.patch() else { continue };
                let counts = &mut counts[from.place()];
                counts.count[half] += 1;
                match to {
                    LineEnd::NOTHING => counts.missed[half] += 1,
                    LineEnd::INSIDE => counts.inside[half] += 1,
                    // A flat patch cannot see itself; rounding at its edges may say so.
                    _ => {
                        let may_see = |&to: &PatchIndex| to != from || patches.sees_itself(from);
                        hits[from.place()].extend(to.patch().filter(may_see));
                    }
                }
            }
        }
        let hits = hits.into_par_iter().map(counted);
        hits.zip(&mut counts).for_each(|(hits, counts)| counts.hits[half] = hits);
    }
    counts
}
