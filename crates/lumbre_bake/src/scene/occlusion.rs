//! What a ray meets: a lit side of a surface, a black back, the inside of something, or nothing.

use glam::Vec3;
use lumbre_rays::{Hit, Ray, offset_ray_origin};

use super::BakeScene;
use super::material::Side;

/// What a ray meets first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum SurfaceHit {
    /// Nothing.
    None,
    /// A side that takes part in the exchange of light.
    Lit {
        /// Triangle of the scene.
        triangle: u32,
        /// Which side.
        side: Side,
        /// Barycentric weights of the second and third vertex.
        at: (f32, f32),
        /// Distance in canonical units (the direction being of unit length).
        distance: f32,
    },
    /// The back of a single-sided open surface: black.
    Back,
    /// The inside of a closed piece: the ray began inside.
    Inside,
}

/// Two hits nearer to each other than this share of their distance and coordinates are in one place.
pub(super) const SAME_PLACE: f32 = 64.0 / (1 << 24) as f32;

/// Where a segment ends. A target is off its surface by the rounding of its own coordinates. VisibilitySummary from afar, in a scene much larger than
/// they are, the surface is met by as many roundings of the distance before it or behind it: those are taken off the end.
const FAR_END: f32 = 1.0 - 16.0 / (1 << 24) as f32;

impl BakeScene {
    /// The first thing on a ray with a direction of unit length. Counts it among the leaks if it ended where none should.
    pub fn first_hit(&self, origin: Vec3, direction: Vec3) -> SurfaceHit {
        let hit = self.first_surface(origin, direction, |_| true);
        match hit {
            SurfaceHit::Back | SurfaceHit::Inside => self.leaks.note(),
            SurfaceHit::None if self.leaks.closed_scene => self.leaks.note(),
            SurfaceHit::None | SurfaceHit::Lit { .. } => {}
        }
        hit
    }

    /// The first thing on a ray among the triangles that `counts` accepts; what is odd is not noted.
    pub fn first_surface(&self, origin: Vec3, direction: Vec3, counts: impl Fn(u32) -> bool) -> SurfaceHit {
        let ray = Ray::new(origin, direction);
        let Some(mut hit) = self.closest(&ray, &counts) else { return SurfaceHit::None };
        let triangle = &self.triangles[hit.triangle as usize];
        if hit.back_face && !triangle.two_sided {
            // Of the two faces of a sheet, the one that looks at the ray. Not what a solid stands on, seen from inside of it.
            let near = self.near(&ray, hit.triangle, hit.distance, direction);
            let facing = |index: u32| {
                let other = &self.triangles[index as usize];
                let same = triangle.solid.is_none() || other.solid == triangle.solid;
                same && counts(index) && other.normal.dot(direction) < 0.0
            };
            match self.closest(&near, facing) {
                Some(front) => hit = front,
                None if triangle.closed => return SurfaceHit::Inside,
                None => return SurfaceHit::Back,
            }
        }
        let side = if hit.back_face { Side::Back } else { Side::Front };
        SurfaceHit::Lit { triangle: hit.triangle, side, at: hit.barycentric, distance: hit.distance }
    }

    /// As [`first_hit`](Self::first_hit), for rays that tell where they began: what a solid stands on is in one place with the solid's own side,
    /// and from the inside either may be met first. What leaves the scene where it is dark outside began there. Takes up to three times as long.
    pub fn classify_hit(&self, origin: Vec3, direction: Vec3) -> SurfaceHit {
        let hit = self.first_hit(origin, direction);
        let SurfaceHit::Lit { triangle, distance, .. } = hit else {
            return if hit == SurfaceHit::None && self.dark_outside { SurfaceHit::Inside } else { hit };
        };
        let near = self.near(&Ray::new(origin, direction), triangle, distance, direction);
        let cosine = |index: u32| self.triangles[index as usize].normal.dot(direction);
        let solid = |index: u32| self.triangles[index as usize].solid;
        let left = self.closest(&near, |index| solid(index).is_some() && cosine(index) > 0.0);
        let Some(left) = left.map(|left| solid(left.triangle)) else { return hit };
        // Of no thickness, it has no inside.
        match self.closest(&near, |index| solid(index) == left && cosine(index) < 0.0) {
            Some(_) => hit,
            None => SurfaceHit::Inside,
        }
    }

    /// The part of a ray in which other triangles are in one place with one that it meets.
    fn near(&self, ray: &Ray, triangle: u32, distance: f32, direction: Vec3) -> Ray {
        let triangle = &self.triangles[triangle as usize];
        // What a plane's place is off by, a grazing ray meets further along.
        let cosine = triangle.normal.dot(direction).abs().max(1.0 / 1024.0);
        let slack = SAME_PLACE * (distance + triangle.extent) / cosine;
        ray.with_range((distance - slack).max(0.0), distance + slack)
    }

    /// Whether something lies between two points that are off their surfaces.
    pub fn blocked(&self, from: Vec3, to: Vec3) -> bool {
        self.any(&Ray::segment(from, to).with_range(0.0, FAR_END))
    }

    /// Whether something lies in a direction, however far.
    pub fn blocked_towards(&self, from: Vec3, direction: Vec3) -> bool {
        self.any(&Ray::new(from, direction))
    }

    /// A point just off a side of a triangle.
    pub fn off_surface(&self, triangle: u32, side: Side, position: Vec3) -> Vec3 {
        let triangle = &self.triangles[triangle as usize];
        offset_ray_origin(position, triangle.side_normal(side), triangle.extent)
    }

    /// A point just off a side of a triangle, as the end of a segment from `from`: what rounds there is as large as the coordinates of
    /// both ends, and a small lamp near the origin would shade itself.
    pub fn off_surface_seen_from(&self, triangle: u32, side: Side, position: Vec3, from: Vec3) -> Vec3 {
        let triangle = &self.triangles[triangle as usize];
        let extent = triangle.extent.max(from.abs().max_element());
        offset_ray_origin(position, triangle.side_normal(side), extent)
    }

    fn closest(&self, ray: &Ray, accept: impl Fn(u32) -> bool) -> Option<Hit> {
        if self.masked {
            self.bvh.closest_hit_filtered(ray, |index, u, v| accept(index) && self.is_solid(index, u, v))
        } else {
            self.bvh.closest_hit_filtered(ray, |index, _, _| accept(index))
        }
    }

    fn any(&self, ray: &Ray) -> bool {
        if self.masked {
            self.bvh.any_hit_filtered(ray, |index, u, v| self.is_solid(index, u, v))
        } else {
            self.bvh.any_hit(ray)
        }
    }

    pub(super) fn is_solid(&self, index: u32, u: f32, v: f32) -> bool {
        let triangle = &self.triangles[index as usize];
        self.surfaces[triangle.surface as usize].stops_light(triangle.vertices, [1.0 - u - v, u, v])
    }
}
