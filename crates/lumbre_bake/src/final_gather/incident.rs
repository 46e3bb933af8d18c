//! Where a receiver's light by bounces comes from: points by cosine rays and by the guide, several receivers at a time, so that what they
//! read is on its way from memory together. Not what is made of it: that is `gather`.

use std::f32::consts::FRAC_1_PI;

use glam::{Vec2, Vec3};

use super::radiance_cache::RadianceCache;
use crate::radiosity::patch_index::PatchIndex;
use crate::radiosity::patches::Patch;
use crate::radiosity::sampling_guide::{Region, RowPart};
use crate::sampling::{cosine_about, triangle_point};
use crate::scene::material::Side;
use crate::scene::{Receiver, SurfaceHit};
use crate::texel_index::MapTexel;

/// A receiver that asks for a sample of its light by bounces.
#[derive(Clone, Copy, Debug)]
pub(crate) struct GatherRequest {
    pub receiver: Receiver,
    /// Its region of the guide; without one cosine rays only.
    pub region: Option<Region>,
    /// In the unit square.
    pub u: f32,
    pub v: f32,
}

impl GatherRequest {
    /// Fills the lists' empty places.
    pub const NOWHERE: Self = Self {
        receiver: Receiver {
            position: Vec3::ZERO,
            origin: Vec3::ZERO,
            geometric_normal: Vec3::Z,
            normal: Vec3::Z,
        },
        region: None,
        u: 0.0,
        v: 0.0,
    };
}

/// A surface that a sample has met.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Hit {
    pub triangle: u32,
    pub side: Side,
    pub at: (f32, f32),
    pub patch: PatchIndex,
    pub reflectance: Vec3,
    /// Irradiance there: direct, and the texel's or patch's by bounces.
    pub direct: Vec3,
    pub indirect: Vec3,
    /// The patches' errors in that.
    pub error: Vec2,
    /// The squared error of `indirect` where it is that of a texel that was gathered before, and not the patch's.
    pub variance: Option<f32>,
    /// Of the ray, of unit length, and how far it went.
    pub direction: Vec3,
    pub distance: f32,
}

impl Hit {
    /// Nothing is read yet.
    const UNREAD: Self = Self {
        triangle: 0,
        side: Side::Front,
        at: (0.0, 0.0),
        patch: PatchIndex(0),
        reflectance: Vec3::ZERO,
        direct: Vec3::ZERO,
        indirect: Vec3::ZERO,
        error: Vec2::ZERO,
        variance: None,
        direction: Vec3::ZERO,
        distance: 0.0,
    };
}

/// What a sample has found.
#[derive(Clone, Copy, Debug)]
pub(crate) struct IncidentSample {
    /// A surface that reflects.
    pub hit: Option<Hit>,
    /// Or else what arrives all the same, times π as all light is here: the sky's, or none. Weighted.
    pub light: Vec3,
    pub weight: f32,
}

impl IncidentSample {
    /// No light and no weight: what the guide named is not to be seen.
    pub const NOTHING: Self = Self { hit: None, light: Vec3::ZERO, weight: 0.0 };
}

/// Where a sample looks.
#[derive(Clone, Copy)]
pub(crate) enum SampleTarget {
    /// In a direction about the receiver's normal.
    Around(Vec3),
    /// At a point of a region that the guide named with this probability, as it would be met; and the point just off it.
    At(Region, f32, Hit, Vec3),
    Nowhere,
}

/// A sample under way.
#[derive(Clone, Copy)]
pub(crate) struct SamplePath {
    aim: SampleTarget,
    /// Of the samples, what the guide places; none if it knows nothing of the receiver.
    share: Option<f32>,
    /// Part of the guide's row that is asked next.
    part: RowPart,
    /// Region and texel met, where they count, and the texel's direct light.
    region: Option<Region>,
    texel: MapTexel,
    direct: Vec3,
    reflectance: Vec3,
}

impl SamplePath {
    /// Nothing is known.
    pub const NONE: Self = Self {
        aim: SampleTarget::Nowhere,
        share: None,
        part: RowPart::NONE,
        region: None,
        texel: MapTexel::NONE,
        direct: Vec3::ZERO,
        reflectance: Vec3::ZERO,
    };
}

/// What the direction of a ray about a receiver's normal is worth: cos θ / π, with what lies under the facet mirrored up.
fn kernel(receiver: &Receiver, direction: Vec3) -> f32 {
    let below = direction - receiver.geometric_normal * (2.0 * direction.dot(receiver.geometric_normal));
    (direction.dot(receiver.normal).max(0.0) + below.dot(receiver.normal).max(0.0)) * FRAC_1_PI
}

/// A direction with density [`kernel`].
#[inline]
fn about(receiver: &Receiver, u: f32, v: f32) -> Vec3 {
    let direction = cosine_about(receiver.normal, u, v);
    let below = direction.dot(receiver.geometric_normal);
    if below <= 0.0 {
        // Under the facet though above the smooth surface: mirrored up.
        return direction - receiver.geometric_normal * (2.0 * below);
    }
    direction
}

impl RadianceCache<'_> {
    /// For each receiver a point that its light by bounces comes from: some of the samples, if the guide knows the receiver's region, are
    /// points of regions that it names, the others are what cosine rays meet; weighed by the balance heuristic (Veach and Guibas, "Optimally
    /// Combining Sampling Techniques for Monte Carlo Rendering", 1995, section 3.3).
    pub(crate) fn incident(
        &self,
        requests: &[GatherRequest],
        paths: &mut [SamplePath],
        found: &mut [IncidentSample],
    ) {
        // One thing for all samples before the next: the loops that read from afar do little else.
        let (paths, found) = (&mut paths[..requests.len()], &mut found[..requests.len()]);
        for (path, request) in paths.iter_mut().zip(requests) {
            path.share = request.region.and_then(|region| self.guide.share(region));
            if let (Some(region), Some(share)) = (request.region, path.share)
                && request.u < share
            {
                path.part = self.guide.near(region, request.u / share);
            }
        }
        for (path, request) in paths.iter_mut().zip(requests) {
            self.aim(request, path);
        }
        for ((path, request), found) in paths.iter().zip(requests).zip(found.iter_mut()) {
            self.follow(request, path, found);
        }
        for (path, found) in paths.iter_mut().zip(found.iter_mut()) {
            path.texel = MapTexel::NONE;
            let Some(hit) = &mut found.hit else { continue };
            let Some(patch) = self.patches.at(hit.triangle, hit.side, hit.at) else {
                *found = IncidentSample::NOTHING;
                continue;
            };
            path.region = match path.aim {
                SampleTarget::At(region, ..) => Some(region),
                _ if path.share.is_some() => self.guide.region_at(hit.triangle, hit.side, hit.at),
                _ => None,
            };
            hit.patch = patch;
            path.texel = self.texel_at(hit.triangle, hit.side, hit.at);
        }
        for path in paths.iter_mut() {
            path.direct = self.direct.get(path.texel.place()).copied().unwrap_or(Vec3::NAN);
            path.reflectance = self.reflectance.get(path.texel.place()).copied().unwrap_or(Vec3::NAN);
        }
        for ((path, request), found) in paths.iter_mut().zip(requests).zip(found.iter_mut()) {
            let Some(hit) = &mut found.hit else { continue };
            hit.reflectance = match path.reflectance.x.is_nan() {
                true => self.reflectance_at(hit.triangle, hit.side, hit.at),
                false => path.reflectance,
            };
            match self.gathered.at(path.texel) {
                Some(texel) => {
                    (hit.indirect, hit.error) = (texel.irradiance, texel.patch_error);
                    hit.variance = Some(texel.variance);
                }
                None => {
                    hit.indirect = self.patch_indirect[hit.patch.place()];
                    hit.error = self.patch_error[hit.patch.place()];
                }
            }
            if let (SampleTarget::Around(_), Some(own), Some(region)) =
                (&path.aim, request.region, path.region)
            {
                path.part = self.guide.near_region(own, region);
            }
        }
        for ((path, request), found) in paths.iter().zip(requests).zip(found) {
            let Some(hit) = &mut found.hit else { continue };
            hit.direct =
                if path.direct.x.is_nan() { self.patch_direct[hit.patch.place()] } else { path.direct };
            if let Some(share) = path.share {
                match self.weight(request, path, share, hit) {
                    Some(weight) => found.weight = weight,
                    None => *found = IncidentSample::NOTHING,
                }
            }
        }
    }

    /// Where to look.
    #[inline]
    fn aim(&self, request: &GatherRequest, path: &mut SamplePath) {
        let &GatherRequest { ref receiver, u, v, .. } = request;
        path.aim = match path.share {
            None => SampleTarget::Around(about(receiver, u, v)),
            Some(share) if u >= share => {
                SampleTarget::Around(about(receiver, (u - share) / (1.0 - share), v))
            }
            Some(share) => {
                let picked = self.guide.pick(&path.part, u / share);
                let point = picked
                    .and_then(|(region, u, probability)| self.point_of(receiver, region, probability, u, v));
                point.unwrap_or(SampleTarget::Nowhere)
            }
        };
    }

    /// What is there, its light not read yet.
    #[inline]
    fn follow(&self, request: &GatherRequest, path: &SamplePath, found: &mut IncidentSample) {
        *found = IncidentSample::NOTHING;
        let origin = request.receiver.origin;
        match &path.aim {
            SampleTarget::Nowhere => {}
            SampleTarget::At(_, _, hit, end) => {
                if !self.scene.blocked(origin, *end) {
                    found.hit = Some(*hit);
                    found.weight = 1.0;
                }
            }
            &SampleTarget::Around(direction) => {
                // The sky is found by these alone.
                let rest = 1.0 - path.share.unwrap_or(0.0);
                match self.scene.first_hit(origin, direction) {
                    SurfaceHit::Lit { triangle, side, at, distance } => {
                        found.hit = Some(Hit { triangle, side, at, direction, distance, ..Hit::UNREAD });
                        found.weight = 1.0;
                    }
                    SurfaceHit::None => (found.light, found.weight) = (self.sky / rest, 1.0 / rest),
                    SurfaceHit::Back | SurfaceHit::Inside => found.weight = 1.0 / rest,
                }
            }
        }
    }

    /// The weight of a sample of which the guide places a share.
    #[inline]
    fn weight(&self, request: &GatherRequest, path: &SamplePath, share: f32, hit: &Hit) -> Option<f32> {
        let region = path.region?;
        let probability = match path.aim {
            SampleTarget::At(_, probability, ..) => probability,
            _ => self.guide.probability(&path.part, region),
        };
        // Densities over the surfaces' area.
        let by_guide = probability / self.guide.region(region).area;
        let normal = self.scene.triangles[hit.triangle as usize].side_normal(hit.side);
        let cosine = -hit.direction.dot(normal);
        let by_cosine = kernel(&request.receiver, hit.direction) * cosine / (hit.distance * hit.distance);
        let weight = by_cosine / ((1.0 - share) * by_cosine + share * by_guide);
        (cosine > 0.0 && weight.is_finite()).then_some(weight)
    }

    /// A point of a region, if it and the receiver face each other.
    #[inline]
    fn point_of(
        &self,
        receiver: &Receiver,
        region: Region,
        probability: f32,
        u: f32,
        v: f32,
    ) -> Option<SampleTarget> {
        let Patch { triangle, side, .. } = *self.guide.region(region);
        let at = self.guide.point(region, triangle_point(u, v));
        let surface = &self.scene.triangles[triangle as usize];
        let position = surface.position(at.0, at.1);
        let apart = position - receiver.position;
        let distance = apart.length();
        let direction = apart / distance;
        let faces =
            direction.dot(surface.side_normal(side)) < 0.0 && direction.dot(receiver.geometric_normal) > 0.0;
        if !faces {
            return None;
        }
        let end = self.scene.off_surface_seen_from(triangle, side, position, receiver.origin);
        let hit = Hit { triangle, side, at, direction, distance, ..Hit::UNREAD };
        Some(SampleTarget::At(region, probability, hit, end))
    }

    /// The receiver at a surface that was met.
    pub(crate) fn receiver_at(&self, hit: &Hit) -> Receiver {
        let surface = &self.scene.triangles[hit.triangle as usize];
        let position = surface.position(hit.at.0, hit.at.1);
        let origin = self.scene.off_surface(hit.triangle, hit.side, position);
        let normal = surface.side_normal(hit.side);
        Receiver { position, origin, geometric_normal: normal, normal }
    }
}
