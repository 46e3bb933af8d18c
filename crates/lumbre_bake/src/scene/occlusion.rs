//! What a ray hits first: a lit side of a surface, a black back, the inside of a closed mesh, or nothing. `crossings`
//! finds everything along a line.

use glam::Vec3;
use lumbre_rays::{Hit, Ray, offset_ray_origin};

use super::BakeScene;
use super::material::Side;

/// What a ray hits first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum SurfaceHit {
    /// Nothing.
    None,
    /// A side of a triangle that receives and reflects light.
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
    /// The back of a single-sided open surface, which is black.
    Back,
    /// The inside of a closed mesh: the ray started inside.
    Inside,
}

/// Hits closer together than this fraction of their distance and coordinates count as coincident.
pub(super) const SAME_PLACE: f32 = 64.0 / (1 << 24) as f32;

/// Where a segment ends, as a fraction of its length. The target is offset from its surface by the rounding error of
/// its own coordinates only. On a segment much longer than those coordinates, the surface may be hit some rounding
/// errors of the distance before or behind its true position, so the segment is shortened by as much.
const SEGMENT_END: f32 = 1.0 - 16.0 / (1 << 24) as f32;

impl BakeScene {
    /// The first hit of a ray; `direction` must be a unit vector. Counts the ray as a leak if it ends where no ray
    /// should.
    pub fn first_hit(&self, origin: Vec3, direction: Vec3) -> SurfaceHit {
        let hit = self.first_surface(origin, direction, |_| true);
        match hit {
            SurfaceHit::Back | SurfaceHit::Inside => self.leaks.note(),
            SurfaceHit::None if self.leaks.closed_scene => self.leaks.note(),
            SurfaceHit::None | SurfaceHit::Lit { .. } => {}
        }
        hit
    }

    /// The first hit of a ray among the triangles that `counts` accepts. Leaks are not counted.
    pub fn first_surface(&self, origin: Vec3, direction: Vec3, counts: impl Fn(u32) -> bool) -> SurfaceHit {
        let ray = Ray::new(origin, direction);
        let Some(mut hit) = self.closest(&ray, &counts) else { return SurfaceHit::None };
        let triangle = &self.triangles[hit.triangle as usize];
        if hit.back_face && !triangle.two_sided {
            // Of the two coincident faces of a sheet, choose the one that faces the ray. From inside a solid, do not
            // choose the surface that the solid stands on.
            let near = self.near(&ray, hit.triangle, hit.distance, direction);
            let faces_ray = |index: u32| {
                let other = &self.triangles[index as usize];
                let is_same_solid = triangle.solid.is_none() || other.solid == triangle.solid;
                is_same_solid && counts(index) && other.normal.dot(direction) < 0.0
            };
            match self.closest(&near, faces_ray) {
                Some(front) => hit = front,
                None if triangle.closed => return SurfaceHit::Inside,
                None => return SurfaceHit::Back,
            }
        }
        let side = if hit.back_face { Side::Back } else { Side::Front };
        SurfaceHit::Lit { triangle: hit.triangle, side, at: hit.barycentric, distance: hit.distance }
    }

    /// Like [`first_hit`](Self::first_hit), but also decides whether the ray started inside something, at up to three
    /// times the cost. Where a solid stands on a surface, the two coincide, and a ray from inside the solid may hit
    /// either first. A ray that leaves a scene that is dark outside started outside of its rooms, which counts as
    /// inside.
    pub fn classify_hit(&self, origin: Vec3, direction: Vec3) -> SurfaceHit {
        let hit = self.first_hit(origin, direction);
        let SurfaceHit::Lit { triangle, distance, .. } = hit else {
            return if hit == SurfaceHit::None && self.dark_outside { SurfaceHit::Inside } else { hit };
        };
        let near = self.near(&Ray::new(origin, direction), triangle, distance, direction);
        let cosine = |index: u32| self.triangles[index as usize].normal.dot(direction);
        let solid = |index: u32| self.triangles[index as usize].solid;
        let exit = self.closest(&near, |index| solid(index).is_some() && cosine(index) > 0.0);
        let Some(exited_solid) = exit.map(|exit| solid(exit.triangle)) else { return hit };
        // If the ray also enters the same solid here, the solid has no thickness and so no inside.
        match self.closest(&near, |index| solid(index) == exited_solid && cosine(index) < 0.0) {
            Some(_) => hit,
            None => SurfaceHit::Inside,
        }
    }

    /// The section of a ray in which hits count as coincident with the hit of `triangle` at `distance`.
    fn near(&self, ray: &Ray, triangle: u32, distance: f32, direction: Vec3) -> Ray {
        let triangle = &self.triangles[triangle as usize];
        // On a grazing ray, an error in the plane's position moves the hit much further along the ray.
        let cosine = triangle.normal.dot(direction).abs().max(1.0 / 1024.0);
        let slack = SAME_PLACE * (distance + triangle.extent) / cosine;
        ray.with_range((distance - slack).max(0.0), distance + slack)
    }

    /// Whether something blocks the segment between two points, each already offset from its surface.
    pub fn blocked(&self, from: Vec3, to: Vec3) -> bool {
        self.any_hit(&Ray::segment(from, to).with_range(0.0, SEGMENT_END))
    }

    /// Whether something blocks a direction, at any distance.
    pub fn blocked_towards(&self, from: Vec3, direction: Vec3) -> bool {
        self.any_hit(&Ray::new(from, direction))
    }

    /// A point just off a side of a triangle.
    pub fn off_surface(&self, triangle: u32, side: Side, position: Vec3) -> Vec3 {
        let triangle = &self.triangles[triangle as usize];
        offset_ray_origin(position, triangle.side_normal(side), triangle.extent)
    }

    /// A point just off a side of a triangle, as the end of a segment from `from`. The offset covers the rounding error
    /// of the coordinates of both ends; else a small lamp near the origin would shadow itself.
    pub fn off_surface_seen_from(&self, triangle: u32, side: Side, position: Vec3, from: Vec3) -> Vec3 {
        let triangle = &self.triangles[triangle as usize];
        let extent = triangle.extent.max(from.abs().max_element());
        offset_ray_origin(position, triangle.side_normal(side), extent)
    }

    fn closest(&self, ray: &Ray, accept: impl Fn(u32) -> bool) -> Option<Hit> {
        if self.has_masks() {
            self.bvh.closest_hit_filtered(ray, |index, u, v| accept(index) && self.is_solid(index, u, v))
        } else {
            self.bvh.closest_hit_filtered(ray, |index, _, _| accept(index))
        }
    }

    fn any_hit(&self, ray: &Ray) -> bool {
        if self.has_masks() {
            self.bvh.any_hit_filtered(ray, |index, u, v| self.is_solid(index, u, v))
        } else {
            self.bvh.any_hit(ray)
        }
    }

    /// Whether some surface lets light through in places.
    pub fn has_masks(&self) -> bool {
        !self.masked.is_empty()
    }

    /// Whether light may pass through parts of a triangle.
    pub fn is_masked(&self, index: u32) -> bool {
        self.masked.get(index as usize).is_some_and(|masked| *masked)
    }

    /// Whether a triangle blocks light at a point of it.
    pub(super) fn is_solid(&self, index: u32, u: f32, v: f32) -> bool {
        if !self.is_masked(index) {
            return true;
        }
        let triangle = &self.triangles[index as usize];
        self.surfaces[triangle.surface as usize].stops_light(triangle.vertices, [1.0 - u - v, u, v])
    }
}
