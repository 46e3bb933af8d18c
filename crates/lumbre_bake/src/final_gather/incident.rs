//! Samples of where a receiver's light by bounces comes from: surfaces found by cosine rays and by the guide, for
//! several receivers at a time, so that what they read is on its way from memory together. Not how samples add up: that
//! is `gather`.

use std::f32::consts::FRAC_1_PI;

use glam::{Vec2, Vec3};

use super::radiance_cache::RadianceCache;
use crate::radiosity::{GuidedPatch, PatchIndex, RegionIndex, RowPart};
use crate::sampling::cosine_about;
use crate::scene::{Receiver, Side, SurfaceHit};
use crate::texel_index::MapTexel;

/// A request for one sample of a receiver's light by bounces.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct GatherRequest {
    pub receiver: Receiver,
    /// The receiver's region of the guide; without one, only cosine rays are cast.
    pub region: Option<RegionIndex>,
    /// The sample's point in the unit square.
    pub u: f32,
    pub v: f32,
}

/// A surface that a sample has hit. By default its light has not been read yet.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Hit {
    pub triangle: u32,
    pub side: Side,
    pub at: (f32, f32),
    pub patch: PatchIndex,
    pub reflectance: Vec3,
    /// Irradiance there: direct, and by bounces as the texel or the patch has it.
    pub direct: Vec3,
    pub indirect: Vec3,
    /// The patches' errors in `indirect`, each with its sign.
    pub error: Vec2,
    /// The squared error of `indirect` where it is that of a texel gathered in an earlier round; `None` where it is the
    /// patch's.
    pub variance: Option<f32>,
    /// Unit direction of the ray, and the distance it went.
    pub direction: Vec3,
    pub distance: f32,
}

/// The result of a sample; by default no light and no weight, as where the point that the guide proposed is not visible.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct IncidentSample {
    /// The reflecting surface that was hit, if one was.
    pub hit: Option<Hit>,
    /// Without a hit, the light of the sky, if it was reached: its irradiance (π times its radiance, W/m²), already
    /// weighted.
    pub light: Vec3,
    pub weight: f32,
}

/// Where a sample's ray goes.
#[derive(Clone, Copy, Default)]
pub(crate) enum SampleTarget {
    /// In a direction, cosine-distributed about the receiver's normal.
    Direction(Vec3),
    /// To a point that the guide chose with this density, per square canonical unit: the hit if nothing is in between,
    /// and the point just off its surface.
    Point(f32, Hit, Vec3),
    /// The guide's point cannot light the receiver.
    #[default]
    Nowhere,
}

/// The state of a sample while it is followed.
#[derive(Clone, Copy, Default)]
pub(crate) struct SamplePath {
    target: SampleTarget,
    /// The share of the samples that the guide places; `None` if it knows nothing of the receiver.
    guided_share: Option<f32>,
    /// Part of the guide's row that is searched next.
    row_part: RowPart,
    /// The texel that shows what was hit, if there is one.
    texel: Option<MapTexel>,
}

impl SamplePath {
    /// The share of the samples that go in directions of a cosine distribution.
    pub fn cosine_share(&self) -> f32 {
        1.0 - self.guided_share.unwrap_or(0.0)
    }
}

/// The density of [`sample_cosine`]: cos θ / π about the shading normal, with what lies below the facet mirrored up.
fn cosine_density(receiver: &Receiver, direction: Vec3) -> f32 {
    let below = direction - receiver.geometric_normal * (2.0 * direction.dot(receiver.geometric_normal));
    (direction.dot(receiver.normal).max(0.0) + below.dot(receiver.normal).max(0.0)) * FRAC_1_PI
}

/// A cosine-distributed direction about a receiver's shading normal, above its facet.
#[inline]
fn sample_cosine(receiver: &Receiver, u: f32, v: f32) -> Vec3 {
    let direction = cosine_about(receiver.normal, u, v);
    let below = direction.dot(receiver.geometric_normal);
    if below <= 0.0 {
        // Below the facet, though above the smooth surface: mirrored up.
        return direction - receiver.geometric_normal * (2.0 * below);
    }
    direction
}

impl RadianceCache<'_> {
    /// For each receiver, samples one point that its light by bounces comes from. If the guide knows the receiver's
    /// region, a share of the samples are points of regions that it chooses; the others are what cosine rays hit. They
    /// are combined by the balance heuristic (Veach and Guibas, "Optimally Combining Sampling Techniques for Monte
    /// Carlo Rendering", 1995, section 3.3).
    pub(crate) fn incident(
        &self,
        requests: &[GatherRequest],
        paths: &mut [SamplePath],
        results: &mut [IncidentSample],
    ) {
        // Each step is done for all samples before the next: loops that read distant memory do little else, so reads
        // overlap.
        let (paths, results) = (&mut paths[..requests.len()], &mut results[..requests.len()]);
        for (path, request) in paths.iter_mut().zip(requests) {
            path.guided_share = request.region.and_then(|region| self.guide.share(region));
            if let (Some(region), Some(share)) = (request.region, path.guided_share)
                && request.u < share
            {
                path.row_part = self.guide.near(region, request.u / share);
            }
        }
        for (path, request) in paths.iter_mut().zip(requests) {
            self.choose_target(request, path);
        }
        for ((path, request), result) in paths.iter().zip(requests).zip(results.iter_mut()) {
            self.follow(request, path, result);
        }
        for (path, result) in paths.iter_mut().zip(results.iter_mut()) {
            path.texel = None;
            let Some(hit) = &mut result.hit else { continue };
            if let SampleTarget::Direction(_) = path.target {
                let Some(patch) = self.exchange.patches.at(hit.triangle, hit.side, hit.at) else {
                    *result = IncidentSample::default();
                    continue;
                };
                hit.patch = patch;
            }
            path.texel = self.texel_at(hit.triangle, hit.side, hit.at);
        }
        for (path, result) in paths.iter().zip(results.iter_mut()) {
            let Some(hit) = &mut result.hit else { continue };
            let texel = self.texels.at(path.texel);
            hit.direct = self.direct_at(texel, hit.triangle, hit.at).unwrap_or(Vec3::NAN);
            hit.reflectance = texel.reflectance;
            if let Some(light) = texel.indirect() {
                (hit.indirect, hit.error) = (light.irradiance, light.patch_error);
                hit.variance = Some(light.variance);
            }
        }
        for ((path, request), result) in paths.iter_mut().zip(requests).zip(results.iter_mut()) {
            let Some(hit) = &mut result.hit else { continue };
            if hit.reflectance.x.is_nan() {
                hit.reflectance = self.reflectance_at(hit.triangle, hit.side, hit.at);
            }
            if hit.variance.is_none() {
                hit.indirect = self.exchange.indirect[hit.patch.place()];
                hit.error = self.exchange.indirect_error[hit.patch.place()];
            }
            if let (SampleTarget::Direction(_), Some(region), Some(_)) =
                (&path.target, request.region, path.guided_share)
            {
                path.row_part = self.guide.near_patch(region, hit.patch);
            }
        }
        for ((path, request), result) in paths.iter().zip(requests).zip(results) {
            let Some(hit) = &mut result.hit else { continue };
            if hit.direct.x.is_nan() {
                hit.direct = self.exchange.direct[hit.patch.place()];
            }
            if let Some(share) = path.guided_share {
                match self.weight(request, path, share, hit) {
                    Some(weight) => result.weight = weight,
                    None => *result = IncidentSample::default(),
                }
            }
        }
    }

    /// Decides where the sample's ray goes.
    #[inline]
    fn choose_target(&self, request: &GatherRequest, path: &mut SamplePath) {
        let &GatherRequest { ref receiver, u, v, .. } = request;
        path.target = match path.guided_share {
            None => SampleTarget::Direction(sample_cosine(receiver, u, v)),
            Some(share) if u >= share => {
                SampleTarget::Direction(sample_cosine(receiver, (u - share) / (1.0 - share), v))
            }
            Some(share) => {
                let picked = self.guide.pick(&path.row_part, u / share);
                let point = picked.and_then(|patch| self.point_of(receiver, patch, v));
                point.unwrap_or(SampleTarget::Nowhere)
            }
        };
    }

    /// Casts the sample's ray; the light of what it hits is not read yet.
    #[inline]
    fn follow(&self, request: &GatherRequest, path: &SamplePath, result: &mut IncidentSample) {
        *result = IncidentSample::default();
        let origin = request.receiver.origin;
        match &path.target {
            SampleTarget::Nowhere => {}
            SampleTarget::Point(_, hit, end) => {
                if !self.scene.blocked(origin, *end) {
                    result.hit = Some(*hit);
                    result.weight = 1.0;
                }
            }
            &SampleTarget::Direction(direction) => {
                // Only these samples find the sky and the black insides, which the guide does not know.
                let cosine_share = path.cosine_share();
                match self.scene.first_hit(origin, direction) {
                    SurfaceHit::Lit { triangle, side, at, distance } => {
                        result.hit = Some(Hit { triangle, side, at, direction, distance, ..Hit::default() });
                        result.weight = 1.0;
                    }
                    SurfaceHit::None => {
                        (result.light, result.weight) = (self.sources.sky / cosine_share, 1.0 / cosine_share);
                    }
                    SurfaceHit::Back | SurfaceHit::Inside => result.weight = 1.0 / cosine_share,
                }
            }
        }
    }

    /// The weight of a sample where the guide places this share of the samples; `None` for a sample that cannot count.
    #[inline]
    fn weight(&self, request: &GatherRequest, path: &SamplePath, share: f32, hit: &Hit) -> Option<f32> {
        // Densities per area of the surface that was hit.
        let by_guide = match path.target {
            SampleTarget::Point(density, ..) => density,
            _ => self.guide.density(&path.row_part, hit.patch),
        };
        let normal = self.scene.triangles[hit.triangle as usize].side_normal(hit.side);
        let cosine = -hit.direction.dot(normal);
        let by_cosine =
            cosine_density(&request.receiver, hit.direction) * cosine / (hit.distance * hit.distance);
        let weight = by_cosine / ((1.0 - share) * by_cosine + share * by_guide);
        (cosine > 0.0 && weight.is_finite()).then_some(weight)
    }

    /// A point of a patch that the guide chose as a target, if it and the receiver face each other.
    #[inline]
    fn point_of(&self, receiver: &Receiver, guided: GuidedPatch, v: f32) -> Option<SampleTarget> {
        let GuidedPatch { patch, u, density } = guided;
        let chosen = &self.exchange.patches.list[patch.place()];
        let (triangle, at) = self.exchange.patches.point(chosen, [u, v]);
        let side = chosen.side;
        let surface = &self.scene.triangles[triangle as usize];
        let position = surface.position(at.0, at.1);
        let offset = position - receiver.position;
        let distance = offset.length();
        let direction = offset / distance;
        let is_facing =
            direction.dot(surface.side_normal(side)) < 0.0 && direction.dot(receiver.geometric_normal) > 0.0;
        if !is_facing {
            return None;
        }
        let end = self.scene.off_surface_seen_from(triangle, side, position, receiver.origin);
        let hit = Hit { triangle, side, at, patch, direction, distance, ..Hit::default() };
        Some(SampleTarget::Point(density, hit, end))
    }

    /// The receiver at the surface that was hit.
    pub(crate) fn receiver_at(&self, hit: &Hit) -> Receiver {
        Receiver::on_facet(self.scene, hit.triangle, hit.side, hit.at)
    }
}
