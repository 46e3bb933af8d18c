//! The error of the map's own resolution: the difference between a bilinear look-up of the map at points of the
//! surfaces and the light that arrives there. The points, spread evenly over the surfaces' area, are baked on their
//! own, by the same direct light and the same gather as texels. The squared difference is the product of the
//! differences to two independent halves of a point's samples, which is free of the samples' noise; the sampling error
//! of the map itself, by its own estimate, is subtracted. Not the sampling error: that is `error_ledger`.

use glam::{Vec2, Vec3};
use serde::{Deserialize, Serialize};

use crate::chunks::in_chunks;
use crate::coverage::{CoveredTexels, Footprint, FootprintPoint, Texel, receiver};
use crate::denoise::REPLICATES;
use crate::final_gather::{GatherSums, RadianceCache};
use crate::monitor::{BakeMonitor, Clock};
use crate::report::{ResolutionReport, StageNotes};
use crate::sampling::{Sequence, Stream, cosine_about, hash, interval_at, triangle_point};
use crate::scene::{Receiver, SurfaceHit};
use crate::sources::Sources;
use crate::texel_index::{MapIndex, MapTexel};
use crate::{BakeError, BakeOptions};

/// The points get one part in this many of the bake's rays, and never fewer than take no noticeable time.
const RAYS_DIVISOR: u64 = 20;
const MIN_RAYS: u64 = 1 << 16;
/// Fewest and most points.
const POINTS: (u64, u64) = (256, 4096);
/// For each point, shadow rays to each source, and gather rays of each replicate. Two replicates make one half.
const SHADOW_RAYS: u32 = 16;
const GATHER_RAYS: u32 = 32;
/// Rays that test whether a point lies inside other geometry.
const OPEN_TEST_RAYS: u32 = 8;

/// A point of a surface, baked on its own.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub(crate) struct DensePoint {
    pub triangle: u32,
    pub at: (f32, f32),
    /// Whether it lies in the open, and so counts.
    pub counts: bool,
    /// Irradiance by direct light and by bounces, as each half of the samples finds it.
    pub direct: [Vec3; 2],
    pub indirect: [Vec3; 2],
    /// Checks of patches against real bounces, and the sum of their differences.
    pub checks: u32,
    pub differences: Vec3,
    pub rays: u64,
}

/// Why the error of the map's resolution is not measured; `None` if it is.
pub(crate) fn why_left_out(options: &BakeOptions, clock: Clock) -> Option<&'static str> {
    match options.resolution_error {
        false => Some("switched off"),
        true => clock.is_over().then_some("the time is up"),
    }
}

/// The points that the finished map is compared with. `cache` is `None` where nothing bounces; `rays` is how many rays
/// the bake has cast so far.
pub(crate) fn dense_points(
    sources: &Sources<'_>,
    cache: Option<&RadianceCache<'_>>,
    rays: u64,
    options: &BakeOptions,
    monitor: &mut BakeMonitor<'_>,
) -> Result<(Vec<DensePoint>, StageNotes), BakeError> {
    let baker = PointBaker { sources, cache };
    let points = baker.bake_points(rays, options, monitor)?;
    let notes = StageNotes::of_rays(points.iter().map(|point| point.rays).sum());
    Ok((points, notes))
}

/// Computes the light at single points.
struct PointBaker<'a> {
    sources: &'a Sources<'a>,
    /// `None` where nothing bounces.
    cache: Option<&'a RadianceCache<'a>>,
}

impl PointBaker<'_> {
    /// Points in proportion to area, as many as a twentieth of `rays` allows.
    fn bake_points(
        &self,
        rays: u64,
        options: &BakeOptions,
        monitor: &mut BakeMonitor<'_>,
    ) -> Result<Vec<DensePoint>, BakeError> {
        // Running sums of the triangles' areas, to choose triangles by.
        let mut area = 0.0;
        let ends: Vec<f64> = self
            .sources
            .scene
            .triangles
            .iter()
            .map(|triangle| {
                area += if triangle.is_hidden_duplicate { 0.0 } else { f64::from(triangle.area) };
                area
            })
            .collect();
        let gather_rays = if self.cache.is_some() { GATHER_RAYS * REPLICATES as u32 } else { 0 };
        let cost = u64::from(OPEN_TEST_RAYS + 2 * SHADOW_RAYS + gather_rays);
        let count = ((rays / RAYS_DIVISOR).max(MIN_RAYS) / cost).clamp(POINTS.0, POINTS.1) as usize;
        let sequence = Sequence::new(options.seed, Stream::ResolutionPoints, 0);
        let points = in_chunks(count, monitor, |index| {
            let [choice, u, v, _] = sequence.point(index as u32, 0);
            let place = f64::from(choice) * area;
            let Some((triangle, ..)) = interval_at(&ends, |&end| end, place) else {
                return DensePoint::default();
            };
            self.bake_point(triangle as u32, triangle_point(u, v), index as u32, options.seed)
        })?;
        Ok(points)
    }

    fn bake_point(&self, triangle: u32, at: (f32, f32), index: u32, seed: u32) -> DensePoint {
        let mut point = DensePoint { triangle, at, ..DensePoint::default() };
        let footprint = FootprintPoint { triangle, at, offset: Vec2::splat(0.5) };
        let receiver = receiver(self.sources.scene, &footprint);
        let sequence = Sequence::new(seed, Stream::ResolutionLight, index);
        point.rays += u64::from(OPEN_TEST_RAYS);
        point.counts = self.is_open(&receiver, sequence);
        if !point.counts {
            return point;
        }
        for (half, direct) in point.direct.iter_mut().enumerate() {
            let sequence = sequence.of(half as u32);
            let light = self.sources.irradiance(sequence, SHADOW_RAYS, &|_, _| Some(receiver));
            *direct = light.baked;
            point.rays += u64::from(light.rays);
        }
        let Some(cache) = self.cache else { return point };
        // A texel of this one point, with a map and a seed of its own, so that it shares its samples with no
        // other.
        let footprint = Footprint::Points(vec![footprint]);
        let texel = Texel { index: MapTexel(index), map: MapIndex(index), x: 0, y: 0, triangle, footprint };
        let mut gathered = GatherSums::default();
        cache.gather(&texel, &mut gathered, GATHER_RAYS, hash(seed ^ Stream::ResolutionPoints.number()));
        let [a, b, c, d] = gathered.sums.map(|sum| sum / GATHER_RAYS as f32);
        point.indirect = [0.5 * (a + b), 0.5 * (c + d)];
        (point.checks, point.differences) = (gathered.checks, gathered.differences);
        point.rays += gathered.rays;
        point
    }

    /// Whether a point lies neither inside other geometry nor on the dark outside of a closed level: the map does not
    /// show those.
    fn is_open(&self, receiver: &Receiver, sequence: Sequence) -> bool {
        let hits_inside = |ray: &u32| {
            let [u, v, ..] = sequence.point(*ray, 0);
            let direction = cosine_about(receiver.geometric_normal, u, v);
            let hit = self.sources.scene.classify_hit(receiver.origin, direction);
            matches!(hit, SurfaceHit::Inside | SurfaceHit::Back)
        };
        2 * (0..OPEN_TEST_RAYS).filter(hits_inside).count() < OPEN_TEST_RAYS as usize
    }
}

/// Compares the finished map with the points. `variances` is the map's own estimate of its squared sampling error, per
/// texel; NaN where nothing is known.
pub(crate) fn compare(
    texels: &CoveredTexels<'_>,
    filled: &[Vec3],
    variances: &[f32],
    points: &[DensePoint],
) -> ResolutionReport {
    let counting = || points.iter().filter(|point| point.counts);
    // The points read patches, whose excess light, known from checks, has been subtracted from the map: here, as a
    // share of the light by bounces.
    let (mut difference, mut checked) = (Vec3::ZERO, Vec3::ZERO);
    for point in counting() {
        difference += point.differences;
        checked += 0.5 * (point.indirect[0] + point.indirect[1]) * point.checks as f32;
    }
    let excess = difference / checked.max(Vec3::splat(f32::MIN_POSITIVE));
    let excess = if excess.is_finite() { excess } else { Vec3::ZERO };
    let (mut mean, mut squares) = (0.0, Vec::with_capacity(points.len()));
    for point in counting() {
        let Some((shown, variance)) = look_up(texels, filled, variances, point) else { continue };
        let light = [0, 1].map(|half| point.direct[half] + point.indirect[half] * (Vec3::ONE - excess));
        let [a, b] = light.map(|light| (light - shown).as_dvec3());
        squares.push((a * b).element_sum() / 3.0 - f64::from(variance));
        mean += f64::from((light[0] + light[1]).element_sum()) / 6.0;
    }
    let count = squares.len() as f64;
    mean /= count.max(1.0);
    if squares.len() < 2 || mean <= 0.0 {
        return ResolutionReport::default();
    }
    let square = squares.iter().sum::<f64>() / count;
    let spread = squares.iter().map(|other| (other - square).powi(2)).sum::<f64>() / (count - 1.0);
    let square_error = (spread / count).sqrt();
    let error = square.max(0.0).sqrt();
    // The standard error of the root: by the root's derivative, and near 0, the root of the square's standard error.
    let standard_error = square_error / (2.0 * error).max(square_error.sqrt()).max(f64::MIN_POSITIVE);
    ResolutionReport { points: squares.len(), error: error / mean, standard_error: standard_error / mean }
}

/// What the map shows at a point by bilinear filtering, and the variance of that, as if the texels' errors were
/// independent.
fn look_up(
    texels: &CoveredTexels<'_>,
    filled: &[Vec3],
    variances: &[f32],
    point: &DensePoint,
) -> Option<(Vec3, f32)> {
    let triangle = &texels.scene.triangles[point.triangle as usize];
    let map = &texels.layout.maps[triangle.map.place()];
    let at = triangle.place_on_map(point.at);
    if !at.is_finite() {
        return None;
    }
    let (mut light, mut variance) = (Vec3::ZERO, 0.0);
    for (texel, weight) in map.bilinear(at) {
        let texel = texel.place();
        // Texels of which nothing is known are black in the map.
        light += weight * if filled[texel].is_finite() { filled[texel] } else { Vec3::ZERO };
        variance += weight * weight * if variances[texel].is_finite() { variances[texel] } else { 0.0 };
    }
    Some((light, variance))
}
